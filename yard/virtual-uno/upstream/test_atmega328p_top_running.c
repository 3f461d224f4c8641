#include "tests.h"

int main(int argc, char **argv) {
	tests_init(argc, argv);
	tests_assert_uart_receive("atmega328p_top_running.axf", 1000000, "0 5 5\n", '0');
	tests_success();
	return 0;
}
