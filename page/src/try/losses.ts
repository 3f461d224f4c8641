// The reasons why ground of a simulation was not weeded, tall weeds were left and plants were not kept.
//
// Each stretch that the tool passes for the first time goes to one part of the loss budget. The parts are those of
// host/field/src/budget.rs without guarded ground, and add up to the whole stretch. The firmware's output decides: its
// state, its reason, and its keep-out zones.

import { type Machine, span, type Thing } from "../row/machine.ts";
import { quantity, say } from "../words/words.ts";

/** A keep-out zone along the row. */
export type Zone = ReturnType<typeof span>;

/** The parts of the ground: the text of each, and of a tall weed that was left on it. */
const PARTS = {
    weeded: { ground: "groundWeeded", left: "leftSwings" },
    plants: { ground: "groundPlants", left: "leftPlants" },
    margins: { ground: "groundMargins", left: "leftPlants" },
    weeds: { ground: "groundWeeds", left: "leftWeeds" },
    swings: { ground: "groundSwings", left: "leftSwings" },
    closed: { ground: "groundClosed", left: "leftClosed" },
} as const;
type Part = keyof typeof PARTS;

const NOT_KEPT = { unseen: "notKeptUnseen", off: "notKeptOff", late: "notKeptLate" } as const;
export type NotKept = keyof typeof NOT_KEPT;

/** Tolerance of a zone's position: the encoder's count, and the beam's. */
const OFF_MM = 5;
/** Reasons of the firmware for which the tool is out on ground of no plant. */
const CLOSED = ["unseen_ground", "too_fast", "encoder_doubtful"];

/** Why a plant was not kept that needs this width and the margins on both sides. */
export function whyNotKept(plant: Thing, widthMm: number, zones: readonly Zone[], marginMm: number): NotKept {
    const { startMm: fromMm, endMm: toMm } = span({ ...plant, widthMm: widthMm + 2 * marginMm });
    const over = zones.filter(({ startMm, endMm }) => startMm < toMm && endMm > fromMm);
    if (over.length === 0) return "unseen";
    const isOff = !over.some(({ startMm, endMm }) => startMm <= fromMm + OFF_MM && endMm >= toMm - OFF_MM);
    return isOff ? "off" : "late";
}

export class Losses {
    /** Ground of each part, in mm. */
    readonly groundMm: Record<Part, number> = { weeded: 0, plants: 0, margins: 0, weeds: 0, swings: 0, closed: 0 };
    /** The part of the ground below each tall weed, by its number in the row. */
    readonly below = new Map<number, Part>();
    /** The machine's state, and why its tool is out, from its last output. */
    isAtWork = false;
    reason: string | undefined;
    #next = 0;

    /** The position of the tool, which is passed until there. */
    constructor(private passedMm: number) {}

    /** Takes the ground that the tool has passed since the last call, with the firmware's zones. */
    pass(machine: Machine, zones: readonly Zone[], marginMm: number): void {
        const { toolMm, things } = machine;
        if (toolMm <= this.passedMm) return;
        const part = this.#part(machine, zones, marginMm);
        this.groundMm[part] += toolMm - this.passedMm;
        this.passedMm = toolMm;
        for (let thing = things[this.#next]; thing && thing.placeMm <= toolMm; thing = things[this.#next]) {
            if (thing.kind === "weed") this.below.set(this.#next, part);
            this.#next += 1;
        }
    }

    #part({ toolMm, things, isWeeding }: Machine, zones: readonly Zone[], marginMm: number): Part {
        if (isWeeding) return "weeded";
        if (!this.isAtWork || CLOSED.includes(this.reason ?? "")) return "closed";
        const around = zones.filter(({ startMm, endMm }) => startMm <= toolMm && endMm >= toolMm);
        if (around.length === 0) return "swings";
        const kept = around.filter(({ startMm, endMm }) => nearest(things, (startMm + endMm) / 2) !== "weed");
        if (kept.length === 0) return "weeds";
        const isInside = kept.some(({ startMm, endMm }) => startMm + marginMm <= toolMm && endMm - marginMm >= toolMm);
        return isInside ? "plants" : "margins";
    }
}

/** The kind of the thing nearest to a position. */
function nearest(things: readonly Thing[], placeMm: number): Thing["kind"] | undefined {
    const awayMm = (thing: Thing) => Math.abs(thing.placeMm - placeMm);
    const nearer = (one: Thing, other: Thing) => (awayMm(one) < awayMm(other) ? one : other);
    return things.length > 0 ? things.reduce(nearer).kind : undefined;
}

/** The parts of the ground, in words; empty without ground. */
export function groundInWords(groundMm: Readonly<Record<Part, number>>): string {
    const parts = Object.keys(PARTS) as Part[];
    const allMm = parts.reduce((sum, part) => sum + groundMm[part], 0);
    if (allMm < 1) return "";
    const share = (part: Part) => quantity((100 * groundMm[part]) / allMm, "percent");
    return say("ground", { parts: parts.map((part) => say(PARTS[part].ground, { share: share(part) })).join(", ") });
}

/** The counts of the texts in a list, the most frequent first. */
function counted(words: readonly ((typeof PARTS)[Part]["left"] | (typeof NOT_KEPT)[NotKept])[]): string {
    const counts = new Map<(typeof words)[number], number>();
    for (const word of words) counts.set(word, (counts.get(word) ?? 0) + 1);
    return [...counts]
        .sort(([, one], [, other]) => other - one)
        .map(([word, count]) => say(word, { count }))
        .join(", ");
}

/** Why weeds were left and plants not kept, in words. */
export function whyInWords(left: readonly (Part | undefined)[], notKept: readonly NotKept[]): string {
    const weeds =
        left.length > 0 ? [say("left", { parts: counted(left.map((part) => PARTS[part ?? "closed"].left)) })] : [];
    const plants = notKept.length > 0 ? [say("notKept", { parts: counted(notKept.map((why) => NOT_KEPT[why])) })] : [];
    return [...plants, ...weeds].join(" ");
}
