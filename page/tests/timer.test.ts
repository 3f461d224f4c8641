// A timer that is called only when something happens, beside avr8js's own, which is called at each step.

import assert from "node:assert/strict";
import test from "node:test";
import { AVRIOPort, AVRTimer, CPU, portBConfig, timer1Config } from "avr8js";
import { addTimer } from "../src/uno/timer.ts";
import { chance } from "./chance.ts";

const { TCNT, TCCRA, TCCRB, OCRA, OCRB, ICR, TIFR } = timer1Config;

/** TCCR1A and TCCR1B: fast PWM with ICR1 or OCR1A on top, clear on compare match with either, and normal. */
const MODES = [
    [0x82, 0x1a],
    [0xc2, 0x19],
    [0xa3, 0x1a],
    [0x50, 0x1a],
    [0x80, 0x0a],
    [0x00, 0x02],
] as const;

test("a timer that is called seldom counts, matches and moves its pins as one that is called at each step", () => {
    const random = chance(1);
    const below = (limit: number): number => Math.floor(random() * limit);
    const chips = [(cpu: CPU) => new AVRTimer(cpu, timer1Config), (cpu: CPU) => addTimer(cpu, timer1Config)].map(
        (add) => {
            const cpu = new CPU(new Uint16Array(16), 2048);
            const port = new AVRIOPort(cpu, portBConfig);
            add(cpu);
            return { cpu, port };
        },
    );
    // A store takes two cycles.
    const write = (register: number, value: number, is16 = false) => {
        for (const { cpu } of chips) {
            if (is16) cpu.writeData(register + 1, value >> 8);
            cpu.writeData(register, value & 0xff);
            for (let cycle = 0; cycle < 2; cycle++) {
                cpu.cycles++;
                cpu.tick();
            }
        }
    };
    write(portBConfig.DDR, 0b110);
    let matches = 0;
    for (let change = 0; change < 2000; change++) {
        const value = below(400);
        const pick = below(8);
        if (change % 200 === 0) {
            const [a, b] = MODES[(change / 200) % MODES.length] ?? [];
            write(TCCRB, 0);
            write(TCCRA, a ?? 0);
            write(TCCRB, b ?? 0);
        }
        // Another mode while it counts.
        if (pick === 0) write(TCCRA, [0x00, 0x82, 0xc2, 0x50, 0xa3][below(5)] ?? 0);
        if (pick === 1) write(TCCRB, [0x1a, 0x19, 0x0a, 0x09, 0x02, 0x1b][below(6)] ?? 0);
        if (pick === 2) write(OCRA, value, true);
        if (pick === 3) write(OCRB, value, true);
        if (pick === 4) write(ICR, value, true);
        if (pick === 5) write(TIFR, 0x27);
        if (pick === 6 && below(4) === 0) write(TCNT, value, true);
        for (let cycles = below(600); cycles > 0; cycles--) {
            const [eager, lazy] = chips.map(({ cpu, port }) => {
                cpu.cycles++;
                cpu.tick();
                return [cpu.data[TIFR], port.pinState(1), port.pinState(2)];
            });
            assert.deepEqual(lazy, eager, `change ${change}, cycle ${chips[0]?.cpu.cycles}`);
            matches += (eager?.[0] ?? 0) > 0 ? 1 : 0;
        }
        const [eager, lazy] = chips.map(({ cpu }) => cpu.readData(TCNT));
        assert.equal(lazy, eager, `change ${change}`);
    }
    assert(matches > 1000, "the flags were set");
});
