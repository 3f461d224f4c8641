// A trial without a page: the real firmware weeds a row, and each plant gets its verdict. Each fault of "Try it" has
// the effect that it has in a field.

import assert from "node:assert/strict";
import test from "node:test";
import { hex } from "../src/core.ts";
import { isEvent, read } from "../src/link/grammar.ts";
import { LineReader } from "../src/link/session.ts";
import { inWords } from "../src/try/outcome.ts";
import { Trial } from "../src/try/trial.ts";

/**
 * A trial after the firmware's start, with its missing settings confirmed, and some commands. It reads the firmware's
 * output, as the page's does.
 */
class Tried {
    readonly trial = new Trial(hex, 7);
    heard = "";

    constructor(...commands: string[]) {
        const lines = new LineReader();
        this.trial.onText = (text) => {
            this.heard += text;
            for (const line of lines.take(text)) {
                const said = read(line);
                if (said.is === "status") this.trial.take({ is: "status", status: said, line });
                else if (isEvent(said)) this.trial.take({ is: "event", event: said, line });
            }
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

    /** Rolls at a speed until the tool has reached a position. */
    roll(speedKmH: number, toolMm: number): void {
        this.trial.machine.change({ speedKmH });
        while (this.trial.machine.toolMm < toolMm) {
            this.trial.uno.send("status\n");
            this.pass(0.05);
        }
    }

    /** The distinct reasons why plants were not kept. */
    get notKept(): string[] {
        return [...new Set(this.trial.outcome.notKept.values())];
    }

    /** Plants whose keep-out zone was reached, damaged ones included. */
    get reached(): number {
        const { reached, damaged } = this.trial.outcome.totals.plants;
        return reached + damaged;
    }
}

test("a row that the real firmware weeds has no plant damaged and no margin cut, and tall weeds are cut", () => {
    const tried = new Tried();
    tried.trial.machine.change({ weedShare: 1 });
    tried.trial.work(true);
    tried.roll(2, 6000);
    const { plants, weeds } = tried.trial.outcome.totals;
    assert(plants.kept >= 8, `${plants.kept} plants were passed`);
    assert.deepEqual([plants.marginCut, plants.reached, plants.damaged], [0, 0, 0]);
    // The others stand on ground that the plants' margins and the servo's time take.
    assert(weeds.passed >= 6 && weeds.cut >= 2, `${weeds.cut} of ${weeds.passed} weeds`);
    assert.match(
        inWords(tried.trial.outcome.totals),
        /^The tool has passed \d+ plants: all kept, with the margin\. Of \d+ tall/,
    );
    const { machine, losses, outcome, why } = tried.trial;
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
    tried.trial.work(true);
    tried.roll(2.5, 3000);
    assert(tried.reached >= 3, `${tried.reached} of the plants`);
    assert.match(inWords(tried.trial.outcome.totals), / zone reached| damaged: the tool was at the stem/);
    assert.deepEqual(tried.notKept, ["late"]);
    assert.match(tried.trial.why, /^Why plants were not kept: \d+ the swing was late or early for this speed\./);
});

test("a plant is damaged if the tool is driven over it directly, and stays damaged when the machine rolls back and passes it again", () => {
    const tried = new Tried();
    const [first] = tried.trial.machine.things;
    assert(first?.kind === "plant");
    const [beforeMm, behindMm] = [first.placeMm - 200, first.placeMm + 200];
    // Out in hold; driven in directly when the tool is beside the first plant.
    tried.roll(1, first.placeMm - 50);
    tried.trial.machine.change({ speedKmH: 0 });
    tried.pass(2);
    tried.ask("servo in");
    tried.ask("servo out");
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.trial.outcome.plants], [[0, "damaged"]]);
    tried.trial.machine.change({ speedKmH: -1 });
    while (tried.trial.machine.toolMm > beforeMm) tried.pass(0.1);
    tried.roll(1, behindMm);
    assert.deepEqual([...tried.trial.outcome.plants], [[0, "damaged"]]);
});

test("a wheel that slips has each window come late, until the margin is cut", () => {
    const tried = new Tried();
    tried.trial.machine.change({ slip: 0.2 });
    tried.trial.work(true);
    tried.roll(2, 4000);
    const { plants } = tried.trial.outcome.totals;
    // A fifth of the distance from beam to tool is 80 mm, more than a margin of 50 mm.
    assert(plants.marginCut + plants.reached + plants.damaged >= 4, inWords(tried.trial.outcome.totals));
    assert.deepEqual(tried.notKept, ["off"]);
});

test("behind a torn beam wire every plant is damaged, and the machine warns of ground without plants", () => {
    const tried = new Tried("set no_plant_m 2");
    tried.trial.work(true);
    tried.trial.machine.change({ beamWireTorn: true });
    tried.roll(2.5, 3500);
    assert(tried.reached >= 3, `${tried.reached} of the plants`);
    assert.match(tried.heard, /^warning name=no_plants/m);
    assert.deepEqual(tried.notKept, ["unseen"]);
});

test("a supply that sags at work takes the tool out until the switch is thrown again, and no plant is damaged", () => {
    const tried = new Tried("save");
    tried.trial.work(true);
    tried.roll(2, 1500);
    tried.trial.uno.reset("brown-out");
    tried.roll(2, 3000);
    assert.match(tried.heard, /reset by brown_out/);
    assert(tried.trial.machine.isClear);
    assert.equal(tried.reached, 0);
});

test("a machine that rolls too fast has the tool out, and says why", () => {
    const tried = new Tried();
    tried.trial.work(true);
    tried.roll(7, 4000);
    assert.match(tried.heard, /^alarm code=3-1 name=too_fast/m);
    assert(tried.trial.machine.isClear);
    assert.equal(tried.reached, 0);
});

test("spacing and weeds are sown as they are asked for, ahead of what is sown already", () => {
    const tried = new Tried();
    const sown = tried.trial.machine.things.length;
    tried.trial.machine.change({ spacingMm: 350 });
    tried.trial.machine.change({ weedShare: 0 });
    tried.roll(2.5, 3500);
    const things = tried.trial.machine.things.slice(sown);
    assert(things.length >= 8 && things.every(({ kind }) => kind === "plant"));
    const [first, last] = [things[0], things.at(-1)];
    const spacingMm = ((last?.placeMm ?? 0) - (first?.placeMm ?? 0)) / (things.length - 1);
    assert(Math.abs(spacingMm - 350) < 20, `${spacingMm} mm from plant to plant`);
});
