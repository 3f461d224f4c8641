// Timers that keep time in a hidden tab. A browser delays a hidden page's own timers to a second or more, but not those
// of its workers. A bootloader waits for one second only, and a HOLD that has not come through is typed again.

const CODE = "onmessage = ({ data: [id, ms] }) => setTimeout(() => postMessage(id), ms)";

const waiting = new Map<number, () => void>();
let count = 0;
let worker: Worker | undefined;

export function wait(ms: number): Promise<void> {
    if (!worker) {
        worker = new Worker(URL.createObjectURL(new Blob([CODE], { type: "text/javascript" })));
        worker.addEventListener("message", ({ data }) => {
            waiting.get(data)?.();
            waiting.delete(data);
        });
    }
    const id = count++;
    worker.postMessage([id, ms]);
    return new Promise((done) => waiting.set(id, done));
}

/** Does something again and again, with this time between. */
export function every(ms: number, work: () => void): void {
    void wait(ms).then(() => {
        // First: work that fails is reported, and done again.
        every(ms, work);
        work();
    });
}
