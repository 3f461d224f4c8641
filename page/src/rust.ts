// The project's own Rust (host/page, as WebAssembly): a question goes in as JSON, and its answer comes out. It remembers nothing from
// one question to the next, but for the log that is read and the machine that rolls.

/** What the module gives: host/page/src/exports.rs says what each is for. */
interface Exports {
    readonly memory: WebAssembly.Memory;
    readonly room: (length: number) => number;
    readonly answer: () => number;
    readonly length: () => number;
    readonly read: () => void;
    readonly table: (number: number) => number;
    readonly table_length: (number: number) => number;
    readonly roll: (cycle: number) => void;
    readonly hear: (rise: number, fall: number) => void;
    readonly trial_table: (number: number) => number;
    readonly trial_table_length: (number: number) => number;
}

const [encoder, decoder] = [new TextEncoder(), new TextDecoder()];

export class Rust {
    readonly #exports: Exports;

    /** `progress` takes how far a long answer is, from 0 to 1. */
    constructor(module: WebAssembly.Module, progress: (share: number) => void = () => {}) {
        const { exports } = new WebAssembly.Instance(module, { page: { progress_is: progress } });
        this.#exports = exports as unknown as Exports;
    }

    /** Asks a question. Throws where it is none: this page and its Rust are not of one version then. */
    ask<Answer>(question: unknown): Answer {
        this.#put(encoder.encode(JSON.stringify(question)));
        const { memory, answer, length } = this.#exports;
        const at = answer();
        const text = decoder.decode(new Uint8Array(memory.buffer, at, length()));
        const said = JSON.parse(text) as { answer: Answer } | { error: string };
        if ("error" in said) throw new Error(`the page asks its Rust what that does not know: ${said.error}`);
        return said.answer;
    }

    /** Has it read the next bytes of a log. */
    read(bytes: Uint8Array): void {
        this.#put(bytes);
        this.#exports.read();
    }

    /** A copy of a table of what the log shows. */
    table(number: number): Float64Array<ArrayBuffer> {
        const { memory, table, table_length } = this.#exports;
        return new Float64Array(
            memory.buffer,
            table(number),
            table_length(number),
        ).slice() as Float64Array<ArrayBuffer>;
    }

    /** Rolls the machine until a cycle. */
    roll(cycle: number): void {
        this.#exports.roll(cycle);
    }

    /** Has the machine's servo hear a pulse, by the cycles of its edges. */
    hear(rise: number, fall: number): void {
        this.#exports.hear(rise, fall);
    }

    /** A table of the machine that rolls, until it is asked something else. */
    trialTable(number: number): Float64Array {
        const { memory, trial_table, trial_table_length } = this.#exports;
        const at = trial_table(number);
        return new Float64Array(memory.buffer, at, trial_table_length(number));
    }

    #put(bytes: Uint8Array): void {
        const room = this.#exports.room(bytes.length);
        // The memory may move as it grows.
        new Uint8Array(this.#exports.memory.buffer, room, bytes.length).set(bytes);
    }
}
