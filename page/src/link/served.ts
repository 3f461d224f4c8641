// The machines at another computer's ports, by `weeder serve`. That computer has a session with each machine. It sends
// their state as server-sent events, and answers a request for each command.
//
// The computer decides which commands this page may type. If it falls silent, its machines are reported as lost, and the
// page asks again until it answers. Every request has a time limit, because a network may forget a connection.
//
// A network may also deliver a command late, or after a later HOLD. So a command carries the number of the last message
// that the page had received when the operator gave it. The computer refuses it if that is too old.

import { english } from "../words/words.ts";
import { read } from "./grammar.ts";
import { type Happening, type Link, type News, NoMachine, NotSent, Refused, tell } from "./session.ts";

/** Silence after which the computer counts as lost: it sends a message twice a second. */
const SILENCE_MS = 3000;
const RETRY_MS = 2000;
/** Time limit of a HOLD, and of a question about the computer. The page then tries again. */
const SHORT_MS = 1500;
/** Time limit of a command, and of a HOLD to all: the computer gives a silent machine up after 3 s. */
const LONG_MS = 10_000;

const SILENT = english("servedSilent");

/** Commands that this page may type, besides `hold` and questions. */
export interface Allowed {
    /** `start` and `clear`. */
    readonly mayStart: boolean;
    /** Commands that change the machine or move its tool. */
    readonly mayChange: boolean;
}

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

type About = News | { is: "lost"; why: string; isWanted?: boolean };

type Message = (About & { machine: number }) | { is: "beat" | "dropped" | "held" };

/** Sends a request. It fails with `NoMachine` at its time limit, or when `gone` aborts. Returns the status and the body. */
async function send(path: string, limitMs: number, request: RequestInit = {}, gone?: AbortSignal) {
    const limit = AbortSignal.timeout(limitMs);
    const signal = gone ? AbortSignal.any([limit, gone]) : limit;
    try {
        const answer = await fetch(path, { ...request, signal });
        return { status: answer.status, isOk: answer.ok, text: await answer.text() };
    } catch {
        throw gone?.aborted ? gone.reason : new NoMachine(SILENT);
    }
}

export class Served {
    readonly machines: readonly ServedMachine[];
    /** Whether the page may load itself again: no log is lost by that. */
    mayReload = () => true;
    #isBehind = false;
    #events: EventSource | undefined;
    #heardMs = 0;
    /** The number of the last message. */
    #seen = "";

    static async open(): Promise<Served> {
        const { isOk, text } = await send("/machines", LONG_MS);
        if (!isOk) throw new Error(text);
        return new Served(text, JSON.parse(text));
    }

    /** `text` is the computer's answer. */
    private constructor(
        private readonly text: string,
        readonly allowed: Allowed & { machines: string[] },
    ) {
        this.machines = allowed.machines.map((name, number) => new ServedMachine(number, name, () => this.#seen));
    }

    listen(): void {
        this.#heardMs = performance.now();
        const events = new EventSource("/events");
        this.#events = events;
        events.addEventListener("message", ({ data, lastEventId }) => {
            this.#heardMs = performance.now();
            this.#seen = lastEventId;
            this.#take(JSON.parse(data) as Message);
        });
        events.addEventListener("error", () => this.#lose(SILENT));
    }

    /**
     * Whether another tab of this browser listens instead. A browser has six connections to a computer, and HOLD needs
     * one.
     */
    set isBehind(isBehind: boolean) {
        this.#isBehind = isBehind;
        if (isBehind) this.#lose(english("noneConnected"), true);
    }

    /** Holds all machines, before all waiting commands. */
    async holdAll(): Promise<HeldAll> {
        if (this.machines.some(({ isOther }) => isOther)) throw new Error(english("servedOther"));
        const { isOk, text } = await send("/machines/hold", LONG_MS, { method: "POST" });
        if (!isOk) throw new Error(text);
        return JSON.parse(text) as HeldAll;
    }

    watch(): void {
        if (this.#events && performance.now() - this.#heardMs > SILENCE_MS) this.#lose(SILENT);
    }

    #take(message: Message): void {
        if (message.is === "dropped") this.#lose(english("servedDropped"));
        else if (message.is !== "held" && "machine" in message) this.machines[message.machine]?.tell(message);
    }

    #lose(why: string, isWanted = false): void {
        if (!this.#events) return;
        this.#events.close();
        this.#events = undefined;
        for (const machine of this.machines) machine.tell({ is: "lost", why, isWanted });
        setTimeout(() => void this.#again(), RETRY_MS);
    }

    async #again(): Promise<void> {
        const answer = await send("/machines", SHORT_MS).catch(() => undefined);
        // A new start of `weeder serve` has another code, so it answers with the form. It may have other machines.
        const isOther = answer?.status === 401 || (answer?.isOk && answer.text !== this.text);
        // Some browsers would not ask before they drop a log.
        if (isOther && !this.mayReload()) {
            for (const machine of this.machines) {
                machine.isOther = true;
                machine.tell({ is: "lost", why: english("servedOther") });
            }
        } else if (isOther) location.reload();
        else if (answer?.isOk && !this.#isBehind) this.listen();
        else setTimeout(() => void this.#again(), RETRY_MS);
    }
}

/** A machine at another computer's port. The computer's session reports by `tell`, and each command is a request. */
export class ServedMachine implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** Gets the reason if the machine was absent and still is. */
    onAbsent: (why: string) => void = () => {};
    /** Whether the computer may have another machine by this number now. */
    isOther = false;
    /** While it is connected: ends pending requests, with the reason. */
    #there: AbortController | undefined;
    /** Resolves when earlier commands are answered. A browser has few connections, and HOLD needs one at once. */
    #answered: Promise<unknown> = Promise.resolve();
    #holds = 0;

    /** `seen` returns the number of the last message from the computer. */
    constructor(
        private readonly number: number,
        readonly name: string,
        private readonly seen: () => string = () => "",
    ) {}

    ask(command: string): Promise<string[]> {
        const holds = this.#holds;
        // What the operator has seen, and not what is seen when the command's turn comes.
        const seen = this.seen();
        const answer = this.#answered.then(() => {
            if (holds !== this.#holds) throw new NotSent(english("holdFirst"));
            const gone = this.#there?.signal;
            if (!gone) throw new NoMachine(english("servedNotThere"));
            return this.#type(command, LONG_MS, { headers: { "Weeder-Seen": seen } }, gone);
        });
        this.#answered = answer.catch(() => {});
        return answer;
    }

    /** Goes out at once, also if the machine seems to be lost. */
    async hold(): Promise<void> {
        this.#holds++;
        if (this.isOther) throw new NoMachine(english("servedOther"));
        await this.#type("hold", SHORT_MS);
    }

    tell(message: About): void {
        if (message.is === "there") this.#there = new AbortController();
        if (message.is === "lost") this.#lose(message.why, message.isWanted);
        else tell(message, (happening) => this.onHappening(happening));
    }

    #lose(why: string, isWanted = false): void {
        this.#there?.abort(new NoMachine(english("mayBeDone", { why })));
        if (this.#there) this.onHappening({ is: "lost", why, forGood: true, isWanted });
        else this.onAbsent(why);
        this.#there = undefined;
    }

    async #type(line: string, limitMs: number, request?: RequestInit, gone?: AbortSignal): Promise<string[]> {
        this.onHappening({ is: "command", line });
        const path = `/machines/${this.number}/command`;
        const { text } = await send(path, limitMs, { ...request, method: "POST", body: line }, gone).catch((error) => {
            const isUnknown = gone !== undefined && !gone.aborted;
            throw isUnknown ? new NoMachine(english("mayBeDone", { why: SILENT })) : error;
        });
        const lines = text.trim().split("\n");
        const end = read(lines.at(-1) ?? "");
        if (end.is !== "end") throw new NoMachine(text.trim());
        for (const line of lines) this.onHappening({ is: "answer", line });
        if (end.error !== undefined) throw new Refused(end.error);
        return lines.slice(0, -1);
    }
}
