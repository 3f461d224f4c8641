// The overview of all machines of `weeder serve`: the state of each, and one HOLD for all, with the time until the last
// one has obeyed.

import { make } from "../dom.ts";
import type { HeldAll } from "../link/served.ts";
import { quantity, say, show, told } from "../words/words.ts";
import { fault } from "./machine.ts";
import type { Panel } from "./panel.ts";

/** Fills an element. A row's name leads to its panel. Returns a function that shows the changes. */
export function overview(into: HTMLElement, names: readonly string[], holdAll: () => Promise<HeldAll>) {
    const states = names.map(() => make("span", "overview-state"));
    const rows = states.map((state, row) => {
        const link = make("button", "", names[row] ?? "");
        link.type = "button";
        link.addEventListener("click", () => into.parentElement?.children[row + 1]?.scrollIntoView());
        return make("li", "", link, state);
    });
    const hold = make("button", "hold-all");
    hold.type = "button";
    show(hold, () => say("holdAll"));
    const said = make("p", "overview-said");
    said.role = "status";
    hold.addEventListener("click", () => {
        show(said, () => say("waitingForAll"));
        holdAll().then(
            (held) => show(said, () => inWords(held)),
            (error) => show(said, () => say("holdFailed", { why: told(error) })),
        );
    });
    into.append(make("ul", "", ...rows), make("div", "hold-bar", said, hold));
    return (panels: readonly Panel[]) => {
        for (const [row, state] of states.entries()) {
            const machine = panels[row]?.machine;
            if (!machine) continue;
            const { alarm, stateWord: word } = machine;
            const text = machine.state === "alarm" && alarm !== undefined ? `${word} ${fault(alarm).title}` : word;
            if (state.textContent !== text) state.textContent = text;
            if (state.dataset.state !== machine.state) state.dataset.state = machine.state;
        }
    };
}

/** The result of a HOLD to all. Machines that have not obeyed come first. */
function inWords({ machines, lastMs }: HeldAll): string {
    const failed = machines.filter(({ error }) => error !== null);
    const obeyed = machines.length - failed.length;
    const not = failed.map(({ name, error }) => say("notObeyed", { name, why: told(error ?? "") })).join("; ");
    const all = machines.length;
    const have =
        lastMs === null
            ? say("obeyed", { obeyed, all })
            : say("obeyedAfter", { obeyed, all, time: quantity(lastMs, "millisecond") });
    return `${not === "" ? "" : `${not}. `}${have}`;
}
