#include "tests.h"

int main(int argc, char **argv) {
	tests_init(argc, argv);
	tests_assert_uart_receive("atmega328p_top_write.axf", 1000000, "0 9999\n", '9');
	tests_success();
	return 0;
}
