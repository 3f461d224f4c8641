// The firmware's console on avr8js: every kind of answer, and its events.

import assert from "node:assert/strict";
import test from "node:test";
import { poweredUp, wokenUp } from "./operator.ts";

test("the firmware names itself, why it started and what is missing", () => {
    const { greeting } = poweredUp();
    assert.match(greeting, /^weeder \d+\.\d+\.\d+( \([0-9a-f]+\+?\))?, .*power_on.*settings_lost.*help.*\r\n/);
});

test("every kind of command is answered by its lines and one ok", () => {
    const operator = wokenUp();
    for (const [command, least] of [
        ["help", 15],
        ["help wheel_mm", 2],
        ["version", 1],
        ["status", 2],
        ["get", 15],
        ["get wheel_mm", 1],
        ["set wheel_mm 405", 0],
        ["examples", 10],
        ["dump", 1],
        ["events on", 0],
        ["start", 0],
        ["hold", 0],
        ["servo out", 0],
        ["save", 0],
        ["clear", 0],
    ] as const) {
        const answer = operator.ask(command);
        assert(answer.length >= least, `${command}: ${answer.length} lines, not ${least}`);
        operator.run(20);
    }
});

test("an answer that fills the line for a tenth of a second comes whole, again and again", () => {
    const operator = wokenUp();
    const first = operator.ask("help");
    for (let time = 0; time < 3; time++) assert.deepEqual(operator.ask("help"), first);
});

test("a bad line is answered by one error that says what would be right", () => {
    const operator = wokenUp();
    for (const [line, remedy] of [
        ["hepl", "help"],
        ["set wheel_mm 4oo", "from 200 to 800"],
        ["set wheel 400", "get"],
        ["status please", "the command is status"],
        ["höld", "letters, digits and blanks"],
        ["x".repeat(81), "80"],
    ] as const) {
        const answer = operator.exchange(line);
        assert.equal(answer.length, 1, `${line}: ${answer}`);
        assert(answer[0]?.startsWith("error: ") && answer[0].includes(remedy), `${line}: ${answer}`);
    }
});

test("lines that are typed without waiting are all answered, in order", () => {
    const operator = wokenUp();
    operator.uno.send("version\nget k\nhepl\nget margin_mm\n");
    operator.run(100);
    const lines = operator.take().trimEnd().split("\r\n");
    assert.deepEqual(
        lines.map((line) => line.split(/[ =:]/)[0]),
        ["weeder", "ok", "k", "ok", "error", "margin_mm", "ok"],
    );
});

test("a plot comes twenty times a second until it is turned off", () => {
    const operator = wokenUp();
    operator.ask("plot on");
    operator.run(1000);
    const lines = operator.take().trimEnd().split("\r\n");
    assert(lines.length >= 18 && lines.length <= 22, `${lines.length} lines`);
    for (const line of lines) assert.match(line, /^\w+:-?\d+(,\w+:-?\d+)+$/);
    operator.ask("plot off");
    operator.run(200);
    assert.equal(operator.take(), "");
});

test("the work switch puts it to work and takes it off, and events say so", () => {
    const operator = wokenUp();
    operator.ask("events on");
    operator.uno.set(4, false);
    assert.match(operator.waitFor(/\n/), /^state is=work\r/);
    operator.uno.set(4, true);
    assert.match(operator.waitFor(/\n/), /^state is=hold\r/);
});
