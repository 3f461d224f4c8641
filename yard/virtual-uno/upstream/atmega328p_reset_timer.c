// Whether Timer1 counts behind a reset by the watchdog. A reset stops it, and its counter is 0 (data sheet, 11.1 and the
// initial values of its registers).
#include "report.h"
#include <avr/wdt.h>

int main(void) {
    uint8_t cause = MCUSR;
    MCUSR = 0;
    if (cause & 1 << WDRF) {
        wdt_disable();
        uint16_t first = TCNT1;
        __asm__ volatile(".rept 200\n\tnop\n\t.endr");
        uint16_t second = TCNT1;
        report(first, ' ');
        report(second - first, ' ');
        // With its clock given back it counts from there, in normal mode.
        TCCR1B = 1 << CS10;
        __asm__ volatile(".rept 200\n\tnop\n\t.endr");
        report(TCNT1 / 100, '\n');
        finish();
    }
    TCCR1A = 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12;
    ICR1 = 99;
    TCCR1B |= 1 << CS10;
    wdt_enable(WDTO_15MS);
    for (;;)
        ;
}
