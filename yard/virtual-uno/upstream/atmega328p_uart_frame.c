// Bits of a byte on the serial line: a start bit, eight data bits and a stop bit (data sheet, 20.4). The receiver is
// off, and no parity is asked for.
#include "report.h"

enum { BIT_CYCLES = 8 * (16 + 1) };

int main(void) {
    UBRR0 = 16;
    UCSR0A = 1 << U2X0;
    UCSR0C = 1 << UCSZ01 | 1 << UCSZ00;
    UCSR0B = 1 << TXEN0;
    TCCR1B = 1 << CS10;
    UCSR0A |= 1 << TXC0;
    TCNT1 = 0;
    UDR0 = ' ';
    while (!(UCSR0A & 1 << TXC0))
        ;
    uint16_t cycles = TCNT1;
    report((cycles + BIT_CYCLES / 2) / BIT_CYCLES, '\n');
    finish();
}
