// Setting up the machine: the steps of the manual with their inputs, the next measurement, and the least margin. The project's Rust has
// the steps, remembers the measurements and calculates the margin (host/page/src/console.rs).

import { module } from "../core.ts";
import { make, makeButton, type Parts, plain } from "../dom.ts";
import { steps as order, read } from "../link/grammar.ts";
import type { Ask, Happening } from "../link/session.ts";
import { Rust } from "../rust.ts";
import { ended, language, type Plain, quantity, say, show, table, told } from "../words/words.ts";
import type { Machine } from "./machine.ts";

interface Advice {
    readonly steps: readonly {
        readonly title: string;
        readonly how: string;
        readonly tasks: readonly string[];
        /** Whether settings or measurements show that it is done. */
        readonly isShown: boolean;
        /** Why it is not done, if they show that. */
        readonly open: string | null;
    }[];
    /** The next step; null before the first measurement. */
    readonly next: string | null;
    readonly missing: readonly string[];
    readonly marginMm: number | null;
    readonly warning: string | null;
}

export class SetUp {
    /** An instance for the measurements of this machine. */
    #rust = new Rust(module);
    #marginMm: number | null = null;
    /** The language of the steps that are shown, and their inputs by setting. */
    #language: string | undefined;
    readonly #inputs = new Map<string, HTMLInputElement>();
    /** The mark of each step: a text, or a box where only the operator knows. */
    #marks: readonly (HTMLElement | HTMLInputElement)[] = [];
    /** The steps that the operator has marked, by their places. */
    readonly #marked = new Set<number>();

    constructor(
        private readonly parts: Parts,
        private readonly machine: Machine,
        private readonly ask: Ask,
    ) {
        parts.button("margin-set", () => {
            const set = ask(`set margin_mm ${this.#marginMm}`).then(() => ask("save"));
            void parts.attempt("margin-said", set);
        });
    }

    /** Begins again, for another machine. */
    forget(): void {
        this.#rust = new Rust(module);
        this.#marked.clear();
        this.#language = undefined;
        this.show();
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
        // Built once for each language, because the operator may be typing.
        if (this.#language !== language) this.#build(steps);
        for (const [name, input] of this.#inputs)
            if (input.dataset.typed === undefined) input.value = String(this.machine.setting(name));
        let done = 0;
        this.#marks.forEach((mark, at) => {
            const open = steps[at]?.open ?? null;
            const isDone = mark instanceof HTMLInputElement ? this.#marked.has(at) : open === null;
            if (isDone) done++;
            if (mark instanceof HTMLInputElement) mark.checked = isDone;
            else mark.textContent = open === null ? say("stepDone") : say("stepOpen", { what: plain(told(open)) });
        });
        const isAll = done === steps.length ? ` ${say("readWork")}` : "";
        this.parts.write("set-up-done", say("stepsDone", { done, all: steps.length }) + isAll);
        const before = () => say("beforeMargin", { steps: missing.map((step) => ended(told(step))).join(" ") });
        this.parts.write("margin-said", next === null ? before() : say("next", { step: told(next) }));
        this.parts.write("margin-warning", warning === null ? "" : say("warningOf", { what: told(warning) }));
        const button = this.parts.get("margin-set", HTMLButtonElement);
        button.hidden = marginMm === null || marginMm === this.machine.setting("margin_mm");
        if (marginMm !== null) button.textContent = say("setMargin", { margin: quantity(marginMm, "millimeter") });
    }

    #build(steps: Advice["steps"]): void {
        this.#language = language;
        this.#inputs.clear();
        this.#marks = steps.map((manual, at) => (manual.isShown ? make("p", "aside") : this.#box(at)));
        this.parts.html("set-up-steps").replaceChildren(
            ...steps.map((manual, at) => {
                const text = table.steps?.[manual.title] ?? `${manual.title}. ${manual.how}`;
                const [title = ""] = text.split(/[.।]/, 1);
                const mark = this.#marks[at] ?? "";
                return make(
                    "li",
                    "stack",
                    make("span", "", make("b", "", title), text.slice(title.length)),
                    ...this.#tasks(manual.tasks),
                    manual.isShown ? mark : make("label", "", mark, say("markDone")),
                );
            }),
        );
    }

    #box(at: number): HTMLInputElement {
        const box = make("input", "");
        box.type = "checkbox";
        box.addEventListener("change", () => {
            if (box.checked) this.#marked.add(at);
            else this.#marked.delete(at);
            this.show();
        });
        return box;
    }

    #tasks(tasks: readonly string[]): HTMLElement[] {
        const said = make("p", "");
        said.role = "status";
        const does = (text: string, use: () => Promise<unknown>, done: Plain) => {
            const button = makeButton("needs-machine", () => {
                use().then(
                    () => show(said, () => say(done)),
                    (error) => show(said, () => told(error)),
                );
            });
            button.textContent = text;
            button.disabled = this.machine.version === undefined;
            return button;
        };
        const names: string[] = [];
        const parts: HTMLElement[] = tasks.flatMap((task) => {
            if (task === "calibrate servo") return [does(say("swingSix"), () => this.ask(task), "swingsSix")];
            const [, name, unit] = /^(\w+) = \d+ (\S*)$/.exec(task) ?? [];
            if (name === undefined) return /^[\w.]+ = /.test(task) ? [make("code", "", task)] : [];
            names.push(name);
            const input = make("input", "");
            [input.type, input.inputMode, input.dataset.step] = ["number", "numeric", name];
            input.addEventListener("input", () => {
                input.dataset.typed = "";
            });
            this.#inputs.set(name, input);
            return [make("label", "", make("span", "", unit ? `${name} (${unit})` : name), input)];
        });
        if (names.length > 0) parts.push(does(say("setAndSave"), () => this.#save(names), "isSavedNow"));
        return [...parts, said];
    }

    /**
     * Saves a step's values, in an order without intermediate contradictions. If the result contradicts itself, nothing is sent: a part
     * of a step can be worse than none.
     */
    async #save(names: readonly string[]): Promise<void> {
        const typed = [...this.#inputs].filter(([name, { dataset }]) => names.includes(name) && "typed" in dataset);
        // The machine says what would be right.
        const wrong = typed.find(([name, input]) => {
            const setting = this.machine.settings.find((setting) => setting.name === name);
            const value = /^\d+$/.test(input.value) ? Number(input.value) : Number.NaN;
            return setting && !(setting.least <= value && value <= setting.greatest);
        });
        if (wrong) await this.ask(`set ${wrong[0]} ${wrong[1].value}`);
        const wanted = new Map(typed.map(([name, input]) => [name, Number(input.value)]));
        const { contradiction, steps } = order(this.machine.settings, wanted);
        // Settings that already contradict each other are corrected one at a time.
        const isContradicted = order(this.machine.settings, new Map()).contradiction !== undefined;
        if (contradiction && !isContradicted) throw new Error(contradiction);
        for (const [name, value] of contradiction ? wanted : steps) await this.ask(`set ${name} ${value}`);
        for (const [, input] of typed) delete input.dataset.typed;
        await this.ask("save");
    }
}
