// ICR1 becomes 10000 - 1 while the timer runs in mode 14, and sets the running period (data sheet, 16.9.3). First the level of
// OC1A behind the period's compare value, if OCR1A is new too. Then TCNT1 in thousands, 15000 clocks behind the start, if ICR1
// was 20000 - 1 and if it was 0.
#include "report.h"

static void start(uint16_t top) {
    TCCR1B = 1 << WGM13 | 1 << WGM12;
    ICR1 = top;
    TCNT1 = 0;
    TCCR1B |= 1 << CS11;
}

static int16_t thousands(uint16_t top) {
    start(top);
    ICR1 = 10000 - 1;
    __builtin_avr_delay_cycles(8 * 15000UL);
    return TCNT1 / 1000;
}

int main(void) {
    DDRB = 1 << 1;
    OCR1A = 5000 - 1;
    TCCR1A = 1 << COM1A1 | 1 << WGM11;
    start(20000 - 1);
    // The first period has no bottom behind it that sets the pin.
    while (TCNT1 < 19000)
        ;
    while (TCNT1 > 1000)
        ;
    while (TCNT1 < 2000)
        ;
    OCR1A = 1000 - 1;
    ICR1 = 10000 - 1;
    while (TCNT1 < 6000)
        ;
    report(PINB >> 1 & 1, ' ');
    report(thousands(20000 - 1), ' ');
    report(thousands(0), '\n');
    finish();
}
