// The machines at the ports of `weeder serve`, side by side: a panel with its name for each. If there are several, an
// overview is above them: the state of each, and one HOLD for all, with the time until the last one has obeyed.

import { every } from "../clock.ts";
import { make, makeButton } from "../dom.ts";
import { type HeldAll, Served } from "../link/served.ts";
import { ended, inLanguage, quantity, say, show, told } from "../words/words.ts";
import { fault } from "./machine.ts";
import { Panel, TURN_MS } from "./panel.ts";

export async function showServed(into: HTMLElement): Promise<Panel[]> {
    const served = await Served.open();
    const all = make("section", "overview stack");
    inLanguage(() => {
        all.ariaLabel = say("allRows");
    });
    const names = served.machines.map(({ name }) => name);
    const panels: Panel[] = [];
    // A machine that has not obeyed gets HOLD again until it has.
    const holdAll = async () => {
        const held = await served.holdAll().catch((error) => {
            for (const panel of panels) panel.hold();
            throw error;
        });
        for (const [row, { error }] of held.machines.entries()) if (error !== null) panels[row]?.hold();
        return held;
    };
    const showAll = names.length > 1 ? overview(all, names, holdAll) : undefined;
    if (showAll) into.append(all);
    for (const [number, machine] of served.machines.entries()) {
        const { name } = machine;
        const element = make("div", showAll ? "panel stack" : "panel stack alone");
        const section = make("section", "served stack", make("h2", "", name), element);
        section.ariaLabel = name;
        into.append(section);
        const panel = new Panel(element, `served-${number}`, served.allowed, showAll ? name : "");
        // Read out, they say whose parts they are.
        inLanguage(() => {
            for (const part of element.querySelectorAll("section")) part.ariaLabel = `${name}: ${part.ariaLabel}`;
        });
        panel.connect(machine, performance.now());
        machine.onAbsent = (why) => {
            panel.machine.lost = why;
        };
        panels.push(panel);
    }
    served.mayReload = () => !panels.some(({ isNeeded }) => isNeeded);
    every(TURN_MS, () => {
        served.watch();
        for (const panel of panels) panel.turn(performance.now());
        showAll?.(panels);
    });
    const tabs = new BroadcastChannel("served");
    tabs.onmessage = () => {
        served.isBehind = document.hidden;
    };
    const comeToFront = () => {
        if (document.hidden) return;
        served.isBehind = false;
        tabs.postMessage("");
    };
    document.addEventListener("visibilitychange", comeToFront);
    comeToFront();
    served.listen();
    // A tab that is loaded hidden listens once it is in front.
    served.isBehind = document.hidden;
    return panels;
}

/** Fills an element with the overview. A row's name leads to its panel. Returns a function that shows the changes. */
function overview(into: HTMLElement, names: readonly string[], holdAll: () => Promise<HeldAll>) {
    const states = names.map(() => make("span", "overview-state"));
    const rows = states.map((state, row) => {
        const link = makeButton("", () => into.parentElement?.children[row + 1]?.scrollIntoView(), names[row] ?? "");
        return make("li", "stack", link, state);
    });
    const said = make("p", "");
    said.role = "status";
    const hold = makeButton("hold-all", () => {
        show(said, () => say("waitingForAll"));
        holdAll().then(
            (held) => show(said, () => inWords(held)),
            (error) => show(said, () => say("holdFailed", { why: told(error) })),
        );
    });
    show(hold, () => say("holdAll"));
    into.append(make("ul", "stack", ...rows), make("div", "hold-bar stack", said, hold));
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
    return not === "" ? have : `${ended(not)} ${have}`;
}
