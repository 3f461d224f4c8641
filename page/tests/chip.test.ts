// The ATmega328P's interrupt timing, which src/uno/chip.ts corrects.

import assert from "node:assert/strict";
import test from "node:test";
import { EEPROMMemoryBackend } from "avr8js";
import { Chip, EEPROM_BYTES, FLASH_BYTES, SRAM_BYTES } from "../src/uno/chip.ts";

/** The transmitter's vector (UDRE), in words. */
const VECTOR = 0x26;

/** Ways to set the interrupt flag, with r18 = 0x80, and the words behind the program that they call. */
const WAYS: Record<string, number[]> = {
    sei: [0x9478],
    "out SREG, r18": [0xbf2f],
    "sts 0x5f, r18": [0x9320, 0x005f],
    "rcall to reti": [0xd004],
};

test("one more instruction runs before a waiting interrupt, after any that sets the interrupt flag", () => {
    for (const [name, way] of Object.entries(WAYS)) {
        const program = new Uint16Array(FLASH_BYTES / 2);
        // ldi r16, 0; ldi r18, 0x80; ldi r19, 0x28; sts UCSR0B, r19: the transmitter asks for a byte.
        const before = [0xe000, 0xe820, 0xe238, 0x9330, 0x00c1];
        // inc r16, three times; rjmp to itself; reti
        program.set([...before, ...way, 0x9503, 0x9503, 0x9503, 0xcfff, 0x9518]);
        // sts 0x0100, r16; rjmp to itself
        program.set([0x9300, 0x0100, 0xcfff], VECTOR);
        const sram = new Uint8Array(SRAM_BYTES).fill(0xff);
        const chip = new Chip(program, sram, new EEPROMMemoryBackend(EEPROM_BYTES), "power-on", 0);
        chip.run(100);
        assert.equal(chip.sram[0], 1, name);
    }
});
