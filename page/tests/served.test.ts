// The page as `weeder serve` gives it to a phone: the real process at a virtual Uno, in a real browser. 127.0.0.2 stands for the
// computer's address in the network, where a code is needed.

import assert from "node:assert/strict";
import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import test, { after, before, type TestContext } from "node:test";
import { setTimeout as wait } from "node:timers/promises";
import type { Browser, Page } from "playwright-core";
import { close, inspect, launch, openAt, PHONE } from "./browser.ts";

const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");
const WEEDER = process.env.WEEDER ?? resolve("../target/debug/weeder");

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

const part = (page: Page, machine: string, name: string) =>
    page.getByRole("region", { name: machine, exact: true }).locator(`[data-part="${name}"]`);

/** Ends a process as Ctrl-C does. */
async function end(child: ChildProcess): Promise<void> {
    if (child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((done) => child.once("exit", done));
    child.kill("SIGINT");
    await ended;
}

/** A virtual Uno whose port has this path, until the test ends. */
async function plugIn(test: TestContext, path: string): Promise<ChildProcess> {
    const uno = spawn(WEEDER, ["virtual-uno", "--elf", FIRMWARE, "--link", path], { stdio: "ignore" });
    test.after(() => end(uno));
    for (let waited = 0; !existsSync(path); waited += 50) {
        assert(uno.exitCode === null && waited < 60_000, "the virtual Uno does not start");
        await wait(50);
    }
    return uno;
}

interface Served {
    /** The page's addresses for the computer itself, and for a phone without the code and with it. */
    readonly here: string;
    readonly lan: string;
    readonly code: string;
    readonly process: ChildProcess;
    /** Types a line at the computer itself. */
    type(line: string, machine?: number): Promise<void>;
}

/** Serves machines at ports. */
async function serve(test: TestContext, ports: string[], ...options: string[]): Promise<Served> {
    const named = ports.flatMap((port) => ["--port", port]);
    const words = ["serve", "--page", "dist", "--http-port", "0", "--lan", "127.0.0.2", ...named, ...options];
    const child = spawn(WEEDER, words, { stdio: ["ignore", "pipe", "inherit"] });
    test.after(() => end(child));
    const said: string[] = [];
    for await (const line of createInterface({ input: child.stdout })) if (said.push(line) === 2) break;
    const [here = "", withCode = ""] = said.map((line) => line.split(" ")[0] ?? "");
    const [lan = "", code = ""] = withCode.split("#");
    const origin = new URL(here).origin;
    return {
        here,
        lan,
        code,
        process: child,
        async type(line, machine = 0) {
            const address = `${origin}/machines/${machine}/command`;
            // A machine that was just plugged in is not there at once.
            for (let tries = 0; ; tries++) {
                const answer = await fetch(address, { method: "POST", body: line, headers: { Origin: origin } });
                if (answer.ok) return;
                assert(answer.status === 503 && tries < 600, `${line}: ${await answer.text()}`);
                await wait(100);
            }
        },
    };
}

/** A folder that is gone at the test's end. */
function folder(test: TestContext): string {
    const folder = mkdtempSync(join(tmpdir(), "weeder-served-"));
    test.after(() => rmSync(folder, { recursive: true }));
    return folder;
}

test("a phone is paired by the code, sees the machine, and holds it", async (test) => {
    const port = join(folder(test), "uno");
    const uno = await plugIn(test, port);
    const served = await serve(test, [port]);
    const opened = await openAt(browser, served.lan, PHONE);
    const { page } = opened;
    await inspect(page, "phone-pair");
    await page.getByLabel("The code on the computer's screen").fill(served.code.toLowerCase());
    await page.getByRole("button", { name: "Pair this phone" }).click();

    await part(page, "uno", "alarm-name").filter({ hasText: "Alarm 5-1 settings_lost" }).waitFor();
    assert(await part(page, "uno", "clear").isHidden());
    for (const line of ["save", "clear", "start"]) await served.type(line);
    await part(page, "uno", "state").filter({ hasText: "work" }).waitFor();
    await part(page, "uno", "last-object")
        .filter({ hasText: /mm wide/ })
        .waitFor();
    assert.match((await part(page, "uno", "speed").textContent()) ?? "", /^\d\.\d$/);
    await part(page, "uno", "limits").filter({ hasText: "watched and held" }).waitFor();
    for (const name of ["start", "teach-plant", "tab-calibrate"])
        assert(await part(page, "uno", name).isHidden(), `${name} is not offered`);
    await inspect(page, "phone-served");
    const hold = await part(page, "uno", "hold").boundingBox();
    assert(hold && hold.width > 300 && hold.height >= 80 && hold.y + hold.height <= PHONE.height, "HOLD is at hand");
    await part(page, "uno", "hold").click();
    await part(page, "uno", "state").filter({ hasText: "hold" }).waitFor();

    assert.equal(opened.errors.join(), "");
    await end(uno);
    await part(page, "uno", "why").filter({ hasText: "The port is gone: plug the Uno in again." }).waitFor();
    assert(await part(page, "uno", "hold").isDisabled());
    await plugIn(test, port);
    // It has forgotten its settings.
    await part(page, "uno", "alarm-name").filter({ hasText: "settings_lost" }).waitFor();

    // The computer falls silent, as one that the phone's network no longer reaches.
    served.process.kill("SIGSTOP");
    await part(page, "uno", "why")
        .filter({ hasText: "The computer that has the machine's port does not answer" })
        .waitFor();
    served.process.kill("SIGCONT");
    await part(page, "uno", "tool").filter({ hasText: "out" }).waitFor();

    await page.getByRole("link", { name: "Flash" }).click();
    await page.getByText(/comes from weeder serve, which .* flashes nothing/).waitFor();
    assert(await page.getByRole("button", { name: "Flash it" }).isDisabled());
    // The browser itself writes down that a machine which was pulled had not answered yet.
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
    await part(page, "right", "start").click();
    await part(page, "right", "state").filter({ hasText: "work" }).waitFor();
    assert.equal(await part(page, "left", "state").textContent(), "hold");
    await inspect(page, "phone-served-two");
    // At the computer itself nobody needs a code, and all of the panel is there.
    const here = await openAt(browser, served.here);
    await part(here.page, "right", "state").filter({ hasText: "work" }).waitFor();
    assert(await part(here.page, "right", "tab-calibrate").isVisible());
    await inspect(here.page, "desk-served-two");
    await part(page, "right", "hold").click();
    await part(here.page, "right", "state").filter({ hasText: "hold" }).waitFor();

    // All of them at once, at a glance.
    const all = page.getByRole("region", { name: "all rows" });
    for (const name of ["left", "right"]) await part(page, name, "start").click();
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
    assert.equal(await part(page, "left", "state").textContent(), "hold");
    // What a page was asking as HOLD came was dropped, which the browser itself writes down.
    for (const { page, errors } of [here, opened])
        await close({ page, errors: errors.filter((error) => !error.includes("status of 409")) });
});
