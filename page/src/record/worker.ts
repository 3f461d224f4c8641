// Reads logs outside the page's thread, so that the page can be used meanwhile: a day's log takes a second to read, and
// its replay a minute.
//
// It gets one question, reports its progress, and is terminated to cancel it.

import { Rust } from "../rust.ts";

export interface Asked {
    readonly module: WebAssembly.Module;
    /** One log; several for a map. */
    readonly logs: readonly File[];
    /** The map's texts: see host/gps/src/picture.rs. */
    readonly wants: "picture" | "replay" | { map: { legend: string[]; withoutPlace: string; north: string } };
}

/** Its messages: the progress from 0 to 1, the answer, or the error. */
export type Told = { readonly share: number } | { readonly answer: unknown } | { readonly why: string };

const PIECE_BYTES = 1 << 20;
/** Share of the reading in the total time, for a replay and for a map. */
const READING = { replay: 0.05, map: 0.5 };

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
    const answer = rust.ask<{ tables?: number[][] }>(wants);
    // The page takes them over without a copy.
    const tables = answer.tables?.map((table) => Float64Array.from(table));
    tell(
        { answer: { ...answer, tables } },
        tables?.map(({ buffer }) => buffer),
    );
}
