// Settings as the TOML file of `weeder settings`: help, range and unit are above each value. Settings that a file does
// not name are not changed. The parser accepts keys with values, and comments.

import { download } from "../dom.ts";
import { english } from "../words/words.ts";
import type { Setting } from "./console_line.ts";
import { tickMm } from "./grammar.ts";

/** An error in a settings file, and what would be right. */
export class SettingsFileError extends Error {}

/** How files of 0.1.0 name `merge_gap_mm`, which was in ticks of the encoder. */
export const OLD_MERGE_GAP = "merge_gap_ticks";

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
    download("machine.toml", head + entries.join(""), "application/toml");
}

/** Converts the gap of 0.1.0, unless the present one is there. `value` is that of a setting. */
export function renameOldGap(values: Map<string, number>, value: (name: string) => number): void {
    const ticks = values.get(OLD_MERGE_GAP);
    if (ticks !== undefined && !values.has("merge_gap_mm"))
        values.set("merge_gap_mm", Math.min(1000, Math.round(ticks * tickMm(value))));
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
    const value = (name: string) => values.get(name) ?? settings.find((setting) => setting.name === name)?.value ?? 0;
    if (!isOld) renameOldGap(values, value);
    if (values.size === 0) throw new SettingsFileError(english("fileEmpty"));
    return values;
}
