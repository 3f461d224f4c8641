// The console: typed lines and the machine's output, and an input line. It does not interpret the lines.

import { make, type Parts } from "../dom.ts";

const LINES = 500;

/** Greatest distance from the end, in pixels, at which the console still scrolls with new lines. */
const AT_THE_END = 8;

export class Console {
    readonly #said: HTMLElement;
    readonly #typed: string[] = [];
    /** Which of the typed lines the arrow keys are at. */
    #recalled = 0;
    #waiting: HTMLElement[] = [];
    /** Whether it scrolls with new lines: until the operator scrolls back. */
    #follows = true;
    /** Whether it was shown since it was hidden. A browser forgets how far a hidden element is scrolled. */
    #isShown = false;

    constructor(parts: Parts, type: (line: string) => void) {
        const said = parts.html("said");
        this.#said = said;
        said.addEventListener("scroll", () => {
            if (this.#isShown) this.#follows = said.scrollHeight - said.scrollTop - said.clientHeight < AT_THE_END;
        });
        const input = parts.get("typed", HTMLInputElement);
        const enter = (line: string) => {
            this.#recalled = this.#typed.push(line);
            type(line);
        };
        // The field would join pasted lines to one, and cut a long one.
        const paste = (event: Event, data: DataTransfer | null) => {
            const text = data?.getData("text/plain") ?? "";
            const lines = text.split(/[\r\n]+/).filter((line) => line.trim() !== "");
            if (lines.length < 2 && text.length <= input.maxLength) return;
            event.preventDefault();
            for (const line of lines) enter(line.trim());
        };
        input.addEventListener("paste", (event) => paste(event, event.clipboardData));
        input.addEventListener("drop", (event) => paste(event, event.dataTransfer));
        parts.get("line", HTMLFormElement).addEventListener("submit", (event) => {
            event.preventDefault();
            const line = input.value.trim();
            input.value = "";
            if (line !== "") enter(line);
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
        const said = this.#said;
        const isNew = this.#waiting.length > 0;
        said.append(...this.#waiting.splice(0));
        while (said.childElementCount > LINES) said.firstElementChild?.remove();
        const wasShown = this.#isShown;
        this.#isShown = said.clientHeight > 0;
        if (this.#follows && this.#isShown && (isNew || !wasShown)) said.scrollTop = said.scrollHeight;
    }
}
