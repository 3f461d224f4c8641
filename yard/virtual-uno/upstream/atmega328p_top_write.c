// ICR1 behind a write in normal mode, and behind one in mode 14, of which it is the top. Only the second write counts (data
// sheet, 16.6.3).
#include "report.h"

int main(void) {
    ICR1 = 20000 - 1;
    int16_t before = ICR1;
    TCCR1A = 1 << WGM11;
    TCCR1B = 1 << WGM13 | 1 << WGM12;
    ICR1 = 10000 - 1;
    report(before, ' ');
    report(ICR1, '\n');
    finish();
}
