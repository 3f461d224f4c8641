// The results for each plant and each tall weed of a simulation. The machine judges a thing as soon as its tool is well
// behind it.

import type { Machine, Verdict } from "../row/machine.ts";
import { say } from "../words/words.ts";
import { type NotKept, whyNotKept, type Zone } from "./losses.ts";

export class Outcome {
    /** The verdicts on plants, and whether weeds were cut, by number in the row. */
    readonly plants = new Map<number, Verdict>();
    readonly weeds = new Map<number, boolean>();
    readonly notKept = new Map<number, NotKept>();
    /** The firmware's margin on both sides of a canopy. */
    marginMm = 50;
    /** The firmware's zone of a single plant; 0 for its whole canopy. */
    stemZoneMm = 0;

    /** Judges the things behind the tool, with the firmware's zones. */
    judge(machine: Machine, zones: readonly Zone[]): void {
        for (const [number, fate] of machine.judge(this.marginMm, this.stemZoneMm)) {
            if (typeof fate === "boolean") {
                this.weeds.set(number, fate);
                continue;
            }
            this.plants.set(number, fate);
            const plant = machine.things[number];
            if (fate === "kept" || !plant || this.notKept.has(number)) continue;
            const widthMm = this.stemZoneMm || plant.widthMm;
            this.notKept.set(number, whyNotKept(plant, widthMm, zones, this.marginMm));
        }
    }

    /** How many plants there were of each verdict, and tall weeds, cut and passed. */
    get totals() {
        const plants = { kept: 0, marginCut: 0, reached: 0, damaged: 0 };
        for (const verdict of this.plants.values()) plants[verdict] += 1;
        const cut = [...this.weeds.values()].filter((cut) => cut).length;
        return { plants, weeds: { cut, passed: this.weeds.size } };
    }
}

export function inWords({ plants, weeds }: Outcome["totals"]): string {
    const passed = plants.kept + plants.marginCut + plants.reached + plants.damaged;
    if (passed === 0) return say("noPlantYet");
    const words = [plants.kept === passed ? say("allKept") : say("someKept", { kept: plants.kept })];
    if (plants.marginCut > 0) words.push(say("someCut", { cut: plants.marginCut }));
    if (plants.reached > 0) words.push(say("reached", { count: plants.reached }));
    if (plants.damaged > 0) words.push(say("damaged", { count: plants.damaged }));
    const sentences = [say("passed", { count: passed, rest: words.join("; ") })];
    if (weeds.passed > 0) sentences.push(say("weedsCut", { count: weeds.passed, cut: weeds.cut }));
    return sentences.join(" ");
}
