// A session with a machine at the other end of a wire: types commands one at a time, knows whose answer comes, asks for
// the status in between, and tells what happened.
//
// It has no clock of its own: `turn` is called over and over with the wire's time, which for the page's own Uno is the
// chip's. After every start of the Uno it asks who is there, for settings and examples, and turns the events on. `hold` does
// not wait. A wire that ended ends its session.

import type { EventLine, Setting, Status } from "./console_line.ts";
import { isEvent, read, settingsOf } from "./grammar.ts";
import { LineReader } from "./lines.ts";

/** Types a command, and gives back its answer without the `ok`. Throws what the machine refuses by. */
export type Ask = (command: string) => Promise<string[]>;

/** A serial line to a machine. */
export interface Wire {
    /** Hears what comes. */
    onText: (text: string) => void;
    /** The line is gone, and why; never called after `close`. */
    onEnd: (why: string) => void;
    send(text: string): void;
    close(): Promise<void>;
}

/** Time between two questions for the status. */
const POLL_MS = 100;
/** Time after which an answer is given up: the longest, all examples, takes less than a second. */
const PATIENCE_MS = 2000;
/** The longest that counts between two turns. A page that was busy, or asleep, has not waited: the answer may lie there unread. */
const LONGEST_TURN_MS = 200;
/** Time in which the greeting comes after a reset, behind a bootloader: the old ones wait for two seconds. */
const BOOT_MS = 3000;
/** How often a machine whose answers do not come, or come garbled, is asked again from the beginning. */
const TRIES = 2;

/** Something that happened. */
export type Happening =
    /** The firmware has started, and says why. */
    | { is: "started"; line: string }
    /** The machine is there, and has shown its settings and examples. */
    | { is: "connected"; version: string; settings: readonly Setting[]; examples: readonly string[] }
    /** The machine is gone: for good, by the operator's wish or not, or until it has restarted. */
    | { is: "lost"; why: string; forGood: boolean; isWanted: boolean }
    | { is: "status"; status: Status; line: string }
    /** The machine told something by itself. */
    | { is: "event"; event: EventLine; line: string }
    | { is: "command"; line: string }
    | { is: "answer"; line: string }
    | { is: "settings"; settings: readonly Setting[] }
    | { is: "examples"; examples: readonly string[] }
    /** What the settings are, by their names. */
    | { is: "help"; help: Map<string, string> };

/** The machine refused a command: what was wrong, and what would be right. */
export class Refused extends Error {}

/** There is no machine that answers, and what to do. */
export class NoMachine extends Error {}

/** A machine to talk to: by a session here, or by the session of another computer (served.ts). */
export interface Link {
    onHappening: (happening: Happening) => void;
    /** Types a command for the operator when those before it are answered, and gives back its answer without the `ok`. */
    ask: Ask;
    /** Has the machine hold, before what the operator typed and is not sent yet: that is dropped. Done when it has obeyed. */
    hold(): Promise<void>;
    /** Goes on, at a time, if it has a clock. */
    turn?(now: number): void;
    /** Lets go of the machine, if it holds it. */
    close?(): Promise<void>;
}

interface Question {
    readonly command: string;
    /** Whether the operator asked it. */
    readonly isTyped: boolean;
    readonly since: number;
    readonly answer: string[];
    readonly done: (answer: string[]) => void;
    readonly failed: (error: Error) => void;
}

export class Session implements Link {
    onHappening: (happening: Happening) => void = () => {};
    /** Whether the machine is there and has said what it is. */
    #isReady = false;
    readonly #wire: Wire;
    readonly #lines = new LineReader();
    /** What was typed and is not answered yet, in the order of the answers. */
    #asked: Question[] = [];
    #waiting: Question[] = [];
    /** Time that was spent waiting, by the wire's clock. */
    #now: number;
    /** The wire's time at the last turn. */
    #turnedAt: number;
    #pollAt = Number.POSITIVE_INFINITY;
    #ended = false;
    /** Until when a greeting is waited for. */
    #greetingBy: number;
    /** How often what was asked has been dropped to ask again from the beginning. */
    #beginnings = 0;
    /** Something that has come and is no weeder's. */
    #strange = "";

    /** `resets` says whether opening the wire resets the Uno. */
    constructor(wire: Wire, now: number, resets: boolean) {
        this.#wire = wire;
        [this.#now, this.#turnedAt] = [now, now];
        this.#greetingBy = resets ? now + BOOT_MS : now;
        wire.onText = (text) => this.#hear(text);
        wire.onEnd = (why) => this.#end(why);
    }

    ask(command: string): Promise<string[]> {
        return this.#ask(command, true);
    }

    /** What the page asks itself is not dropped. */
    async hold(): Promise<void> {
        const dropped = this.#waiting.filter(({ isTyped }) => isTyped);
        this.#waiting = this.#waiting.filter(({ isTyped }) => !isTyped);
        for (const { failed } of dropped) failed(new Refused("hold came first, so this was not sent"));
        await this.#ask("hold", true, (question) => this.#send(question));
    }

    turn(now: number): void {
        this.#now += Math.min(now - this.#turnedAt, LONGEST_TURN_MS);
        this.#turnedAt = now;
        if (this.#ended) return;
        if (this.#now >= this.#greetingBy) {
            this.#greetingBy = Number.POSITIVE_INFINITY;
            void this.#begin();
        }
        const [oldest] = this.#asked;
        if (oldest && this.#now - oldest.since > PATIENCE_MS) this.#giveUp(oldest);
        if (this.#asked.length > 0) return;
        if (this.#waiting.length === 0 && this.#now >= this.#pollAt) {
            this.#pollAt = this.#now + POLL_MS;
            void this.#ask("status", false).catch(() => {});
        }
        const next = this.#waiting.shift();
        if (next) this.#send({ ...next, since: this.#now });
    }

    async close(): Promise<void> {
        this.#end("No machine is connected.", true);
        await this.#wire.close();
    }

    /** `take` sends the question, or has it wait. */
    #ask(
        command: string,
        isTyped: boolean,
        take: (question: Question) => unknown = (question) => this.#waiting.push(question),
    ): Promise<string[]> {
        return new Promise((done, failed) => {
            if (this.#ended) failed(new NoMachine("no machine is connected"));
            else take({ command, isTyped, since: this.#now, answer: [], done, failed });
        });
    }

    #send(question: Question): void {
        this.#asked.push(question);
        if (question.isTyped) this.onHappening({ is: "command", line: question.command });
        this.#wire.send(`${question.command}\n`);
    }

    /** Asks who is there, again where an answer is lost: a computer that is busy, or noise on the wire, takes one now and then. */
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
                    this.#end(error instanceof Error ? error.message : String(error));
                    return;
                }
            }
    }

    /** Asks the machine for all that the page shows. */
    async #introduce(): Promise<void> {
        const version = await this.#version();
        const settings = await this.#settings();
        const examples = await this.#ask("examples", false);
        await this.#ask("events on", false);
        this.#isReady = true;
        this.#strange = "";
        this.onHappening({ is: "connected", version, settings, examples });
        this.#pollAt = this.#now;
        await this.#ask("status", false);
        const help = new Map<string, string>();
        for (const { name } of settings)
            for (const line of await this.#ask(`help ${name}`, false)) {
                const said = read(line);
                if (said.is === "help") help.set(said.name, said.help);
            }
        this.onHappening({ is: "help", help });
    }

    async #version(): Promise<string> {
        // What was typed before ends here, and its answer belongs to no question.
        this.#wire.send("\n");
        for (const line of await this.#ask("version", false)) {
            const said = read(line);
            if (said.is === "version") return said.version;
        }
        throw new NoMachine(this.#whoIsThere());
    }

    async #settings(): Promise<Setting[]> {
        const settings = settingsOf(await this.#ask("get", false));
        if (settings.length === 0)
            throw new NoMachine("the firmware shows no settings: flash this page's, and try again");
        return settings;
    }

    /** An answer does not come: a machine that was there is asked for all again. */
    #giveUp(question: Question): void {
        const error = new NoMachine(this.#whoIsThere());
        if (this.#isReady) this.#beginAgain(error, error.message);
        else {
            this.#asked.shift();
            question.failed(error);
        }
    }

    /** Why no good answer came, and what to do. */
    #whoIsThere(): string {
        const strange = [...this.#strange];
        const unreadable = strange.filter((character) => character === "\u{fffd}").length;
        if (strange.length === 0)
            return "nothing answers at this port: choose another, or press the Uno's reset; a new board is to be flashed first";
        if (unreadable * 4 > strange.length)
            return "what comes from this port is no text: choose another; on an Uno see that D0 and D1 are free, and flash it again";
        return `it is not the weeder's firmware that answers, but \u201c${this.#strange.trim().slice(0, 60)}\u201d: choose another port, or flash this one`;
    }

    #hear(text: string): void {
        for (const line of this.#lines.take(text)) this.#take(line);
    }

    #take(line: string): void {
        if (this.#ended) return;
        const said = read(line);
        if (said.is === "greeting") {
            this.#restart(line);
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

    /** The Uno has started: nothing that was typed will be answered. */
    #restart(greeting: string): void {
        this.#beginAgain(new NoMachine("the Uno was reset while it was asked"), "the Uno was reset");
        this.onHappening({ is: "started", line: greeting });
    }

    /** Drops what was asked, and asks who is there. */
    #beginAgain(error: Error, why: string): void {
        const dropped = [...this.#asked.splice(0), ...this.#waiting.splice(0)];
        this.#beginnings++;
        if (this.#isReady) this.onHappening({ is: "lost", why, forGood: false, isWanted: false });
        this.#isReady = false;
        for (const { failed } of dropped) failed(error);
        this.#greetingBy = this.#now;
    }

    /** Asks for what a command has changed. */
    async #follow(command: string): Promise<void> {
        if (/^\s*(set|defaults|revert|calibrate|save)\b/.test(command))
            this.onHappening({ is: "settings", settings: await this.#settings() });
        if (/^\s*(label|teach|forget)\b/.test(command))
            this.onHappening({ is: "examples", examples: await this.#ask("examples", false) });
        // The page lives on them.
        if (/^\s*events\b/.test(command)) await this.#ask("events on", false);
    }

    #end(why: string, isWanted = false): void {
        if (this.#ended) return;
        this.#ended = true;
        this.#isReady = false;
        const error = new NoMachine(why);
        for (const { failed } of [...this.#asked.splice(0), ...this.#waiting.splice(0)]) failed(error);
        this.onHappening({ is: "lost", why, forGood: true, isWanted });
        void this.#wire.close();
    }
}
