// The log of a session, as `weeder replay` reads it: a CSV file of `time_ms,kind,line`, a line each, as the firmware wrote
// them. The machine's settings and examples stand in it where it connected, so that it can be replayed by itself.

import type { Happening } from "./session.ts";

/** Lines that are kept: some eleven hours at work. Of a longer session, what comes later is left out, and `isFull` says so. */
const MOST = 500_000;

export class Log {
    #lines: string[] = [];
    #from: number | undefined;
    isFull = false;

    /** Lines in it, the heading left out. */
    get length(): number {
        return this.#lines.length;
    }

    /** Writes down what happened, at a time. */
    add(happening: Happening, nowMs: number): void {
        this.#from ??= nowMs;
        const write = (kind: string, line: string) =>
            this.#write(Math.round(nowMs - (this.#from ?? nowMs)), kind, line);
        switch (happening.is) {
            case "connected":
                write("connected", happening.version);
                for (const { name, value } of happening.settings) write("setting", `${name}=${value}`);
                for (const example of happening.examples) write("example", example);
                break;
            case "lost":
                write("lost", happening.why);
                break;
            case "told":
                write("event", happening.line);
                break;
            case "status":
            case "command":
            case "answer":
                write(happening.is, happening.line);
                break;
            default:
        }
    }

    /** The file. */
    text(): string {
        return `${["time_ms,kind,line", ...this.#lines].join("\n")}\n`;
    }

    #write(timeMs: number, kind: string, line: string): void {
        this.isFull = this.#lines.length >= MOST;
        if (this.isFull) return;
        const field = /[",\n]/.test(line) ? `"${line.replaceAll('"', '""')}"` : line;
        this.#lines.push(`${timeMs},${kind},${field}`);
    }
}
