#include "tests.h"
#include "avr_adc.h"

int main(int argc, char **argv) {
	tests_init(argc, argv);
	avr_t *avr = tests_init_avr("atmega328p_adc_result.axf");
	avr->vcc = avr->avcc = 5000;
	avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_ADC_GETIRQ, ADC_IRQ_ADC0), 2500);
	tests_assert_uart_receive_avr(avr, 1000000, "512\n", '0');
	tests_success();
	return 0;
}
