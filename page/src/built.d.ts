// What build.mjs puts in: the firmware, as it is and packed, the project's Rust, packed, the worker that reads logs, and what the manual says of alarms and warnings.
declare module "weeder.hex" {
    const hex: string;
    export default hex;
}

declare module "packed.hex" {
    const packed: Uint8Array<ArrayBuffer>;
    export default packed;
}

declare module "log-worker.js" {
    const code: string;
    export default code;
}

declare module "page.wasm" {
    const packed: Uint8Array<ArrayBuffer>;
    export default packed;
}

declare module "faults.json" {
    const faults: { name: string; title: string; cause: string; advice: string }[];
    export default faults;
}
