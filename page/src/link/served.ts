// The machines at another computer's ports, by `weeder serve`. That computer has a session with each machine. It sends
// their state as server-sent events, and answers a request for each command.
//
// The computer decides which commands this page may type. If it falls silent, its machines are reported as lost, and the
// page asks again until it answers.

import { english } from "../words/words.ts";
import { isEvent, linesOf, read } from "./grammar.ts";
import { type Happening, type Link, NoMachine, Refused } from "./session.ts";

/** Silence after which the computer counts as lost: it sends a message twice a second. */
const SILENCE_MS = 3000;
/** Time between two tries to reach it. */
const RETRY_MS = 2000;

const SILENT = english("servedSilent");

/** Commands that this page may type, besides `hold` and questions. */
export interface Allowed {
    /** `start` and `clear`. */
    readonly mayStart: boolean;
    /** Commands that change the machine or move its tool. */
    readonly mayChange: boolean;
}

/** The result of a HOLD to all machines. */
export interface HeldAll {
    /** Each machine, and why it has not obeyed. */
    readonly machines: readonly { readonly name: string; readonly error: string | null }[];
    /** Time until the last machine had obeyed, measured by the computer. `null` if none has. */
    readonly lastMs: number | null;
}

/** Whether this page comes from `weeder serve`. */
export function isServed(): boolean {
    return new URLSearchParams(location.search).has("served");
}

/** News of a machine. Settings and examples are the lines that show them. Help texts are by the setting's name. */
type About =
    | {
          is: "there";
          version: string;
          settings: readonly string[];
          examples: readonly string[];
          help: Record<string, string>;
          status?: string;
      }
    | { is: "lost"; why: string }
    | { is: "settings" | "examples"; said: string[] }
    | { is: "status" | "event"; said: string };

type Message = (About & { machine: number }) | { is: "beat" | "dropped" };

export class Served {
    readonly machines: readonly ServedMachine[];
    #events: EventSource | undefined;
    #heardMs = 0;

    /** Asks the computer for its machines. */
    static async open(): Promise<Served> {
        const answer = await fetch("/machines");
        const text = await answer.text();
        if (!answer.ok) throw new Error(text);
        return new Served(text, JSON.parse(text));
    }

    /** `text` is the computer's answer. */
    private constructor(
        private readonly text: string,
        readonly allowed: Allowed & { machines: string[] },
    ) {
        this.machines = allowed.machines.map((name, number) => new ServedMachine(number, name));
    }

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

    /** Holds all machines, before all waiting commands. */
    async holdAll(): Promise<HeldAll> {
        const answer = await fetch("/machines/hold", { method: "POST" }).catch(() => {
            throw new Error(SILENT);
        });
        if (!answer.ok) throw new Error(await answer.text());
        return (await answer.json()) as HeldAll;
    }

    /** Checks whether the computer has fallen silent. */
    watch(): void {
        if (this.#events && performance.now() - this.#heardMs > SILENCE_MS) this.#lose(SILENT);
    }

    #take(message: Message): void {
        if (message.is === "dropped") this.#lose(english("servedDropped"));
        else if ("machine" in message) this.machines[message.machine]?.tell(message);
    }

    #lose(why: string): void {
        if (!this.#events) return;
        this.#events.close();
        this.#events = undefined;
        for (const machine of this.machines) machine.tell({ is: "lost", why });
        setTimeout(() => void this.#again(), RETRY_MS);
    }

    async #again(): Promise<void> {
        const answer = await fetch("/machines").catch(() => undefined);
        // A new start of `weeder serve` has another code, so it answers with the form. It may have other machines.
        if (answer?.status === 401 || (answer?.ok && (await answer.text()) !== this.text)) location.reload();
        else if (answer?.ok) this.listen();
        else setTimeout(() => void this.#again(), RETRY_MS);
    }
}

/** A machine at another computer's port. The computer's session reports by `tell`, and each command is a request. */
export class ServedMachine implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** Gets the reason if the machine was absent and still is. */
    onAbsent: (why: string) => void = () => {};
    /** While it is connected: ends pending requests, with the reason. */
    #there: AbortController | undefined;
    /** Resolves when earlier commands are answered. A browser has few connections, and HOLD needs one at once. */
    #answered: Promise<unknown> = Promise.resolve();
    #holds = 0;

    constructor(
        private readonly number: number,
        readonly name: string,
    ) {}

    ask(command: string): Promise<string[]> {
        const holds = this.#holds;
        const answer = this.#answered.then(() => {
            if (holds !== this.#holds) throw new Refused(english("holdFirst"));
            return this.#type(command);
        });
        this.#answered = answer.catch(() => {});
        return answer;
    }

    async hold(): Promise<void> {
        this.#holds++;
        await this.#type("hold");
    }

    /** Takes the computer's news of it. */
    tell(message: About): void {
        switch (message.is) {
            case "there":
                this.#there = new AbortController();
                this.onHappening({ ...message, is: "connected", settings: linesOf("setting", message.settings) });
                this.onHappening({ is: "help", help: new Map(Object.entries(message.help)) });
                if (message.status !== undefined) this.#read(message.status);
                break;
            case "lost":
                this.#lose(message.why);
                break;
            case "settings": {
                const lines = message.said;
                this.onHappening({ is: "settings", settings: linesOf("setting", lines), lines });
                break;
            }
            case "examples":
                this.onHappening({ is: "examples", examples: message.said });
                break;
            default:
                this.#read(message.said);
        }
    }

    #lose(why: string): void {
        this.#there?.abort(new NoMachine(why));
        if (this.#there) this.onHappening({ is: "lost", why, forGood: true, isWanted: false });
        else this.onAbsent(why);
        this.#there = undefined;
    }

    /** A status, or an event. */
    #read(line: string): void {
        const said = read(line);
        if (said.is === "status") this.onHappening({ is: "status", status: said, line });
        else if (isEvent(said)) this.onHappening({ is: "event", event: said, line });
    }

    async #type(line: string): Promise<string[]> {
        const signal = this.#there?.signal;
        if (!signal) throw new NoMachine(english("servedNotThere"));
        this.onHappening({ is: "command", line });
        const request = { method: "POST", body: line, signal };
        const answer = await fetch(`/machines/${this.number}/command`, request)
            .then((response) => response.text())
            .catch((error) => {
                throw error instanceof NoMachine ? error : new NoMachine(SILENT);
            });
        const lines = answer.trim().split("\n");
        const end = read(lines.at(-1) ?? "");
        if (end.is !== "end") throw new NoMachine(answer.trim());
        for (const line of lines) this.onHappening({ is: "answer", line });
        if (end.error !== undefined) throw new Refused(end.error);
        return lines.slice(0, -1);
    }
}
