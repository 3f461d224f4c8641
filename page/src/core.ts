// The compressed parts of the page: the project's own Rust, the firmware, and the translations. start.ts waits for them.
// The page is smaller this way: the Base64 of compressed data is shorter than the data.

import packedHex from "firmware.deflated";
import packedLanguages from "languages.deflated";
import packedRust from "rust.deflated";
import { Rust } from "./rust.ts";

/** The Rust's module: for workers, and for further instances with their own state. */
export let module: WebAssembly.Module;
export let hex = "";
export let translations: {
    readonly hi: typeof import("./words/hi.json");
    readonly es: typeof import("./words/es.json");
    readonly fr: typeof import("./words/fr.json");
};
let rust: Rust;

function unpack(packed: Uint8Array<ArrayBuffer>): Response {
    return new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate-raw")));
}

/** Resolves when they are decompressed. */
export const ready = (async () => {
    translations = await unpack(packedLanguages).json();
    hex = await unpack(packedHex).text();
    module = new WebAssembly.Module(await unpack(packedRust).arrayBuffer());
    rust = new Rust(module);
})();

export const ask = <Answer>(question: unknown): Answer => rust.ask(question);
