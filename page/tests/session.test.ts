// A session with the real firmware, without a page: the operator's actions at any moment.

import assert from "node:assert/strict";
import test from "node:test";
import { Log } from "../src/link/log.ts";
import { type Happening, isHold, Refused, Session, type Wire } from "../src/link/session.ts";
import { CYCLES_PER_SECOND } from "../src/uno/uno.ts";
import { wokenUp } from "./operator.ts";

/** Time between two turns of the session. */
const TURN_MS = 10;
/** Turns in which a session has asked all its questions. */
const TURNS = 300;

/** A session with a firmware at work, which turns as often as a page's. */
class Connected {
    readonly happened: Happening[] = [];
    readonly session: Session;
    /** Time in which the page slept, and the machine's answers lay unread. */
    sleptMs = 0;
    readonly #operator = wokenUp();
    /** Number of events before its reset. */
    #resetAt = Number.POSITIVE_INFINITY;

    /** `lost` says which of the lines, counted from 0, noise on the wire takes. */
    constructor(lost: (line: number) => boolean = () => false) {
        const { uno } = this.#operator;
        this.#operator.ask("start now");
        let lines = 0;
        const wire: Wire = {
            send: (text) => {
                if (text.trim() === "") {
                    uno.send(text);
                    return;
                }
                if (!lost(lines++)) uno.send(text);
            },
            close: async () => {},
        };
        this.session = new Session(wire, this.nowMs, false);
        uno.onByte = (byte) => this.session.receive(String.fromCharCode(byte));
        this.session.onHappening = (happening) => this.happened.push(happening);
    }

    get nowMs(): number {
        return (this.#operator.uno.cycle / CYCLES_PER_SECOND) * 1000 + this.sleptMs;
    }

    async turn(): Promise<void> {
        this.#operator.run(TURN_MS);
        this.session.turn(this.nowMs);
        // Lets the code that waits for an answer continue.
        await new Promise((done) => setImmediate(done));
    }

    has(is: Happening["is"]): boolean {
        return this.happened.some((happening) => happening.is === is);
    }

    sag(): void {
        this.#resetAt = this.happened.length;
        this.#operator.uno.reset("brown-out");
    }

    hasAfterReset(is: Happening["is"]): boolean {
        return this.happened.slice(this.#resetAt).some((happening) => happening.is === is);
    }

    /** The machine's last reported state. */
    get mode(): string | undefined {
        return this.happened.flatMap((happening) => (happening.is === "status" ? [happening.status.mode] : [])).at(-1);
    }
}

test("HOLD at any moment of a session holds the machine, and the session goes on", async () => {
    // Ten a second, and single ones at moments all over a session's first questions.
    const moments = [
        (turn: number) => turn % 10 === 0,
        ...[1, 3, 8, 21, 55].map((at) => (turn: number) => turn === at),
    ];
    for (const [index, isMoment] of moments.entries()) {
        const machine = new Connected();
        for (let turn = 0; turn < TURNS && !(machine.has("help") && machine.mode === "hold"); turn++) {
            await machine.turn();
            if (isMoment(turn)) machine.session.hold().catch(() => {});
        }
        for (const is of ["connected", "help"] as const) assert(machine.has(is), `${is} is missing at moment ${index}`);
        assert(!machine.has("lost"), `the session is lost at moment ${index}`);
        assert.equal(machine.mode, "hold");
    }
});

test("a page that sleeps at any moment of a session loses no machine that answers", async () => {
    for (const sleptMs of [3_000, 60_000, 3_600_000])
        for (const every of [20, 33, 50]) {
            const machine = new Connected();
            for (let turn = 0; turn < TURNS && !machine.has("help"); turn++) {
                await machine.turn();
                if (turn % every === 0) machine.sleptMs += sleptMs;
            }
            assert(machine.has("help") && !machine.has("lost"), `${sleptMs} ms at every ${every}. turn`);
        }
});

test("a supply that sags at any moment of a session, in the midst of a line too, loses no machine", async () => {
    // The status, which comes ten times a second, takes a good part of that time.
    for (const at of [40, 97, 101, 103, 106, 108, 202, 204, 207, 209]) {
        const machine = new Connected();
        for (let turn = 0; turn < 2 * TURNS && !machine.hasAfterReset("connected"); turn++) {
            await machine.turn();
            if (turn === at) machine.sag();
        }
        assert(machine.hasAfterReset("connected"), `a machine whose supply sags in turn ${at} is connected again`);
    }
});

test("a question that noise takes, whichever it is, loses no machine for good", async () => {
    // A session's first questions, and the help and the status after them.
    for (const taken of [0, 1, 2, 3, 40]) {
        const machine = new Connected((line) => line === taken);
        for (let turn = 0; turn < 2 * TURNS; turn++) await machine.turn();
        const connected = machine.happened.findLastIndex(({ is }) => is === "connected");
        const lost = machine.happened.findLastIndex(({ is }) => is === "lost");
        assert(connected > lost, `connected at the end, question ${taken}`);
        assert(
            machine.happened.every((happening) => happening.is !== "lost" || !happening.forGood),
            `question ${taken} ends the session`,
        );
    }
});

test("what was typed and waits is not sent behind a HOLD, and says so", async () => {
    const machine = new Connected();
    for (let turn = 0; turn < TURNS; turn++) await machine.turn();
    assert.equal(machine.mode, "work");
    const examples = machine.session.ask("examples");
    const start = machine.session.ask("start");
    machine.session.hold().catch(() => {});
    for (const dropped of [examples, start]) await assert.rejects(dropped, Refused);
    for (let turn = 0; turn < 50; turn++) await machine.turn();
    assert.equal(machine.mode, "hold");
});

test("a command that waited while the computer slept is not sent", async () => {
    const connected = new Connected();
    for (let turns = 0; turns < TURNS; turns++) await connected.turn();
    const refused = assert.rejects(connected.session.ask("start now"), Refused);
    connected.sleptMs += 4000;
    for (let turns = 0; turns < 10; turns++) await connected.turn();
    await refused;
    assert(!connected.happened.some((happening) => happening.is === "command" && happening.line === "start now"));
});

test("HOLD is understood however it is typed", () => {
    for (const line of ["hold", "HOLD", " Hold ", "hold.", "hold!!"]) assert(isHold(line), line);
    for (const line of ["", "holder", "hold 5", "start"]) assert(!isHold(line), line);
});

test("what a command has changed is asked for behind it", async () => {
    const machine = new Connected();
    for (let turn = 0; turn < TURNS; turn++) await machine.turn();
    const changed = (is: Happening["is"]) => machine.happened.filter((happening) => happening.is === is);
    assert.deepEqual([changed("settings"), changed("examples")], [[], []]);
    const answers = ["hold", "set k 5", "forget all"].map((command) => machine.session.ask(command));
    for (let turn = 0; turn < TURNS; turn++) await machine.turn();
    await Promise.all(answers);
    const [[settings], [examples]] = [changed("settings"), changed("examples")];
    assert(settings?.is === "settings" && settings.settings.some(({ name, value }) => name === "k" && value === 5));
    const log = new Log();
    log.add(settings, 0);
    assert.match(log.text(), /^0,answer,"k=5 from /m, "the log has the changed settings");
    assert(examples?.is === "examples" && examples.examples.length > 0);
});
