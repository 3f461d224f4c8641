// The console: what the machine says, line by line, and a line to type to it. It knows nothing of what the words mean.
//
// It is connected to a `Port`, which may be the virtual Uno's serial line or a real one's.

/** The other end of a serial line. */
export interface Port {
    send(text: string): void;
}

/** Lines that are kept. */
const LINES = 500;

/** Distance from the end, in pixels, up to which the console still follows what is said. */
const AT_THE_END = 8;

export class Console {
    readonly #port: Port;
    readonly #said: HTMLElement;
    readonly #typed: string[] = [];
    /** Which of the typed lines the arrow keys are at. */
    #recalled = 0;
    #partial = "";
    #waiting: HTMLElement[] = [];

    constructor(port: Port, said: HTMLElement, form: HTMLFormElement, input: HTMLInputElement) {
        this.#port = port;
        this.#said = said;
        form.addEventListener("submit", (event) => {
            event.preventDefault();
            const line = input.value.trim();
            input.value = "";
            if (line === "") return;
            this.#recalled = this.#typed.push(line);
            this.type(line);
        });
        input.addEventListener("keydown", (event) => {
            const by = { ArrowUp: -1, ArrowDown: 1 }[event.key];
            if (by === undefined) return;
            event.preventDefault();
            this.#recalled = Math.min(Math.max(this.#recalled + by, 0), this.#typed.length);
            input.value = this.#typed[this.#recalled] ?? "";
        });
    }

    /** Types a line to the machine, as the operator would. */
    type(line: string): void {
        this.#add(`> ${line}`, "typed");
        this.#port.send(`${line}\n`);
    }

    /** Hears what the machine sends, and gives back the lines that are complete. */
    hear(text: string): string[] {
        const lines = (this.#partial + text).split(/\r?\n/);
        this.#partial = lines.pop() ?? "";
        for (const line of lines) this.#add(line, /^(error:|alarm )/.test(line) ? "error" : "");
        return lines;
    }

    /** Shows what has come since the last time. */
    show(): void {
        if (this.#waiting.length === 0) return;
        const said = this.#said;
        const follows = said.scrollHeight - said.scrollTop - said.clientHeight < AT_THE_END;
        said.append(...this.#waiting);
        this.#waiting = [];
        while (said.childElementCount > LINES) said.firstElementChild?.remove();
        if (follows) said.scrollTop = said.scrollHeight;
    }

    #add(line: string, kind: string): void {
        const element = document.createElement("div");
        element.textContent = line;
        element.className = kind;
        this.#waiting.push(element);
    }
}
