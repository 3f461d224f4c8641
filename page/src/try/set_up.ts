// The machine that is set up by the manual: its differences from the machine from the box, and its firmware's settings.
//
// The values come from the manual's steps, which the project's Rust has (host/page/src/console.rs).

import { ask } from "../core.ts";
import type { MachineKind } from "../row/machine.ts";

/** The margin from the measurements of the simulated machine. */
const MARGIN_MM = 11;

/** The values of the steps, by their names. */
function values(): Map<string, number> {
    const { steps } = ask<{ steps: { tasks: string[] }[] }>({ setUp: { lines: [], settings: {} } });
    const tasks = steps.flatMap(({ tasks }) => tasks).map((task) => /^([\w.]+) = ([\d.]+)/.exec(task));
    return new Map(tasks.flatMap((found) => (found?.[1] ? [[found[1], Number(found[2])] as const] : [])));
}

export function machineSetUp(): MachineKind {
    const of = values();
    const taken = [
        ["toolWidthMm", of.get("machine.tool_width_mm")],
        ["servoInUs", of.get("servo_in_us")],
        ["servoOutUs", of.get("servo_out_us")],
    ] as const;
    return Object.fromEntries(taken.filter(([, value]) => value !== undefined));
}

/** Its firmware's settings, without those of the second beam, which this machine lacks. */
export function commandsSetUp(): string[] {
    const set = [...values()].filter(([name]) => !name.includes(".") && name !== "second_beam_mm");
    return [...set, ["margin_mm", MARGIN_MM] as const].map(([name, value]) => `set ${name} ${value}`);
}
