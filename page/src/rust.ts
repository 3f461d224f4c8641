// The project's own Rust (host/page, as WebAssembly): it takes a question as JSON, and returns its answer. Its only
// state between questions is the log that is being read, the rolling machine, and the measurements of a set-up.

/** The module's exports: see host/page/src/exports.rs. */
interface Exports {
    readonly memory: WebAssembly.Memory;
    readonly room: (length: number) => number;
    readonly answer: () => number;
    readonly length: () => number;
    readonly read: () => void;
}

const [encoder, decoder] = [new TextEncoder(), new TextDecoder()];

export class Rust {
    readonly #exports: Exports;

    /** `progress` takes how far a long answer is, from 0 to 1. */
    constructor(module: WebAssembly.Module, progress: (share: number) => void = () => {}) {
        const { exports } = new WebAssembly.Instance(module, { page: { progress_is: progress } });
        this.#exports = exports as unknown as Exports;
    }

    /** Asks a question. Throws if it is invalid: the page and its Rust are then of different versions. */
    ask<Answer>(question: unknown): Answer {
        this.#put(encoder.encode(JSON.stringify(question)));
        const { memory, answer, length } = this.#exports;
        const at = answer();
        const text = decoder.decode(new Uint8Array(memory.buffer, at, length()));
        const said = JSON.parse(text) as { answer: Answer } | { error: string };
        if ("error" in said) throw new Error(`the page asks its Rust what that does not know: ${said.error}`);
        return said.answer;
    }

    /** Passes the next bytes of a log. */
    read(bytes: Uint8Array): void {
        this.#put(bytes);
        this.#exports.read();
    }

    #put(bytes: Uint8Array): void {
        const room = this.#exports.room(bytes.length);
        // The memory may move when it grows.
        new Uint8Array(this.#exports.memory.buffer, room, bytes.length).set(bytes);
    }
}
