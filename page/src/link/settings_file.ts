// Settings as the TOML file of `weeder settings`: help, range and unit are above each value. Settings that a file does
// not name are not changed. The parser accepts keys with values, and comments.

import { download } from "../dom.ts";
import { english } from "../words/words.ts";
import type { Setting } from "./console_line.ts";
import { tickMm } from "./grammar.ts";

/** An error in a settings file, and what would be right. */
export class SettingsFileError extends Error {}

/** How files of 0.1.0 name `merge_gap_mm`, which was in ticks of the encoder. */
const OLD_MERGE_GAP = "merge_gap_ticks";

/** The factory's leads and top speed of 0.1.0, which are not safe. */
const UNSAFE = { lead_out_ms: 180, lead_in_ms: 40, top_speed_mm_s: 1400 };

export function range({ isSwitched, least, greatest, unit, default: usual }: Setting): string {
    if (isSwitched) return english("rangeSwitched", { usual: String(usual === 1) });
    return english("range", { least, greatest: `${greatest}${unit && ` ${unit}`}`, usual });
}

/** Hands the operator these settings as a file. */
export function save(settings: readonly Setting[], help: ReadonlyMap<string, string>): void {
    const head =
        "# Settings of a weeder. `weeder settings push` sends them to the machine, `weeder settings diff` compares.\n" +
        "# Settings that are not named here are not changed.\n";
    const entries = settings.map((setting) => {
        const value = setting.isSwitched ? setting.value === 1 : setting.value;
        return `\n# ${help.get(setting.name) ?? ""}\n# ${range(setting)}\n${setting.name} = ${value}\n`;
    });
    download(new File([head, ...entries], "machine.toml", { type: "application/toml" }));
}

/**
 * Makes settings of 0.1.0 present ones: converts the gap, unless the present one is there, and leaves out what is not safe.
 * `value` is that of a setting.
 */
export function update(values: Map<string, number>, value: (name: string) => number): void {
    const ticks = values.get(OLD_MERGE_GAP);
    if (ticks === undefined) return;
    if (!values.has("merge_gap_mm")) values.set("merge_gap_mm", Math.min(1000, Math.round(ticks * tickMm(value))));
    for (const [name, old] of Object.entries(UNSAFE)) if (values.get(name) === old) values.delete(name);
    values.delete(OLD_MERGE_GAP);
}

/** The values that a file names, by the names of settings. Throws a SettingsFileError. */
export function parse(text: string, settings: readonly Setting[]): Map<string, number> {
    const values = new Map<string, number>();
    const isOld = settings.some(({ name }) => name === OLD_MERGE_GAP);
    for (const [index, line] of text.split(/\r?\n/).entries()) {
        if (/^\s*(#.*)?$/.test(line)) continue;
        const refuse = (problem: string) =>
            new SettingsFileError(english("fileLine", { line: index + 1, why: problem }));
        const [, name = "", word = ""] = /^\s*(\w+)\s*=\s*([^\s#]+)\s*(?:#.*)?$/.exec(line) ?? [];
        if (name === "") throw refuse(english("fileForm"));
        if (name === OLD_MERGE_GAP && !isOld) {
            if (!/^\d{1,4}$/.test(word) || Number(word) > 2000) throw refuse(english("fileOldGap", { name }));
            values.set(name, Number(word));
            continue;
        }
        const setting = settings.find((setting) => setting.name === name);
        if (!setting)
            throw refuse(english("fileUnknown", { name, names: settings.map(({ name }) => name).join(", ") }));
        if (values.has(name)) throw refuse(english("fileTwice", { name }));
        const value = setting.isSwitched ? ["false", "true"].indexOf(word) : /^\d+$/.test(word) ? Number(word) : -1;
        if (value < setting.least || value > setting.greatest)
            throw refuse(
                english(setting.isSwitched ? "fileSwitched" : "fileNumber", {
                    name,
                    value: word,
                    range: range(setting),
                }),
            );
        values.set(name, value);
    }
    // Settings that the file does not name are the machine's.
    const own = (name: string) => settings.find((setting) => setting.name === name)?.value ?? 0;
    const value = (name: string) => values.get(name) ?? own(name);
    if (!isOld) update(values, value);
    const ticks = values.get("ticks_per_m");
    const isOtherWheel = ["ticks_per_rev", "wheel_mm"].some((name) => value(name) !== own(name));
    // A saved file in which the wheel was edited.
    if (ticks && ticks === own("ticks_per_m") && isOtherWheel)
        throw new SettingsFileError(english("fileOldWheel", { value: ticks }));
    if (values.size === 0) throw new SettingsFileError(english("fileEmpty"));
    return values;
}
