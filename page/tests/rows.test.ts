// Rows at the paper's speeds on avr8js: every plant has a swing of its own, and the tool is never over a canopy.

import assert from "node:assert/strict";
import test from "node:test";
import { Machine } from "../src/row/machine.ts";
import { Motion, mmS } from "../src/row/motion.ts";
import { chance, PLANTING, Row, sow, span } from "../src/row/row.ts";
import { type Operator, wokenUp } from "./operator.ts";

const PLANTS = 8;
const FIRST_MM = 900;
const ACCELERATION_MM_S2 = 1000;

/** What came of a row. */
interface Outcome {
    operator: Operator;
    machine: Machine;
    /** Plants over whose canopies the tool was not fully out, and those over which it was. */
    touched: number;
    clear: number;
    /** Weeds that the tool worked. */
    weeded: number;
    /** Share of the ground between the plants that the tool worked. */
    worked: number;
    swings: number;
}

/** Plants 480 to 620 mm apart with canopies of 100 to 180 mm, and a tall weed in the middle of every second gap. */
function irregularRow(seed: number): Row {
    const planting = { ...PLANTING, spacingScatterMm: 70, canopyMm: 140, canopyScatterMm: 40, weedShare: 0 };
    const plants = new Row();
    sow(plants, FIRST_MM + (PLANTS - 1.5) * planting.spacingMm, planting, chance(seed), FIRST_MM);
    const row = new Row();
    for (const [index, plant] of plants.things.slice(0, PLANTS).entries()) {
        const before = row.things.at(-1);
        if (before && index % 2 === 1)
            row.add({ kind: "weed", placeMm: (span(before).endMm + span(plant).startMm) / 2, widthMm: 15 });
        row.add(plant);
    }
    return row;
}

/** Weeds a row from standstill until the tool is behind it, the firmware set up by these commands. */
function weed(speedKmH: number, seed: number, commands: readonly string[] = []): Outcome {
    const operator = wokenUp();
    for (const command of commands) operator.ask(command);
    const row = irregularRow(seed);
    const motion = new Motion(0);
    const machine = new Machine(operator.uno, row, motion);
    operator.ask("start");
    operator.run(50);

    const startS = machine.timeS();
    motion.changeSpeed(startS, mmS(speedKmH), ACCELERATION_MM_S2);
    const swingsBefore = machine.servo.commands;
    const endMm = row.endMm + 100;
    const touched = new Set<number>();
    const worked = new Set<number>();
    let [weededMm, lastMm] = [0, 0];
    const isOver = (index: number) => {
        const thing = row.things[index];
        return thing && machine.toolMm >= span(thing).startMm && machine.toolMm <= span(thing).endMm;
    };
    while (machine.toolMm < endMm) {
        machine.runUntil(operator.uno.cycle + 160_000, () => {
            for (const index of row.things.keys()) {
                if (!isOver(index)) continue;
                if (!machine.isClear) touched.add(index);
                if (machine.isWeeding) worked.add(index);
            }
            if (machine.isWeeding && machine.toolMm > FIRST_MM && machine.toolMm < row.endMm)
                weededMm += machine.toolMm - lastMm;
            lastMm = machine.toolMm;
        });
    }
    const swings = machine.servo.commands - swingsBefore;
    motion.changeSpeed(machine.timeS(), 0, ACCELERATION_MM_S2);
    machine.runUntil(operator.uno.cycle + 16_000_000);
    const plants = [...row.things.keys()].filter((index) => row.things[index]?.kind === "plant");
    const canopiesMm = plants.reduce((sum, index) => sum + (row.things[index]?.widthMm ?? 0), 0);
    return {
        operator,
        machine,
        touched: plants.filter((index) => touched.has(index)).length,
        clear: plants.filter((index) => !touched.has(index)).length,
        weeded: worked.size - plants.filter((index) => worked.has(index)).length,
        worked: weededMm / (row.endMm - FIRST_MM - canopiesMm),
        swings,
    };
}

for (const speedKmH of [1, 1.5, 2, 2.5]) {
    test(`at ${speedKmH} km/h no canopy is reached, and the ground between is weeded`, () => {
        const outcome = weed(speedKmH, speedKmH * 10);
        const { operator, machine } = outcome;
        assert.deepEqual([outcome.touched, outcome.clear], [0, PLANTS]);
        // In, as the first ground that was seen reaches the tool; then out and in for each plant.
        assert.equal(outcome.swings, 1 + 2 * PLANTS);
        const weeds = machine.row.things.length - PLANTS;
        assert.equal(outcome.weeded, weeds, `tall weeds worked of ${weeds}`);
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
    const row = new Row();
    sow(row, 5000, PLANTING, chance(3), FIRST_MM);
    const motion = new Motion(0);
    const machine = new Machine(operator.uno, row, motion);
    operator.ask("start now");
    motion.changeSpeed(machine.timeS(), mmS(2), ACCELERATION_MM_S2);
    machine.runUntil(operator.uno.cycle + 2 * 16_000_000);
    machine.killEncoder(true);
    operator.take();
    machine.runUntil(operator.uno.cycle + 5 * 16_000_000);
    assert.match(operator.take(), /^alarm /m);
    assert.equal(operator.status().state, "alarm");
    assert(machine.isClear);
});
