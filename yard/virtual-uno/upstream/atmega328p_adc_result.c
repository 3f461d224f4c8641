// What the ADC makes of its input 0, with AVCC as the reference: the voltage times 1024 over the reference (data sheet,
// 24.7). The test puts half of AVCC there.
#include "report.h"

int main(void) {
    ADMUX = 1 << REFS0;
    ADCSRA = 1 << ADEN | 1 << ADSC | 7;
    while (ADCSRA & 1 << ADSC)
        ;
    report(ADC, '\n');
    finish();
}
