// The machine's settings as a form: name, help, unit, range, what is in use and what is saved; sent and saved by one button,
// kept in a file and taken from one.

import { download, make, type Parts } from "../dom.ts";
import { steps as order, type Setting } from "../link/grammar.ts";
import type { Ask } from "../link/session.ts";
import { parse, range, SettingsFileError, write } from "../link/settings_file.ts";
import { type Machine, sentence } from "./machine.ts";

export class SettingsForm {
    readonly #parts: Parts;
    readonly #machine: Machine;
    readonly #ask: Ask;
    readonly #list: HTMLElement;
    readonly #mayChange: boolean;
    /** What the operator wants and the machine does not have, by name. */
    readonly #wanted = new Map<string, number>();
    readonly #problems = new Map<string, string>();

    constructor(parts: Parts, machine: Machine, ask: Ask, mayChange: boolean) {
        [this.#parts, this.#machine, this.#ask, this.#mayChange] = [parts, machine, ask, mayChange];
        this.#list = parts.html("settings-list");
        parts.button("settings-send", () => void this.#send());
        parts.button("settings-undo", () => this.#undo());
        parts.button("settings-read", () => void this.#read());
        parts.button(
            "settings-defaults",
            () => void this.#take("defaults", "The defaults are in use. They are not saved yet."),
        );
        parts.button("settings-revert", () => void this.#take("revert", "The saved settings are in use."));
        parts.button("settings-save-file", () =>
            download("machine.toml", write(machine.settings, machine.help), "application/toml"),
        );
        const file = parts.get("settings-file", HTMLInputElement);
        parts.button("settings-open-file", () => file.click());
        file.addEventListener("change", () => void this.#open(file));
    }

    /** Shows what is known now; what the operator has changed stays. */
    show(): void {
        for (const { name, value } of this.#machine.settings)
            if (this.#wanted.get(name) === value) this.#wanted.delete(name);
        // A field that is being typed in keeps its cursor.
        const focused =
            document.activeElement instanceof HTMLElement ? document.activeElement.dataset.setting : undefined;
        this.#list.replaceChildren(...this.#machine.settings.map((setting) => this.#row(setting)));
        if (focused) this.#list.querySelector<HTMLElement>(`[data-setting="${focused}"]`)?.focus();
        this.#count();
    }

    #row(setting: Setting): HTMLElement {
        const { name, unit, isSwitched, value, saved, least, greatest } = setting;
        const input = make("input", "");
        input.dataset.setting = name;
        input.disabled = !this.#mayChange;
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
            Object.assign(input, {
                type: "number",
                inputMode: "numeric",
                step: "1",
                min: `${least}`,
                max: `${greatest}`,
            });
            input.value = String(wanted);
            input.addEventListener("input", () => change(input.value === "" ? Number.NaN : input.valueAsNumber));
        }
        const isSaved =
            saved === value ? "" : saved === undefined ? "; not saved" : `; ${shown(setting, saved)} is saved`;
        const label = make(
            "label",
            "",
            make("span", "setting-name", name),
            make("span", "setting-field", input, make("span", "unit", unit)),
            make("span", "setting-help", `${this.#machine.help.get(name) ?? ""} (${range(setting)}${isSaved})`),
        );
        const row = make("li", this.#wanted.has(name) ? "changed" : "", label);
        const problem = this.#problems.get(name);
        if (problem) row.append(make("p", "problem", problem));
        return row;
    }

    #count(): void {
        const { size } = this.#wanted;
        this.#parts.get("settings-send", HTMLButtonElement).disabled = size === 0 && !this.#isUnsaved;
        this.#parts.get("settings-undo", HTMLButtonElement).disabled = size === 0;
        this.#parts.write(
            "settings-send",
            size === 0 ? "Save" : size === 1 ? "Send 1 change and save" : `Send ${size} changes and save`,
        );
    }

    get #isUnsaved(): boolean {
        return this.#machine.settings.some(({ value, saved }) => value !== saved);
    }

    #say(text: string): void {
        this.#parts.write("settings-said", text);
    }

    #undo(): void {
        this.#wanted.clear();
        this.#problems.clear();
        this.#say("");
        this.show();
    }

    async #read(): Promise<void> {
        await this.#take("get", "These are the machine's.");
    }

    async #take(command: string, said: string): Promise<void> {
        try {
            await this.#ask(command);
            this.#undo();
            this.#say(said);
        } catch (error) {
            this.#say(String(error instanceof Error ? error.message : error));
        }
    }

    /**
     * Sends what was changed, in an order in which no value contradicts one that is yet to be sent, and saves it. What contradicts
     * itself in the end is not sent; what the machine refuses is shown with its words.
     */
    async #send(): Promise<void> {
        this.#problems.clear();
        const { settings } = this.#machine;
        const { contradiction, steps } = order(settings, this.#wanted);
        if (contradiction) {
            this.#say(`${sentence(contradiction)} Nothing was sent.`);
            return;
        }
        for (const [name, value] of steps)
            try {
                const setting = settings.find((setting) => setting.name === name);
                await this.#ask(`set ${name} ${setting?.isSwitched ? (value === 1 ? "on" : "off") : value}`);
            } catch (error) {
                this.#problems.set(name, error instanceof Error ? error.message : String(error));
            }
        const { size } = this.#problems;
        if (size > 0) this.#say(`${size} of ${steps.length} were refused, and nothing is saved: see there.`);
        else
            try {
                await this.#ask("save");
                this.#say("Saved: they are there after a reset, and without power.");
            } catch (error) {
                this.#say(`Not saved: ${error instanceof Error ? error.message : error}`);
            }
        this.show();
    }

    async #open(file: HTMLInputElement): Promise<void> {
        const chosen = file.files?.[0];
        file.value = "";
        if (!chosen) return;
        try {
            const values = parse(await chosen.text(), this.#machine.settings);
            for (const [name, value] of values) this.#wanted.set(name, value);
            this.show();
            const { size } = this.#wanted;
            this.#say(
                size === 0
                    ? `${chosen.name} says what the machine has already.`
                    : `${chosen.name}: ${size} differ from the machine's. Look at them, then send them.`,
            );
        } catch (error) {
            if (!(error instanceof SettingsFileError)) throw error;
            this.#say(`${chosen.name}, ${error.message}`);
        }
    }
}

function shown({ isSwitched, unit }: Setting, value: number): string {
    return isSwitched ? (value === 1 ? "on" : "off") : `${value}${unit && ` ${unit}`}`;
}
