// The content of a log, read by the project's Rust (host/page/src/record.rs) in a worker. The worker's code is inside
// the page, because a page on the disk can start no other.
//
// Distances are the tool's travel since the log began, in mm. A day has a million of these values: they stay in tables,
// and only the visible ones are used.

import code from "log-worker.js";
import { module } from "../core.ts";
import type { Asked, Told } from "./worker.ts";

/** The columns of a detection: its class (0 plant, 1 weed, 2 unknown), its canopy's ends, and its keep-out zone. */
const OBJECT = ["class", "fromMm", "toMm", "zoneMm", "zoneEndMm"] as const;
/** The machine's speed at a position and a time, negative backwards. */
const SPEED = ["mm", "timeMs", "mmS"] as const;
/** Ground with the tool in the row. */
const WORKED = ["startMm", "endMm"] as const;

type Row<Columns extends readonly string[]> = Readonly<Record<Columns[number], number>>;
export type Speed = Row<typeof SPEED>;

export interface Trouble {
    readonly name: string;
    readonly mm: number;
    readonly timeMs: number;
    readonly isWarning: boolean;
}

/** A map as SVG, if anything has a place; how many objects have one, and how many lines of the logs are left out. */
export interface Mapped {
    readonly svg: string | null;
    readonly placed: number;
    readonly leftOut: number;
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

interface Head {
    readonly lengthMm: number;
    readonly timeMs: number;
    readonly swings: number;
    readonly alarms: readonly Trouble[];
    /** Whether it has a satellite receiver's positions. */
    readonly hasPlaces: boolean;
    /** Times from which on nothing is drawn: the log lacks the settings in use. */
    readonly unknownMs: readonly number[];
    /** Of the detections, the speeds, and the worked ground. */
    readonly tables: readonly [Float64Array, Float64Array, Float64Array];
}

/** Rows of numbers in the log's order. */
export class Table<Columns extends readonly string[]> {
    /** The columns from `first` to before `end` are the positions of a row, in mm. */
    constructor(
        private readonly values: Float64Array,
        private readonly columns: Columns,
        private readonly first: number,
        private readonly end: number,
    ) {}

    get length(): number {
        return this.values.length / this.columns.length;
    }

    near(fromMm: number, toMm: number): Row<Columns>[] {
        const { values, columns, first, end } = this;
        const rows: Row<Columns>[] = [];
        for (let row = 0; row < values.length; row += columns.length) {
            let [isBefore, isBehind] = [true, true];
            for (let at = row + first; at < row + end; at++) {
                const mm = values[at] ?? 0;
                isBefore &&= mm < fromMm;
                isBehind &&= mm > toMm;
            }
            if (!isBefore && !isBehind) rows.push(this.#row(row));
        }
        return rows;
    }

    nearest(placeMm: number): Row<Columns> {
        const awayMm = (row: number) => Math.abs((this.values[row + this.first] ?? 0) - placeMm);
        let best = 0;
        for (let row = 0; row < this.values.length; row += this.columns.length)
            if (awayMm(row) < awayMm(best)) best = row;
        return this.#row(best);
    }

    #row(at: number): Row<Columns> {
        const values = this.columns.map((column, index) => [column, this.values[at + index]]);
        return Object.fromEntries(values);
    }
}

export interface Picture extends Head {
    readonly objects: Table<typeof OBJECT>;
    readonly speeds: Table<typeof SPEED>;
    readonly worked: Table<typeof WORKED>;
    readonly fastestMmS: number;
}

/** How work goes on: `progress` gets its share that is done, from 0 to 1, and `cancel` ends it. */
export interface Work {
    readonly progress: (share: number) => void;
    readonly cancel: AbortSignal;
}

let address: string | undefined;

/** Asks a question. The worker ends with its answer, or when the work is cancelled. */
export function read<Said>(logs: readonly File[], wants: Asked["wants"], { progress, cancel }: Work): Promise<Said> {
    address ??= URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    const worker = new Worker(address);
    const answer = new Promise<Said>((resolve, reject) => {
        cancel.addEventListener("abort", () => reject(cancel.reason), { once: true });
        worker.addEventListener("error", ({ message }) => reject(new Error(message)));
        worker.addEventListener("message", ({ data }: MessageEvent<Told>) => {
            if ("share" in data) progress(data.share);
            else if ("why" in data) reject(new Error(data.why));
            else resolve(data.answer as Said);
        });
    });
    worker.postMessage({ module, logs, wants } satisfies Asked);
    return answer.finally(() => worker.terminate());
}

export async function picture(log: File, work: Work): Promise<Picture | Problem> {
    const said = await read<Head | Problem>([log], "picture", work);
    if ("problem" in said) return said;
    const [objects, speeds, worked] = said.tables;
    let fastestMmS = 1;
    for (let at = SPEED.indexOf("mmS"); at < speeds.length; at += SPEED.length)
        fastestMmS = Math.max(fastestMmS, Math.abs(speeds[at] ?? 0));
    return {
        ...said,
        fastestMmS,
        objects: new Table(objects, OBJECT, 1, 5),
        speeds: new Table(speeds, SPEED, 0, 1),
        worked: new Table(worked, WORKED, 0, 2),
    };
}
