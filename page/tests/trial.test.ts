// A trial without a page: the real firmware weeds a row, and what became of each plant is judged; and each thing that can be
// broken in "Try it" does what it does in a field.

import assert from "node:assert/strict";
import test from "node:test";
import hex from "weeder.hex";
import { inWords } from "../src/try/outcome.ts";
import { Trial } from "../src/try/trial.ts";

/** A trial whose firmware has woken up, been told that its settings are right, and some more. */
class Tried {
    readonly trial = new Trial(hex, 7);
    heard = "";

    constructor(...commands: string[]) {
        this.trial.onText = (text) => {
            this.heard += text;
        };
        this.pass(0.5);
        for (const command of ["clear", "events on", ...commands]) this.ask(command);
    }

    pass(seconds: number): void {
        this.trial.advance(seconds, Number.POSITIVE_INFINITY);
    }

    /** Types a command, which is carried out. */
    ask(command: string): void {
        this.heard = "";
        this.trial.uno.send(`${command}\n`);
        this.pass(0.2);
        assert.match(this.heard, /^ok\r$/m, command);
    }

    /** Rolls at a speed until the tool has come to a place. */
    roll(speedKmH: number, toolMm: number): void {
        this.trial.rollAt(speedKmH);
        while (this.trial.machine.toolMm < toolMm) this.pass(0.05);
    }

    get damaged(): number {
        return this.trial.outcome.totals.plants.damaged;
    }
}

test("a row that the real firmware weeds has no plant damaged and no margin cut, and tall weeds are cut", () => {
    const tried = new Tried();
    tried.trial.planting.weedShare = 1;
    tried.trial.work(true);
    tried.roll(2, 6000);
    const { plants, weeds } = tried.trial.outcome.totals;
    assert(plants.kept >= 8, `${plants.kept} plants were passed`);
    assert.deepEqual([plants["margin cut"], plants.damaged], [0, 0]);
    // The others stand on ground that the plants' margins and the servo's way take.
    assert(weeds.passed >= 6 && weeds.cut >= 2, `${weeds.cut} of ${weeds.passed} weeds`);
    assert.match(
        inWords(tried.trial.outcome.totals),
        /^The tool has passed \d+ plants: all kept, with the margin\. Of \d+ tall/,
    );
});

test("without the servo's leads plants are damaged, and that is said", () => {
    const tried = new Tried("set lead_out_ms 0", "set lead_in_ms 0");
    tried.trial.work(true);
    tried.roll(2.5, 3000);
    assert(tried.damaged >= 3, `${tried.damaged} of the plants`);
    assert.match(inWords(tried.trial.outcome.totals), / damaged: the tool was over the canopy\./);
});

test("a plant over which the tool is taken by hand is damaged, and stays so when the machine rolls back and passes it anew", () => {
    const tried = new Tried();
    const [first] = tried.trial.machine.row.things;
    assert(first?.kind === "plant");
    const [beforeMm, behindMm] = [first.placeMm - 200, first.placeMm + 200];
    // Out in hold; in by hand, as the tool is beside the first plant.
    tried.roll(1, first.placeMm - 50);
    tried.ask("servo in");
    tried.ask("servo out");
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.trial.outcome.plants], [[0, "damaged"]]);
    tried.trial.rollAt(-1);
    while (tried.trial.machine.toolMm > beforeMm) tried.pass(0.1);
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.trial.outcome.plants], [[0, "damaged"]]);
});

test("a wheel that slips has each window come late, until the margin is cut", () => {
    const tried = new Tried();
    tried.trial.slipBy(0.2);
    tried.trial.work(true);
    tried.roll(2, 4000);
    const { plants } = tried.trial.outcome.totals;
    // A fifth of the way from beam to tool is 80 mm, which no margin of 50 mm holds.
    assert(plants["margin cut"] + plants.damaged >= 4, inWords(tried.trial.outcome.totals));
});

test("behind a torn beam wire every plant is damaged, and the machine warns of ground without plants", () => {
    const tried = new Tried("set no_plant_m 2");
    tried.trial.work(true);
    tried.trial.machine.tearBeamWire(true);
    tried.roll(2.5, 3500);
    assert(tried.damaged >= 3, `${tried.damaged} of the plants`);
    assert.match(tried.heard, /^warning name=no_plants/m);
});

test("a supply that sags at work takes the tool out until the switch is thrown again, and no plant is damaged", () => {
    const tried = new Tried("save");
    tried.trial.work(true);
    tried.roll(2, 1500);
    tried.trial.uno.reset("brown-out");
    tried.roll(2, 3000);
    assert.match(tried.heard, /reset by brown_out/);
    assert(tried.trial.machine.isClear);
    assert.equal(tried.damaged, 0);
});

test("a machine that rolls too fast has the tool out, and says why", () => {
    const tried = new Tried();
    tried.trial.work(true);
    tried.roll(7, 4000);
    assert.match(tried.heard, /^alarm name=too_fast/m);
    assert(tried.trial.machine.isClear);
    assert.equal(tried.damaged, 0);
});

test("spacing and weeds are sown as they are asked for, ahead of what is sown already", () => {
    const tried = new Tried();
    const sown = tried.trial.machine.row.things.length;
    Object.assign(tried.trial.planting, { spacingMm: 350, weedShare: 0 });
    tried.roll(2.5, 3500);
    const things = tried.trial.machine.row.things.slice(sown);
    assert(things.length >= 8 && things.every(({ kind }) => kind === "plant"));
    const [first, last] = [things[0], things.at(-1)];
    const spacingMm = ((last?.placeMm ?? 0) - (first?.placeMm ?? 0)) / (things.length - 1);
    assert(Math.abs(spacingMm - 350) < 20, `${spacingMm} mm from plant to plant`);
});
