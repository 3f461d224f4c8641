// "Try it" in a real browser: the real firmware weeds a row in the page. Simulated faults appear on the same panel that
// works with a real Uno.

import assert from "node:assert/strict";
import test, { after, before } from "node:test";
import type { Browser } from "playwright";
import { close, DESK, expect, inspect, launch, moving, open, PHONE } from "./browser.ts";
import { part, pass, rollTo, tryIt, type, weeds } from "./trying.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

test("the page weeds a row with the real firmware, no plant is damaged, and it says so", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await moving(page);
    await page.getByLabel("Work switch").check();
    await pass(page, 0.2);
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await rollTo(page, 5500);
    const { plants, passed, worked, shapes, free } = await page.evaluate(() => ({
        plants: globalThis.simulation.outcome.totals.plants,
        passed: globalThis.simulation.outcome.plants.size,
        worked: globalThis.simulation.track.filter(({ acrossMm }) => acrossMm < 1).length,
        // Plants of this stretch round which the firmware's zone is as wide as the canopy and both margins. The first
        // may be passed before the switch is on.
        free: globalThis.simulation.machine.things.filter(
            ({ kind, placeMm, widthMm }) =>
                kind === "plant" &&
                placeMm > 1000 &&
                placeMm < 5500 &&
                globalThis.simulation.zones.some(
                    ({ startMm, endMm }) =>
                        Math.abs(startMm - (placeMm - widthMm / 2 - globalThis.simulation.outcome.marginMm)) < 3 &&
                        Math.abs(endMm - (placeMm + widthMm / 2 + globalThis.simulation.outcome.marginMm)) < 3,
                ),
        ).length,
        shapes: document.querySelectorAll("#drawing [data-kind=plant]").length,
    }));
    assert.deepEqual(plants, { kept: passed, marginCut: 0, reached: 0, damaged: 0 });
    assert(passed >= 5, `${passed} plants were passed`);
    assert(worked >= passed, "the tool was in the row between the plants");
    assert(free >= 4, `${free} zones lie round their plants`);
    assert(shapes >= 2, `${shapes} plants are drawn`);
    await page
        .locator("#outcome", { hasText: /^The tool has passed \d+ plants: all kept, with the margin\./ })
        .waitFor();
    await page.locator("#drawing [data-kind=plant][data-verdict=kept] .verdict").first().waitFor({ state: "attached" });
    await type(page, "status", /state=work tool=(in|out) /);
    await close(opened);
});

test("on opening the machine weeds, and the first sentence says what to watch", async () => {
    const opened = await open(browser, "try");
    const { page } = opened;
    await page.getByText("Watch the tool: it swings out at each plant").waitFor();
    await weeds(page);
    await expect(page.getByLabel("Work switch")).toBeChecked();
    await rollTo(page, 2500);
    await page.locator("#outcome", { hasText: /all kept, with the margin/ }).waitFor();
    await page.locator("#why", { hasText: /[1-9]\d?(\.\d)?% weeded/ }).waitFor();
    await part(page, "hold").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await close(opened);
});

test("a fault that is made by a click takes the tool out, and its alarm shows until it is cleared", async () => {
    const opened = await tryIt(browser);
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

test("no control moves under the pointer while the machine drives, and into its alarm", async () => {
    for (const [screen, language] of [
        [DESK, "en"],
        [{ width: 600, height: 900 }, "fr"],
        [PHONE, "fr"],
    ] as const) {
        const opened = await open(browser, "try", screen);
        const { page } = opened;
        await weeds(page);
        await page.locator("#language").selectOption(language);
        // The sentences of the machine are said in it in the next frame.
        await pass(page, 0.1);
        const watched = page.evaluate(async () => {
            const places = () =>
                [...document.querySelectorAll("#view-try :is(button, input, select)")]
                    .filter((control) => control.checkVisibility())
                    .map((control): [Element, number] => {
                        const scrolled = control.closest(".dock") ? 0 : scrollY;
                        return [control, Math.round(control.getBoundingClientRect().bottom + scrolled)];
                    });
            const first = new Map(places());
            const moved = new Set<string>();
            while (!document.querySelector("#try-panel .alarm:not([hidden])")) {
                await new Promise(requestAnimationFrame);
                for (const [control, place] of places())
                    if ((first.get(control) ?? place) !== place) moved.add(control.outerHTML);
            }
            return [...moved];
        });
        await rollTo(page, 4000);
        await page.locator("#dead").check();
        await pass(page, 5);
        assert.deepEqual(await watched, []);
        await close(opened);
    }
});

test("the mouse wheel scrolls the page, and changes no number in a field", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await part(page, "tab-settings").click();
    const margin = page.locator("#try-panel [data-setting=margin_mm]");
    await margin.evaluate((field) => field.scrollIntoView({ block: "center" }));
    await margin.fill("45");
    await margin.hover();
    const before = await page.evaluate(() => scrollY);
    await page.mouse.wheel(0, -100);
    await page.waitForFunction((before) => scrollY < before, before);
    await page.keyboard.type("6");
    await expect(margin).toHaveValue("456");
    await close(opened);
});

test("a page that does not start says so, and one that starts does not", async () => {
    const { page } = await open(browser, "work");
    await expect(page.locator("#not-started")).toHaveCount(0);
    await page.addInitScript(() => Reflect.deleteProperty(globalThis, "DecompressionStream"));
    await page.reload();
    await page.evaluate(() => {
        for (const animation of document.getAnimations()) animation.finish();
    });
    await page.getByText("This page has not started").waitFor();
    await page.context().close();
});

test("a plant that was damaged is marked in the row, and told in words", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await type(page, "set lead_out_ms 0", /^ok$/);
    await page.locator("#speed").fill("2.5");
    await page.getByLabel("Work switch").check();
    while (await page.evaluate(() => globalThis.simulation.outcome.totals.plants.damaged === 0)) await pass(page, 0.3);
    await page.locator("#outcome", { hasText: /\d (is|are) damaged: the tool was at the stem/ }).waitFor();
    await page.locator("#drawing [data-verdict=damaged] .verdict").first().waitFor({ state: "attached" });
    await inspect(page, "desk-damaged");
    await close(opened);
});

test("what is moved or broken on the page is moved or broken on the machine", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    const sown = await page.evaluate(() => globalThis.simulation.machine.things.length);
    for (const [slider, value] of [
        ["speed", "2.5"],
        ["spacing", "400"],
        ["weeds", "100"],
    ] as const)
        await page.locator(`#${slider}`).fill(value);
    // How far the row was sown before depends on the time until now.
    await rollTo(page, 6000);
    const kinds = await page.evaluate(
        (sown) => globalThis.simulation.machine.things.slice(sown).map(({ kind }) => kind),
        sown,
    );
    const [plants, weeds] = ["plant", "weed"].map((kind) => kinds.filter((other) => other === kind).length);
    assert(plants && weeds && plants >= 8 && weeds >= plants - 3, `${plants} plants, ${weeds} weeds`);

    const tickMm = await page.evaluate(() => globalThis.simulation.machine.groundMmATick);
    await page.locator("#speed").fill("-0.5");
    await page.locator("#slip").fill("12");
    for (const label of ["Tear the beam's wire", "Kill the encoder"]) await page.getByLabel(label).check();
    await pass(page, 4);
    const found = await page.evaluate(async () => {
        const { machine, uno, advance } = globalThis.simulation;
        const pins = new Set<number>();
        const set = uno.set.bind(uno);
        uno.set = (pin, high) => {
            pins.add(pin);
            set(pin, high);
        };
        const wasTicks = machine.ticks;
        advance.call(globalThis.simulation, 5, Number.POSITIVE_INFINITY);
        uno.set = set;
        const { speedMmS, groundMmATick, ticks } = machine;
        return { pins: [...pins], ticks: ticks - wasTicks, speedMmS, groundMmATick };
    });
    // It rolls past plants, but no pin changes.
    assert(found.ticks < -1000 && found.pins.length === 0, JSON.stringify(found));
    assert(Math.abs(found.speedMmS + 500 / 3.6) < 1e-6, JSON.stringify(found));
    assert(Math.abs(found.groundMmATick / tickMm - 0.88) < 1e-6, JSON.stringify(found));
    await page.getByRole("button", { name: "Press reset" }).click();
    await pass(page, 0.5);
    await part(page, "said")
        .locator("div", { hasText: /reset by reset_pin/ })
        .waitFor();
    await close(opened);
});

test("a setting that is saved is there after the supply has sagged", async () => {
    const opened = await tryIt(browser);
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

test("a wheel that is measured once counts once, also where its setting is read again", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    // Until the page has read its settings.
    await pass(page, 2);
    // The servo was timed, and its leads are in use, so that the wheel is the next step.
    for (const lead of ["lead_out_ms 100", "lead_in_ms 99"]) await type(page, `set ${lead}`, /^ok$/);
    const timed = "calibrated lead_out_ms=100 lead_in_ms=99 set=yes\r\n";
    // The machine may be in the middle of a line.
    await page.evaluate((line) => globalThis.simulation.onText(`\r\n${line}${line}`), timed);
    // A stretch is measured from a stop to a stop.
    await page.locator("#speed").fill("0");
    await pass(page, 1);
    await type(page, "calibrate start", /^ok$/);
    await page.locator("#speed").fill("2");
    await pass(page, 4);
    await page.locator("#speed").fill("0");
    await pass(page, 1);
    await type(page, "calibrate 1900 force", /^that is \d+ permille off the diameter/);
    const next = part(page, "margin-said");
    await expect(next).toHaveText(/^Next, measure 10 m: .*\(1 of 3 done\)/);
    await type(page, "get", /^ticks_per_m=/);
    await pass(page, 1);
    await expect(next).toHaveText(/\(1 of 3 done\)/);
    await close(opened);
});

test("HOLD takes the tool out at once, even while other commands wait for their answers", async () => {
    const opened = await tryIt(browser);
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
        const opened = await tryIt(browser, viewport);
        await opened.page.getByLabel("Work switch").check();
        await rollTo(opened.page, 1500);
        await inspect(opened.page, `${device}-try`);
        await close(opened);
    });
}

test("how soon the page moves, and how fluently on a slow processor, is measured", async (test) => {
    const { page, errors } = await open(browser, "try", PHONE);
    await moving(page);
    const moved = await page.waitForFunction(() => globalThis.simulation.machine.placeMm > 0 && performance.now());
    const processor = await page.context().newCDPSession(page);
    await processor.send("Emulation.setCPUThrottlingRate", { rate: 6 });
    const perSecond = await page.evaluate(async () => {
        const startedMs = performance.now();
        let pictures = 0;
        for (; performance.now() - startedMs < 5000; pictures++) await new Promise(requestAnimationFrame);
        return (1000 * pictures) / (performance.now() - startedMs);
    });
    await expect(page.locator("#pace")).toHaveText(/^\d\.\d\d x$/);
    const pace = await page.locator("#pace").textContent();
    test.diagnostic(
        `the first movement after ${Number(await moved.jsonValue()).toFixed(0)} ms; with a sixth of the processor ` +
            `${perSecond.toFixed(0)} pictures a second, and a pace of ${pace}`,
    );
    await close({ page, errors });
});
