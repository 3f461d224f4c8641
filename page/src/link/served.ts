// The machines at another computer's ports, by `weeder serve`: what they say comes as server-sent events, what is typed goes
// there by POST, and each of them is a wire for a session as a serial port of the browser is.
//
// What may be typed from here is decided there. A computer that falls silent is told as machines that are lost, and asked anew
// until it answers.

import { english } from "../words/words.ts";
import type { Wire } from "./session.ts";

/** Time without a word from the computer after which it is taken for gone: it says something twice a second, however still the machines are. */
const SILENCE_MS = 3000;
/** Time between two tries to hear it again. */
const RETRY_MS = 2000;

const SILENT = english("servedSilent");

/** What may be typed from here beside `hold` and questions. */
export interface Allowed {
    /** `start` and `clear`. */
    readonly mayStart: boolean;
    /** What changes the machine, or moves its tool by hand. */
    readonly mayChange: boolean;
}

/** What came of a HOLD to all machines. */
export interface HeldAll {
    /** Each machine, and why it has not obeyed. */
    readonly machines: readonly { readonly name: string; readonly error: string | null }[];
    /** Time until the last of those that have had obeyed, as the computer there took it. */
    readonly lastMs: number | null;
}

/** Whether this page comes from `weeder serve`. */
export function isServed(): boolean {
    return new URLSearchParams(location.search).has("served");
}

type Message =
    | { is: "there"; machine: number }
    | { is: "lost"; machine: number; why: string }
    | { is: "status"; machine: number; line: string }
    | { is: "event"; machine: number; line: string }
    | { is: "beat" | "dropped" };

export class Served {
    /** A machine is there, with its wire. */
    onThere: (machine: number, wire: Wire) => void = () => {};
    /** A machine without a wire is not there, and why. */
    onLost: (machine: number, why: string) => void = () => {};
    readonly names: readonly string[];
    readonly allowed: Allowed;
    readonly #wires: (ServedWire | undefined)[] = [];
    #events: EventSource | undefined;
    #heardMs = 0;

    /** Asks which machines there are. */
    static async open(): Promise<Served> {
        const answer = await fetch("/machines");
        if (!answer.ok) throw new Error(await answer.text());
        const { machines, ...allowed } = (await answer.json()) as Allowed & { machines: string[] };
        return new Served(machines, allowed);
    }

    private constructor(names: readonly string[], allowed: Allowed) {
        [this.names, this.allowed] = [names, allowed];
    }

    /** Hears the machines from now on. */
    listen(): void {
        this.#heardMs = performance.now();
        const events = new EventSource("/events");
        this.#events = events;
        events.addEventListener("message", ({ data }) => {
            this.#heardMs = performance.now();
            this.#take(JSON.parse(data) as Message);
        });
        events.addEventListener("error", () => this.#lose(SILENT));
    }

    /** Has all machines hold, before all that waits. */
    async holdAll(): Promise<HeldAll> {
        const answer = await fetch("/machines/hold", { method: "POST" }).catch(() => {
            throw new Error(SILENT);
        });
        if (!answer.ok) throw new Error(await answer.text());
        return (await answer.json()) as HeldAll;
    }

    /** Looks whether the computer is still there. */
    watch(): void {
        if (this.#events && performance.now() - this.#heardMs > SILENCE_MS) this.#lose(SILENT);
    }

    #take(message: Message): void {
        switch (message.is) {
            case "there": {
                const wire = new ServedWire(message.machine);
                this.#wires[message.machine] = wire;
                this.onThere(message.machine, wire);
                break;
            }
            case "lost":
                this.#end(message.machine, message.why);
                break;
            case "status":
                this.#wires[message.machine]?.onStatus(message.line);
                break;
            case "event":
                this.#wires[message.machine]?.tell(message.line);
                break;
            case "dropped":
                this.#lose(english("servedDropped"));
                break;
            default:
        }
    }

    #end(machine: number, why: string): void {
        const wire = this.#wires[machine];
        this.#wires[machine] = undefined;
        if (wire) wire.end(why);
        else this.onLost(machine, why);
    }

    #lose(why: string): void {
        if (!this.#events) return;
        this.#events.close();
        this.#events = undefined;
        for (const machine of this.names.keys()) this.#end(machine, why);
        setTimeout(() => void this.#again(), RETRY_MS);
    }

    async #again(): Promise<void> {
        const answer = await fetch("/machines").catch(() => undefined);
        // Another start of `weeder serve` has another code, and gives the form for it; and maybe other machines.
        if (answer?.status === 401 || (answer?.ok && !this.#isSame(await answer.text()))) location.reload();
        else if (answer?.ok) this.listen();
        else setTimeout(() => void this.#again(), RETRY_MS);
    }

    #isSame(text: string): boolean {
        const { machines, mayStart, mayChange } = JSON.parse(text) as Allowed & { machines: string[] };
        const { allowed } = this;
        return (
            mayStart === allowed.mayStart &&
            mayChange === allowed.mayChange &&
            machines.join("\n") === this.names.join("\n")
        );
    }
}

/** A machine at another computer's port, as a session's wire. */
class ServedWire implements Wire {
    onText: (text: string) => void = () => {};
    onEnd: (why: string) => void = () => {};
    onStatus: (line: string) => void = () => {};
    readonly #machine: number;
    #isOver = false;
    /** Answers are given in the order of the lines, whichever comes first. */
    #answered: Promise<void> = Promise.resolve();

    constructor(machine: number) {
        this.#machine = machine;
    }

    /** The machine says something by itself. */
    tell(line: string): void {
        if (!this.#isOver) this.onText(`${line}\r\n`);
    }

    /** The machine is gone, and why. */
    end(why: string): void {
        if (this.#isOver) return;
        this.#isOver = true;
        this.onEnd(why);
    }

    send(text: string): void {
        const line = text.trim();
        // There nobody has left half a line behind.
        if (line === "" || this.#isOver) return;
        // It is on its way at once: `hold` waits for nobody.
        const answer = this.#post(line);
        this.#answered = this.#answered.then(async () => {
            const lines = await answer;
            if (lines !== undefined && !this.#isOver) this.onText(lines);
        });
    }

    async close(): Promise<void> {
        this.#isOver = true;
    }

    /** The answer's lines; nothing where none comes. */
    async #post(line: string): Promise<string | undefined> {
        try {
            const answer = await fetch(`/machines/${this.#machine}/command`, { method: "POST", body: line });
            const said = await answer.text();
            if (answer.ok || said.startsWith("error:")) return said;
            this.end(said.trim());
        } catch {
            this.end(SILENT);
        }
        return undefined;
    }
}
