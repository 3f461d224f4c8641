// Cycles from the end of an instruction to the vector's first one. The data sheet (7.7.1) says four. `icall` of the same
// vector takes three cycles, and stands for the interrupt in the second measurement.
#include "report.h"

static volatile uint16_t entered;

ISR(TIMER1_OVF_vect) {
    entered = TCNT1;
}

static uint16_t by_interrupt(void) {
    uint16_t begun;
    TIMSK1 = 1 << TOIE1;
    TCNT1 = 0xFFFF;
    while (!(TIFR1 & 1 << TOV1))
        ;
    __asm__ volatile("lds %A0, %1\n\tlds %B0, %2\n\tsei\n\tnop\n\tnop\n\tnop\n\tcli"
                     : "=r"(begun) : "n"(&TCNT1L), "n"(&TCNT1H) : "memory");
    TIMSK1 = 0;
    return entered - begun;
}

static uint16_t by_call(void) {
    uint16_t begun;
    uint16_t vector = TIMER1_OVF_vect_num * 2;
    __asm__ volatile("lds %A0, %1\n\tlds %B0, %2\n\tnop\n\tnop\n\ticall\n\tcli"
                     : "=&r"(begun) : "n"(&TCNT1L), "n"(&TCNT1H), "z"(vector) : "memory");
    return entered - begun;
}

int main(void) {
    TCCR1B = 1 << CS10;
    uint16_t interrupt = by_interrupt();
    report(3 + interrupt - by_call(), '\n');
    finish();
}
