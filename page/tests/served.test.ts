// The page from `weeder serve` on a phone: the real process with a virtual Uno, in a real browser.

import assert from "node:assert/strict";
import { join } from "node:path";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright";
import { close, expect, inspect, launch, openAt, PATIENCE_MS, PHONE } from "./browser.ts";
import { end, folder, part, plugIn, serve } from "./serving.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

/** Starts a machine. A page that a busy computer has left a second behind is refused, and its operator starts it again. */
const start = (page: Page, machine: string) =>
    expect(async () => {
        await part(page, machine, "start").click();
        await expect(part(page, machine, "state")).toHaveText("work", { timeout: 5000 });
    }).toPass({ timeout: PATIENCE_MS });

/** The errors of a page without those of requests that were refused or taken from it: the browser writes them down. */
const ownErrors = (errors: readonly string[]) => errors.filter((error) => !/net::ERR_FAILED|status of 412/.test(error));

test("a phone is paired by the code, sees the machine, and holds it", async (test) => {
    const port = join(folder(test), "uno");
    const uno = await plugIn(test, port);
    const served = await serve(test, [port]);
    const opened = await openAt(browser, served.lan, PHONE);
    const { page } = opened;
    await inspect(page, "phone-pair");
    // As in a browser that keeps no cookie.
    await page.route("**/pair", (route) => route.fulfill({ status: 204 }));
    await page.getByLabel("The code on the computer's screen").fill("K7PM-2F9X");
    await page.getByRole("button", { name: "Pair this phone" }).click();
    await page.getByText("This browser keeps no cookies.").waitFor();
    await page.unroute("**/pair");
    // The browser itself writes that down.
    opened.errors.splice(0);
    await page.getByLabel("The code on the computer's screen").fill(served.code.toLowerCase());
    await page.getByRole("button", { name: "Pair this phone" }).click();

    await part(page, "uno", "alarm-name").filter({ hasText: "Alarm 5-1 settings_lost" }).waitFor();
    await expect(part(page, "uno", "clear")).toBeHidden();
    for (const line of ["save", "clear", "start"]) await served.type(line);
    await part(page, "uno", "state").filter({ hasText: "work" }).waitFor();
    await part(page, "uno", "last-object")
        .filter({ hasText: /mm wide/ })
        .waitFor();
    await expect(part(page, "uno", "speed")).toHaveText(/^\d\.\d$/);
    await part(page, "uno", "limits").filter({ hasText: "watched and held" }).waitFor();
    for (const name of ["start", "teach-plant", "tab-calibrate"])
        await expect(part(page, "uno", name), `${name} is not offered`).toBeHidden();
    await inspect(page, "phone-served");
    const hold = await part(page, "uno", "hold").boundingBox();
    assert(hold && hold.width > 300 && hold.height >= 80 && hold.y + hold.height <= PHONE.height, "HOLD is at hand");
    await part(page, "uno", "hold").click();
    await part(page, "uno", "state").filter({ hasText: "hold" }).waitFor();

    assert.equal(opened.errors.join(), "");
    await end(uno);
    await part(page, "uno", "why").filter({ hasText: "The port is gone: plug the Uno in again." }).waitFor();
    // A HOLD is kept for it, and says so.
    await part(page, "uno", "hold").click();
    await part(page, "uno", "drive-said").filter({ hasText: "HOLD has not come through: the port is gone" }).waitFor();
    await plugIn(test, port);
    // It has lost its settings.
    await part(page, "uno", "alarm-name").filter({ hasText: "settings_lost" }).waitFor();

    // The computer stops answering, as if out of the phone's network.
    served.process.kill("SIGSTOP");
    await part(page, "uno", "why")
        .filter({ hasText: "The computer that has the machine's port does not answer" })
        .waitFor();
    served.process.kill("SIGCONT");
    await part(page, "uno", "tool").filter({ hasText: "out" }).waitFor();

    await page.getByRole("link", { name: "Flash" }).click();
    await page.getByText(/comes from weeder serve, which .* flashes nothing/).waitFor();
    await expect(page.getByRole("button", { name: "Flash it" })).toBeDisabled();
    // The browser itself writes down the HOLDs to the lost machine.
    await close({ page, errors: opened.errors.filter((error) => !error.includes("status of 503")) });
});

test("the address with the code pairs by itself, and machines side by side are started and held one by one", async (test) => {
    const ports = ["left", "right"].map((name) => join(folder(test), name));
    await Promise.all(ports.map((port) => plugIn(test, port)));
    const served = await serve(test, ports, "--allow-start");
    for (const machine of [0, 1]) for (const line of ["save", "clear"]) await served.type(line, machine);
    const opened = await openAt(browser, `${served.lan}#${served.code}`, PHONE);
    const { page } = opened;
    for (const name of ["left", "right"]) await part(page, name, "state").filter({ hasText: "hold" }).waitFor();
    assert(!page.url().includes(served.code), page.url());
    await start(page, "right");
    await expect(part(page, "left", "state")).toHaveText("hold");
    await inspect(page, "phone-served-two");
    // The computer itself needs no code, and shows the whole panel.
    const here = await openAt(browser, served.here);
    await part(here.page, "right", "state").filter({ hasText: "work" }).waitFor();
    await expect(part(here.page, "right", "tab-calibrate")).toBeVisible();
    await inspect(here.page, "desk-served-two");
    // A HOLD that is lost says so, and is sent again until it is obeyed. Until then nothing starts.
    let isLost = true;
    await page.route("**/machines/1/command", (route) => (isLost ? route.abort() : route.continue()));
    const enter = async (line: string) => {
        await part(page, "right", "typed").fill(line);
        await part(page, "right", "typed").press("Enter");
    };
    for (const hold of [() => part(page, "right", "hold").click(), () => enter("hold.")]) {
        await hold();
        await part(page, "right", "drive-said").filter({ hasText: "HOLD has not come through" }).waitFor();
        await expect(part(page, "right", "state")).toHaveText("work");
        await part(page, "right", "start").click();
        await part(page, "right", "drive-said").filter({ hasText: "so this was not sent" }).waitFor();
        await enter("start now");
        await part(page, "right", "said")
            .getByText("start now: HOLD has not come through yet, so this was not sent")
            .last()
            .waitFor();
        isLost = false;
        await part(here.page, "right", "state").filter({ hasText: "hold" }).waitFor();
        await part(page, "right", "drive-said").filter({ hasText: /^$/ }).waitFor({ state: "attached" });
        await part(page, "right", "state").filter({ hasText: "hold" }).waitFor();
        await start(page, "right");
        isLost = true;
    }
    isLost = false;
    await part(page, "right", "hold").click();
    await part(here.page, "right", "state").filter({ hasText: "hold" }).waitFor();

    // A change on one page is visible on another, and on a page opened later, with its help.
    const settings = (of: Page) => part(of, "right", "settings-list");
    await expect(async () => {
        await part(here.page, "right", "typed").fill("set k 5");
        await part(here.page, "right", "typed").press("Enter");
        await expect(settings(here.page).locator('[data-setting="k"]')).toHaveValue("5", { timeout: 5000 });
    }).toPass({ timeout: PATIENCE_MS });
    const late = await openAt(browser, served.here);
    for (const shown of [page, here.page, late.page]) {
        const setting = settings(shown).getByRole("listitem", { includeHidden: true });
        const help = /^k\s*nearest examples that vote \(1 to 15, default 3; 3 is saved\)$/;
        await setting.filter({ hasText: help }).waitFor({ state: "attached" });
        await expect(settings(shown).locator('[data-setting="k"]')).toHaveValue("5");
    }
    await close(late);

    // A browser has six connections to a computer: of its tabs, those behind the one in front do not listen.
    const hide = (hidden: boolean) =>
        here.page.evaluate((hidden) => {
            Object.defineProperty(document, "hidden", { value: hidden, configurable: true });
            document.dispatchEvent(new Event("visibilitychange"));
        }, hidden);
    await hide(true);
    await expect(part(here.page, "left", "state")).toHaveText("hold");
    const front = await here.page.context().newPage();
    await front.goto(served.here);
    await part(here.page, "left", "why").filter({ hasText: "No machine is connected." }).waitFor();
    await part(front, "left", "state").filter({ hasText: "hold" }).waitFor();
    // Nor does a tab that is loaded behind: it asks again instead.
    await front.addInitScript(() => Object.defineProperty(document, "hidden", { value: true }));
    await front.reload();
    await part(front, "left", "why").filter({ hasText: "No machine is connected." }).waitFor();
    await front.waitForRequest("**/machines");
    await front.close();
    await hide(false);
    await part(here.page, "left", "state").filter({ hasText: "hold" }).waitFor();

    // All of them at once, at a glance.
    const all = page.getByRole("region", { name: "all rows" });
    for (const name of ["left", "right"]) await start(page, name);
    await all
        .getByRole("listitem")
        .filter({ hasText: /left\s*work/ })
        .waitFor();
    await all
        .getByRole("listitem")
        .filter({ hasText: /right\s*work/ })
        .waitFor();
    await all.getByRole("button", { name: "HOLD all" }).click();
    await all.getByText(/^HOLD obeyed by 2 of 2, the last after \d+ ms\.$/).waitFor();
    await all
        .getByRole("listitem")
        .filter({ hasText: /right\s*hold/ })
        .waitFor();
    await expect(part(page, "left", "state")).toHaveText("hold");
    for (const ended of [here, opened]) await close({ page: ended.page, errors: ownErrors(ended.errors) });
});
