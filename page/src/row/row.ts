// What stands in a crop row, as the beam sees it: crop plants and tall weeds, each with its place along the row and its
// width at the beam's height. Weeds that are too short for the beam are not in it: they are the ground that the tool works.
//
// A `Row` grows at its far end, in order of place; things stand apart. `Planting` sows one by chance, for as long as the
// machine rolls. All places are millimetres along the ground.

/** What a thing in the row is. */
export type Kind = "plant" | "weed";

/** A plant or a tall weed: its centre along the row, and its width at the beam's height. */
export interface Thing {
    readonly kind: Kind;
    readonly placeMm: number;
    readonly widthMm: number;
}

/** The stretch of ground below a thing. */
export function span({ placeMm, widthMm }: Thing): { startMm: number; endMm: number } {
    return { startMm: placeMm - widthMm / 2, endMm: placeMm + widthMm / 2 };
}

export class Row {
    readonly things: readonly Thing[];
    readonly #things: Thing[] = [];

    constructor(things: Iterable<Thing> = []) {
        this.things = this.#things;
        for (const thing of things) this.add(thing);
    }

    /** Adds a thing behind all others. */
    add(thing: Thing): void {
        const { startMm, endMm } = span(thing);
        if (!(startMm < endMm))
            throw new RangeError(`a ${thing.kind} is ${thing.widthMm} mm wide: it has to be above 0`);
        if (!(startMm > this.endMm))
            throw new RangeError(`the ${thing.kind} at ${thing.placeMm} mm has to stand behind the others, and apart`);
        this.#things.push(thing);
    }

    /** Where the last thing ends. */
    get endMm(): number {
        const last = this.#things.at(-1);
        return last ? span(last).endMm : Number.NEGATIVE_INFINITY;
    }

    /** Where the beam changes: the ends of all things, in order; every second one is a beginning, from the first on. */
    endOfThing(index: number): number | undefined {
        const thing = this.#things[index >> 1];
        if (!thing) return undefined;
        const { startMm, endMm } = span(thing);
        return index % 2 === 0 ? startMm : endMm;
    }
}

/** How a row is planted by chance. Scatter is spread evenly: what it is of lies within it of its mean. */
export interface Planting {
    spacingMm: number;
    spacingScatterMm: number;
    canopyMm: number;
    canopyScatterMm: number;
    /** Share of the gaps between plants in which a tall weed stands. */
    weedShare: number;
}

/** As in the manual's example. */
export const PLANTING: Planting = {
    spacingMm: 550,
    spacingScatterMm: 40,
    canopyMm: 150,
    canopyScatterMm: 25,
    weedShare: 0.25,
};

/** Distance that a weed keeps from everything else, so that the beam sees it as an object of its own. */
const WEED_MARGIN_MM = 60;
/** Widths of tall weeds at the beam's height. */
const WEED_WIDTH_MM = { least: 12, greatest: 20 };

/** A source of chance: the same seed gives the same numbers, from 0 to 1, everywhere (Mulberry32). */
export function chance(seed: number): () => number {
    let state = seed >>> 0;
    return () => {
        state = (state + 0x6d2b79f5) >>> 0;
        let bits = Math.imul(state ^ (state >>> 15), state | 1);
        bits ^= bits + Math.imul(bits ^ (bits >>> 7), bits | 61);
        return ((bits ^ (bits >>> 14)) >>> 0) / 2 ** 32;
    };
}

/** Sows plants and weeds behind what stands in a row already, until it reaches a place. */
export function sow(row: Row, untilMm: number, planting: Planting, random: () => number, firstMm: number): void {
    const scatter = (mean: number, by: number) => mean + (2 * random() - 1) * by;
    let last = row.things.findLast(({ kind }) => kind === "plant");
    while ((last?.placeMm ?? Number.NEGATIVE_INFINITY) < untilMm) {
        const plant: Thing = {
            kind: "plant",
            placeMm: last ? last.placeMm + scatter(planting.spacingMm, planting.spacingScatterMm) : firstMm,
            widthMm: scatter(planting.canopyMm, planting.canopyScatterMm),
        };
        // A canopy that reaches into the one before it stands right behind it instead.
        const { startMm } = span(plant);
        const gapMm = startMm - row.endMm;
        const moved = gapMm > 0 ? plant : { ...plant, placeMm: plant.placeMm - gapMm + 1 };
        const weedMm = WEED_WIDTH_MM.least + random() * (WEED_WIDTH_MM.greatest - WEED_WIDTH_MM.least);
        const roomMm = gapMm - 2 * WEED_MARGIN_MM - weedMm;
        const [grows, where] = [random() < planting.weedShare, random()];
        if (last && grows && roomMm > 0) {
            const startsMm = row.endMm + WEED_MARGIN_MM + where * roomMm;
            row.add({ kind: "weed", placeMm: startsMm + weedMm / 2, widthMm: weedMm });
        }
        row.add(moved);
        last = moved;
    }
}
