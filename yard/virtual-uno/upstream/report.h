// How the firmwares here tell what they measured: numbers on the serial line, and a halt.
#pragma once
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <stdlib.h>

#if __has_include("avr_mcu_section.h")
#include "avr_mcu_section.h"
AVR_MCU(F_CPU, "atmega328p");
#endif

static inline void put(char byte) {
    while (!(UCSR0A & 1 << UDRE0))
        ;
    UDR0 = byte;
}

// Sends a number and what ends it.
static inline void report(int16_t number, char end) {
    char text[8];
    UCSR0B = 1 << TXEN0;
    itoa(number, text, 10);
    for (char *byte = text; *byte; byte++)
        put(*byte);
    put(end);
}

// Sleeps with interrupts off, which ends a simulation.
static inline void finish(void) {
    cli();
    sleep_enable();
    for (;;)
        sleep_cpu();
}
