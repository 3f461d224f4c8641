// The page in a real browser, headless Chromium: it weeds a row with the real firmware, and shows faults that are made.
//
// CHROMIUM names the browser where it is not Debian's. Screenshots go to build/screenshots, phone and desk, light and dark.

import assert from "node:assert/strict";
import { resolve } from "node:path";
import test, { after, before } from "node:test";
import { pathToFileURL } from "node:url";
import { type Browser, chromium, type Page } from "playwright-core";
import type { Trial } from "../src/try/trial.ts";

/** What the page leaves for tests, and what this test leaves there. */
declare global {
    var trial: Trial;
    var touched: number[];
}

/** The longest that anything on the page may take: CI's machines are slow, and share their cores. */
const PATIENCE_MS = 60_000;

let browser: Browser;

before(async () => {
    browser = await chromium.launch({
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        args: [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--no-first-run",
        ],
    });
});

after(() => browser?.close());

/** Opens the page from the disk, as somebody without a network does. What goes wrong in it is kept. */
async function open(viewport = { width: 1440, height: 900 }): Promise<{ page: Page; errors: string[] }> {
    const page = await browser.newPage({ viewport });
    page.setDefaultTimeout(PATIENCE_MS);
    const errors: string[] = [];
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("console", (message) => {
        if (message.type() === "error") errors.push(message.text());
    });
    page.on("request", (request) => {
        if (!request.url().startsWith("file:")) errors.push(`asks for ${request.url()}`);
    });
    await page.goto(pathToFileURL(resolve("dist/index.html")).href);
    await pass(page, 0.5);
    await page.locator("#state", { hasText: "hold" }).waitFor();
    return { page, errors };
}

/** Lets time pass in the page until the tool has come to a place along the row, as fast as this machine can. */
async function rollTo(page: Page, toolMm: number): Promise<void> {
    while (await page.evaluate((mm) => globalThis.trial.machine.toolMm < mm, toolMm)) await pass(page, 0.5);
}

/** Lets so much time pass on the chip. */
async function pass(page: Page, seconds: number): Promise<void> {
    await page.evaluate((seconds) => globalThis.trial.advance(seconds, Number.POSITIVE_INFINITY), seconds);
}

/** Types a command and waits for what the machine says to it. */
async function type(page: Page, command: string, answer: RegExp): Promise<void> {
    await page.getByLabel("Type to the machine").fill(command);
    await page.getByRole("button", { name: "Send" }).click();
    await pass(page, 0.2);
    await page.locator("#said div", { hasText: answer }).last().waitFor();
}

test("the page weeds a row with the real firmware, and no canopy is reached", async () => {
    const { page, errors } = await open();
    await page.evaluate(() => {
        globalThis.touched = [];
        globalThis.trial.onStep = ({ row, toolMm, isClear }) => {
            const isOver = row.things.findIndex(
                ({ kind, placeMm, widthMm }) => kind === "plant" && Math.abs(toolMm - placeMm) <= widthMm / 2,
            );
            if (isOver >= 0 && !isClear) globalThis.touched.push(isOver);
        };
    });
    await page.getByLabel("Work switch").check();
    await pass(page, 0.2);
    await page.locator("#state", { hasText: "work" }).waitFor();
    await rollTo(page, 4000);
    const { touched, passed, worked, shapes, free } = await page.evaluate(() => ({
        touched: globalThis.touched,
        passed: globalThis.trial.machine.row.things.filter(
            ({ kind, placeMm }) => kind === "plant" && placeMm < globalThis.trial.machine.toolMm,
        ).length,
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
    assert.deepEqual(touched, []);
    assert(passed >= 5, `${passed} plants were passed`);
    assert(worked >= passed, "the tool was in the row between the plants");
    assert(free >= 4, `${free} windows lie round their plants`);
    assert(shapes >= 2, `${shapes} plants are drawn`);
    await type(page, "status", /state=work tool=(in|out) /);
    assert.deepEqual(errors, []);
    await page.close();
});

test("a fault that is made by a click takes the tool out, and its alarm shows until it is cleared", async () => {
    const { page, errors } = await open();
    await page.getByLabel("Work switch").check();
    await rollTo(page, 900);
    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await page.getByRole("alert").filter({ hasText: "encoder_silent" }).waitFor();
    await page.locator("#tool", { hasText: "out" }).waitFor();
    await page.getByLabel("Kill the encoder").uncheck();
    await page.getByRole("button", { name: "Clear the alarm" }).click();
    await pass(page, 0.2);
    await page.locator("#alarm").waitFor({ state: "hidden" });
    assert.deepEqual(errors, []);
    await page.close();
});

test("a setting that is saved is there after the supply has sagged", async () => {
    const { page, errors } = await open();
    await type(page, "set margin_mm 70", /^ok$/);
    await type(page, "save", /^ok$/);
    await page.getByRole("button", { name: "Let the supply sag" }).click();
    await pass(page, 0.5);
    await page.locator("#said div", { hasText: /reset by brown_out, state hold/ }).waitFor();
    await type(page, "get margin_mm", /^margin_mm=70/);
    assert.deepEqual(errors, []);
    await page.close();
});

for (const [device, width, height] of [
    ["phone", 390, 844],
    ["desk", 1440, 900],
] as const) {
    test(`on a ${device} nothing is wider than the screen, light or dark`, async () => {
        const { page, errors } = await open({ width, height });
        await page.getByLabel("Work switch").check();
        await rollTo(page, 1500);
        for (const colorScheme of ["light", "dark"] as const) {
            await page.emulateMedia({ colorScheme });
            const wide = await page.evaluate(() => document.documentElement.scrollWidth);
            assert(wide <= width, `${wide} of ${width} pixels`);
            await page.screenshot({ path: `build/screenshots/${device}-${colorScheme}.png` });
        }
        assert.deepEqual(errors, []);
        await page.close();
    });
}
