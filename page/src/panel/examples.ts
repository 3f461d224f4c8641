// Teaching: two buttons label the last detection. Below are the taught examples.

import { make, makeButton, type Parts } from "../dom.ts";
import type { Line } from "../link/console_line.ts";
import { linesOf } from "../link/grammar.ts";
import { type Ask, mayForce } from "../link/session.ts";
import { quantity, say } from "../words/words.ts";
import type { Machine } from "./machine.ts";

/** Number of slots for taught examples. */
const PLACES = 32;

type Label = "plant" | "weed";

export class Examples {
    /** The last refusal that can be insisted on, and its detection: the firmware labels the newest one. */
    #refusal: { readonly label: Label; readonly of: Line<"detection"> | undefined } | undefined;

    constructor(
        private readonly parts: Parts,
        private readonly machine: Machine,
        private readonly ask: Ask,
    ) {
        parts.button("teach-plant", () => void this.#teach("plant", ""));
        parts.button("teach-weed", () => void this.#teach("weed", ""));
        parts.button("teach-force", () => this.#refused && void this.#teach(this.#refused, " force"));
        parts.button("examples-read", () => void parts.attempt("teach-said", this.#read()));
        parts.button("examples-forget", () => void this.#forget("all"));
    }

    /** The label to insist on, while no other detection is the last one. */
    get #refused(): Label | undefined {
        const [last] = this.machine.objects;
        return last && last === this.#refusal?.of ? this.#refusal.label : undefined;
    }

    show(): void {
        const [last] = this.machine.objects;
        this.parts.html("teach-force").hidden = this.#refused === undefined;
        const width = quantity(last ? this.machine.widthMm(last) : 0, "millimeter");
        const seen = last && say("lastObject", { class: say(last.class), width, count: last.votes });
        this.parts.write("last-object", seen ?? say("nothingSeen"));
    }

    showExamples(): void {
        const field = linesOf("example", this.machine.examples).filter(({ fromField }) => fromField);
        this.parts.write("examples-count", say("places", { count: field.length, all: PLACES }));
        this.parts.html("examples-list").replaceChildren(
            ...field.map(({ number, label }) => {
                const forget = makeButton("needs-change", () => this.#forget(String(number)), say("forget"));
                forget.ariaLabel = say("forgetOne", { number });
                return make("li", "across", make("span", "", `${number}: ${say(label)}`), forget);
            }),
        );
        this.parts.get("examples-forget", HTMLButtonElement).disabled = field.length === 0;
    }

    async #teach(label: Label, force: string): Promise<void> {
        const taught = () => {
            const what = say(label === "plant" ? "wasPlant" : "wasWeed");
            return say("taughtThat", { what: `${what.charAt(0).toLowerCase()}${what.slice(1)}` });
        };
        const [of] = this.machine.objects;
        const error = await this.parts.attempt("teach-said", this.ask(`label ${label}${force}`), taught);
        this.#refusal = mayForce(error) ? { label, of } : undefined;
        this.parts.say("teach-force", () => say("isClass", { class: say(label) }));
    }

    #forget(which: string): Promise<unknown> {
        return this.parts.attempt("teach-said", this.ask(`forget ${which}`));
    }

    async #read(): Promise<void> {
        this.machine.examples = await this.ask("examples");
        this.showExamples();
    }
}
