#include "tests.h"

int main(int argc, char **argv) {
	tests_init(argc, argv);
	tests_assert_uart_receive("atmega328p_reset_timer.axf", 1000000, "0 0 2\n", '0');
	tests_success();
	return 0;
}
