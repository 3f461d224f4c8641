// All machines of `weeder serve` at a glance: how each of them is, and one HOLD for all, with the time until the last one has obeyed.

import { make } from "../dom.ts";
import type { HeldAll } from "../link/served.ts";
import { fault } from "./machine.ts";
import type { Panel } from "./panel.ts";

export class Overview {
    readonly #states: HTMLElement[];

    /** Fills an element. A row's name leads to its panel. */
    constructor(into: HTMLElement, names: readonly string[], holdAll: () => Promise<HeldAll>) {
        this.#states = names.map(() => make("span", "overview-state"));
        const rows = this.#states.map((state, row) => {
            const link = make("button", "", names[row] ?? "");
            link.type = "button";
            link.addEventListener("click", () => into.parentElement?.children[row + 1]?.scrollIntoView());
            return make("li", "", link, state);
        });
        const hold = make("button", "hold-all", "HOLD all");
        hold.type = "button";
        const said = make("p", "overview-said");
        said.role = "status";
        hold.addEventListener("click", () => {
            said.textContent = "HOLD: waiting for all to obey.";
            holdAll().then(
                (held) => {
                    said.textContent = told(held);
                },
                (error) => {
                    said.textContent = `HOLD has not come through: ${error instanceof Error ? error.message : error}`;
                },
            );
        });
        into.append(make("ul", "", ...rows), make("div", "hold-bar", said, hold));
    }

    /** Shows what has changed. */
    show(panels: readonly Panel[]): void {
        for (const [row, state] of this.#states.entries()) {
            const machine = panels[row]?.machine;
            if (!machine) continue;
            const word = machine.stateWord;
            const text = word === "alarm" && machine.alarm !== undefined ? `alarm ${fault(machine.alarm).name}` : word;
            if (state.textContent !== text) state.textContent = text;
            const kind = word.replace(" ", "-");
            if (state.dataset.state !== kind) state.dataset.state = kind;
        }
    }
}

/** What came of a HOLD to all, those first that have not obeyed. */
function told({ machines, lastMs }: HeldAll): string {
    const failed = machines.filter(({ error }) => error !== null);
    const obeyed = machines.length - failed.length;
    const time = lastMs === null ? "" : `, the last after ${lastMs} ms`;
    const not = failed.map(({ name, error }) => `${name} NOT: ${error}`).join("; ");
    return `${not === "" ? "" : `${not}. `}HOLD obeyed by ${obeyed} of ${machines.length}${time}.`;
}
