// The virtual Uno: an ATmega328P at 16 MHz that runs a firmware's real HEX file, on avr8js.
//
// `new Uno` powers it up. `set` sets the level of a pin, `send` types into its serial line, and `runUntil` lets its
// clock run. `onLevel` and `onByte` receive its outputs. Pins have the board's numbers: 0 to 13 are D0 to D13, 14 to 19
// are A0 to A5. Time is the chip's own count of cycles since the first power-up, and continues over resets. No other
// clock is used.
//
// It is independent of its firmware's purpose. There is no bootloader, and no start-up time after a reset.
// docs/simulators.md lists the differences between avr8js and the chip.

import { type EEPROMBackend, PinState } from "avr8js";
import { Chip, CYCLES_PER_SECOND, EEPROM_BYTES, FLASH_BYTES, type ResetCause, SRAM_BYTES } from "./chip.ts";
import { readHex } from "./hex.ts";

export { CYCLES_PER_SECOND, type ResetCause } from "./chip.ts";

/** Cycles of a byte that a terminal sends at 115200 baud: a start bit, eight data bits and a stop bit. */
const SENT_BYTE_CYCLES = Math.round((10 * CYCLES_PER_SECOND) / 115_200);

/** Content of SRAM at power-up: random on a real chip. A byte other than zero reveals code that expects zeros. */
const sramAtPowerUp = () => new Uint8Array(SRAM_BYTES).fill(0xc5);

/** Cycles after which a byte that could not be taken is offered again: the shortest instruction. */
const NEXT_INSTRUCTION = 1;

export class Uno {
    /** Called when the level that the firmware drives on a pin has changed. An undriven pin counts as low. */
    onLevel: (pin: number, high: boolean, cycle: number) => void = () => {};
    /** The firmware has handed a byte to its transmitter. */
    onByte: (byte: number) => void = () => {};
    /** Resets since the first power-up, oldest first. */
    readonly resets: { readonly cycle: number; readonly cause: ResetCause }[] = [];
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

    /** Powers up an Uno with a firmware. `eeprom` has the first bytes of the EEPROM, and the others are erased. */
    constructor(hex: string, eeprom: Uint8Array = new Uint8Array()) {
        this.#program = new Uint16Array(readHex(hex, FLASH_BYTES).buffer);
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
        this.#chip = this.#start("power-on", 0, sramAtPowerUp());
    }

    /** Cycles since the first power-up. */
    get cycle(): number {
        return this.#chip.cpu.cycles;
    }

    /** Lets the clock run to the first end of an instruction at or after a cycle. */
    runUntil(cycle: number): void {
        while (this.cycle < cycle) {
            this.#chip.run(cycle);
            if (this.#chip.watchdogRanOut) this.#restart("watchdog", this.#chip.sram);
        }
    }

    /** Sets the external level of a pin. It stays over resets. */
    set(pin: number, high: boolean): void {
        this.#inputs.set(pin, high);
        this.#chip.set(pin, high);
    }

    isHigh(pin: number): boolean {
        return this.#driven.get(pin) ?? false;
    }

    /** Types into the serial line at 115200 baud, after earlier text. */
    send(text: string): void {
        const was = this.#toSend.length;
        for (const byte of new TextEncoder().encode(text)) this.#toSend.push(byte);
        if (was === 0 && this.#toSend.length > 0) this.#sendNext(this.#chip);
    }

    /** Resets the chip. SRAM loses its content only after a power failure. */
    reset(cause: Exclude<ResetCause, "watchdog">): void {
        this.#restart(cause, cause === "power-on" ? sramAtPowerUp() : this.#chip.sram);
    }

    #restart(cause: ResetCause, sram: Uint8Array): void {
        const { cycle } = this;
        this.resets.push({ cycle, cause });
        // All pins are released.
        for (const pin of [...this.#driven.keys()]) this.#drives(pin, false, cycle);
        this.#chip = this.#start(cause, cycle, sram);
        if (this.#toSend.length > 0) this.#sendNext(this.#chip);
    }

    #start(cause: ResetCause, cycle: number, sram: Uint8Array): Chip {
        const chip = new Chip(this.#program, sram, this.#backend, cause, cycle);
        for (const [pin, { port, bit }] of chip.pins.entries())
            port.addListener(() => this.#drives(pin, port.pinState(bit) === PinState.High, chip.cpu.cycles));
        chip.usart.onByteTransmit = (byte) => this.onByte(byte);
        for (const [pin, high] of this.#inputs) chip.set(pin, high);
        return chip;
    }

    #drives(pin: number, high: boolean, cycle: number): void {
        if (this.isHigh(pin) === high) return;
        this.#driven.set(pin, high);
        this.onLevel(pin, high, cycle);
    }

    /** Lets the next byte arrive at its time. */
    #sendNext(chip: Chip): void {
        this.#lineFree = Math.max(this.#lineFree, chip.cpu.cycles) + SENT_BYTE_CYCLES;
        const arrive = (): void => {
            if (!chip.takesByte) {
                chip.cpu.addClockEvent(arrive, NEXT_INSTRUCTION);
                return;
            }
            // A receiver that is off ignores it.
            chip.usart.writeByte(this.#toSend.shift() ?? 0, true);
            if (this.#toSend.length > 0) this.#sendNext(chip);
        };
        // A reset before makes another chip.
        chip.cpu.addClockEvent(arrive, this.#lineFree - chip.cpu.cycles);
    }
}
