// The machine between row and Uno: the project's Rust (host/page/src/simulation.rs) simulates it, and this module connects
// it to the Uno.
//
// The machine's position is that of the beam; the tool works the ground beamToToolMm behind it. `runUntil` lets the
// Uno's clock run: encoder and beams change their pins at their exact cycles, and the servo receives each pulse. Speed,
// slip, faults and the parameters of the sowing may change between two calls.

import { module } from "../core.ts";
import { Rust } from "../rust.ts";
import type { Uno } from "../uno/uno.ts";

/** The Uno's pins that the page uses itself (README, wiring). */
export const PIN = { workSwitch: 4, endSwitch: 5, servo: 9, lamp: 13 } as const;

/** A crop plant or a tall weed: its centre along the row, and its width at the beam's height. */
export interface Thing {
    readonly kind: "plant" | "weed";
    readonly placeMm: number;
    readonly widthMm: number;
}

/** The stretch of ground below a thing. */
export function span({ placeMm, widthMm }: Thing): { readonly startMm: number; readonly endMm: number } {
    return { startMm: placeMm - widthMm / 2, endMm: placeMm + widthMm / 2 };
}

/** The random row in front of the machine, which continues while the machine rolls. */
export interface Sowing {
    readonly seed: number;
    readonly spacingMm: number;
    /** Share of the gaps between plants with a tall weed. */
    readonly weedShare: number;
    /** The first plant's position. */
    readonly firstMm: number;
}

/** The result for a plant: its margin was kept, the tool came nearer, or the tool was not out over its canopy. */
export type Verdict = "kept" | "marginCut" | "reached" | "damaged";

/** A change from now on: `Different` in host/page/src/simulation.rs. */
export type Change =
    | { speedKmH: number }
    | { slip: number }
    | { beamWireTorn: boolean }
    | { encoderDead: boolean }
    | { spacingMm: number }
    | { weedShare: number };

type Levels = [pin: number, high: boolean][];

interface Begun {
    readonly dimensions: { readonly beamToToolMm: number; readonly toolWidthMm: number };
    readonly setUp: readonly string[];
    readonly levels: Levels;
}

export class Machine {
    readonly uno: Uno;
    readonly dimensions: Begun["dimensions"];
    /** The commands that set up its firmware. */
    readonly setUp: readonly string[];
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
    isBroken = false;
    /** Net counts of a perfect encoder since the start, and the distance of one count. */
    ticks = 0;
    groundMmATick = 0;
    /** Changes of the tool's command so far. The first is not a swing. */
    commands = 0;
    readonly #rust = new Rust(module);
    #pulseRise = 0;

    /**
     * Places a standing machine in front of a row, at the Uno's cycle. `kind` has the differences from the machine from
     * the box: `Begun` in host/page/src/simulation.rs.
     */
    constructor(uno: Uno, sowing: Sowing, kind: { isSetUp?: boolean; secondBeamMm?: number } = {}) {
        this.uno = uno;
        const begin = { cycle: uno.cycle, ...sowing, ...kind };
        const { dimensions, setUp, levels } = this.#rust.ask<Begun>({ begin });
        [this.dimensions, this.setUp] = [dimensions, setUp];
        this.#set(levels);
        this.#look();
        uno.set(PIN.workSwitch, true);
        uno.set(PIN.endSwitch, true);
        uno.onLevel = (pin, high, cycle) => {
            if (pin !== PIN.servo) return;
            if (high) this.#pulseRise = cycle;
            else this.#rust.ask({ hear: [this.#pulseRise, cycle] });
        };
    }

    change(change: Change): void {
        this.#set(this.#rust.ask<Levels>({ change }));
    }

    /** Rolls on until a future cycle, and lets the Uno's clock run until then. */
    runUntil(cycle: number): void {
        const { uno } = this;
        const changes = this.#rust.ask<[cycle: number, pin: number, high: boolean][]>({ roll: cycle });
        for (const [at, pin, high] of changes) {
            uno.runUntil(at);
            uno.set(pin, high);
        }
        uno.runUntil(cycle);
        this.#look();
    }

    /**
     * Judges the things behind the tool, by the firmware's margin and stem zone. Returns by number the result of a
     * plant, or whether a weed was cut. Things that are passed again are judged again; a plant keeps its worse result.
     */
    judge(marginMm: number, stemZoneMm: number): [number: number, fate: Verdict | boolean][] {
        return this.#rust.ask({ judge: { marginMm, stemZoneMm } });
    }

    #set(levels: Levels): void {
        for (const [pin, high] of levels) this.uno.set(pin, high);
    }

    #look(): void {
        const { state, sown } = this.#rust.ask<{ state: object; sown: Thing[] }>("look");
        Object.assign(this, state);
        this.things.push(...sown);
    }
}
