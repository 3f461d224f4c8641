// Shared code of the tests of "Try it": the page after its machine is set up, and time on its chip.

import assert from "node:assert/strict";
import type { Browser, Locator, Page } from "playwright";
import { DESK, type Opened, open } from "./browser.ts";

export const part = (page: Page, name: string): Locator => page.locator(`#try-panel [data-part="${name}"]`);

/** Opens "Try it", where the machine weeds at once, and takes it to hold by its work switch. */
export async function tryIt(browser: Browser, viewport = DESK): Promise<Opened> {
    const opened = await open(browser, "try", viewport);
    await weeds(opened.page);
    await opened.page.getByLabel("Work switch").uncheck();
    await pass(opened.page, 0.3);
    await part(opened.page, "state").filter({ hasText: "hold" }).waitFor();
    return opened;
}

/** Waits until the machine is set up, and has begun to weed. */
export async function weeds(page: Page): Promise<void> {
    const state = part(page, "state").filter({ hasText: "work" });
    await passUntil(page, 0.1, () => state.isVisible());
}

/** Lets time pass in the page until the tool has reached a position along the row, as fast as this machine can. */
export async function rollTo(page: Page, toolMm: number): Promise<void> {
    await passUntil(page, 0.5, () => page.evaluate((mm) => globalThis.simulation.machine.toolMm >= mm, toolMm));
}

/** Lets time pass in such steps until something is so. Fails after a minute on the chip. */
async function passUntil(page: Page, seconds: number, isSo: () => Promise<boolean>): Promise<void> {
    for (let left = 60; !(await isSo()); left -= seconds) {
        assert(left > 0, `the machine says ${(await part(page, "said").locator("div").allTextContents()).join(" / ")}`);
        await pass(page, seconds);
    }
}

/**
 * Lets time pass on the chip. As in the page's own frames, the panel has its turn after a tenth of a second at most: it
 * would take its own pause for the machine's silence otherwise.
 */
export async function pass(page: Page, seconds: number): Promise<void> {
    await page.evaluate(async (seconds) => {
        for (let left = seconds; left > 0; left -= 0.1) {
            globalThis.simulation.advance(Math.min(left, 0.1), Number.POSITIVE_INFINITY);
            await new Promise(requestAnimationFrame);
        }
    }, seconds);
}

/** Types a command, and waits until the console shows the command again and an answer like this. */
export async function type(page: Page, command: string, answer: RegExp): Promise<void> {
    const typed = part(page, "said").locator("div", { hasText: new RegExp(`^> ${command}$`) });
    const before = await typed.count();
    await part(page, "typed").fill(command);
    await page.locator("#try-panel").getByRole("button", { name: "Send" }).click();
    await pass(page, 0.2);
    await typed.nth(before).locator("xpath=following-sibling::div").filter({ hasText: answer }).first().waitFor();
}
