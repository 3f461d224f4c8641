// Shared code of the tests: a started Uno, and a patient operator at its console.

import { hex } from "../src/core.ts";
import { CYCLES_PER_SECOND, Uno } from "../src/uno/uno.ts";

/** Timeout of an answer, and of the firmware's first line. */
const TIMEOUT_MS = 1000;

const CYCLES_PER_MS = CYCLES_PER_SECOND / 1000;

/** The line that ends an answer. */
const END_OF_ANSWER = /^(ok|error: .*)\r\n/m;

/** A level on each input: encoder low, beams clear, switches open. */
const AT_REST: [number, boolean][] = [
    [2, false],
    [3, false],
    [4, true],
    [5, true],
    [8, true],
    [10, true],
];

export class Operator {
    readonly uno: Uno;
    /** The firmware's output that was not read yet. */
    #heard = "";

    constructor(uno: Uno) {
        this.uno = uno;
        uno.onByte = (byte) => {
            this.#heard += String.fromCharCode(byte);
        };
    }

    /** The output since the last call. */
    take(): string {
        const heard = this.#heard;
        this.#heard = "";
        return heard;
    }

    run(ms: number): void {
        this.uno.runUntil(this.uno.cycle + ms * CYCLES_PER_MS);
    }

    /** Lets the firmware run until its output matches, and returns that. */
    waitFor(pattern: RegExp): string {
        for (let waited = 0; !pattern.test(this.#heard); waited++) {
            if (waited === TIMEOUT_MS)
                throw new Error(`the firmware sent ${JSON.stringify(this.#heard)}, not ${pattern}`);
            this.run(1);
        }
        return this.take();
    }

    /** Types a line and returns all lines of its answer. The last line is `ok` or begins with `error:`. */
    exchange(line: string): string[] {
        this.take();
        this.uno.send(`${line}\n`);
        const heard = this.waitFor(END_OF_ANSWER);
        const end = heard.search(END_OF_ANSWER) + (heard.match(END_OF_ANSWER)?.[0].length ?? 0);
        // An event may come directly after the answer.
        this.#heard = heard.slice(end);
        return heard.slice(0, end).trimEnd().split("\r\n");
    }

    /** Types a command that must succeed, and returns the lines of its answer without the `ok`. */
    ask(command: string): string[] {
        const answer = this.exchange(command);
        const last = answer.pop();
        if (last !== "ok") throw new Error(`the firmware answers ${command} by ${last}`);
        return answer;
    }

    /** The figures of `status`, by name. */
    status(): Record<string, string> {
        const words = this.ask("status")
            .join(" ")
            .matchAll(/(\S+)=(\S+)/g);
        return Object.fromEntries([...words].map(([, key, value]) => [key, value]));
    }
}

/** An Uno with its inputs at rest, after its firmware's first line. */
export function poweredUp(eeprom?: Uint8Array): { operator: Operator; greeting: string } {
    const operator = new Operator(new Uno(hex, eeprom));
    for (const [pin, high] of AT_REST) operator.uno.set(pin, high);
    return { operator, greeting: operator.waitFor(/\n/) };
}

/** As `poweredUp`, with the alarm for missing saved settings cleared. */
export function wokenUp(): Operator {
    const { operator } = poweredUp();
    operator.ask("clear");
    return operator;
}
