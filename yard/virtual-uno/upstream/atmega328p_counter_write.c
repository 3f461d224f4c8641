// The level of OC1A behind a write of TCNT1. The write moves the counter and leaves the pin alone (data sheet, 16.7.2 and
// 16.8): low behind the match, it stays low, though a match is to come again.
#include "report.h"

int main(void) {
    DDRB = 1 << 1;
    OCR1A = 5000 - 1;
    TCCR1A = 1 << COM1A1 | 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12;
    ICR1 = 20000 - 1;
    TCCR1B |= 1 << CS10;
    while (TCNT1 < 19000)
        ;
    while (TCNT1 > 1000)
        ;
    while (TCNT1 < 6000)
        ;
    char before = PINB >> 1 & 1;
    TCNT1 = 1000;
    char behind = PINB >> 1 & 1;
    report(before, ' ');
    report(behind, '\n');
    finish();
}
