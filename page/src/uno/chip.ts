// An ATmega328P from power-up or a reset to the next one, on avr8js.
//
// avr8js resets neither its peripherals nor its registers. So a reset here makes a new chip, which takes over the state
// that survives a reset: flash, EEPROM, SRAM and the clock. The peripherals are avr8js's own, unchanged. This file
// corrects the core's interrupt timing; docs/simulators.md has the whole list.

import {
    AVRClock,
    AVREEPROM,
    AVRIOPort,
    type AVRPortConfig,
    AVRUSART,
    AVRWatchdog,
    avrInstruction,
    CPU,
    clockConfig,
    type EEPROMBackend,
    eepromConfig,
    portBConfig,
    portCConfig,
    portDConfig,
    timer0Config,
    timer1Config,
    timer2Config,
    usart0Config,
    watchdogConfig,
} from "avr8js";
import { addTimer } from "./timer.ts";

export const CYCLES_PER_SECOND = 16_000_000;

/** Bytes of the chip's memories. */
export const FLASH_BYTES = 32 * 1024;
export const SRAM_BYTES = 2048;
export const EEPROM_BYTES = 1024;

/** Reset causes, as their bits in MCUSR (data sheet, 11.9.1). */
const RESET_CAUSES = { "power-on": 1, external: 2, "brown-out": 4, watchdog: 8 } as const;
export type ResetCause = keyof typeof RESET_CAUSES;

/** Addresses in the data space (data sheet, register summary). */
const SMCR = 0x53;
const MCUSR = 0x54;
const UCSR0A = 0xc0;
/** UCSR0A: a byte has been received and not read yet. */
const RXC0 = 0x80;
/** SMCR: sleep is enabled. */
const SE = 0x01;

const SRAM_START = 0x100;

/** Half of the write time of a byte in the EEPROM: 3.4 ms in all (data sheet, table 8-1). */
const EEPROM_HALF_CYCLES = (CYCLES_PER_SECOND * 3.4e-3) / 2;

/** Cycles that entering an interrupt takes more than avr8js counts: 4 (data sheet, 7.7.1) less 2. */
const INTERRUPT_ENTRY_CYCLES = 2;
/** Cycles that an interrupt takes more if it ends a sleep (data sheet, 7.7.1). */
const WAKE_UP_CYCLES = 4;

/** One more instruction is executed before an interrupt after `reti`, and after any that sets I (data sheet, 7.7). */
const RETI = 0x9518;
const SLEEP = 0x9588;

/** The cycle of a peripheral's next event, from the CPU's private list. */
function nextEvent(cpu: CPU): number {
    return (cpu as unknown as { nextClockEvent: { cycles: number } | null }).nextClockEvent?.cycles ?? Infinity;
}

export class Chip {
    /** The board's pins, each a bit of a port: D0 to D13, then A0 to A5. */
    readonly pins: readonly { readonly port: AVRIOPort; readonly bit: number }[];
    readonly usart: AVRUSART;
    /** Whether the watchdog has run out: the chip stands still until it is replaced. */
    watchdogRanOut = false;
    readonly cpu: CPU;
    #until = 0;
    #isAsleep = false;

    /** Starts with these memories, after this cause, at this cycle. */
    constructor(program: Uint16Array, sram: Uint8Array, eeprom: EEPROMBackend, cause: ResetCause, cycle: number) {
        const cpu = new CPU(program, SRAM_BYTES);
        this.cpu = cpu;
        cpu.cycles = cycle;
        cpu.data.set(sram, SRAM_START);
        cpu.data[MCUSR] = RESET_CAUSES[cause];
        const bits = (config: AVRPortConfig, count: number) => {
            const port = new AVRIOPort(cpu, config);
            return Array.from({ length: count }, (_, bit) => ({ port, bit }));
        };
        this.pins = [...bits(portDConfig, 8), ...bits(portBConfig, 6), ...bits(portCConfig, 6)];
        for (const config of [timer0Config, timer1Config, timer2Config]) addTimer(cpu, config);
        this.usart = new AVRUSART(cpu, usart0Config, CYCLES_PER_SECOND);
        new AVREEPROM(cpu, eeprom, {
            ...eepromConfig,
            eraseCycles: EEPROM_HALF_CYCLES,
            writeCycles: EEPROM_HALF_CYCLES,
        });
        new AVRWatchdog(cpu, watchdogConfig, new AVRClock(cpu, CYCLES_PER_SECOND, clockConfig));
        // From here on only the watchdog calls it.
        cpu.reset = () => {
            this.watchdogRanOut = true;
            this.#until = 0;
        };
    }

    set(pin: number, high: boolean): void {
        const found = this.pins[pin];
        found?.port.setPin(found.bit, high);
    }

    get sram(): Uint8Array {
        return this.cpu.data.slice(SRAM_START);
    }

    /** Runs to the end of the instruction at `cycle`, or until the watchdog runs out. */
    run(cycle: number): void {
        const cpu = this.cpu;
        const program = cpu.progMem;
        this.#until = cycle;
        while (cpu.cycles < this.#until) {
            if (this.#isAsleep) this.#skipToEvent();
            else {
                const wasEnabled = cpu.interruptsEnabled;
                let instruction = program[cpu.pc];
                avrInstruction(cpu);
                if (instruction === RETI || (!wasEnabled && cpu.interruptsEnabled)) {
                    instruction = program[cpu.pc];
                    avrInstruction(cpu);
                }
                if (instruction === SLEEP) this.#isAsleep = ((cpu.data[SMCR] ?? 0) & SE) !== 0;
            }
            // Nothing else happens behind most instructions.
            if (cpu.nextInterrupt < 0 && cpu.cycles < nextEvent(cpu)) continue;
            const next = cpu.pc;
            cpu.tick();
            if (cpu.pc !== next) {
                cpu.cycles += INTERRUPT_ENTRY_CYCLES + (this.#isAsleep ? WAKE_UP_CYCLES : 0);
                this.#isAsleep = false;
            }
        }
    }

    /** Lets the time pass to the next event of a peripheral, unless an interrupt is waiting. */
    #skipToEvent(): void {
        const cpu = this.cpu;
        if (cpu.nextInterrupt >= 0 && cpu.interruptsEnabled) return;
        cpu.cycles = Math.max(cpu.cycles, Math.min(this.#until, nextEvent(cpu)));
    }

    /**
     * Whether a byte that arrives now is certain to be kept. avr8js has one waiting byte without a further buffer, and
     * drops it when the firmware writes UCSR0B, as handlers do. So a byte must arrive when its own handler follows at
     * once.
     */
    get takesByte(): boolean {
        return this.cpu.interruptsEnabled && !((this.cpu.data[UCSR0A] ?? 0) & RXC0);
    }
}
