// Cycles that an interrupt takes longer out of sleep. The data sheet (7.7.1) says four.
#include "report.h"

static volatile uint16_t entered;

ISR(TIMER1_COMPA_vect) {
    entered = TCNT1;
    TIMSK1 = 0;
}

static void begin(void) {
    entered = 0;
    OCR1A = 200;
    TCNT1 = 0;
    TIFR1 = 1 << OCF1A;
    TIMSK1 = 1 << OCIE1A;
    sei();
}

int main(void) {
    TCCR1B = 1 << CS10;
    begin();
    __asm__ volatile(".rept 400\n\tnop\n\t.endr");
    uint16_t awake = entered;
    begin();
    sleep_mode();
    report(entered - awake, '\n');
    finish();
}
