// What build.mjs puts in: the firmware, the project's Rust, and what the manual says of alarms and warnings.
declare module "weeder.hex" {
    const hex: string;
    export default hex;
}

declare module "page.wasm" {
    const bytes: Uint8Array<ArrayBuffer>;
    export default bytes;
}

declare module "faults.json" {
    const faults: { code: string; name: string; cause: string; advice: string }[];
    export default faults;
}
