// The machines at the ports of `weeder serve`, side by side: a panel with its name for each. If there are several, an
// overview is above them.

import { make } from "../dom.ts";
import { Served } from "../link/served.ts";
import { inLanguage, say } from "../words/words.ts";
import { overview } from "./overview.ts";
import { Panel } from "./panel.ts";

/** Time between two turns. */
const TURN_MS = 20;

/** Fills an element with the machines' panels, and returns these. */
export async function showServed(into: HTMLElement): Promise<Panel[]> {
    const served = await Served.open();
    const all = make("section", "overview");
    inLanguage(() => {
        all.ariaLabel = say("allRows");
    });
    const names = served.machines.map(({ name }) => name);
    const showAll = names.length > 1 ? overview(all, names, () => served.holdAll()) : undefined;
    if (showAll) into.append(all);
    const panels = served.machines.map((machine, number) => {
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
        return panel;
    });
    setInterval(() => {
        served.watch();
        for (const panel of panels) panel.turn(performance.now());
        showAll?.(panels);
    }, TURN_MS);
    served.listen();
    return panels;
}
