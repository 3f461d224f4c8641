// Save and restart on avr8js: the EEPROM's content after a reset, a brown-out and a power failure.

import assert from "node:assert/strict";
import test from "node:test";
import type { ResetCause } from "../src/uno/uno.ts";
import { type Operator, poweredUp, wokenUp } from "./operator.ts";

/** Restarts the machine and returns its first line. */
function restart(operator: Operator, cause: Exclude<ResetCause, "watchdog">): string {
    operator.take();
    operator.uno.reset(cause);
    return operator.waitFor(/\n/);
}

test("saved settings are there after every kind of restart, and unsaved ones are not", () => {
    const operator = wokenUp();
    operator.ask("set wheel_mm 405");
    operator.ask("save");
    for (const [cause, said] of [
        ["external", "reset_pin"],
        ["brown-out", "brown_out"],
        ["power-on", "power_on"],
    ] as const) {
        operator.ask("set margin_mm 60");
        const greeting = restart(operator, cause);
        assert(greeting.includes(said), greeting);
        assert.match(operator.ask("get wheel_mm")[0] ?? "", /^wheel_mm=405 /);
        assert.match(operator.ask("get margin_mm")[0] ?? "", /^margin_mm=50 /);
        assert.equal(operator.status().state, "hold");
    }
    assert.deepEqual(
        operator.uno.resets.map(({ cause }) => cause),
        ["external", "brown-out", "power-on"],
    );
});

test("another Uno wakes up with the EEPROM of this one", () => {
    const operator = wokenUp();
    operator.ask("set beam_to_tool_mm 500");
    operator.ask("save");
    const { operator: other, greeting } = poweredUp(operator.uno.eeprom);
    assert(!greeting.includes("settings_lost"), greeting);
    assert.match(other.ask("get beam_to_tool_mm")[0] ?? "", /^beam_to_tool_mm=500 /);
    assert.equal(other.status().state, "hold");
});

test("a machine without settings wakes up with an alarm, and lights its code", () => {
    const { operator } = poweredUp();
    assert.equal(operator.status().state, "alarm");
    let edges = 0;
    operator.uno.onLevel = (pin) => {
        if (pin === 13) edges += 1;
    };
    operator.run(3000);
    assert(edges > 4, `${edges} edges of the lamp`);
});

test("the servo has no signal during a restart, and comes back with the tool out", () => {
    const operator = wokenUp();
    const widthsUs: number[] = [];
    let rise = 0;
    operator.uno.onLevel = (pin, high, cycle) => {
        if (pin !== 9) return;
        if (high) rise = cycle;
        else widthsUs.push((cycle - rise) / 16);
    };
    operator.ask("servo in");
    operator.run(100);
    operator.uno.reset("brown-out");
    // The reset may have cut off this pulse.
    widthsUs.length = 0;
    operator.run(200);
    assert(widthsUs.length >= 8, `${widthsUs.length} pulses`);
    for (const widthUs of widthsUs) assert(Math.abs(widthUs - 2000) < 1, `a pulse of ${widthUs} us`);
});
