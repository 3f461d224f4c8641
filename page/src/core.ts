// The project's own Rust in the page (host/page, as WebAssembly): a question goes in as JSON, and its answer comes out.
//
// It is inside of the page, and there before anything is asked. It remembers nothing from one question to the next.

import bytes from "page.wasm";

/** What the module gives: host/page/src/exports.rs says what each is for. */
interface Exports {
    readonly memory: WebAssembly.Memory;
    readonly room: (length: number) => number;
    readonly answer: () => number;
    readonly length: () => number;
}

const core = new WebAssembly.Instance(new WebAssembly.Module(bytes)).exports as unknown as Exports;
const [encoder, decoder] = [new TextEncoder(), new TextDecoder()];

/** Asks a question. Throws where it is none: this page and its Rust are not of one version then. */
export function ask<Answer>(question: unknown): Answer {
    const asked = encoder.encode(JSON.stringify(question));
    const room = core.room(asked.length);
    // The memory may move as it grows.
    new Uint8Array(core.memory.buffer, room, asked.length).set(asked);
    const answer = core.answer();
    const text = decoder.decode(new Uint8Array(core.memory.buffer, answer, core.length()));
    const said = JSON.parse(text) as { answer: Answer } | { error: string };
    if ("error" in said) throw new Error(`the page asks its Rust what that does not know: ${said.error}`);
    return said.answer;
}
