// The log of a session, for `weeder replay`: a CSV file of `time_ms,kind,line`, with the firmware's own lines. It has
// the machine's settings and examples at each connection, so that it can be replayed alone. Changed settings are answers.

import type { Happening } from "./session.ts";

/** Greatest number of lines: some eleven hours at work. Later lines are dropped, and `isFull` is true. */
const MOST = 500_000;

export class Log {
    #lines: string[] = [];
    #from: number | undefined;
    isFull = false;
    /** Whether it has work, or something that the operator did, since `text` was called. */
    isUnsaved = false;

    get length(): number {
        return this.#lines.length;
    }

    add(happening: Happening, nowMs: number): void {
        this.#from ??= nowMs;
        const { is } = happening;
        const isWork = is === "status" && happening.status.mode === "work";
        this.isUnsaved ||= isWork || is === "event" || is === "command";
        const timeMs = Math.round(nowMs - this.#from);
        const write = (kind: string, line: string) => {
            this.isFull = this.#lines.length >= MOST;
            if (this.isFull) return;
            const field = /[",\n]/.test(line) ? `"${line.replaceAll('"', '""')}"` : line;
            this.#lines.push(`${timeMs},${kind},${field}`);
        };
        if (happening.is === "connected") {
            write("connected", happening.version);
            for (const { name, value } of happening.settings) write("setting", `${name}=${value}`);
            for (const example of happening.examples) write("example", example);
        } else if (happening.is === "lost") write("lost", happening.why);
        // Of `revert`, and of a change at another computer, no typed line has the values.
        else if (happening.is === "settings") for (const line of happening.lines) write("answer", line);
        else if ("line" in happening) write(happening.is, happening.line);
    }

    /** The file's text, for saving it. */
    text(): string {
        this.isUnsaved = false;
        return `${["time_ms,kind,line", ...this.#lines].join("\n")}\n`;
    }
}
