// A session with a machine over a wire of the browser. The project's own Rust (host/link/src/session.rs) decides what is
// typed when, and which answer belongs to which command. This module passes it the time and the received bytes.
//
// It has no clock: the caller calls `turn` in a loop with the wire's time. A session ends with its wire.

import { ask } from "../core.ts";
import { english } from "../words/words.ts";
import type { EventLine, Line, Setting } from "./console_line.ts";
import { linesOf, read } from "./grammar.ts";

/** Types a command, and returns its answer without the `ok`. Throws `Refused` if the machine refuses it. */
export type Ask = (command: string) => Promise<string[]>;

/** A serial line to a machine. Its owner passes what it receives to the session. */
export interface Wire {
    send(text: string): void;
    /** Discards what has not left this computer yet: the machine must not get a command after its sender has given it up. */
    discard?(): void;
    close(): Promise<void>;
}

/** Longest time that the operator's command waits to be sent, by the wire's own clock: then it may surprise. */
const WAIT_MS = 3000;

export type Happening =
    /** The firmware has started; its greeting has the reason. */
    | { is: "started"; line: string; wasAtWork: boolean }
    /** The machine is connected, and has shown its settings and examples. `help` has the settings' texts, by name. */
    | {
          is: "connected";
          version: string;
          settings: readonly Setting[];
          examples: readonly string[];
          help: ReadonlyMap<string, string>;
      }
    /** The machine is lost: for good, as the operator wanted or not, or until it has restarted. */
    | { is: "lost"; why: string; forGood: boolean; isWanted: boolean }
    | { is: "status"; status: Line<"status">; line: string }
    /** The present warning has changed, or has ended. */
    | { is: "warning"; warning: string | undefined }
    | { is: "event"; event: EventLine; line: string }
    | { is: "command"; line: string }
    | { is: "answer"; line: string }
    /** The settings after a command has changed some, and the lines that show them. */
    | { is: "settings"; settings: readonly Setting[]; lines: readonly string[] }
    | { is: "examples"; examples: readonly string[] };

/** The machine refused a command: the problem, and what would be right. */
export class Refused extends Error {}

/** Whether an error is the refusal of a command that the machine takes with `force`. */
export const mayForce = (error: unknown): boolean => error instanceof Refused && error.message.includes("force");

/** Whether a typed line means `hold`, as `is_hold` of host/link/src/lib.rs has it: in any case, with any punctuation. */
export const isHold = (line: string): boolean => /^\s*hold[\s!-/:-@[-\x60{-~]*$/i.test(line);

/** No machine answers, and what to do. */
export class NoMachine extends Error {}

/** The page has not sent a line: why, and what would be right. */
export class NotSent extends Error {}

/** A machine to talk to: by a session here, or by the session of another computer (served.ts). */
export interface Link {
    onHappening: (happening: Happening) => void;
    /** Types an operator's command after the commands before it. Returns its answer without the `ok`. */
    ask: Ask;
    /** Holds the machine at once, and drops the operator's unsent commands. Resolves when the machine has obeyed. */
    hold(): Promise<void>;
    /** Runs a turn at this time. A link without it needs no turns. */
    turn?(now: number): void;
    /** Closes the wire, if this link has one. */
    close?(): Promise<void>;
}

/** News of a machine, as host/page/src/session.rs and `weeder serve` tell it. Help texts are by the setting's name. */
export type News =
    | {
          is: "there";
          version: string;
          /** The lines that show them. */
          settings: readonly string[];
          examples: readonly string[];
          help: Readonly<Record<string, string>>;
          status?: string;
          warning?: string | null;
      }
    /** The present warning's name. */
    | { is: "warning"; said: string | null }
    | { is: "settings" | "examples"; said: readonly string[] }
    | { is: "status" | "event"; said: string }
    /** `weeder serve` tells only of restarts at work. */
    | { is: "restarted"; said: string; wasAtWork?: boolean };

export function tell(news: News, onHappening: (happening: Happening) => void): void {
    switch (news.is) {
        case "there": {
            const { version, examples, status, warning } = news;
            const help = new Map(Object.entries(news.help));
            onHappening({ is: "connected", version, settings: linesOf("setting", news.settings), examples, help });
            if (status !== undefined) tell({ is: "status", said: status }, onHappening);
            if (warning) tell({ is: "warning", said: warning }, onHappening);
            break;
        }
        case "warning":
            onHappening({ is: "warning", warning: news.said ?? undefined });
            break;
        case "settings":
            onHappening({ is: "settings", settings: linesOf("setting", news.said), lines: news.said });
            break;
        case "examples":
            onHappening({ is: "examples", examples: news.said });
            break;
        case "restarted":
            onHappening({ is: "started", line: news.said, wasAtWork: news.wasAtWork ?? true });
            break;
        default: {
            const [line, said] = [news.said, read(news.said)];
            if (said.is === "status") onHappening({ is: "status", status: said, line });
            else if ("isEvent" in said) onHappening({ is: "event", event: said, line });
        }
    }
}

/** What a turn has led to. A failure ends the session. */
interface Turn {
    readonly news: readonly (
        | News
        | { is: "lost"; why: string }
        | { is: "command" | "answer"; line: string }
        | { is: "answered"; number: number; refusal: string | null }
        | { is: "unanswered"; number: number; why: "late" | "held" | "notTyped" | "unknown"; because: string | null }
    )[];
    /** Whether what was typed before is given up. */
    readonly isGivenUp: boolean;
    readonly send: string;
    /** Why no weeder answers, and what the reason is about. */
    readonly failure: {
        is: "noText" | "unsteady" | "nothingAnswers" | "otherDevice" | "resetWhileAsked";
        about: string;
    } | null;
}

export class Session implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** Its number in the Rust. */
    readonly #session: number;
    /** Received text that the Rust does not have yet. */
    #received = "";
    #ended = false;
    #isTurning = false;
    /** Who waits for the end of a command, by its number. Several may wait for a `hold`. */
    readonly #askers = new Map<number, { done(answer: string[]): void; failed(error: Error): void }[]>();
    /** The lines of the answer in progress. */
    #answer: string[] = [];

    /**
     * `resets` says whether opening the wire resets the Uno. `calendarMs` goes on while the computer sleeps: there the
     * clock of `turn` stands still on some systems. Without it, that clock is the only one.
     */
    constructor(
        private readonly wire: Wire,
        private now: number,
        resets: boolean,
        private readonly calendarMs = () => this.now,
    ) {
        this.#session = ask<number>({ open: resets });
    }

    /** Takes received text, with a character for each byte. Whole lines are told at once: where the machine is counts. */
    receive(text: string): void {
        this.#received += text;
        if (/[\r\n]/.test(text)) this.#listen();
    }

    ask(line: string): Promise<string[]> {
        if (this.#ended) return Promise.reject(new NoMachine(english("noneConnected")));
        const number = this.#request<number | null>({ command: { line, deadline: this.#moment(WAIT_MS) } });
        if (number !== null) return this.#end(number);
        const isText = /^[ -~]*$/.test(line);
        const why = line.length > 80 ? "refusedTooLong" : isText ? "tooMuchWaits" : "refusedNotText";
        return Promise.reject(new NotSent(english(why)));
    }

    async hold(): Promise<void> {
        if (this.#ended) throw new NoMachine(english("noneConnected"));
        const held = this.#end(this.#request<number>("hold"));
        this.turn(this.now);
        await held;
    }

    turn(now: number): void {
        this.now = now;
        this.#listen();
        this.#go({ turn: { now: this.#moment() } });
    }

    async close(): Promise<void> {
        this.end(english("noneConnected"), true);
        await this.wire.close();
    }

    /** Ends with the wire: it is lost, or the operator wants to close it. */
    end(why: string, isWanted = false): void {
        if (this.#ended) return;
        this.#ended = true;
        const { news } = this.#request<Turn>({ close: { why } });
        for (const one of news) if (one.is === "unanswered") this.#take(one, why);
        this.onHappening({ is: "lost", why, forGood: true, isWanted });
        void this.wire.close();
    }

    #listen(): void {
        if (this.#isTurning || this.#received === "") return;
        const received = this.#received;
        this.#received = "";
        this.#go({ listen: { received } });
    }

    #go(what: unknown): void {
        if (this.#ended || this.#isTurning) return;
        this.#isTurning = true;
        const { news, isGivenUp, send, failure } = this.#request<Turn>(what);
        const why = failure && whyNone(failure);
        try {
            if (isGivenUp) this.wire.discard?.();
            if (send !== "") this.wire.send(send);
            for (const one of news) this.#take(one, why);
        } finally {
            this.#isTurning = false;
        }
        if (why !== null) this.end(why);
    }

    /** The time now, or some time later, by both clocks. */
    #moment(laterMs = 0) {
        return { tickingMs: this.now + laterMs, calendarMs: this.calendarMs() + laterMs };
    }

    #request<Answer>(what: unknown): Answer {
        return ask<Answer>({ session: { session: this.#session, what } });
    }

    #end(number: number): Promise<string[]> {
        return new Promise((done, failed) => {
            this.#askers.set(number, [...(this.#askers.get(number) ?? []), { done, failed }]);
        });
    }

    #fail(number: number, error: Error): void {
        for (const { failed } of this.#askers.get(number) ?? []) failed(error);
        this.#askers.delete(number);
    }

    /** Takes news. `why` is why the session ends, if it does. */
    #take(news: Turn["news"][number], why: string | null): void {
        switch (news.is) {
            case "lost":
                // `end` tells it.
                if (why !== null) break;
                this.#answer = [];
                this.onHappening({ ...news, forGood: false, isWanted: false });
                break;
            case "command":
                this.onHappening(news);
                break;
            case "answer":
                this.#answer.push(news.line);
                this.onHappening(news);
                break;
            case "answered": {
                const answer = this.#answer.splice(0).slice(0, -1);
                const said = read(news.refusal ?? "");
                if (said.is === "end") this.#fail(news.number, new Refused(said.error));
                for (const { done } of this.#askers.get(news.number) ?? []) done(answer);
                this.#askers.delete(news.number);
                break;
            }
            case "unanswered":
                this.#fail(news.number, whyNot(news.why, why ?? news.because ?? ""));
                break;
            default:
                tell(news, (happening) => this.onHappening(happening));
        }
    }
}

/** Why no weeder answers: on a page the remedies are other ones than those of the command. */
function whyNone({ is, about }: NonNullable<Turn["failure"]>): string {
    if (is === "otherDevice") return english(is, { text: about });
    return is === "resetWhileAsked" ? english(is, { command: about }) : english(is);
}

function whyNot(why: "late" | "held" | "notTyped" | "unknown", because: string): Error {
    if (why === "late") return new NotSent(english("waitedTooLong"));
    if (why === "held") return new NotSent(english("holdFirst"));
    return new NoMachine(why === "unknown" ? english("mayBeDone", { why: because }) : because);
}
