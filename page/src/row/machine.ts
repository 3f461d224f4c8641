// The machine between row and Uno: the project's own Rust (host/page/src/trial.rs) rolls it, and here it is wired to the Uno.
//
// The machine's place is what the beam sees; the tool works the ground beamToToolMm behind it. `runUntil` lets the Uno's clock run:
// encoder and beams change their pins at their exact cycles, and the servo hears each pulse. Speed, slip, faults and what is yet to
// be sown may change between two calls.

import { another } from "../core.ts";
import type { Uno } from "../uno/uno.ts";
import type { Thing } from "./row.ts";

/** The Uno's pins that the page itself has to do with (README, wiring). */
export const PIN = { workSwitch: 4, endSwitch: 5, servo: 9, lamp: 13 } as const;

/** What is not as on the machine straight from the box. */
export interface MachineKind {
    readonly toolWidthMm?: number;
    /** Distance from the beam back to a second one; 0 where there is none. */
    readonly secondBeamMm?: number;
    /** Pulse widths for the tool in the row, and out of it. */
    readonly servoInUs?: number;
    readonly servoOutUs?: number;
}

/** What the machine stands in front of. */
export interface Ground {
    /** In order of place, and apart. */
    readonly things?: readonly Thing[];
    /** How the row goes on behind them, by chance, for as long as the machine rolls. */
    readonly sowing?: {
        readonly seed: number;
        readonly spacingMm: number;
        /** Share of the gaps between plants in which a tall weed stands. */
        readonly weedShare: number;
        /** Where the first plant stands. */
        readonly firstMm: number;
    };
}

export interface Dimensions {
    readonly beamToToolMm: number;
    /** From the arm's pivot to the tool. */
    readonly armMm: number;
    readonly toolWidthMm: number;
}

/** How a plant fared, from good to bad: kept by its margin, or the tool came nearer, or was not out over its canopy. */
export type Verdict = "kept" | "margin cut" | "damaged";

/** What may become different on the way, one at a time. */
export type Change =
    /** The speed that the machine comes to; negative backwards. */
    | { speedKmH: number }
    /** The share of the wheel's way that is lost, below 1. */
    | { slip: number }
    /** The first beam's wire is torn: its pin stays on the pull-up, as over bare ground. */
    | { beamWireTorn: boolean }
    /** The encoder says nothing more: its pins stay as they are. */
    | { encoderDead: boolean }
    | { spacingMm: number }
    | { weedShare: number };

type Levels = [pin: number, high: boolean][];

/** The tables of host/page/src/trial.rs. */
const TABLE = { now: 0, changes: 1, sown: 2 } as const;

export class Machine {
    readonly uno: Uno;
    readonly dimensions: Dimensions;
    /** What stands in the row so far. */
    readonly things: Thing[] = [];
    /** The ground that the beam sees, and the ground under the tool. */
    placeMm = 0;
    toolMm = 0;
    /** Negative backwards. */
    speedMmS = 0;
    /** The tool's angle; 0 is in the row. */
    degrees = 0;
    /** How far the tool's middle is beside the row's line. */
    acrossMm = 0;
    /** Whether the tool is fully out of the row. */
    isClear = true;
    /** Whether the tool works the row's line. */
    isWeeding = false;
    /** Whether something stands in the beam. */
    isBroken = false;
    /** Counts of a perfect encoder, net, since the machine was put in front of the row, and what it rolls in one. */
    ticks = 0;
    groundMmATick = 0;
    /** Changes of the tool's command so far. The first is not a swing. */
    commands = 0;
    readonly #rust = another();
    #pulseRise = 0;

    /** Puts the machine, from the Uno's cycle on, in front of a row, where it stands. */
    constructor(uno: Uno, { things = [], sowing }: Ground, kind: MachineKind = {}) {
        this.uno = uno;
        const { dimensions, levels } = this.#rust.ask<{ dimensions: Dimensions; levels: Levels }>({
            begin: { cycle: uno.cycle, things, sowing, ...kind },
        });
        this.dimensions = dimensions;
        this.#set(levels);
        this.#look();
        uno.set(PIN.workSwitch, true);
        uno.set(PIN.endSwitch, true);
        uno.onLevel = (pin, high, cycle) => {
            if (pin !== PIN.servo) return;
            if (high) this.#pulseRise = cycle;
            else this.#rust.hear(this.#pulseRise, cycle);
        };
    }

    /** From now on something is different. */
    change(change: Change): void {
        this.#set(this.#rust.ask<Levels>({ change }));
    }

    /** Rolls on until a cycle that the Uno has not come to, and lets the Uno's clock run there. */
    runUntil(cycle: number): void {
        const { uno } = this;
        this.#rust.roll(cycle);
        // A copy: the servo's pulses on the way change the memory that it is in.
        const changes = this.#rust.trialTable(TABLE.changes).slice();
        for (let at = 0; at < changes.length; at += 3) {
            uno.runUntil(changes[at] ?? 0);
            uno.set(changes[at + 1] ?? 0, changes[at + 2] === 1);
        }
        uno.runUntil(cycle);
        this.#look();
    }

    /**
     * Judges what lies behind the tool by now, by the margin and the stem zone that the firmware keeps: of each thing, by its number,
     * how a plant fared, or whether a weed was cut. What is passed again is judged again; of a plant the worse stands.
     */
    judge(marginMm: number, stemZoneMm: number): [number: number, fate: Verdict | boolean][] {
        return this.#rust.ask({ judge: { marginMm, stemZoneMm } });
    }

    #set(levels: Levels): void {
        for (const [pin, high] of levels) this.uno.set(pin, high);
    }

    /** Takes how the machine is now, and what was sown. */
    #look(): void {
        const now = this.#rust.trialTable(TABLE.now);
        const [placeMm = 0, toolMm = 0, speedMmS = 0, degrees = 0, acrossMm = 0] = now;
        const [isClear, isWeeding, isBroken, ticks = 0, groundMmATick = 0, commands = 0] = now.subarray(5);
        const numbers = { placeMm, toolMm, speedMmS, degrees, acrossMm, ticks, groundMmATick, commands };
        Object.assign(this, numbers, { isClear: isClear === 1, isWeeding: isWeeding === 1, isBroken: isBroken === 1 });
        const sown = this.#rust.trialTable(TABLE.sown);
        for (let at = 0; at < sown.length; at += 3) {
            const [kind, placeMm = 0, widthMm = 0] = sown.subarray(at, at + 3);
            this.things.push({ kind: kind === 0 ? "plant" : "weed", placeMm, widthMm });
        }
    }
}
