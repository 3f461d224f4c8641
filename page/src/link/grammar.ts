// Parses the machine's lines. This is the only place in the page that parses console lines: `read` returns the meaning
// of a line. The parser is the project's own Rust (host/link/src/console_line.rs), and these are its types.
//
// Commands are composed where they are typed. Their words are in the firmware's help.

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
    /** Keep-out zones at the tool or ahead of it. */
    readonly windows: number;
    /** Distance until ground that the beam has seen reaches the tool. */
    readonly unseenMm: number;
}

/** A setting as `get` shows it. A switch is 0 or 1. */
export interface Setting {
    readonly name: string;
    readonly value: number;
    readonly unit: string;
    readonly least: number;
    readonly greatest: number;
    readonly isSwitched: boolean;
    readonly default: number;
    /** Undefined if nothing is saved. */
    readonly saved?: number;
}

/** The meaning of a line. */
export type Said =
    /** The first line after a reset. */
    | { is: "greeting"; version: string; cause: string }
    /** The answer to `version`. */
    | { is: "version"; version: string }
    /** The end of an answer, with the error and what would be right, if there is one. */
    | { is: "end"; error?: string }
    | { is: "status"; status: Status }
    | { is: "setting"; setting: Setting }
    /** The description of a setting or a command. */
    | { is: "help"; name: string; help: string }
    | { is: "example"; fromField: boolean; number: number; label: string }
    | Told
    | { is: "other" };

/** Whether it is an event, and not a part of an answer. */
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
    /** The contradiction, and what would be right. */
    readonly contradiction?: string;
    readonly steps: readonly (readonly [name: string, value: number])[];
}

/**
 * The values to send to change the machine's settings, without a contradiction on the way. Invalid values come last:
 * the machine reports their errors.
 */
export function steps(from: readonly Setting[], to: ReadonlyMap<string, number>): Steps {
    const canBe = (value: number) => Number.isInteger(value) && value >= 0 && value <= 65_535;
    const values = from.map(({ name, value }) => [name, value] as const);
    const [good, bad] = [true, false].map((good) => [...to].filter(([, value]) => canBe(value) === good));
    const change = { from: Object.fromEntries(values), to: Object.fromEntries(good ?? []) };
    const { steps, ...rest } = ask<Steps>({ steps: change });
    return { ...rest, steps: [...steps, ...(bad ?? [])] };
}
