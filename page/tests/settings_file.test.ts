// Settings files, as the panel reads them.

import assert from "node:assert/strict";
import { test } from "node:test";
import type { Setting } from "../src/link/console_line.ts";
import { parse, SettingsFileError } from "../src/link/settings_file.ts";

const setting = (name: string, value: number, greatest: number): Setting => ({
    is: "setting",
    name,
    value,
    least: 0,
    greatest,
    unit: "mm",
    default: value,
    isSwitched: false,
});
const SETTINGS = [
    setting("ticks_per_rev", 2400, 10000),
    setting("wheel_mm", 400, 800),
    setting("ticks_per_m", 0, 20000),
    setting("merge_gap_mm", 21, 1000),
];

test("a merge gap in ticks, as older files have it, is read in millimetres", () => {
    const gap = (text: string) => parse(text, SETTINGS).get("merge_gap_mm");
    assert.equal(gap("merge_gap_ticks = 40"), 21);
    assert.equal(gap("merge_gap_ticks = 40\nticks_per_m = 1000"), 40);
    assert.equal(gap("ticks_per_m = 500\nmerge_gap_ticks = 2000"), 1000);
    assert.equal(gap("merge_gap_ticks = 40\nmerge_gap_mm = 5"), 5);
    assert.throws(() => gap("merge_gap_ticks = 2001"), SettingsFileError);
    const older = [...SETTINGS, setting("merge_gap_ticks", 40, 2000)];
    assert.deepEqual([...parse("merge_gap_ticks = 60", older)], [["merge_gap_ticks", 60]]);
});

test("a file with another wheel and the machine's own calibration is refused", () => {
    const own = SETTINGS.map((own) => (own.name === "ticks_per_m" ? setting("ticks_per_m", 1929, 20000) : own));
    assert.throws(
        () => parse("wheel_mm = 410\nticks_per_m = 1929", own),
        /ticks_per_m 1929 was measured with the wheel/,
    );
    assert.equal(parse("wheel_mm = 410\nticks_per_m = 1862", own).get("ticks_per_m"), 1862);
    assert.equal(parse("wheel_mm = 400\nticks_per_m = 1929", own).get("ticks_per_m"), 1929);
});
