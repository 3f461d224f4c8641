// What became of each plant and each tall weed of a trial: how the machine rolled and what the servo was told is written
// down, and judged by the project's own Rust (host/field/src/verdict.rs) as soon as the tool is well behind a thing.
//
// Where the machine rolls back over a plant, that is judged again when it has been passed anew, and the worse of both stands.
// What was written down is kept for as long as a thing is to be judged by it.

import { ask } from "../core.ts";
import { CLEAR_WITHIN_DEGREES, type Machine } from "../row/machine.ts";
import { span, type Thing } from "../row/row.ts";

/** How a plant fared, from good to bad: kept by its margin, or the tool came nearer, or was not out over its canopy. */
export const VERDICTS = ["kept", "margin cut", "damaged"] as const;
export type Verdict = (typeof VERDICTS)[number];

/** Ground behind a thing's margin at which it is judged: by then the tool could have begun to come back too early. */
const BEHIND_MM = 20;
/** Ground before the next thing to be judged of which all is kept: more than the tool needs to swing, at any speed. */
const BEFORE_MM = 500;
/** A swing is over after this. */
const SWING_S = 1;

/** How many plants there were of each verdict, and tall weeds, cut and passed. */
export interface Totals {
    readonly plants: Readonly<Record<Verdict, number>>;
    readonly weeds: { readonly cut: number; readonly passed: number };
}

export class Outcome {
    /** What is known of plants, and whether weeds were cut, by their numbers in the row. */
    readonly plants = new Map<number, Verdict>();
    readonly weeds = new Map<number, boolean>();
    /** All that is judged so far, in numbers. */
    totals: Totals = { plants: { kept: 0, "margin cut": 0, damaged: 0 }, weeds: { cut: 0, passed: 0 } };
    /** Ground that the firmware is to keep free on both sides of a canopy. */
    marginMm = 50;
    readonly #machine: Machine;
    /** The servo's commands, by the cycles of the pulses' edges. */
    #pulses: [rise: number, fall: number][] = [];
    /** When what was written down begins. */
    #fromS: number;
    /** The first thing that is not judged, or is to be judged again. */
    #next = 0;

    constructor(machine: Machine) {
        this.#machine = machine;
        this.#fromS = machine.timeS();
        machine.onCommand = (rise, fall) => this.#pulses.push([rise, fall]);
    }

    /** Judges what lies behind the tool by now. */
    judge(): void {
        const { things } = this.#machine.row;
        const isBehind = (index: number) => {
            const thing = things[index];
            return thing !== undefined && span(thing).endMm + this.marginMm + BEHIND_MM < this.#machine.toolMm;
        };
        while (this.#next > 0 && !isBehind(this.#next - 1)) this.#next -= 1;
        const first = this.#next;
        while (isBehind(this.#next)) this.#next += 1;
        if (first === this.#next) return;
        this.#take(first, things.slice(first, this.#next));
        this.#count();
        this.#forget(things[this.#next]);
    }

    #take(first: number, things: readonly Thing[]): void {
        const { motion, dimensions, servo } = this.#machine;
        const { beamToToolMm, armMm, toolWidthMm } = dimensions;
        const judged = ask<{ plants: Verdict[]; weeds: boolean[] }>({
            judge: {
                things,
                machine: { beamToToolMm, armMm, toolWidthMm, clearWithinDegrees: CLEAR_WITHIN_DEGREES },
                servo: servo.kind,
                marginMm: this.marginMm,
                startMm: motion.placeMm(this.#fromS),
                startCycle: this.#machine.cycleAt(this.#fromS),
                pieces: motion.rolled(this.#fromS, this.#machine.timeS()),
                pulses: this.#pulses,
            },
        });
        for (const [at, { kind }] of things.entries()) {
            const number = first + at;
            if (kind === "weed") {
                this.weeds.set(number, Boolean(judged.weeds.shift()) || this.weeds.get(number) === true);
                continue;
            }
            const [now, before] = [judged.plants.shift() ?? "kept", this.plants.get(number) ?? "kept"];
            this.plants.set(number, VERDICTS.indexOf(now) > VERDICTS.indexOf(before) ? now : before);
        }
    }

    #count(): void {
        const plants = { kept: 0, "margin cut": 0, damaged: 0 };
        for (const verdict of this.plants.values()) plants[verdict] += 1;
        const cut = [...this.weeds.values()].filter((cut) => cut).length;
        this.totals = { plants, weeds: { cut, passed: this.weeds.size } };
    }

    /** Forgets what was before the tool came near the next thing to be judged. */
    #forget(next: Thing | undefined): void {
        const { motion, dimensions, toolMm } = this.#machine;
        const nearMm = Math.min(next ? span(next).startMm : toolMm, toolMm) - BEFORE_MM;
        const placeMm = nearMm + dimensions.beamToToolMm;
        if (motion.placeMm(this.#fromS) >= placeMm) return;
        const near = motion.nextPassing(this.#fromS, placeMm, Number.NEGATIVE_INFINITY);
        if (!near) return;
        this.#fromS = near.timeS;
        motion.forget(this.#fromS);
        // The tool rests where the first command told it.
        const rested = this.#machine.cycleAt(this.#fromS - SWING_S);
        const last = this.#pulses.findLastIndex(([rise]) => rise < rested);
        if (last > 0) this.#pulses.splice(0, last);
    }
}

/** The totals in words. */
export function inWords({ plants, weeds }: Totals): string {
    const passed = plants.kept + plants["margin cut"] + plants.damaged;
    if (passed === 0) return "The tool has passed no plant yet.";
    const are = (count: number) => (count === 1 ? "is" : "are");
    const words = [
        `The tool has passed ${passed} ${passed === 1 ? "plant" : "plants"}: ${
            plants.kept === passed ? "all kept" : `${plants.kept} kept`
        }, with the margin`,
    ];
    if (plants["margin cut"] > 0) words.push(`${plants["margin cut"]} with the margin cut`);
    if (plants.damaged > 0)
        words.push(`${plants.damaged} ${are(plants.damaged)} damaged: the tool was over the canopy`);
    const cut =
        weeds.passed > 0
            ? ` Of ${weeds.passed} tall ${weeds.passed === 1 ? "weed" : "weeds"} it has cut ${weeds.cut}.`
            : "";
    return `${words.join("; ")}.${cut}`;
}
