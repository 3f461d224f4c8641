// "Try it" in a real browser: the real firmware weeds a row in the page, and shows faults that are made on the same panel that
// works with a real Uno.

import assert from "node:assert/strict";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright-core";
import { close, DESK, inspect, launch, type Opened, open, PHONE } from "./browser.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

const part = (page: Page, name: string) => page.locator(`#try-panel [data-part="${name}"]`);

/** Opens "Try it", and waits until its settings are saved and it holds: a switch that is thrown before that does nothing. */
async function tryIt(viewport = DESK): Promise<Opened> {
    const opened = await open(browser, "try", viewport);
    await pass(opened.page, 0.5);
    await part(opened.page, "said")
        .locator("div", { hasText: /clear$/ })
        .waitFor();
    await pass(opened.page, 0.3);
    await part(opened.page, "state").filter({ hasText: "hold" }).waitFor();
    return opened;
}

/** Lets time pass in the page until the tool has come to a place along the row, as fast as this machine can. */
async function rollTo(page: Page, toolMm: number): Promise<void> {
    while (await page.evaluate((mm) => globalThis.trial.machine.toolMm < mm, toolMm)) await pass(page, 0.5);
}

/** Lets so much time pass on the chip. */
async function pass(page: Page, seconds: number): Promise<void> {
    await page.evaluate((seconds) => globalThis.trial.advance(seconds, Number.POSITIVE_INFINITY), seconds);
}

/** Types a command and waits for what the machine says to it: an answer like this behind the command itself, which is shown anew. */
async function type(page: Page, command: string, answer: RegExp): Promise<void> {
    const typed = part(page, "said").locator("div", { hasText: new RegExp(`^> ${command}$`) });
    const before = await typed.count();
    await part(page, "typed").fill(command);
    await page.locator("#try-panel").getByRole("button", { name: "Send" }).click();
    await pass(page, 0.2);
    await typed.nth(before).locator("xpath=following-sibling::div").filter({ hasText: answer }).first().waitFor();
}

test("the page weeds a row with the real firmware, no plant is damaged, and it says so", async () => {
    const opened = await tryIt();
    const { page } = opened;
    await page.getByLabel("Work switch").check();
    await pass(page, 0.2);
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await rollTo(page, 4000);
    const { plants, passed, worked, shapes, free } = await page.evaluate(() => ({
        plants: globalThis.trial.outcome.totals.plants,
        passed: globalThis.trial.outcome.plants.size,
        worked: globalThis.trial.track.filter(({ acrossMm }) => acrossMm < 1).length,
        // Plants of this stretch round which the firmware's window is as wide as the canopy and both margins.
        free: globalThis.trial.machine.row.things.filter(
            ({ kind, placeMm, widthMm }) =>
                kind === "plant" &&
                placeMm > 1000 &&
                placeMm < 4000 &&
                globalThis.trial.windows.some(
                    ({ startMm, endMm }) =>
                        Math.abs(startMm - (placeMm - widthMm / 2 - 50)) < 3 &&
                        Math.abs(endMm - (placeMm + widthMm / 2 + 50)) < 3,
                ),
        ).length,
        shapes: document.querySelectorAll("#drawing [data-kind=plant]").length,
    }));
    assert.deepEqual(plants, { kept: passed, "margin cut": 0, damaged: 0 });
    assert(passed >= 5, `${passed} plants were passed`);
    assert(worked >= passed, "the tool was in the row between the plants");
    assert(free >= 4, `${free} windows lie round their plants`);
    assert(shapes >= 2, `${shapes} plants are drawn`);
    await page
        .locator("#outcome", { hasText: /^The tool has passed \d+ plants: all kept, with the margin\./ })
        .waitFor();
    await page.locator("#drawing [data-kind=plant][data-verdict=kept] .verdict").first().waitFor({ state: "attached" });
    await type(page, "status", /state=work tool=(in|out) /);
    await close(opened);
});

test("a fault that is made by a click takes the tool out, and its alarm shows until it is cleared", async () => {
    const opened = await tryIt();
    const { page } = opened;
    await page.getByLabel("Work switch").check();
    await rollTo(page, 900);
    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await page.getByRole("alert").filter({ hasText: "encoder_silent" }).waitFor();
    await part(page, "alarm-advice").filter({ hasText: "See to the encoder's coupling" }).waitFor();
    await page.locator("#true-tool", { hasText: "out" }).waitFor();
    await page.getByLabel("Kill the encoder").uncheck();
    await part(page, "clear").click();
    await part(page, "alarm").waitFor({ state: "hidden" });
    await close(opened);
});

test("a plant that was damaged is marked in the row, and told in words", async () => {
    const opened = await tryIt();
    const { page } = opened;
    await type(page, "set lead_out_ms 0", /^ok$/);
    await page.locator("#speed").fill("2.5");
    await page.getByLabel("Work switch").check();
    while (await page.evaluate(() => globalThis.trial.outcome.totals.plants.damaged === 0)) await pass(page, 0.3);
    await page.locator("#outcome", { hasText: /1 is damaged: the tool was over the canopy\./ }).waitFor();
    await page.locator("#drawing [data-verdict=damaged] .verdict").waitFor({ state: "attached" });
    await inspect(page, "desk-damaged");
    await close(opened);
});

test("what is moved or broken on the page is moved or broken on the machine", async () => {
    const opened = await tryIt();
    const { page } = opened;
    for (const [slider, value] of [
        ["speed", "-0.5"],
        ["spacing", "400"],
        ["weeds", "60"],
        ["slip", "12"],
    ] as const)
        await page.locator(`#${slider}`).fill(value);
    for (const label of ["Tear the beam's wire", "Kill the encoder"]) await page.getByLabel(label).check();
    await pass(page, 2);
    const found = await page.evaluate(() => {
        const { machine, planting } = globalThis.trial;
        const { motion, faults } = machine;
        const timeS = machine.timeS();
        return { planting, faults, speedMmS: motion.speedMmS(timeS), slip: 1 - motion.groundMmAMm(timeS) };
    });
    assert.deepEqual([found.planting.spacingMm, found.planting.weedShare], [400, 0.6]);
    assert.deepEqual(found.faults, { beamWireTorn: true, encoderDead: true });
    assert(Math.abs(found.speedMmS + 500 / 3.6) < 1e-6 && Math.abs(found.slip - 0.12) < 1e-6, JSON.stringify(found));
    await page.getByRole("button", { name: "Press reset" }).click();
    await pass(page, 0.5);
    await part(page, "said")
        .locator("div", { hasText: /reset by reset_pin/ })
        .waitFor();
    await close(opened);
});

test("a setting that is saved is there after the supply has sagged", async () => {
    const opened = await tryIt();
    const { page } = opened;
    await type(page, "set margin_mm 70", /^ok$/);
    await type(page, "save", /^ok$/);
    await page.getByRole("button", { name: "Let the supply sag" }).click();
    await pass(page, 0.5);
    await part(page, "said")
        .locator("div", { hasText: /reset by brown_out, state hold/ })
        .waitFor();
    await type(page, "get margin_mm", /^margin_mm=70/);
    await close(opened);
});

test("HOLD takes the tool out at once, whatever else waits for its answer", async () => {
    const opened = await tryIt();
    const { page } = opened;
    await page.getByLabel("Work switch").check();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await rollTo(page, 900);
    await part(page, "typed").fill("examples");
    await page.locator("#try-panel").getByRole("button", { name: "Send" }).click();
    await part(page, "hold").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await page.locator("#true-tool", { hasText: "out" }).waitFor();
    await close(opened);
});

for (const [device, viewport] of [
    ["phone", PHONE],
    ["desk", DESK],
] as const) {
    test(`on a ${device} nothing is wider than the screen, light or dark`, async () => {
        const opened = await tryIt(viewport);
        await opened.page.getByLabel("Work switch").check();
        await rollTo(opened.page, 1500);
        await inspect(opened.page, `${device}-try`);
        await close(opened);
    });
}
