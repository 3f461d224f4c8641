// The machine's settings as a form: name, help, unit, range, and the current and saved values. One button sends and
// saves them. They can be saved to a file and loaded from one.

import { make, type Parts } from "../dom.ts";
import type { Setting } from "../link/console_line.ts";
import { steps as order } from "../link/grammar.ts";
import type { Ask } from "../link/session.ts";
import { parse, range, SettingsFileError, save } from "../link/settings_file.ts";
import { type Plain, reason, say, table, told } from "../words/words.ts";
import { type Machine, sentence } from "./machine.ts";

export class SettingsForm {
    readonly #list: HTMLElement;
    /** The operator's values that the machine does not have yet, by name. */
    readonly #wanted = new Map<string, number>();
    readonly #problems = new Map<string, string>();

    constructor(
        private readonly parts: Parts,
        private readonly machine: Machine,
        private readonly ask: Ask,
        private readonly mayChange: boolean,
    ) {
        this.#list = parts.html("settings-list");
        parts.button("settings-send", () => void this.#send());
        parts.button("settings-undo", () => this.forget());
        parts.button("settings-read", () => void this.#take("get", "areMachines"));
        parts.button("settings-defaults", () => void this.#take("defaults", "defaultsInUse"));
        parts.button("settings-revert", () => void this.#take("revert", "savedInUse"));
        parts.button("settings-save-file", () => save(machine.settings, machine.help));
        parts.files("settings-open-file", "settings-file", ([file]) => file && void this.#open(file));
    }

    forget(): void {
        this.parts.write("settings-said", "");
        this.#undo();
    }

    /** Shows the present values. The operator's changes stay. */
    show(): void {
        // With another wheel the machine drops its calibration: an equal one is sent again after the wheel.
        const isOfWheel = (name: string) =>
            name === "ticks_per_m" && (this.#wanted.has("wheel_mm") || this.#wanted.has("ticks_per_rev"));
        for (const { name, value } of this.machine.settings)
            if (this.#wanted.get(name) === value && !isOfWheel(name)) this.#wanted.delete(name);
        // A field that is being edited keeps its cursor.
        const focused =
            document.activeElement instanceof HTMLElement ? document.activeElement.dataset.setting : undefined;
        this.#list.replaceChildren(...this.machine.settings.map((setting) => this.#row(setting)));
        if (focused) this.#list.querySelector<HTMLElement>(`[data-setting="${focused}"]`)?.focus();
        this.#count();
    }

    /** Saves these values on the machine. Returns whether it has. */
    async putBack(values: ReadonlyMap<string, number>): Promise<boolean> {
        for (const [name, value] of values) this.#wanted.set(name, value);
        this.show();
        return await this.#send();
    }

    #row(setting: Setting): HTMLElement {
        const { name, unit, isSwitched, value, saved, least, greatest } = setting;
        const input = make("input", "");
        input.dataset.setting = name;
        input.disabled = !this.mayChange;
        const wanted = this.#wanted.get(name) ?? value;
        const change = (value: number) => {
            this.#problems.delete(name);
            if (value === setting.value) this.#wanted.delete(name);
            else this.#wanted.set(name, value);
            row.classList.toggle("changed", this.#wanted.has(name));
            this.#count();
        };
        if (isSwitched) {
            input.type = "checkbox";
            input.checked = wanted === 1;
            input.addEventListener("change", () => change(input.checked ? 1 : 0));
        } else {
            Object.assign(input, { type: "number", inputMode: "numeric", min: `${least}`, max: `${greatest}` });
            input.value = String(wanted);
            // As a number, 4.000 would be 4.
            input.addEventListener("input", () => change(/^\d+$/.test(input.value) ? Number(input.value) : Number.NaN));
        }
        const isSaved =
            saved === value
                ? ""
                : `; ${saved === undefined ? say("notSaved") : say("isSaved", { value: shown(setting, saved) })}`;
        const inOwnWords = table.settings?.[name];
        const help = make("span", "", inOwnWords ?? this.machine.help.get(name) ?? "");
        // The machine speaks English.
        if (inOwnWords === undefined) help.lang = "en";
        const label = make(
            "label",
            "",
            make("span", "setting-name", name),
            make("span", "setting-field across", input, make("span", "unit", unit)),
            make("span", "setting-help aside", help, ` (${told(range(setting))}${isSaved})`),
        );
        const row = make("li", this.#wanted.has(name) ? "changed" : "", label);
        const problem = this.#problems.get(name);
        if (problem) row.append(make("p", "problem", told(problem)));
        return row;
    }

    #count(): void {
        const { size } = this.#wanted;
        const isSaved = this.machine.settings.every(({ value, saved }) => value === saved);
        this.parts.get("settings-send", HTMLButtonElement).disabled = size === 0 && isSaved;
        this.parts.get("settings-undo", HTMLButtonElement).disabled = size === 0;
        this.parts.write("settings-send", size === 0 ? say("save") : say("sendAndSave", { count: size }));
    }

    #say(text: () => string): void {
        this.parts.say("settings-said", text);
    }

    #undo(): void {
        this.#wanted.clear();
        this.#problems.clear();
        this.show();
    }

    async #take(command: string, done: Plain): Promise<void> {
        if (!(await this.parts.attempt("settings-said", this.ask(command), () => say(done)))) this.#undo();
    }

    /**
     * Sends the changed values, in an order without intermediate contradictions, and saves them. Nothing is sent if the
     * result contradicts itself. Refusals are shown in the machine's words. Returns whether it is saved.
     */
    async #send(): Promise<boolean> {
        this.#problems.clear();
        const { settings } = this.machine;
        const { contradiction, steps } = order(settings, this.#wanted);
        if (contradiction) {
            this.#say(() => say("nothingSent", { why: sentence(told(contradiction)) }));
            return false;
        }
        for (const [name, value] of steps)
            try {
                const setting = settings.find((setting) => setting.name === name);
                await this.ask(`set ${name} ${setting?.isSwitched ? (value === 1 ? "on" : "off") : value}`);
            } catch (error) {
                this.#problems.set(name, reason(error));
            }
        const { size } = this.#problems;
        const saved = () => say("savedForGood");
        const notSaved = (error: unknown) => say("notSavedWhy", { why: told(error) });
        if (size > 0) this.#say(() => say("refused", { count: size, all: steps.length }));
        const isSaved = size === 0 && !(await this.parts.attempt("settings-said", this.ask("save"), saved, notSaved));
        this.show();
        return isSaved;
    }

    async #open(opened: File): Promise<void> {
        const file = opened.name;
        try {
            const values = parse(await opened.text(), this.machine.settings);
            for (const [name, value] of values) this.#wanted.set(name, value);
            this.show();
            const { size: count } = this.#wanted;
            this.#say(() => (count === 0 ? say("fileSame", { file }) : say("fileDiffers", { file, count })));
        } catch (error) {
            if (!(error instanceof SettingsFileError)) throw error;
            this.#say(() => `${file}, ${told(error)}`);
        }
    }
}

function shown({ isSwitched, unit }: Setting, value: number): string {
    return isSwitched ? (value === 1 ? "on" : "off") : `${value}${unit && ` ${unit}`}`;
}
