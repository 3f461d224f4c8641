// Clocks of the ADC that its first conversion takes, and the next one: 25 and 13 (data sheet, table 24-1). They are told
// for a prescaler of 64 and for one of 128.
#include "report.h"

static uint16_t clocks(uint8_t control, uint8_t prescaler) {
    TCNT1 = 0;
    ADCSRA = control | 1 << ADSC;
    while (ADCSRA & 1 << ADSC)
        ;
    uint16_t cycles = TCNT1;
    return (cycles + prescaler / 2) / prescaler;
}

static void both(uint8_t select, uint8_t prescaler, char end) {
    ADCSRA = 0;
    report(clocks(1 << ADEN | select, prescaler), ' ');
    report(clocks(1 << ADEN | select, prescaler), end);
}

int main(void) {
    TCCR1B = 1 << CS10;
    ADMUX = 1 << REFS0;
    both(6, 64, ' ');
    both(7, 128, '\n');
    finish();
}
