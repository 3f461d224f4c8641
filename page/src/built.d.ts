// The files that build.mjs includes: the firmware, the project's Rust and the translations, compressed, the worker that
// reads logs, and the manual's alarms and warnings.
declare module "*.deflated" {
    const packed: Uint8Array<ArrayBuffer>;
    export default packed;
}

declare module "log-worker.js" {
    const code: string;
    export default code;
}

declare module "faults.json" {
    const faults: { name: string; title: string; advice: string }[];
    export default faults;
}

/** This build of the page: the hash of its files (build.mjs). */
declare const BUILD: string;

/** The firmware's commit behind its version: empty, or as in " (abc1234)". */
declare const COMMIT: string;
