// Parts that must be on the screen without scrolling: state, its reason, the alarm and HOLD, in every tab of "Try it"
// and "Work with it", on the screens that the manual names, in Chromium and in Firefox ESR.

import { join } from "node:path";
import test from "node:test";
import type { Browser } from "playwright-core";
import { assertOnScreen } from "./boxes.ts";
import { close, launch, launchFirefox, openAt } from "./browser.ts";
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
        // The texts of a row at work grow, and would move the buttons.
        await time.selectOption("0");
        await opened.page.getByLabel("Kill the encoder").check();
        await pass(opened.page, 5);
        await tryPart(opened.page, "alarm-name").filter({ hasText: "encoder_silent" }).waitFor();
        const atAlarm = ["state", "why", "alarm", "clear", "hold", "start"];
        await assertOnScreen(opened.page, "#try-panel", atAlarm);
        for (const language of ["hi", "es", "fr"]) {
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
