// What a line of the machine means. This is the page's one door to the console's grammar: `read` tells what was said, and nothing
// else takes a line apart. Behind it is the project's own Rust (host/link/src/console_line.rs), of which these are the types.
//
// Commands are put together where they are typed; their words stand in the firmware's help.

import { ask } from "../core.ts";
import { type Mode, TOLD, type Told } from "./events.ts";

/** The first line of the answer to `status`. Positions are the encoder's counts. */
export interface Status {
    readonly mode: Mode;
    /** The latched alarm's name. */
    readonly alarm?: string;
    readonly toolOut: boolean;
    /** Why the tool is out while the machine works, in the console's word. */
    readonly reason?: string;
    readonly position: number;
    /** Negative backwards. */
    readonly speedMmS: number;
    /** Windows at the tool or ahead of it. */
    readonly windows: number;
    /** How far the machine has to roll until ground that the beam has seen reaches the tool. */
    readonly unseenMm: number;
}

/** A setting as `get` shows it. A switched one is 0 or 1. */
export interface Setting {
    readonly name: string;
    readonly value: number;
    readonly unit: string;
    readonly least: number;
    readonly greatest: number;
    readonly isSwitched: boolean;
    readonly default: number;
    /** Nothing where none are saved. */
    readonly saved?: number;
}

/** What a line says. */
export type Said =
    /** The first line after a reset. */
    | { is: "greeting"; version: string; cause: string }
    /** The answer to `version`. */
    | { is: "version"; version: string }
    /** The end of an answer: what was wrong, and what would be right, where something was. */
    | { is: "end"; error?: string }
    | { is: "status"; status: Status }
    | { is: "setting"; setting: Setting }
    /** What a setting or a command is. */
    | { is: "help"; name: string; help: string }
    | { is: "example"; fromField: boolean; number: number; label: string }
    | Told
    | { is: "other" };

/** Whether the machine says it by itself, and not as a part of an answer. */
export function isTold(said: Said): said is Told {
    return TOLD.some((is) => is === said.is);
}

/** Reads a line. */
export function read(line: string): Said {
    return ask<Said>({ read: line });
}

/** The settings that the lines of an answer to `get` show. */
export function settingsOf(lines: readonly string[]): Setting[] {
    return lines.map(read).flatMap((said) => (said.is === "setting" ? [said.setting] : []));
}

/** The order in which values can be sent, or why they cannot be at all. */
export interface Steps {
    /** What contradicts what, and what would be right. */
    readonly contradiction?: string;
    readonly steps: readonly (readonly [name: string, value: number])[];
}

/**
 * The values to send that lead from the machine's settings to some others, with no contradiction on the way. What no setting's
 * value can be goes last, for the machine to say what is wrong with it.
 */
export function steps(from: readonly Setting[], to: ReadonlyMap<string, number>): Steps {
    const canBe = (value: number) => Number.isInteger(value) && value >= 0 && value <= 65_535;
    const values = from.map(({ name, value }) => [name, value] as const);
    const [good, bad] = [true, false].map((good) => [...to].filter(([, value]) => canBe(value) === good));
    const change = { from: Object.fromEntries(values), to: Object.fromEntries(good ?? []) };
    const { steps, ...rest } = ask<Steps>({ steps: change });
    return { ...rest, steps: [...steps, ...(bad ?? [])] };
}
