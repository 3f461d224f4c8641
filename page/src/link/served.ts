// The machines at another computer's ports, by `weeder serve`. That computer has a session with each of them: what it knows comes as
// server-sent events, and a command is a request that gives back its answer.
//
// What may be typed from here is decided there. A computer that falls silent is reported as lost machines, and asked again
// until it answers.

import { english } from "../words/words.ts";
import { isEvent, read, settingsOf } from "./grammar.ts";
import { type Happening, type Link, NoMachine, Refused } from "./session.ts";

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

/** What is told of a machine. Settings and examples are the lines that show them, help is by a setting's name. */
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
    readonly allowed: Allowed;
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
        this.machines = names.map((name, number) => new ServedMachine(number, name));
        this.allowed = allowed;
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
            machines.join("\n") === this.machines.map(({ name }) => name).join("\n")
        );
    }
}

/** A machine at another computer's port. The session with it is there: what that tells comes by `tell`, and a command is a request. */
export class ServedMachine implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** It was not there before, and is not now: why. */
    onAbsent: (why: string) => void = () => {};
    readonly name: string;
    readonly #number: number;
    /** While it is there: ends the requests under way, with the reason. */
    #there: AbortController | undefined;
    /** Done when what was asked before is answered: a browser has few connections to a computer, and HOLD needs one at once. */
    #answered: Promise<unknown> = Promise.resolve();
    #holds = 0;

    constructor(number: number, name: string) {
        [this.#number, this.name] = [number, name];
    }

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

    /** Takes what that computer tells of it. */
    tell(message: About): void {
        switch (message.is) {
            case "there":
                this.#there = new AbortController();
                this.onHappening({ ...message, is: "connected", settings: settingsOf(message.settings) });
                this.onHappening({ is: "help", help: new Map(Object.entries(message.help)) });
                if (message.status !== undefined) this.#read(message.status);
                break;
            case "lost":
                this.#lose(message.why);
                break;
            case "settings":
                this.onHappening({ is: "settings", settings: settingsOf(message.said) });
                break;
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
        const answer = await fetch(`/machines/${this.#number}/command`, request)
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
