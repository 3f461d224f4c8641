// The check of a board, with avr8js instead of the weeder: a third program compares the two simulators at the pins.

import assert from "node:assert/strict";
import { spawnSync } from "node:child_process";
import test from "node:test";
import { WEEDER } from "./weeder.ts";

/** A line of the report. */
interface Line {
    readonly id: string;
    readonly measured: number | null;
    readonly simulated: number | null;
    readonly verdict: "pass" | "differs" | "fail";
}

test("the board check passes the firmware on avr8js too", () => {
    const words = ["check-board", "--simulated", "--brief", "--second-simulator", "build/lockstep.mjs", "--json"];
    const { status, stdout, stderr } = spawnSync(WEEDER, words, { encoding: "utf8" });
    assert(status === 0 || status === 1, `${stdout}${stderr}`);
    const { wires, lines }: { wires: string[]; lines: Line[] } = JSON.parse(stdout);
    for (const { id, measured, simulated } of lines.filter(({ verdict }) => verdict === "differs"))
        console.log(`${id} is ${measured} on avr8js, and ${simulated} on simavr`);
    // The time of a typed `hold` includes the computer, which may be busy.
    const failed = lines.filter(({ id, verdict }) => verdict === "fail" && id !== "hold_out");
    assert.deepEqual([wires, failed], [[], []]);
    // The limits of each of these exclude a simulator without any output.
    const ids = lines.map(({ id }) => id);
    for (const id of ["pulse_out_us", "highest_forward_busy", "beam_flickers_code", "row_2.5_reached"])
        assert(ids.includes(id), `${id} is not in the report`);
});
