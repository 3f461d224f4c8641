// Timers that keep time in a hidden tab. A browser delays a hidden page's own timers to a second or more, but not those
// of its workers. A bootloader waits for one second only.

const CODE = "onmessage = ({ data: [id, ms] }) => setTimeout(() => postMessage(id), ms)";

const waiting = new Map<number, () => void>();
let count = 0;
let worker: Worker | undefined;

function call(id: number): void {
    waiting.get(id)?.();
    waiting.delete(id);
}

/** Calls `done` after this time. Returns a function that prevents it. */
export function after(ms: number, done: () => void): () => void {
    const id = count++;
    waiting.set(id, done);
    if (!worker) {
        worker = new Worker(URL.createObjectURL(new Blob([CODE], { type: "text/javascript" })));
        worker.addEventListener("message", ({ data }) => call(data));
    }
    worker.postMessage([id, ms]);
    return () => void waiting.delete(id);
}

export const wait = (ms: number): Promise<void> => new Promise((done) => void after(ms, done));
