// A question about logs, answered by a worker. The worker's code is inside the page, because a page on the disk can
// start no other.

import code from "log-worker.js";
import { module } from "../core.ts";
import type { Asked, Told } from "./worker.ts";

interface Answer<Said> {
    readonly said: Said;
    readonly tables: readonly Float64Array[];
}

/** The question was cancelled. */
export class Cancelled extends Error {}

/** How work goes on: `progress` gets its share that is done, from 0 to 1, and `cancel` ends it. */
export interface Work {
    readonly progress: (share: number) => void;
    readonly cancel: AbortSignal;
}

let address: string | undefined;

/** Asks a question. The worker ends with its answer, or when the work is cancelled. */
export function read<Said>(
    logs: readonly File[],
    wants: Asked["wants"],
    { progress, cancel }: Work,
): Promise<Answer<Said>> {
    address ??= URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
    const worker = new Worker(address);
    const answer = new Promise<Answer<Said>>((resolve, reject) => {
        cancel.addEventListener("abort", () => reject(new Cancelled()), { once: true });
        worker.addEventListener("error", ({ message }) => reject(new Error(message)));
        worker.addEventListener("message", ({ data }: MessageEvent<Told>) => {
            if ("share" in data) progress(data.share);
            else if ("why" in data) reject(new Error(data.why));
            else resolve({ said: data.answer as Said, tables: data.tables });
        });
    });
    worker.postMessage({ module, logs, wants } satisfies Asked);
    return answer.finally(() => worker.terminate());
}
