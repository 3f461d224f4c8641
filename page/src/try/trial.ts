// A trial without an end: the real firmware on the virtual Uno, a machine, and a row that goes on for as long as it rolls.
//
// `advance` lets time pass. What the operator does, to the machine or to the row, he may do between two calls. `outcome`
// knows what became of each plant that the tool has left behind.

import type { Seen } from "../link/grammar.ts";
import type { Happening } from "../link/session.ts";
import { Machine, PIN } from "../row/machine.ts";
import { Motion, mmS } from "../row/motion.ts";
import { chance, PLANTING, type Planting, Row, sow } from "../row/row.ts";
import { CYCLES_PER_SECOND, Uno } from "../uno/uno.ts";
import { Outcome } from "./outcome.ts";

/** Ground that lies sown ahead of the beam. */
const SOWN_AHEAD_MM = 2000;
/** Where the first plant stands, ahead of the beam. */
const FIRST_MM = 800;
/** How fast the machine gains and loses speed. */
const ACCELERATION_MM_S2 = 500;
/** Ground behind the tool of which tracks and windows are kept. */
const KEPT_MM = 3000;
/** Cycles between two looks at the host's clock: a millisecond. */
const SLICE_CYCLES = CYCLES_PER_SECOND / 1000;

/** A point of the tool's way over the ground: along the row, and across it from the row's line. */
export interface TrackPoint {
    readonly alongMm: number;
    readonly acrossMm: number;
}

/** Ground along the row that the firmware leaves alone. */
export interface Window {
    readonly startMm: number;
    readonly endMm: number;
}

export class Trial {
    readonly uno: Uno;
    readonly machine: Machine;
    readonly planting: Planting = { ...PLANTING };
    readonly outcome: Outcome;
    /** What the firmware sends. */
    onText: (text: string) => void = () => {};
    windows: Window[] = [];
    track: TrackPoint[] = [];
    readonly #random: () => number;
    /** The machine's count when the firmware began to count. */
    #zero = 0;

    constructor(hex: string, seed: number) {
        this.#random = chance(seed);
        this.uno = new Uno(hex);
        const row = new Row();
        sow(row, SOWN_AHEAD_MM, this.planting, this.#random, FIRST_MM);
        this.machine = new Machine(this.uno, row, new Motion(0));
        this.outcome = new Outcome(this.machine);
        this.uno.onByte = (byte) => this.onText(String.fromCharCode(byte));
        this.#mark();
    }

    /** Lets time pass on the chip, for no longer than the host has for it, and gives back how much did. */
    advance(seconds: number, budgetMs: number): number {
        const { uno, machine } = this;
        const begin = uno.cycle;
        const end = begin + seconds * CYCLES_PER_SECOND;
        const until = performance.now() + budgetMs;
        while (uno.cycle < end && performance.now() < until) {
            sow(machine.row, machine.placeMm + SOWN_AHEAD_MM, this.planting, this.#random, FIRST_MM);
            machine.runUntil(Math.min(end, uno.cycle + SLICE_CYCLES), () => this.#mark());
        }
        this.outcome.judge();
        this.#forget();
        return (uno.cycle - begin) / CYCLES_PER_SECOND;
    }

    /** From now on, rolls at a speed, back where it is negative. */
    rollAt(speedKmH: number): void {
        this.machine.motion.changeSpeed(this.machine.timeS(), mmS(speedKmH), ACCELERATION_MM_S2);
    }

    /** From now on, loses a share of the wheel's way. */
    slipBy(share: number): void {
        this.machine.motion.slipFrom(this.machine.timeS(), share);
    }

    /** Throws the work switch. */
    work(on: boolean): void {
        this.uno.set(PIN.workSwitch, !on);
    }

    /** Whether the status lamp is lit. */
    get isLampLit(): boolean {
        return this.uno.isHigh(PIN.lamp);
    }

    /** Where the tool is, as a point of its track: as in the machine's model, the arm's swing moves it across the row alone. */
    get tool(): TrackPoint {
        return { alongMm: this.machine.toolMm, acrossMm: this.machine.acrossMm };
    }

    /** Takes note of what has happened at the console. */
    take(happening: Happening): void {
        if (happening.is === "started") {
            this.#zero = this.machine.ticks;
            this.windows = [];
        }
        if (happening.is === "connected" || happening.is === "settings") {
            const margin = happening.settings.find(({ name }) => name === "margin_mm");
            if (margin) this.outcome.marginMm = margin.value;
        }
        if (happening.is !== "told") return;
        const { said } = happening;
        if (said.is === "alarm") this.windows = [];
        if (said.is === "object" && said.seen.class !== "weed") this.windows.push(this.#window(said.seen));
    }

    /**
     * The ground of a window. The paper's delay and hold are counted from the moment at which the leading edge is in the
     * beam, when the tool is beamToToolMm behind it. Counts become ground as the machine rolls now.
     */
    #window({ position, delay, hold }: Seen): Window {
        const { machine } = this;
        const { motion, tickMm, dimensions } = machine;
        const timeS = machine.timeS();
        const slipped = motion.groundMmAMm(timeS);
        const ground = (count: number) => machine.placeMm + (count + this.#zero - machine.ticks) * tickMm * slipped;
        const startMm = ground(position + delay) - dimensions.beamToToolMm;
        return { startMm, endMm: startMm + hold * tickMm * slipped };
    }

    /** Puts the tool's place on its track. On a straight way only its end moves. */
    #mark(): void {
        const { track, tool } = this;
        const [before, last] = [track.at(-2), track.at(-1)];
        if (before?.acrossMm === tool.acrossMm && last?.acrossMm === tool.acrossMm) track.pop();
        track.push(tool);
    }

    #forget(): void {
        const behindMm = this.machine.toolMm - KEPT_MM;
        const gone = this.track.findIndex(({ alongMm }) => alongMm > behindMm);
        // The point before is where a straight way comes from.
        if (gone > 100) this.track.splice(0, gone - 1);
        this.windows = this.windows.filter(({ endMm }) => endMm > behindMm);
    }
}
