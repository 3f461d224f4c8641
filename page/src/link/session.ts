// A session with a machine over a wire: types one command at a time, matches the answers, polls the status, and reports
// what happened.
//
// It has no clock: the caller calls `turn` in a loop with the wire's time. For the page's own Uno this is the chip's time.
// After every start of the Uno it asks for version, settings and examples, and turns the events on. `hold` does not wait. A
// session ends with its wire.

import { english, reason } from "../words/words.ts";
import type { EventLine, Line, Setting } from "./console_line.ts";
import { isEvent, linesOf, read } from "./grammar.ts";

/** Types a command, and returns its answer without the `ok`. Throws `Refused` if the machine refuses it. */
export type Ask = (command: string) => Promise<string[]>;

/** A serial line to a machine. Its owner passes what it receives to the session. */
export interface Wire {
    send(text: string): void;
    close(): Promise<void>;
}

/** Time between two polls of the status. */
const POLL_MS = 100;
/** Longest further wait of a poll for commands: between many of them the state must not become unknown. */
const BEHIND_MS = 300;
/** Longest wait for an answer: the longest answer, all examples, takes less than a second. */
const PATIENCE_MS = 2000;
/** Longest time that counts as waiting between two turns. A busy or suspended page may have an unread answer. */
const LONGEST_TURN_MS = 200;
/** Longest time from a reset to the greeting: old bootloaders wait for two seconds. */
const BOOT_MS = 3000;
/** Longest time that the operator's command waits to be sent, by the wire's own clock: then it may surprise. */
const WAIT_MS = 3000;
/** Further tries from the beginning, after missing or damaged answers. */
const TRIES = 2;

export type Happening =
    /** The firmware has started; its greeting has the reason. */
    | { is: "started"; line: string; wasAtWork?: boolean }
    /** The machine is connected, and has shown its settings and examples. */
    | { is: "connected"; version: string; settings: readonly Setting[]; examples: readonly string[] }
    /** The machine is lost: for good, as the operator wanted or not, or until it has restarted. */
    | { is: "lost"; why: string; forGood: boolean; isWanted: boolean }
    | { is: "status"; status: Line<"status">; line: string }
    /** The machine sent an event line. */
    | { is: "event"; event: EventLine; line: string }
    | { is: "command"; line: string }
    | { is: "answer"; line: string }
    /** The settings after a command has changed some, and the lines that show them. */
    | { is: "settings"; settings: readonly Setting[]; lines: readonly string[] }
    | { is: "examples"; examples: readonly string[] }
    /** The help texts of the settings, by name. */
    | { is: "help"; help: Map<string, string> };

/** The machine refused a command: the problem, and what would be right. */
export class Refused extends Error {}

/** Whether an error is the refusal of a command that the machine takes with `force`. */
export const mayForce = (error: unknown): boolean => error instanceof Refused && error.message.includes("force");

/** Whether a typed line means `hold`, as `is_hold` of host/link/src/lib.rs has it: in any case, with any punctuation. */
export const isHold = (line: string): boolean => /^\s*hold[\s!-/:-@[-\x60{-~]*$/i.test(line);

/** No machine answers, and what to do. */
export class NoMachine extends Error {}

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

/** The longest line: 256 characters. The firmware's own lines are shorter than 128. */
const LINE = /[^\r\n]{256}|[^\r\n]+(?=[\r\n])/g;

/**
 * Splits received text into lines. Any input is accepted. A line ends with CR, LF or both, or when it is longer than any
 * line of the firmware. A character that is not printable ASCII becomes U+FFFD. Empty lines are dropped.
 */
export class LineReader {
    #partial = "";

    /** Takes received text, and returns the complete lines. */
    take(text: string): string[] {
        const received = this.#partial + text.replaceAll(/[^ -~\r\n]/g, "\u{fffd}");
        let end = 0;
        const lines = [...received.matchAll(LINE)].map((found) => {
            end = found.index + found[0].length;
            return found[0];
        });
        this.#partial = received.slice(end).replace(/^[\r\n]+/, "");
        return lines;
    }
}

interface Question {
    readonly command: string;
    /** Whether the operator typed it. */
    readonly isTyped: boolean;
    readonly since: number;
    /** The wire's time of the last turn before it was typed. A sleep of the computer counts. */
    readonly typedAt: number;
    readonly answer: string[];
    readonly done: (answer: string[]) => void;
    readonly failed: (error: Error) => void;
}

export class Session implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** Whether the machine has answered with version, settings and examples. */
    #isReady = false;
    readonly #lines = new LineReader();
    /** Typed commands without an answer, in the order of the answers. */
    #asked: Question[] = [];
    #waiting: Question[] = [];
    /** The waiting time so far, by the wire's clock. */
    #now: number;
    /** The wire's time at the last turn. */
    #turnedAt: number;
    #pollAt = Number.POSITIVE_INFINITY;
    #ended = false;
    /** End of the wait for a greeting. */
    #greetingBy: number;
    /** How often the session has begun again. */
    #beginnings = 0;
    /** Received text that does not come from the weeder. */
    #strange = "";

    /** `resets` says whether opening the wire resets the Uno. */
    constructor(
        private readonly wire: Wire,
        now: number,
        resets: boolean,
    ) {
        [this.#now, this.#turnedAt] = [now, now];
        this.#greetingBy = resets ? now + BOOT_MS : now;
    }

    /** Takes received text. */
    receive(text: string): void {
        for (const line of this.#lines.take(text)) this.#take(line);
    }

    ask(command: string): Promise<string[]> {
        return this.#ask(command, true);
    }

    /** Keeps the page's own questions. */
    async hold(): Promise<void> {
        this.#drop(({ isTyped }) => isTyped, "holdFirst");
        await this.#ask("hold", true, (question) => this.#send(question));
    }

    turn(now: number): void {
        this.#now += Math.min(now - this.#turnedAt, LONGEST_TURN_MS);
        this.#turnedAt = now;
        if (this.#ended) return;
        this.#drop(({ isTyped, typedAt }) => isTyped && now - typedAt > WAIT_MS, "waitedTooLong");
        if (this.#now >= this.#greetingBy) {
            this.#greetingBy = Number.POSITIVE_INFINITY;
            void this.#begin();
        }
        const [oldest] = this.#asked;
        if (oldest && this.#now - oldest.since > PATIENCE_MS) this.#giveUp(oldest);
        if (this.#asked.length > 0) return;
        const pollAt = this.#pollAt + (this.#waiting.length > 0 ? BEHIND_MS : 0);
        if (this.#now >= pollAt) {
            this.#pollAt = this.#now + POLL_MS;
            void this.#ask("status", false, (question) => this.#waiting.unshift(question)).catch(() => {});
        }
        const next = this.#waiting.shift();
        if (next) this.#send({ ...next, since: this.#now });
    }

    /** Drops waiting commands, which were not sent. */
    #drop(which: (question: Question) => boolean, why: "holdFirst" | "waitedTooLong"): void {
        const dropped = this.#waiting.filter(which);
        if (dropped.length > 0) this.#waiting = this.#waiting.filter((question) => !dropped.includes(question));
        for (const { failed } of dropped) failed(new Refused(english(why)));
    }

    async close(): Promise<void> {
        this.end("No machine is connected.", true);
        await this.wire.close();
    }

    /** `take` sends the question or queues it. */
    #ask(
        command: string,
        isTyped: boolean,
        take: (question: Question) => unknown = (question) => this.#waiting.push(question),
    ): Promise<string[]> {
        return new Promise((done, failed) => {
            if (this.#ended) failed(new NoMachine(english("noneConnected")));
            else take({ command, isTyped, since: this.#now, typedAt: this.#turnedAt, answer: [], done, failed });
        });
    }

    #send(question: Question): void {
        this.#asked.push(question);
        if (question.isTyped) this.onHappening({ is: "command", line: question.command });
        this.wire.send(`${question.command}\n`);
    }

    /** Asks for version, settings and examples. Tries again if an answer is lost, to a busy computer or noise on the wire. */
    async #begin(): Promise<void> {
        this.#isReady = false;
        this.#pollAt = Number.POSITIVE_INFINITY;
        const beginning = this.#beginnings;
        for (let tries = 0; ; tries++)
            try {
                await this.#introduce();
                return;
            } catch (error) {
                if (this.#ended || beginning !== this.#beginnings) return;
                if (tries === TRIES) {
                    this.end(reason(error));
                    return;
                }
            }
    }

    /** Asks the machine for all that the page shows. */
    async #introduce(): Promise<void> {
        const version = await this.#version();
        const { settings } = await this.#settings();
        const examples = await this.#ask("examples", false);
        await this.#ask("events on", false);
        this.#isReady = true;
        this.#strange = "";
        this.onHappening({ is: "connected", version, settings, examples });
        this.#pollAt = this.#now;
        await this.#ask("status", false);
        const help = new Map<string, string>();
        for (const { name } of settings)
            for (const said of linesOf("help", await this.#ask(`help ${name}`, false))) help.set(said.name, said.help);
        this.onHappening({ is: "help", help });
    }

    async #version(): Promise<string> {
        // Ends an earlier half line. Its answer belongs to no question.
        this.wire.send("\n");
        const [said] = linesOf("version", await this.#ask("version", false));
        if (!said) throw new NoMachine(this.#whyNoAnswer());
        return said.version;
    }

    async #settings(): Promise<{ settings: Setting[]; lines: string[] }> {
        const lines = await this.#ask("get", false);
        const settings = linesOf("setting", lines);
        if (settings.length === 0) throw new NoMachine(english("noSettings"));
        return { settings, lines };
    }

    /** An answer is missing: a connected machine is asked for everything again. */
    #giveUp(question: Question): void {
        if (this.#isReady) {
            const { command } = question;
            const error = new NoMachine(english("unanswered", { command, seconds: PATIENCE_MS / 1000 }));
            this.#beginAgain(error, error.message);
        } else {
            const error = new NoMachine(this.#whyNoAnswer());
            this.#asked.shift();
            this.#failSent(question, error);
        }
    }

    /** Fails a sent question. The machine may have obeyed an operator's command, or may do so later. */
    #failSent({ failed, isTyped }: Question, error: Error): void {
        failed(isTyped ? new NoMachine(english("mayBeDone", { why: error.message })) : error);
    }

    /** Fails all questions. */
    #failAll(sent: readonly Question[], waiting: readonly Question[], error: Error): void {
        for (const question of sent) this.#failSent(question, error);
        for (const { failed } of waiting) failed(error);
    }

    /** Why no valid answer came, and what to do. */
    #whyNoAnswer(): string {
        const strange = [...this.#strange];
        const unreadable = strange.filter((character) => character === "\u{fffd}").length;
        if (strange.length === 0) return english("nothingAnswers");
        if (unreadable * 4 > strange.length) return english("noText");
        return english("otherDevice", { text: this.#strange.trim().slice(0, 60) });
    }

    #take(line: string): void {
        if (this.#ended) return;
        const said = read(line);
        if (said.is === "greeting") {
            // Pending commands will not be answered.
            this.#beginAgain(new NoMachine(english("resetWhileAsked")), english("wasReset"));
            this.onHappening({ is: "started", line });
            return;
        }
        if (isEvent(said)) {
            this.onHappening({ is: "event", event: said, line });
            if (said.is === "calibratedBySwitch" && said.isSet) this.#follow("calibrate").catch(() => {});
            return;
        }
        const [question] = this.#asked;
        if (!question || !this.#isReady) this.#strange = `${this.#strange} ${line}`.slice(-200);
        if (!question) return;
        if (question.isTyped) this.onHappening({ is: "answer", line });
        if (said.is !== "end") {
            question.answer.push(line);
            if (said.is === "status") this.onHappening({ is: "status", status: said, line });
            return;
        }
        this.#asked.shift();
        if (said.error !== undefined) question.failed(new Refused(said.error));
        else {
            question.done(question.answer);
            if (question.isTyped) this.#follow(question.command).catch(() => {});
        }
    }

    /** Drops all questions, and asks for version, settings and examples. */
    #beginAgain(error: Error, why: string): void {
        const [sent, waiting] = [this.#asked.splice(0), this.#waiting.splice(0)];
        this.#beginnings++;
        if (this.#isReady) this.onHappening({ is: "lost", why, forGood: false, isWanted: false });
        this.#isReady = false;
        this.#failAll(sent, waiting, error);
        this.#greetingBy = this.#now;
    }

    /** Asks for what a command has changed. */
    async #follow(command: string): Promise<void> {
        if (/^\s*(set|defaults|revert|calibrate|save)\b/.test(command))
            this.onHappening({ is: "settings", ...(await this.#settings()) });
        if (/^\s*(label|teach|forget)\b/.test(command))
            this.onHappening({ is: "examples", examples: await this.#ask("examples", false) });
        // The page needs the events.
        if (/^\s*events\b/.test(command)) await this.#ask("events on", false);
    }

    /** Ends with the wire: it is lost, or the operator wants to close it. */
    end(why: string, isWanted = false): void {
        if (this.#ended) return;
        this.#ended = true;
        this.#isReady = false;
        this.#failAll(this.#asked.splice(0), this.#waiting.splice(0), new NoMachine(why));
        this.onHappening({ is: "lost", why, forGood: true, isWanted });
        void this.wire.close();
    }
}
