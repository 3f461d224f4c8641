// A machine that `weeder serve` has, as the page talks to it: requests that are answered when a test says so.

import assert from "node:assert/strict";
import test, { beforeEach } from "node:test";
import { Served, ServedMachine } from "../src/link/served.ts";
import { type Happening, NoMachine, NotSent, Refused } from "../src/link/session.ts";
import { Machine } from "../src/panel/machine.ts";
import { english } from "../src/words/words.ts";

/** A command on its way. */
interface Sent {
    readonly line: string;
    readonly seen: string | undefined;
    answer(text: string): void;
    /** Its answer is lost. */
    lose(): void;
}

const THERE = {
    is: "there",
    version: "0.2.0",
    settings: ["k=3 from 1 to 15, default 3, not saved"],
    examples: ["field 0 plant 1 2 3 4 5"],
    help: { k: "nearest examples that vote" },
    status: "state=hold tool=out pos=7 speed_mm_s=0 windows=0 unseen_mm=400",
} as const;

let sent: Sent[] = [];
let happened: Happening[] = [];
let seen = "";
let machine = new ServedMachine(0, "");

beforeEach(() => {
    [sent, happened, machine] = [[], [], new ServedMachine(1, "right", () => seen)];
    machine.tell(THERE);
    machine.onHappening = (happening) => happened.push(happening);
    globalThis.fetch = (path, request) => {
        assert.equal(path, "/machines/1/command");
        return new Promise((done, failed) => {
            const { body, signal, headers } = request as {
                body: string;
                signal: AbortSignal;
                headers?: Record<string, string>;
            };
            signal.addEventListener("abort", () => failed(signal.reason));
            sent.push({
                line: body,
                seen: headers?.["Weeder-Seen"],
                answer: (text) => done(new Response(text)),
                lose: () => failed(new TypeError("Failed to fetch")),
            });
        });
    };
});

/** Lets go on what waits for an answer. */
const goOn = () => new Promise((done) => setImmediate(done));
const lines = () => sent.map(({ line }) => line);

test("a command is a request, and its answer is told behind it", async () => {
    const [status, start] = [machine.ask("status"), machine.ask("start")];
    await goOn();
    assert.deepEqual(lines(), ["status"]);
    sent[0]?.answer("state=hold\nlost=0\nok\n");
    assert.deepEqual(await status, ["state=hold", "lost=0"]);
    await goOn();
    sent[1]?.answer("error: an alarm is latched\n");
    await assert.rejects(start, new Refused("an alarm is latched"));
    const told = happened.map((happening) => ("line" in happening ? `${happening.is} ${happening.line}` : ""));
    assert.deepEqual(told, [
        "command status",
        "answer state=hold",
        "answer lost=0",
        "answer ok",
        "command start",
        "answer error: an alarm is latched",
    ]);
});

test("HOLD is sent at once, and what was typed before it and is not sent yet is dropped", async () => {
    const [dump, start] = [machine.ask("dump"), machine.ask("start")];
    await goOn();
    const held = machine.hold();
    const status = machine.ask("status");
    assert.deepEqual(lines(), ["dump", "hold"]);
    sent[1]?.answer("ok\n");
    await held;
    sent[0]?.answer("ok\n");
    await dump;
    await assert.rejects(start, new NotSent("hold came first, so this was not sent"));
    await goOn();
    assert.deepEqual(lines(), ["dump", "hold", "status"]);
    sent[2]?.answer("ok\n");
    await status;
});

test("a command says what its sender had seen when it was given, and HOLD needs to have seen nothing", async () => {
    seen = "7";
    const [status, start] = [machine.ask("status"), machine.ask("start")];
    await goOn();
    seen = "8";
    const held = machine.hold();
    await goOn();
    sent[1]?.answer("ok\n");
    sent[0]?.answer("ok\n");
    await Promise.all([status, held, assert.rejects(start, NotSent)]);
    machine.ask("clear");
    await goOn();
    const told = sent.map(({ line, seen }) => [line, seen]);
    assert.deepEqual(told, [
        ["status", "7"],
        ["hold", undefined],
        ["clear", "8"],
    ]);
    seen = "";
});

test("a lost answer is an error, and neither that of HOLD nor another ends the page's machine", async () => {
    for (const type of [() => machine.ask("clear"), () => machine.hold()]) {
        const answer = type();
        await goOn();
        sent.pop()?.lose();
        await assert.rejects(answer, (error) => error instanceof NoMachine && /does not answer/.test(error.message));
    }
    assert(!happened.some(({ is }) => is === "lost"));
    machine.tell({ is: "event", said: "state is=work" });
    const event = { is: "state", isEvent: true, mode: "work" };
    assert.deepEqual(happened.at(-1), { is: "event", event, line: "state is=work" });
    const answer = machine.ask("start");
    await goOn();
    sent.pop()?.answer("ok\n");
    assert.deepEqual(await answer, []);
});

test("what is no answer, as where another weeder serve asks for its code, is told as it is", async () => {
    const answer = machine.ask("start");
    await goOn();
    sent.pop()?.answer("this phone is not paired\n");
    await assert.rejects(answer, new NoMachine("this phone is not paired"));
});

test("a machine that is lost answers no command, and says why", async () => {
    const [dump, start] = [machine.ask("dump"), machine.ask("start")];
    await goOn();
    machine.tell({ is: "lost", why: "the port is gone" });
    assert.deepEqual(happened.at(-1), { is: "lost", why: "the port is gone", forGood: true, isWanted: false });
    // A waiting command is not sent when the machine is back.
    await Promise.all([
        assert.rejects(
            dump,
            (error) =>
                error instanceof NoMachine && /the port is gone\. The machine may have done this/.test(error.message),
        ),
        assert.rejects(start, new NoMachine("the machine is not there")),
    ]);
    await assert.rejects(machine.ask("status"), new NoMachine("the machine is not there"));
    const held = machine.hold();
    sent[1]?.answer("error: the port is gone\n");
    await assert.rejects(held, new Refused("the port is gone"));
    happened = [];
    machine.onAbsent = (why) => happened.push({ is: "command", line: why });
    machine.tell({ is: "lost", why: "there is no port" });
    assert.deepEqual(happened.at(-1), { is: "command", line: "there is no port" });
    machine.tell(THERE);
    machine.ask("clear");
    await goOn();
    assert.deepEqual(lines(), ["dump", "hold", "clear"]);
});

test("a machine that is there has told all at once, and tells what others change", () => {
    machine.tell(THERE);
    const [connected, status] = happened;
    assert(connected?.is === "connected" && connected.version === "0.2.0");
    assert.deepEqual([connected.settings[0]?.value, connected.examples], [3, THERE.examples]);
    assert.equal(connected.help.get("k"), THERE.help.k);
    assert(status?.is === "status" && status.status.mode === "hold");
    machine.tell({ is: "settings", said: ["k=5 from 1 to 15, default 3, not saved"] });
    machine.tell({ is: "examples", said: [] });
    const [settings, examples] = happened.slice(-2);
    assert(settings?.is === "settings" && settings.settings[0]?.value === 5);
    assert.deepEqual(examples, { is: "examples", examples: [] });
});

test("a machine that is lost at work weeds on, also when its absence is told again, until it is there", () => {
    const shown = new Machine();
    machine.onHappening = (happening) => shown.take(happening, 0);
    machine.onAbsent = (why) => {
        shown.lost = why;
    };
    for (const [mode, weedsOn] of [
        ["hold", false],
        ["work", true],
    ] as const) {
        machine.tell(THERE);
        machine.tell({ is: "event", said: `state is=${mode}` });
        for (const why of ["the port is gone", "the computer does not answer", "the port is gone"]) {
            machine.tell({ is: "lost", why });
            assert(shown.why.toLowerCase().startsWith(why), shown.why);
            assert.equal(shown.why.includes("weeds on"), weedsOn, `${mode}: ${shown.why}`);
        }
    }
    machine.tell(THERE);
    shown.lost = "the machine does not answer";
    shown.version = undefined;
    assert(!shown.why.includes("weeds on"), shown.why);
});

test("a page that comes later shows a warning too, until it ends", () => {
    const shown = new Machine();
    machine.onHappening = (happening) => shown.take(happening, 0);
    machine.tell({ ...THERE, warning: "no_plants" });
    assert.equal(shown.warning, "no_plants");
    machine.tell({ is: "warning", said: "late_command" });
    assert.equal(shown.warning, "late_command");
    machine.tell({ is: "warning", said: null });
    assert.equal(shown.warning, undefined);
    machine.tell({ ...THERE, warning: null });
    assert.equal(shown.warning, undefined);
});

test("after a new start of weeder serve the page loads itself again, unless that would drop a log", async (test) => {
    let [status, reloads] = [200, 0];
    const told: { error?: () => void; due?: () => void } = {};
    const { setTimeout } = globalThis;
    test.after(() => Object.assign(globalThis, { setTimeout }));
    globalThis.fetch = async () => new Response('{"machines":["row"]}', { status });
    Object.assign(globalThis, {
        setTimeout: (then: () => void) => {
            told.due = then;
        },
        location: { reload: () => reloads++ },
        EventSource: class {
            addEventListener(name: "error", listener: () => void) {
                told[name] = listener;
            }
            close() {}
        },
    });
    for (const [mayReload, expected] of [
        [false, { reloads: 0, why: english("servedOther") }],
        [true, { reloads: 1, why: english("servedSilent") }],
    ] as const) {
        status = 200;
        const served = await Served.open();
        served.mayReload = () => mayReload;
        let why = "";
        for (const machine of served.machines)
            machine.onAbsent = (absent) => {
                why = absent;
            };
        served.listen();
        status = 401;
        told.error?.();
        told.due?.();
        for (let turn = 0; turn < 5; turn++) await goOn();
        assert.deepEqual({ reloads, why }, expected);
        // Another machine may have its number now.
        if (!mayReload) await assert.rejects(served.machines[0]?.hold() ?? Promise.resolve(), NoMachine);
    }
});
