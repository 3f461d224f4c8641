// Parts that must be on the screen without scrolling: state, its reason, the alarm and HOLD, in every tab of "Try it"
// and "Work with it", on the screens that the manual names, in Chromium and in Firefox ESR.

import assert from "node:assert/strict";
import { join } from "node:path";
import test from "node:test";
import type { Browser } from "playwright";
import { LANGUAGES } from "../src/words/words.ts";
import { assertOnScreen } from "./boxes.ts";
import { close, launch, launchFirefox, openAt, PHONE } from "./browser.ts";
import { folder, plugIn, serve } from "./serving.ts";
import { pass, tryIt, part as tryPart } from "./trying.ts";

const BROWSERS: [string, () => Promise<Browser>][] = [
    ["Chromium", launch],
    ["Firefox", launchFirefox],
];

for (const [name, launched] of BROWSERS) {
    test(`in ${name} state, reason and HOLD are on the first screen of every tab, and Esc holds`, async (test) => {
        const browser = await launched();
        test.after(() => browser.close());

        const opened = await tryIt(browser);
        const time = opened.page.locator("#time");
        await time.selectOption("0");
        await assertOnScreen(opened.page, "#try-panel", ["state", "why", "hold", "start"]);
        await time.selectOption("1");
        await opened.page.getByLabel("Work switch").check();
        await pass(opened.page, 0.3);
        await tryPart(opened.page, "state").filter({ hasText: "work" }).waitFor();
        await opened.page.keyboard.press("Escape");
        await tryPart(opened.page, "state").filter({ hasText: "hold" }).waitFor();
        await tryPart(opened.page, "start").click();
        await tryPart(opened.page, "state").filter({ hasText: "work" }).waitFor();
        await opened.page.getByLabel("Kill the encoder").check();
        await pass(opened.page, 5);
        await tryPart(opened.page, "alarm-name").filter({ hasText: "encoder_silent" }).waitFor();
        const atAlarm = ["state", "why", "alarm", "clear", "hold", "start"];
        await assertOnScreen(opened.page, "#try-panel", atAlarm);
        for (const language of Object.keys(LANGUAGES).filter((code) => code !== "en")) {
            await opened.page.locator("#language").selectOption(language);
            await tryPart(opened.page, "alarm-name")
                .filter({ hasText: /^(?!Alarm ).* 2-1 encoder_silent/ })
                .waitFor();
            await assertOnScreen(opened.page, "#try-panel", atAlarm);
        }
        await close(opened);

        const port = join(folder(test), "uno");
        await plugIn(test, port);
        const served = await serve(test, [port]);
        const work = await openAt(browser, served.here);
        const part = (name: string) => work.page.locator(`#served [data-part="${name}"]`);
        await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
        await assertOnScreen(work.page, "#served", ["state", "why", "alarm", "clear", "hold", "start"]);
        for (const line of ["save", "clear", "start"]) await served.type(line);
        await part("state").filter({ hasText: "work" }).waitFor();
        await work.page.keyboard.press("Escape");
        await part("state").filter({ hasText: "hold" }).waitFor();
        // HOLD drops the page's pending questions, and the browser logs them as errors.
        await close({ page: work.page, errors: work.errors.filter((error) => !error.includes("status of 409")) });
    });
}

test("with large text or zoom the dock takes at most half of the screen, HOLD is whole, and Clear can be reached", async (test) => {
    const browser = await launch();
    test.after(() => browser.close());
    const opened = await tryIt(browser);
    const { page } = opened;
    await page.getByLabel("Work switch").check();
    await tryPart(page, "state").filter({ hasText: "work" }).waitFor();
    await page.locator("#time").selectOption("0");
    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await tryPart(page, "alarm-name").filter({ hasText: "encoder_silent" }).waitFor();
    // 400 % of 1280x800, and text of 200 % on a phone and a desk.
    for (const [width, height, rem] of [
        [320, 200, 16],
        [320, 256, 16],
        [390, 844, 32],
        [360, 640, 32],
        [1280, 800, 32],
    ] as const)
        for (const language of Object.keys(LANGUAGES)) {
            await page.setViewportSize({ width, height });
            await page.evaluate((rem) => document.documentElement.style.setProperty("font-size", `${rem}px`), rem);
            await page.locator("#language").selectOption(language);
            await tryPart(page, "clear").focus();
            await tryPart(page, "clear").scrollIntoViewIfNeeded();
            await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
            const found = await page.evaluate(() => {
                const part = (name: string) => document.querySelector(`#try-panel [data-part=${name}]`);
                const isWhole = (name: string) => {
                    const { left, right, top, bottom } = part(name)?.getBoundingClientRect() ?? new DOMRect();
                    const isOnTop = [left + 12, right - 12].every((x) =>
                        [top + 12, bottom - 12].every((y) => {
                            const found = document.elementFromPoint(x, y);
                            return found !== null && part(name)?.contains(found);
                        }),
                    );
                    const text = part(name);
                    return (
                        isOnTop &&
                        text &&
                        text.scrollWidth <= text.clientWidth &&
                        text.scrollHeight <= text.clientHeight
                    );
                };
                const height = part("dock")?.getBoundingClientRect().height ?? 0;
                return { hold: isWhole("hold"), clear: isWhole("clear"), isHalf: height <= innerHeight / 2 + 1 };
            });
            const where = `${width}x${height}, ${rem} px, ${language}`;
            if (width > 320 && width < 400) {
                const wide = await page.evaluate(() =>
                    ["settings", "calibrate", "examples", "console"].map((tab) => {
                        document.querySelector<HTMLElement>(`#try-panel [data-part=tab-${tab}]`)?.click();
                        return document.documentElement.scrollWidth;
                    }),
                );
                assert(Math.max(...wide) <= width, `${where}: the tabs are ${wide} wide`);
            }
            assert.deepEqual(found, { hold: true, clear: true, isHalf: true }, where);
        }
    await close(opened);
});

test("the dock is above a phone's keyboard, and covers nothing on paper", async (test) => {
    const browser = await launch();
    test.after(() => browser.close());
    const opened = await tryIt(browser, PHONE);
    const { page } = opened;
    const keyboard = 300;
    const bottom = await page.evaluate((keyboard) => {
        const viewport = globalThis.visualViewport ?? new VisualViewport();
        Object.defineProperty(viewport, "height", { value: innerHeight - keyboard });
        viewport.dispatchEvent(new Event("resize"));
        return document.querySelector("#try-panel .dock")?.getBoundingClientRect().bottom;
    }, keyboard);
    assert.equal(bottom, PHONE.height - keyboard);
    await page.emulateMedia({ media: "print" });
    const dock = tryPart(page, "dock");
    assert.equal(await dock.evaluate((dock) => getComputedStyle(dock).position), "static");
    await close(opened);
});
