// The console: typed lines and the machine's output, and an input line. It does not interpret the lines.

import { make, type Parts } from "../dom.ts";

/** Greatest number of lines. */
const LINES = 500;

/** Greatest distance from the end, in pixels, at which the console still scrolls with new lines. */
const AT_THE_END = 8;

export class Console {
    readonly #said: HTMLElement;
    readonly #typed: string[] = [];
    /** Which of the typed lines the arrow keys are at. */
    #recalled = 0;
    #waiting: HTMLElement[] = [];

    /** `type` types a line to the machine. */
    constructor(parts: Parts, type: (line: string) => void) {
        this.#said = parts.html("said");
        const input = parts.get("typed", HTMLInputElement);
        parts.get("line", HTMLFormElement).addEventListener("submit", (event) => {
            event.preventDefault();
            const line = input.value.trim();
            input.value = "";
            if (line === "") return;
            this.#recalled = this.#typed.push(line);
            type(line);
        });
        input.addEventListener("keydown", (event) => {
            const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
            if (by === undefined) return;
            event.preventDefault();
            this.#recalled = Math.min(Math.max(this.#recalled + by, 0), this.#typed.length);
            input.value = this.#typed[this.#recalled] ?? "";
        });
    }

    add(line: string, kind: "typed" | "error" | "happened" | ""): void {
        this.#waiting.push(make("div", kind, line));
        if (this.#waiting.length > LINES) this.#waiting.shift();
    }

    show(): void {
        if (this.#waiting.length === 0) return;
        const said = this.#said;
        const follows = said.scrollHeight - said.scrollTop - said.clientHeight < AT_THE_END;
        said.append(...this.#waiting.splice(0));
        while (said.childElementCount > LINES) said.firstElementChild?.remove();
        if (follows) said.scrollTop = said.scrollHeight;
    }
}
