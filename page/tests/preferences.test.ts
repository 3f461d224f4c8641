// The operator's choices, and the system's preferences: the page stores and follows them, and plays its signals.

import assert from "node:assert/strict";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright";
import { close, expect, launch, open, reload } from "./browser.ts";
import { part, pass, tryIt } from "./trying.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

/** Signals since the last call: tones in Hz, and vibrations. */
const heard = (page: Page) => page.evaluate(() => globalThis.signals.splice(0).join(" "));

declare global {
    var signals: string[];
    var audio: AudioContext;
}

test("theme, sound and board are kept from one visit to the next", async () => {
    const opened = await open(browser, "flash");
    const { page } = opened;
    const [light, sound] = [page.getByRole("button", { name: "Light" }), page.getByRole("button", { name: "Sound" })];
    const boards = page.locator("[data-part=board]");
    const shows = async (isLight: string, scheme: string, isHeard: string, board: string) => {
        await expect(light).toHaveAttribute("aria-pressed", isLight);
        await expect(page.locator("html")).toHaveCSS("color-scheme", scheme);
        await expect(sound).toHaveAttribute("aria-pressed", isHeard);
        await expect(boards).toHaveValue(board);
    };
    const [first = "", second = ""] = await boards
        .locator("option")
        .evaluateAll((options) => options.map((option) => (option as HTMLOptionElement).value));
    await shows("false", "light dark", "true", first);
    await light.click();
    await sound.click();
    await boards.selectOption(second);
    await shows("true", "light", "false", second);
    await reload(page);
    await shows("true", "light", "false", second);
    await close(opened);
});

test("where little motion is asked for, the machine stands until it is driven, and the row does not glide", async () => {
    const opened = await open(browser, "work");
    const { page } = opened;
    await page.emulateMedia({ reducedMotion: "reduce" });
    await reload(page);
    await page.getByRole("link", { name: "Try" }).click();
    await expect(page.locator("#speed-is")).toHaveText("0.0 km/h");
    await pass(page, 1);
    assert.equal(await page.evaluate(() => globalThis.simulation.machine.placeMm), 0);
    await page.locator("#speed").fill("2");
    const { pictures, seconds } = await page.evaluate(async () => {
        let pictures = 0;
        const drawing = document.getElementById("drawing");
        if (!drawing) throw new Error("there is no drawing");
        new MutationObserver(() => {
            pictures += 1;
        }).observe(drawing, { attributes: true, subtree: true, childList: true });
        const startedMs = performance.now();
        const passedS = () => (performance.now() - startedMs) / 1000;
        while (passedS() < (pictures === 0 ? 60 : 2.5)) await new Promise(requestAnimationFrame);
        return { pictures, seconds: passedS() };
    });
    assert(pictures >= 1 && pictures <= seconds + 1, `${pictures} pictures in ${seconds.toFixed(1)} s`);
    await close(opened);
});

test("an alarm, a lost machine and an obeyed HOLD are each heard and felt as another one, and one button turns that off", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await page.evaluate(() => {
        Object.assign(navigator, { audioSession: {} });
        globalThis.signals = [];
        const { start } = OscillatorNode.prototype;
        OscillatorNode.prototype.start = function (at) {
            globalThis.signals.push(String(this.frequency.value));
            globalThis.audio = this.context as AudioContext;
            start.call(this, at);
        };
        navigator.vibrate = (pattern) => {
            globalThis.signals.push(`vibrates ${pattern}`);
            return true;
        };
    });
    const sound = page.getByRole("button", { name: "Sound" });
    await sound.click();
    await expect(sound).toHaveAttribute("aria-pressed", "false");
    await heard(page);
    await part(page, "hold").click();
    await pass(page, 0.5);
    await part(page, "said").getByText("> hold").first().waitFor();
    assert.equal(await heard(page), "");

    const held = "vibrates 80,60,80 660 990";
    await sound.click();
    await page.waitForFunction(() => !document.querySelector("#sound.waiting"));
    assert.equal(await heard(page), held, "turned on, it is heard at once");
    // Also on an iPhone whose ring switch is off.
    assert.equal(await page.evaluate(() => Reflect.get(navigator, "audioSession").type), "playback");
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    // The answer to HOLD and the following state, with the delay of a slow line.
    await page.evaluate(() => {
        const { now } = performance;
        let lateMs = 0;
        performance.now = () => {
            lateMs += 1000;
            return now.call(performance) + lateMs;
        };
    });
    await part(page, "hold").click();
    await page.evaluate(async () => {
        for (let turn = 0; turn < 2000; turn++) {
            globalThis.simulation.advance(1e-4, Number.POSITIVE_INFINITY);
            await Promise.resolve();
        }
    });
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    assert.equal(await heard(page), held, "an obeyed HOLD is heard once");
    await page.evaluate(() => delete (performance as Partial<Performance>).now);

    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await part(page, "alarm").waitFor();
    assert.equal(await heard(page), "vibrates 300,100,300,100,300 1760 1760 1760 1760");
    await page.getByRole("button", { name: "Press reset" }).click();
    await part(page, "said")
        .getByText(/reset by reset_pin/)
        .waitFor();
    assert.equal(await heard(page), "vibrates 1000 660 440 330");
    // A call stops the browser's sound: the button says so, and no tone waits for the next touch.
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await page.evaluate(() => globalThis.audio.suspend());
    await page.locator("#sound.waiting").waitFor();
    await page.evaluate(() => globalThis.simulation.uno.reset("external"));
    await page.waitForFunction(() => globalThis.signals.length > 0);
    assert.equal(await heard(page), "vibrates 1000");
    await close(opened);
});
