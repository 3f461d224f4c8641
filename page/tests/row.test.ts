// The machine's own arithmetic, without a firmware: motion, planting and servo.

import assert from "node:assert/strict";
import test from "node:test";
import { Motion, mmS } from "../src/row/motion.ts";
import { chance, PLANTING, Row, sow, span } from "../src/row/row.ts";
import { OUT_DEGREES, Servo } from "../src/row/servo.ts";

const near = (value: number | undefined, expected: number, within = 1e-6) =>
    assert(value !== undefined && Math.abs(value - expected) < within, `${value}, not ${expected}`);

test("a machine gains speed, brakes and rolls back, and passes each place when its position says so", () => {
    const motion = new Motion(-100);
    motion.changeSpeed(1, mmS(1.8), 500);
    near(motion.placeMm(2), 150);
    near(motion.nextPassing(0, 400, Number.NEGATIVE_INFINITY)?.timeS, 2.5);
    motion.changeSpeed(3, -250, 500);
    // Half a second and 250 mm to stand, another to roll back.
    near(motion.placeMm(4), 650 + 250);
    near(motion.speedMmS(4), 0);
    near(motion.placeMm(4.5), 900 - 62.5);
    assert.equal(motion.nextPassing(3, 901, Number.NEGATIVE_INFINITY), undefined);
    const back = motion.nextPassing(4, 1000, 837.5);
    assert(back && !back.forward);
    near(back.timeS, 4.5);
});

test("a wheel that slips turns farther than the machine rolls, from when it slips on", () => {
    const motion = new Motion(0);
    motion.changeSpeed(0, 500, 1000);
    motion.slipFrom(0.25, 0.05);
    const placeMm = motion.placeMm(3);
    near(placeMm, 125 + 500 * 2.5);
    const beforeMm = 500 * 0.25 * 0.25;
    near(motion.wheelMm(3), beforeMm + (placeMm - beforeMm) / 0.95);
    const turning = motion.nextTurning(1, motion.wheelMm(2), Number.NEGATIVE_INFINITY);
    near(turning?.timeS, 2);
});

test("a motion knows how it rolled until that is forgotten", () => {
    const motion = new Motion(100);
    motion.changeSpeed(1, 500, 500);
    motion.changeSpeed(1.5, 0, 500);
    motion.slipFrom(1.75, 0.1);
    for (const fromS of [0, 1.25, 1.5, 1.9]) {
        let placeMm = motion.placeMm(fromS);
        let timeS = fromS;
        for (const { durationS, speedMmS, accelerationMmS2 } of motion.rolled(fromS, 3)) {
            near(motion.speedMmS(timeS), speedMmS);
            placeMm += speedMmS * durationS + (accelerationMmS2 * durationS ** 2) / 2;
            timeS += durationS;
            near(motion.placeMm(timeS), placeMm);
        }
        near(timeS, 3);
    }
    near(motion.placeMm(3), 100 + 2 * 62.5);
    motion.forget(1.6);
    near(motion.placeMm(1.6), 100 + 62.5 + 250 * 0.1 - 250 * 0.01);
    assert.equal(motion.rolled(0, 3).length, 3);
});

test("a row is sown in order and apart, whatever is asked of it, and the same for the same seed", () => {
    const tight = {
        ...PLANTING,
        spacingMm: 150,
        spacingScatterMm: 80,
        canopyMm: 200,
        canopyScatterMm: 100,
        weedShare: 1,
    };
    for (const planting of [PLANTING, tight]) {
        const rows = [5, 5].map((seed) => {
            const row = new Row();
            const random = chance(seed);
            for (let untilMm = 1000; untilMm <= 20_000; untilMm += 1000) sow(row, untilMm, planting, random, 500);
            return row.things;
        });
        assert.deepEqual(rows[0], rows[1]);
        const things = rows[0] ?? [];
        assert(things.length > 20);
        for (const [index, thing] of things.entries()) {
            const before = things[index - 1];
            assert(!before || span(before).endMm < span(thing).startMm);
        }
    }
});

test("a thing that stands in another is refused", () => {
    const row = new Row([{ kind: "plant", placeMm: 500, widthMm: 150 }]);
    assert.throws(() => row.add({ kind: "weed", placeMm: 560, widthMm: 15 }), /behind the others, and apart/);
    assert.throws(() => row.add({ kind: "weed", placeMm: 800, widthMm: 0 }), /above 0/);
});

test("a servo moves after its dead time, at its rate, and turns round from wherever it is", () => {
    const servo = new Servo();
    servo.hear(2000, 0);
    servo.hear(1500, 1);
    near(servo.degrees(1.05), OUT_DEGREES);
    near(servo.degrees(1.06 + 0.06), OUT_DEGREES / 2);
    near(servo.degrees(1.5), 0);
    servo.hear(2000, 2);
    servo.hear(1500, 2.04);
    // It turned out for 40 ms before the second command reached it, and then back.
    near(servo.degrees(2.1), 15);
    near(servo.degrees(2.12), 7.5);
    servo.forget(3);
    near(servo.degrees(3), 0);
    assert.equal(servo.commands, 4);
    servo.hear(3000, 4);
    assert.equal(servo.commands, 4);
});
