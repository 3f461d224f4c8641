// Parses the machine's lines. This is the only place in the page that parses console lines: `read` returns the meaning
// of a line. The parser is the project's own Rust (host/link/src/console_line.rs), and console_line.ts has its types.
//
// Commands are composed where they are typed. Their words are in the firmware's help.

import { ask } from "../core.ts";
import type { ConsoleLine, Line, Setting } from "./console_line.ts";

export function read(line: string): ConsoleLine {
    return ask<ConsoleLine>({ read: line });
}

/** Those of the lines that have this name, read. */
export function linesOf<Name extends ConsoleLine["is"]>(name: Name, lines: readonly string[]): Line<Name>[] {
    return lines.map(read).filter((said): said is Line<Name> => said.is === name);
}

/**
 * The values to send to change the machine's settings, in an order without a contradiction on the way. Invalid values
 * come last: the machine reports their errors. If the values contradict each other: what would be right.
 */
export function steps(from: readonly Setting[], to: ReadonlyMap<string, number>) {
    const isBad = ([, value]: [string, number]) => !(Number.isInteger(value) && value >= 0 && value <= 65_535);
    const values = Object.fromEntries(from.map(({ name, value }) => [name, value]));
    const good = Object.fromEntries([...to].filter((entry) => !isBad(entry)));
    type Answer = { contradiction?: string; steps: [name: string, value: number][] };
    const { contradiction, steps } = ask<Answer>({ steps: { from: values, to: good } });
    return { contradiction, steps: [...steps, ...[...to].filter(isBad)] };
}

/** Distance of an encoder count, by the values of the settings: of the calibrated wheel, or of its diameter. */
export function tickMm(value: (setting: string) => number): number {
    const perMetre = value("ticks_per_m");
    return perMetre > 0 ? 1000 / perMetre : (Math.PI * value("wheel_mm")) / Math.max(value("ticks_per_rev"), 1);
}
