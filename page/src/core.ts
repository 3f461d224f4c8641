// The project's own Rust in the page. It is inside of it, packed: start.ts has it unpacked before anything is asked.

import packed from "page.wasm";
import { Rust } from "./rust.ts";
import { unpack } from "./unpack.ts";

/** The module, for those who ask it in a worker. */
export let module: WebAssembly.Module;
let rust: Rust;

/** When it can be asked. */
export const ready: Promise<void> = unpack(packed).then((bytes) => {
    module = new WebAssembly.Module(bytes);
    rust = new Rust(module);
});

/** One of its own, for what it is to remember. */
export const another = (): Rust => new Rust(module);

/** Asks a question. Throws where it is none: this page and its Rust are not of one version then. */
export const ask = <Answer>(question: unknown): Answer => rust.ask(question);
