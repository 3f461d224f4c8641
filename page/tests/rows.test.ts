// Rows at the paper's speeds on avr8js: every plant has its own swing, and the tool is never over a canopy.

import assert from "node:assert/strict";
import test from "node:test";
import { Machine, span } from "../src/row/machine.ts";
import { CYCLES_PER_SECOND } from "../src/uno/uno.ts";
import { type Operator, wokenUp } from "./operator.ts";

const PLANTS = 8;
const FIRST_MM = 900;
const SECOND_BEAM_PIN = 10;
/** Cycles between two checks of the tool. */
const LOOK_CYCLES = CYCLES_PER_SECOND / 1000;

/** The result of a row. */
interface Outcome {
    operator: Operator;
    machine: Machine;
    /** Plants over whose canopies the tool was not fully out, and the other plants. */
    touched: number;
    clear: number;
    /** Share of the ground between the plants that the tool worked. */
    worked: number;
    swings: number;
}

/** Weeds a row from standstill until the tool is behind it. `commands` set up the firmware. */
function weed(speedKmH: number, seed: number, commands: readonly string[] = []): Outcome {
    const operator = wokenUp();
    for (const command of commands) operator.ask(command);
    const sowing = { seed, spacingMm: 550, weedShare: 0, firstMm: FIRST_MM };
    const machine = new Machine(operator.uno, sowing);
    operator.ask("start");
    machine.runUntil(operator.uno.cycle + CYCLES_PER_SECOND / 20);

    machine.change({ speedKmH });
    const swingsBefore = machine.commands;
    let [toMm, weededMm, lastMm] = [Number.POSITIVE_INFINITY, 0, 0];
    while (machine.toolMm < toMm + 100) {
        machine.runUntil(operator.uno.cycle + LOOK_CYCLES);
        if (machine.isWeeding && machine.toolMm > FIRST_MM && machine.toolMm < toMm)
            weededMm += machine.toolMm - lastMm;
        lastMm = machine.toolMm;
        const last = machine.things[PLANTS - 1];
        if (last) toMm = span(last).endMm;
    }
    const swings = machine.commands - swingsBefore;
    const fates = machine.judge(0, 0).map(([, fate]) => fate);
    machine.change({ speedKmH: 0 });
    machine.runUntil(operator.uno.cycle + CYCLES_PER_SECOND);
    const canopiesMm = machine.things.slice(0, PLANTS).reduce((sum, { widthMm }) => sum + widthMm, 0);
    return {
        operator,
        machine,
        touched: fates.filter((fate) => fate === "damaged" || fate === "reached").length,
        clear: fates.filter((fate) => fate === "kept").length,
        worked: weededMm / (toMm - FIRST_MM - canopiesMm),
        swings,
    };
}

for (const speedKmH of [1, 1.5, 2, 2.5]) {
    test(`at ${speedKmH} km/h no canopy is reached, and the ground between is weeded`, () => {
        // So short a lead that the tool comes in between any two plants.
        const outcome = weed(speedKmH, speedKmH * 10, ["set lead_out_ms 180"]);
        const { operator, machine } = outcome;
        assert.deepEqual([outcome.touched, outcome.clear], [0, PLANTS]);
        // In, as the first ground that was seen reaches the tool; then out and in for each plant.
        assert.equal(outcome.swings, 1 + 2 * PLANTS);
        assert(outcome.worked > 0.25, `worked ${outcome.worked} of the ground between the plants`);
        const { pos, lost, state, mistakes } = operator.status();
        assert.deepEqual([Number(pos), lost, state, mistakes], [machine.ticks, "0", "work", "0"]);
        assert.deepEqual(operator.uno.resets, []);
        console.log(`${speedKmH} km/h: ${(outcome.worked * 100).toFixed(0)} % of the ground between plants worked`);
    });
}

test("without look-ahead, as in the paper, the tool reaches canopies at 2.5 km/h", () => {
    const outcome = weed(2.5, 25, ["set lead_out_ms 0", "set lead_in_ms 0"]);
    assert.equal(outcome.touched, PLANTS);
});

test("a dead encoder takes the tool out of the row, and says so", () => {
    const operator = wokenUp();
    operator.ask("events on");
    const sowing = { seed: 3, spacingMm: 550, weedShare: 0.25, firstMm: FIRST_MM };
    const machine = new Machine(operator.uno, sowing);
    operator.ask("start now");
    machine.change({ speedKmH: 2 });
    machine.runUntil(operator.uno.cycle + 2 * CYCLES_PER_SECOND);
    machine.change({ encoderDead: true });
    operator.take();
    machine.runUntil(operator.uno.cycle + 5 * CYCLES_PER_SECOND);
    assert.match(operator.take(), /^alarm /m);
    assert.equal(operator.status().state, "alarm");
    assert(machine.isClear);
});

test("the second beam sees the row as far behind the first as it stands, and the firmware measures the slip by it", () => {
    const operator = wokenUp();
    const SECOND_BEAM_MM = 220;
    operator.ask(`set second_beam_mm ${SECOND_BEAM_MM}`);
    const sowing = { seed: 5, spacingMm: 550, weedShare: 1, firstMm: 500 };
    const machine = new Machine(operator.uno, sowing, { secondBeamMm: SECOND_BEAM_MM });
    const SLIP = 0.05;
    machine.change({ slip: SLIP });
    const seen: boolean[] = [];
    const setPin = operator.uno.set.bind(operator.uno);
    operator.uno.set = (pin, high) => {
        if (pin === SECOND_BEAM_PIN) seen.push(high);
        setPin(pin, high);
    };
    operator.ask("start");
    assert.equal(operator.status().slip_permille, "none");
    machine.change({ speedKmH: 2 });
    while (machine.placeMm < 2700) machine.runUntil(operator.uno.cycle + LOOK_CYCLES);

    const passed = machine.things.filter((thing) => span(thing).startMm < machine.placeMm - SECOND_BEAM_MM);
    assert(passed.some(({ kind }) => kind === "weed") && passed.length >= 5);
    assert.equal(seen.filter((high) => !high).length, passed.length);
    const measured = Number(operator.status().slip_permille);
    // A share of the wheel's distance, or of the ground: 50 or 53.
    assert(Math.abs(measured - 1000 * SLIP) <= 6, `slip_permille=${measured}`);
});
