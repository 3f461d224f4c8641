// Time of a write to the EEPROM in tenths of a millisecond, at 16 MHz: 3.4 ms (data sheet, table 8-1). EEPE stays set
// for so long.
#include "report.h"

int main(void) {
    TCCR1B = 1 << CS11 | 1 << CS10;
    EEAR = 3;
    EEDR = 0x5A;
    TCNT1 = 0;
    EECR = 1 << EEMPE;
    EECR |= 1 << EEPE;
    while (EECR & 1 << EEPE)
        ;
    // A tenth is 25 clocks of 4 us.
    report((TCNT1 + 12) / 25, '\n');
    finish();
}
