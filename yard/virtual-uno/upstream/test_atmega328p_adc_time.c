#include "tests.h"

int main(int argc, char **argv) {
	tests_init(argc, argv);
	tests_assert_uart_receive("atmega328p_adc_time.axf", 1000000, "25 13 25 13\n", '0');
	tests_success();
	return 0;
}
