// The virtual Uno: an ATmega328P at 16 MHz that runs a firmware's real HEX file, on avr8js.
//
// `new Uno` powers it up. `set` puts a level on a pin, `send` types into its serial line, `runUntil` lets its clock run;
// `onLevel` and `onByte` hear what it does. Pins have the board's numbers: 0 to 13 are D0 to D13, 14 to 19 are A0 to A5.
// Time is the chip's own count of cycles since the first power-up and goes on over resets; no other clock plays a part.
//
// It knows nothing of what its firmware is for. There is no bootloader, and no start-up time after a reset. What avr8js
// does otherwise than the chip stands in docs/simulators.md.

import { type EEPROMBackend, PinState } from "avr8js";
import { Chip, CYCLES_PER_SECOND, EEPROM_BYTES, FLASH_BYTES, type ResetCause, SRAM_BYTES } from "./chip.ts";
import { readHex } from "./hex.ts";

export { CYCLES_PER_SECOND, EEPROM_BYTES, type ResetCause } from "./chip.ts";
export { HexError } from "./hex.ts";

/** Cycles of a byte that a terminal sends at 115200 baud: a start bit, eight data bits and a stop bit. */
export const SENT_BYTE_CYCLES = Math.round((10 * CYCLES_PER_SECOND) / 115_200);

/** What SRAM holds at power-up. A real chip's content is random; a byte that is not zero catches who counts on it. */
const SRAM_AT_POWER_UP = 0xc5;

/** Cycles after which a byte that could not be taken is offered again: the shortest instruction. */
const NEXT_INSTRUCTION = 1;

/** The level that the firmware drives on a pin became another one. A pin that is not driven counts as low. */
export type OnLevel = (pin: number, high: boolean, cycle: number) => void;

/** The firmware has handed a byte to its transmitter. */
export type OnByte = (byte: number, cycle: number) => void;

/** A reset after the first power-up. */
export interface Reset {
    readonly cycle: number;
    readonly cause: ResetCause;
}

type Port = "B" | "C" | "D";

/** The ports, with the number of the pin that is their bit 0, and how many pins of the board they have. */
const PORTS: readonly { readonly port: Port; readonly first: number; readonly pins: number }[] = [
    { port: "D", first: 0, pins: 8 },
    { port: "B", first: 8, pins: 6 },
    { port: "C", first: 14, pins: 6 },
];

export class Uno {
    onLevel: OnLevel = () => {};
    onByte: OnByte = () => {};
    /** Resets since the first power-up, oldest first. */
    readonly resets: Reset[] = [];
    /** What the EEPROM holds. */
    readonly eeprom: Uint8Array;
    readonly #program: Uint16Array;
    readonly #backend: EEPROMBackend;
    /** Levels from outside, and levels that the firmware drives, by pin. */
    readonly #inputs = new Map<number, boolean>();
    readonly #driven = new Map<number, boolean>();
    #toSend: number[] = [];
    /** When the line is free for the next byte. */
    #lineFree = 0;
    #chip: Chip;

    /**
     * Powers up an Uno with a firmware, and an EEPROM whose first bytes are given and whose others are erased.
     * Throws a HexError where `hex` is no firmware for this chip.
     */
    constructor(hex: string, eeprom: Uint8Array = new Uint8Array()) {
        this.#program = new Uint16Array(readHex(hex, FLASH_BYTES).buffer);
        if (eeprom.length > EEPROM_BYTES)
            throw new RangeError(`${eeprom.length} bytes were given for the EEPROM, which holds ${EEPROM_BYTES}`);
        const memory = new Uint8Array(EEPROM_BYTES).fill(0xff);
        memory.set(eeprom);
        this.eeprom = memory;
        this.#backend = {
            readMemory: (address) => memory[address % EEPROM_BYTES] ?? 0xff,
            writeMemory: (address, value) => {
                memory[address % EEPROM_BYTES] = this.#backend.readMemory(address) & value;
            },
            eraseMemory: (address) => {
                memory[address % EEPROM_BYTES] = 0xff;
            },
        };
        this.#chip = this.#start("power-on", 0, new Uint8Array(SRAM_BYTES).fill(SRAM_AT_POWER_UP));
    }

    /** Cycles since the first power-up. */
    get cycle(): number {
        return this.#chip.cycle;
    }

    /** Lets the clock run to the first end of an instruction at or after a cycle. */
    runUntil(cycle: number): void {
        while (this.#chip.cycle < cycle) {
            this.#chip.run(cycle);
            if (this.#chip.watchdogRanOut) this.#restart("watchdog", this.#chip.sram);
        }
    }

    /** Puts a level on a pin from outside. It stays over resets. */
    set(pin: number, high: boolean): void {
        this.#inputs.set(pin, high);
        this.#setOn(this.#chip, pin, high);
    }

    /** Whether the firmware drives a pin high. */
    isHigh(pin: number): boolean {
        return this.#driven.get(pin) ?? false;
    }

    /** Types into the serial line, at 115200 baud behind what was typed before. */
    send(text: string): void {
        const was = this.#toSend.length;
        for (const byte of new TextEncoder().encode(text)) this.#toSend.push(byte);
        if (was === 0 && this.#toSend.length > 0) this.#sendNext(this.#chip);
    }

    /** Whether all that was typed has arrived. */
    get hasSentAll(): boolean {
        return this.#toSend.length === 0;
    }

    /** Resets the chip. SRAM loses its content only after a power failure. */
    reset(cause: Exclude<ResetCause, "watchdog">): void {
        this.#restart(
            cause,
            cause === "power-on" ? new Uint8Array(SRAM_BYTES).fill(SRAM_AT_POWER_UP) : this.#chip.sram,
        );
    }

    #restart(cause: ResetCause, sram: Uint8Array): void {
        const { cycle } = this.#chip;
        this.resets.push({ cycle, cause });
        // Every pin is let go of.
        for (const pin of [...this.#driven.keys()]) this.#drives(pin, false, cycle);
        this.#chip = this.#start(cause, cycle, sram);
        if (this.#toSend.length > 0) this.#sendNext(this.#chip);
    }

    #start(cause: ResetCause, cycle: number, sram: Uint8Array): Chip {
        const chip = new Chip({ program: this.#program, sram, eeprom: this.#backend, cause, cycle });
        for (const { port, first, pins } of PORTS) {
            const io = chip.ports[port];
            io.addListener(() => {
                for (let bit = 0; bit < pins; bit++)
                    this.#drives(first + bit, io.pinState(bit) === PinState.High, chip.cycle);
            });
        }
        chip.usart.onByteTransmit = (byte) => this.onByte(byte, chip.cycle);
        for (const [pin, high] of this.#inputs) this.#setOn(chip, pin, high);
        return chip;
    }

    #setOn(chip: Chip, pin: number, high: boolean): void {
        const place = PORTS.find(({ first, pins }) => pin >= first && pin < first + pins);
        if (!place) throw new RangeError(`an Uno has no pin ${pin}: it has 0 to 19`);
        chip.ports[place.port].setPin(pin - place.first, high);
    }

    #drives(pin: number, high: boolean, cycle: number): void {
        if (this.isHigh(pin) === high) return;
        this.#driven.set(pin, high);
        this.onLevel(pin, high, cycle);
    }

    /** Has the next byte arrive when it is due. */
    #sendNext(chip: Chip): void {
        this.#lineFree = Math.max(this.#lineFree, chip.cycle) + SENT_BYTE_CYCLES;
        const arrive = (): void => {
            if (!chip.takesByte) {
                chip.after(NEXT_INSTRUCTION, arrive);
                return;
            }
            // A receiver that is off does not hear it.
            chip.usart.writeByte(this.#toSend.shift() ?? 0, true);
            if (this.#toSend.length > 0) this.#sendNext(chip);
        };
        chip.after(this.#lineFree - chip.cycle, arrive);
    }
}
