// Reads logs off the page, which goes on meanwhile: a day of a log takes a second to read, and its replay a minute.
//
// It is asked one thing, tells how far it is, and is stopped by its end.

import { Rust } from "../rust.ts";

export interface Asked {
    readonly module: WebAssembly.Module;
    /** One, but for a map. */
    readonly logs: readonly File[];
    readonly wants: "picture" | "replay" | { readonly map: MapWords };
}

/** The words of a map: host/gps/src/picture.rs says which. */
export interface MapWords {
    readonly legend: readonly string[];
    readonly withoutPlace: string;
    readonly north: string;
}

/** What it tells: how far it is, from 0 to 1, or the answer with the tables that go with it, or why there is none. */
export type Told =
    | { readonly share: number }
    | { readonly answer: unknown; readonly tables: readonly Float64Array<ArrayBuffer>[] }
    | { readonly why: string };

const PIECE_BYTES = 1 << 20;
/** What of the time the reading takes, where all lines are held: of a replay, and of a map. */
const READING = { replay: 0.05, map: 0.5 };
const TABLES = [0, 1, 2];

const own = globalThis as unknown as Worker;
const tell = (told: Told, move: Transferable[] = []) => own.postMessage(told, move);

own.addEventListener("message", ({ data }: MessageEvent<Asked>) => {
    answer(data).catch((error: unknown) => tell({ why: error instanceof Error ? error.message : String(error) }));
});

async function answer({ module, logs, wants }: Asked): Promise<void> {
    const isMap = typeof wants === "object";
    const isWhole = wants !== "picture";
    const reading = isMap ? READING.map : isWhole ? READING.replay : 1;
    const rust = new Rust(module, (share) => tell({ share: reading + (1 - reading) * share }));
    for (const [done, log] of logs.entries()) {
        rust.ask({ log: isWhole });
        for (let at = 0; at < log.size; at += PIECE_BYTES) {
            rust.read(new Uint8Array(await log.slice(at, at + PIECE_BYTES).arrayBuffer()));
            tell({ share: (done + (at / log.size) * reading) / logs.length });
        }
        const put = isMap ? rust.ask<{ problem?: string }>("job") : {};
        if (put.problem) throw new Error(put.problem);
    }
    const answer = rust.ask(wants);
    const tables = isWhole ? [] : TABLES.map((number) => rust.table(number));
    tell(
        { answer, tables },
        tables.map(({ buffer }) => buffer),
    );
}
