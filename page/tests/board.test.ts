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

/** A check of the firmware on avr8js. A busy computer may be too late for the tester, and checks again. */
function check(tries = 5): { wires: string[]; lines: Line[] } {
    const words = ["check-board", "--simulated", "--brief", "--second-simulator", "build/lockstep.mjs", "--json"];
    const { status, stdout, stderr } = spawnSync(WEEDER, words, { encoding: "utf8" });
    if (tries > 1 && stderr.includes("the plan reached the tester too late")) return check(tries - 1);
    assert(status === 0 || status === 1, `${stdout}${stderr}`);
    return JSON.parse(stdout);
}

/** What fails in it. The time of a typed `hold` includes the computer, which may be busy. */
function failed({ lines }: { lines: Line[] }): Line[] {
    return lines.filter(({ id, verdict }) => verdict === "fail" && id !== "hold_out");
}

test("the board check passes the firmware on avr8js too", () => {
    let report = check();
    // A busy computer may open the port too late for the reset's window. A fault of the firmware fails again.
    if (failed(report).length > 0) report = check();
    for (const { id, measured, simulated } of report.lines.filter(({ verdict }) => verdict === "differs"))
        console.log(`${id} is ${measured} on avr8js, and ${simulated} on simavr`);
    assert.deepEqual([report.wires, failed(report)], [[], []]);
    // The limits of each of these exclude a simulator without any output.
    const ids = report.lines.map(({ id }) => id);
    for (const id of ["pulse_out_us", "highest_forward_busy", "beam_flickers_code", "row_2.5_reached"])
        assert(ids.includes(id), `${id} is not in the report`);
});
