// The project's own Rust in the page. It is compressed inside the page, and start.ts decompresses it before the first
// question.

import packed from "page.wasm";
import { Rust } from "./rust.ts";
import { unpack } from "./unpack.ts";

/** The module: for workers, and for further instances with their own state. */
export let module: WebAssembly.Module;
let rust: Rust;

/** Resolves when questions can be asked. */
export const ready: Promise<void> = unpack(packed).then((bytes) => {
    module = new WebAssembly.Module(bytes);
    rust = new Rust(module);
});

/** Asks a question. Throws if it is invalid: the page and its Rust are then of different versions. */
export const ask = <Answer>(question: unknown): Answer => rust.ask(question);
