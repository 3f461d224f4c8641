// The content of a log, read by the project's Rust (host/page/src/record.rs). Distances are the tool's travel since the
// log began, in mm. A day has a million of these values: they stay in tables, and only the visible ones are used.

import { read } from "./reading.ts";
import type { MapWords } from "./worker.ts";

/** A detection: its canopy's ends, and its keep-out zone. */
export interface Found {
    readonly class: "plant" | "weed" | "unknown";
    readonly fromMm: number;
    readonly toMm: number;
    readonly zoneMm: number;
    readonly zoneEndMm: number;
}

/** The machine's speed at a position and a time, negative backwards. */
export interface Speed {
    readonly mm: number;
    readonly timeMs: number;
    readonly mmS: number;
}

/** Ground with the tool in the row. */
export interface Worked {
    readonly startMm: number;
    readonly endMm: number;
}

export interface Trouble {
    readonly name: string;
    readonly mm: number;
    readonly timeMs: number;
    readonly isWarning: boolean;
}

/** How much of a log and this firmware agrees, and the first difference. */
export interface Replayed {
    readonly objects: number;
    readonly swings: number;
    readonly alarms: number;
    readonly difference: string | null;
    readonly notes: readonly string[];
}

export interface Problem {
    /** The reason for a missing result. */
    readonly problem: string;
}

/** The Rust's answer besides its tables. */
interface Head {
    readonly lengthMm: number;
    readonly timeMs: number;
    readonly swings: number;
    readonly alarms: readonly Trouble[];
    /** Whether it has a satellite receiver's positions. */
    readonly hasPlaces: boolean;
}

/** Number of rows in a block of a table. A block is found by its ground. */
const BLOCK = 256;

/** Rows of numbers in the log's order, and the ground of each block of rows. */
export class Table<Row> {
    readonly length: number;
    readonly #values: Float64Array;
    readonly #columns: number;
    readonly #make: (values: Float64Array) => Row;
    /** The first and the last mm of each block. */
    readonly #blocks: (readonly [number, number])[] = [];

    /** The columns from `first` to before `end` are the positions of a row, in mm. */
    constructor(
        values: Float64Array,
        columns: number,
        first: number,
        end: number,
        make: (values: Float64Array) => Row,
    ) {
        this.#values = values;
        this.#columns = columns;
        this.#make = make;
        this.length = values.length / columns;
        for (let at = 0; at < this.length; at += BLOCK) {
            let [least, most] = [Number.POSITIVE_INFINITY, Number.NEGATIVE_INFINITY];
            for (let row = at; row < Math.min(at + BLOCK, this.length); row++)
                for (let column = first; column < end; column++) {
                    const mm = values[row * columns + column] ?? 0;
                    least = Math.min(least, mm);
                    most = Math.max(most, mm);
                }
            this.#blocks.push([least, most]);
        }
    }

    /** The rows of all blocks that overlap this ground: all rows on it, and some beside it. */
    near(fromMm: number, toMm: number): Row[] {
        return this.#blocks.flatMap(([least, most], block) =>
            most >= fromMm && least <= toMm ? this.#rows(block) : [],
        );
    }

    /** The rows of the block that is nearest to a position. */
    nearest(placeMm: number): Row[] {
        const away = ([least, most]: readonly [number, number]) => Math.max(least - placeMm, placeMm - most, 0);
        const best = this.#blocks.reduce(
            (best, block, at) => (away(block) < away(this.#blocks[best] ?? block) ? at : best),
            0,
        );
        return this.#rows(best);
    }

    #rows(block: number): Row[] {
        const rows: Row[] = [];
        for (let row = block * BLOCK; row < Math.min((block + 1) * BLOCK, this.length); row++)
            rows.push(this.#make(this.#values.subarray(row * this.#columns, (row + 1) * this.#columns)));
        return rows;
    }
}

export interface Picture extends Head {
    readonly objects: Table<Found>;
    readonly speeds: Table<Speed>;
    readonly worked: Table<Worked>;
    readonly fastestMmS: number;
}

const CLASSES = ["plant", "weed", "unknown"] as const;
const SPEED_COLUMNS = 3;

export async function picture(
    log: File,
    progress: (share: number) => void,
    cancel: AbortSignal,
): Promise<Picture | Problem> {
    const { said, tables } = await read<Head | Problem>([log], "picture", progress, cancel);
    const [objects, speeds, worked] = tables;
    if ("problem" in said || !objects || !speeds || !worked) return said as Problem;
    let fastestMmS = 1;
    for (let at = 2; at < speeds.length; at += SPEED_COLUMNS)
        fastestMmS = Math.max(fastestMmS, Math.abs(speeds[at] ?? 0));
    return {
        ...said,
        fastestMmS,
        objects: new Table(objects, 5, 1, 5, ([kind = 0, fromMm = 0, toMm = 0, zoneMm = 0, zoneEndMm = 0]) => ({
            class: CLASSES[kind] ?? "unknown",
            fromMm,
            toMm,
            zoneMm,
            zoneEndMm,
        })),
        speeds: new Table(speeds, SPEED_COLUMNS, 0, 1, ([mm = 0, timeMs = 0, mmS = 0]) => ({ mm, timeMs, mmS })),
        worked: new Table(worked, 2, 0, 2, ([startMm = 0, endMm = 0]) => ({ startMm, endMm })),
    };
}

export async function replay(
    log: File,
    progress: (share: number) => void,
    cancel: AbortSignal,
): Promise<Replayed | Problem> {
    return (await read<Replayed | Problem>([log], "replay", progress, cancel)).said;
}

/** The map of some logs. */
export interface GroundMap {
    /** Null if nothing has a position. */
    readonly svg: string | null;
    /** How many objects have one. */
    readonly placed: number;
}

export async function map(
    logs: readonly File[],
    words: MapWords,
    progress: (share: number) => void,
    cancel: AbortSignal,
): Promise<GroundMap> {
    return (await read<GroundMap>(logs, { map: words }, progress, cancel)).said;
}
