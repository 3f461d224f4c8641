// The level of OC1A in fast PWM, behind a new compare value that lies in the past. The new one counts from the next
// bottom (data sheet, 16.9.3): the pin stays high up to the old one, is low then, and follows the new one from the next
// period on.
#include "report.h"

static char level_at(uint16_t count) {
    while (TCNT1 < count)
        ;
    return PINB >> 1 & 1;
}

int main(void) {
    DDRB = 1 << 1;
    OCR1A = 10000 - 1;
    TCCR1A = 1 << COM1A1 | 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12;
    ICR1 = 20000 - 1;
    TCCR1B |= 1 << CS10;
    // The first period has no bottom behind it that sets the pin.
    while (TCNT1 < 19000)
        ;
    while (TCNT1 > 1000)
        ;
    (void)level_at(4000);
    OCR1A = 2000 - 1;
    char seen[4] = {level_at(5000), level_at(9000), level_at(11000), 0};
    while (TCNT1 > 1000)
        ;
    (void)level_at(1500);
    seen[3] = level_at(1500) << 1 | level_at(3000);
    for (uint8_t index = 0; index < 3; index++)
        report(seen[index], ' ');
    report(seen[3], '\n');
    finish();
}
