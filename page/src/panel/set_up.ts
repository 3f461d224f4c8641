// Setting up the machine: the steps of the manual, the next measurement, and the least margin. The project's Rust has
// the steps, remembers the measurements and calculates the margin (host/page/src/console.rs).

import { module } from "../core.ts";
import { make, type Parts } from "../dom.ts";
import { read } from "../link/grammar.ts";
import type { Ask, Happening } from "../link/session.ts";
import { Rust } from "../rust.ts";
import { quantity, say, step, told } from "../words/words.ts";
import type { Machine } from "./machine.ts";

/** The results of the session for the steps. */
interface Advice {
    readonly steps: readonly { readonly title: string; readonly how: string; readonly tasks: readonly string[] }[];
    /** The next step; null before the first measurement. */
    readonly next: string | null;
    /** The missing measurements for the margin. */
    readonly missing: readonly string[];
    readonly marginMm: number | null;
    readonly warning: string | null;
}

export class SetUp {
    /** An instance for the measurements of this machine. */
    readonly #rust = new Rust(module);
    #marginMm: number | null = null;

    constructor(
        private readonly parts: Parts,
        private readonly machine: Machine,
        ask: Ask,
    ) {
        parts.button("margin-set", () => {
            const set = ask(`set margin_mm ${this.#marginMm}`).then(() => ask("save"));
            void parts.attempt("margin-said", set);
        });
    }

    /** Takes lines about a measurement. */
    take(happening: Happening): void {
        const { is } = happening;
        if (is === "connected" || is === "settings")
            this.show(["servo_in_us", "servo_out_us"].map((name) => `${name}=${this.machine.setting(name)}`));
        else if (is === "command") this.show([`> ${happening.line}`]);
        else if (is === "answer" && read(happening.line).is === "setting") this.show([happening.line]);
        else if (is === "event" && ["calibratedBySwitch", "calibratedByEye", "slip"].includes(happening.event.is))
            this.show([happening.line]);
    }

    /** Shows the steps and their state, after these new lines. */
    show(lines: readonly string[] = []): void {
        const settings = Object.fromEntries(this.machine.settings.map(({ name, value }) => [name, value]));
        const { steps, next, missing, marginMm, warning } = this.#rust.ask<Advice>({ setUp: { lines, settings } });
        this.#marginMm = marginMm;
        this.parts.html("set-up-steps").replaceChildren(
            ...steps.map((manual) => {
                const [title, how] = step(manual.title, manual.how);
                const codes = manual.tasks.flatMap((task) => [" ", make("code", "", task)]);
                return make("li", "", make("b", "", title), ". ", how, ...codes);
            }),
        );
        const before = () => say("beforeMargin", { steps: missing.map((step) => `${told(step)}.`).join(" ") });
        this.parts.write("margin-said", next === null ? before() : say("next", { step: told(next) }));
        this.parts.write("margin-warning", warning === null ? "" : say("warningOf", { what: told(warning) }));
        const button = this.parts.get("margin-set", HTMLButtonElement);
        button.hidden = marginMm === null || marginMm === this.machine.setting("margin_mm");
        if (marginMm !== null) button.textContent = say("setMargin", { margin: quantity(marginMm, "millimeter") });
    }
}
