// The virtual Uno for another program, in lock step: a command for node, not a part of the page.
//
// Each line of standard input is a turn: the cycle until which the clock runs, and the inputs until then. Each line of
// standard output has the Uno's outputs in that turn. The first line has the firmware. `weeder check-board
// --second-simulator` uses it instead of the weeder (yard/check-board/src/second.rs is the other end).

import { createInterface } from "node:readline";
import { Uno } from "./uno.ts";

/** The inputs of a turn. Cycles are the Uno's own. */
interface Turn {
    readonly until: number;
    /** Changes of input pins, in the order of their cycles. */
    readonly edges: readonly (readonly [cycle: number, pin: number, high: boolean])[];
    /** Bytes that are typed at the turn's beginning. */
    readonly typed: readonly number[];
    /** Whether the reset is pulled at the turn's beginning. */
    readonly reset: boolean;
}

let uno: Uno | undefined;
/** The outputs of a turn. */
const done: { edges: [cycle: number, pin: number, high: boolean][]; said: number[] } = { edges: [], said: [] };

function powerUp(hex: string): Uno {
    const uno = new Uno(hex);
    uno.onLevel = (pin, high, cycle) => done.edges.push([cycle, pin, high]);
    uno.onByte = (byte) => done.said.push(byte);
    return uno;
}

function take(uno: Uno, { until, edges, typed, reset }: Turn): void {
    if (reset) uno.reset("external");
    uno.send(String.fromCharCode(...typed));
    for (const [cycle, pin, high] of edges) {
        uno.runUntil(cycle);
        uno.set(pin, high);
    }
    uno.runUntil(until);
}

createInterface({ input: process.stdin }).on("line", (line) => {
    const said: { hex: string } | Turn = JSON.parse(line);
    if ("hex" in said) uno = powerUp(said.hex);
    else if (uno) take(uno, said);
    process.stdout.write(`${JSON.stringify(done)}\n`);
    [done.edges, done.said] = [[], []];
});
