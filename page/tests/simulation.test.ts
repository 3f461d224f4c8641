// A simulation without a page: the real firmware weeds a row, and each plant gets its verdict. Each fault of "Try it" has
// the effect that it has in a field.

import assert from "node:assert/strict";
import test from "node:test";
import { hex } from "../src/core.ts";
import { read } from "../src/link/grammar.ts";
import { inWords } from "../src/try/outcome.ts";
import { Simulation } from "../src/try/simulation.ts";

/**
 * A simulation after the firmware's start, with its missing settings confirmed, and some commands. It reads the firmware's
 * output, as the page's does.
 */
class Tried {
    readonly simulation = new Simulation(hex, 7);
    heard = "";

    constructor(...commands: string[]) {
        let partial = "";
        this.simulation.onText = (text) => {
            this.heard += text;
            const lines = (partial + text).split(/[\r\n]+/);
            partial = lines.pop() ?? "";
            for (const line of lines) {
                const said = read(line);
                if (said.is === "status") this.simulation.take({ is: "status", status: said, line });
                else if ("isEvent" in said) this.simulation.take({ is: "event", event: said, line });
            }
        };
        this.pass(0.5);
        for (const command of ["clear", "events on", ...commands]) this.ask(command);
    }

    pass(seconds: number): void {
        this.simulation.advance(seconds, Number.POSITIVE_INFINITY);
    }

    /** Types a command, which is carried out. */
    ask(command: string): void {
        this.heard = "";
        this.simulation.uno.send(`${command}\n`);
        this.pass(0.2);
        assert.match(this.heard, /^ok\r$/m, command);
    }

    /** Rolls at a speed until the tool has reached a position. */
    roll(speedKmH: number, toolMm: number): void {
        this.simulation.machine.change({ speedKmH });
        while (this.simulation.machine.toolMm < toolMm) {
            this.simulation.uno.send("status\n");
            this.pass(0.05);
        }
    }

    /** The distinct reasons why plants were not kept. */
    get notKept(): string[] {
        return [...new Set(this.simulation.outcome.notKept.values())];
    }

    /** Plants whose keep-out zone was reached, damaged ones included. */
    get reached(): number {
        const { reached, damaged } = this.simulation.outcome.totals.plants;
        return reached + damaged;
    }
}

test("a row that the real firmware weeds has no plant damaged and no margin cut, and tall weeds are cut", () => {
    const tried = new Tried();
    tried.simulation.machine.change({ weedShare: 1 });
    tried.simulation.work(true);
    tried.roll(2, 6000);
    const { plants, weeds } = tried.simulation.outcome.totals;
    assert(plants.kept >= 8, `${plants.kept} plants were passed`);
    assert.deepEqual([plants.marginCut, plants.reached, plants.damaged], [0, 0, 0]);
    // The others stand on ground that the plants' margins and the servo's time take.
    assert(weeds.passed >= 6 && weeds.cut >= 2, `${weeds.cut} of ${weeds.passed} weeds`);
    assert.match(
        inWords(tried.simulation.outcome.totals),
        /^The tool has passed \d+ plants: all kept, with the margin\. Of \d+ tall/,
    );
    const { machine, losses, outcome, why } = tried.simulation;
    const rolledMm = machine.toolMm + machine.dimensions.beamToToolMm;
    const sumMm = Object.values(losses.groundMm).reduce((sum, mm) => sum + mm, 0);
    assert(Math.abs(sumMm - rolledMm) < 1, `${sumMm} of ${rolledMm} mm`);
    for (const part of ["weeded", "plants", "margins", "swings", "closed"] as const)
        assert(losses.groundMm[part] > rolledMm / 100, `${part}: ${why}`);
    const left = [...outcome.weeds].filter(([, cut]) => !cut);
    assert(left.length > 0 && left.every(([number]) => losses.below.get(number) !== "weeded"), why);
    assert.match(
        why,
        /^Left: \d+ (beside a plant|where the tool swung|classified as a plant).* Of the ground: (2[5-9]|[3-9]\d)% weeded, /,
    );
});

test("without the servo's leads zones are reached, and that is said", () => {
    const tried = new Tried("set lead_out_ms 0", "set lead_in_ms 0");
    tried.simulation.work(true);
    tried.roll(2.5, 3000);
    assert(tried.reached >= 3, `${tried.reached} of the plants`);
    assert.match(inWords(tried.simulation.outcome.totals), / zone reached| damaged: the tool was at the stem/);
    assert.deepEqual(tried.notKept, ["late"]);
    assert.match(tried.simulation.why, /^Why plants were not kept: \d+ the swing was late or early for this speed\./);
});

test("a plant is damaged if the tool is driven over it directly, and stays damaged when the machine rolls back and passes it again", () => {
    const tried = new Tried();
    const [first] = tried.simulation.machine.things;
    assert(first?.kind === "plant");
    const [beforeMm, behindMm] = [first.placeMm - 200, first.placeMm + 200];
    // Out in hold; driven in directly when the tool is beside the first plant.
    tried.roll(1, first.placeMm - 50);
    tried.simulation.machine.change({ speedKmH: 0 });
    tried.pass(2);
    tried.ask("servo in");
    tried.ask("servo out");
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.simulation.outcome.plants], [[0, "damaged"]]);
    tried.simulation.machine.change({ speedKmH: -1 });
    while (tried.simulation.machine.toolMm > beforeMm) tried.pass(0.1);
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.simulation.outcome.plants], [[0, "damaged"]]);
});

test("a wheel that slips has each window come late, until the margin is cut", () => {
    const tried = new Tried();
    tried.simulation.machine.change({ slip: 0.2 });
    tried.simulation.work(true);
    tried.roll(2, 4000);
    const { plants } = tried.simulation.outcome.totals;
    // A fifth of the distance from beam to tool is 80 mm, more than a margin of 50 mm.
    assert(plants.marginCut + plants.reached + plants.damaged >= 4, inWords(tried.simulation.outcome.totals));
    assert.deepEqual(tried.notKept, ["off"]);
});

test("behind a torn beam wire every plant is damaged, and the machine warns of ground without plants", () => {
    const tried = new Tried("set no_plant_m 2");
    tried.simulation.work(true);
    tried.simulation.machine.change({ beamWireTorn: true });
    tried.roll(2.5, 3500);
    assert(tried.reached >= 3, `${tried.reached} of the plants`);
    assert.match(tried.heard, /^warning name=no_plants/m);
    assert.deepEqual(tried.notKept, ["unseen"]);
});

test("a supply that sags at work takes the tool out until the switch is thrown again, and no plant is damaged", () => {
    const tried = new Tried("save");
    tried.simulation.work(true);
    tried.roll(2, 1500);
    tried.simulation.uno.reset("brown-out");
    tried.roll(2, 3000);
    assert.match(tried.heard, /reset by brown_out/);
    assert(tried.simulation.machine.isClear);
    assert.equal(tried.reached, 0);
});

test("a machine that rolls too fast has the tool out, and says why", () => {
    const tried = new Tried();
    tried.simulation.work(true);
    tried.roll(7, 4000);
    assert.match(tried.heard, /^alarm code=3-1 name=too_fast/m);
    assert(tried.simulation.machine.isClear);
    assert.equal(tried.reached, 0);
});

test("spacing and weeds are sown as they are asked for, ahead of what is sown already", () => {
    const tried = new Tried();
    const sown = tried.simulation.machine.things.length;
    tried.simulation.machine.change({ spacingMm: 350 });
    tried.simulation.machine.change({ weedShare: 0 });
    tried.roll(2.5, 3500);
    const things = tried.simulation.machine.things.slice(sown);
    assert(things.length >= 8 && things.every(({ kind }) => kind === "plant"));
    const [first, last] = [things[0], things.at(-1)];
    const spacingMm = ((last?.placeMm ?? 0) - (first?.placeMm ?? 0)) / (things.length - 1);
    assert(Math.abs(spacingMm - 350) < 20, `${spacingMm} mm from plant to plant`);
});
