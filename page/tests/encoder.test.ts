// The encoder at its full rate on avr8js, beside a status that streams and a beam that flickers.

import assert from "node:assert/strict";
import test from "node:test";
import { CYCLES_PER_SECOND } from "../src/uno/uno.ts";
import { chance } from "./chance.ts";
import { wokenUp } from "./operator.ts";

/** Half a second or more, so that the watchdog would reset a starved loop. */
const COUNTS = 100_000;
/** Time between two changes of the beam, whose sensor takes 1 ms. */
const FLICKER_CYCLES = CYCLES_PER_SECOND / 1000;

/** Pending questions at any time, so that the line stays busy while one of them is being read. */
const QUESTIONS_AHEAD = 2;

/** Turns the encoder past COUNTS counts. Each is early or late by up to a share of the time between two. */
function assertNoCountIsLost(countsPerS: number, forward: boolean, jitter: number): void {
    const operator = wokenUp();
    const { uno } = operator;
    const [first, second] = forward ? [2, 3] : [3, 2];
    const random = chance(7);
    const stepCycles = CYCLES_PER_SECOND / countsPerS;
    const begin = uno.cycle;
    let [flicker, broken, heard, unanswered] = [begin, false, "", 0];
    for (let count = 0; count < COUNTS; count++) {
        const due = begin + (count + 1 + (2 * random() - 1) * jitter) * stepCycles;
        for (; flicker < due; flicker += FLICKER_CYCLES) {
            uno.runUntil(flicker);
            broken = !broken;
            uno.set(8, !broken);
        }
        for (; unanswered < QUESTIONS_AHEAD; unanswered++) uno.send("status\n");
        uno.runUntil(due);
        uno.set(count % 2 === 0 ? first : second, count % 4 < 2);
        // A character takes longer than the steps, so at most one has come.
        const said = operator.take();
        heard += said;
        if (said && heard.endsWith("\nok\r")) unanswered -= 1;
    }
    const seconds = (uno.cycle - begin) / CYCLES_PER_SECOND;
    // A tenth of the line, as the tests on the other simulator ask for.
    assert(heard.length > 1152 * seconds, `the console streamed ${heard.length} characters in ${seconds} s`);
    uno.set(8, true);
    operator.run(500);
    const { pos, lost } = operator.status();
    assert.deepEqual([Number(pos), lost, uno.resets], [forward ? COUNTS : -COUNTS, "0", []]);
}

test("no count is lost at the full rate beside telemetry and a flickering beam", () => {
    for (const forward of [true, false]) assertNoCountIsLost(200_000, forward, 0);
});

test("no count is lost at three quarters of it when edges come early and late", () => {
    for (const forward of [true, false]) assertNoCountIsLost(150_000, forward, 0.3);
});
