// The page as an app without a network, a newer page, and a firmware that differs from the page's.

import assert from "node:assert/strict";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import test, { after, before } from "node:test";
import type { Browser } from "playwright-core";
import { close, inspect, launch, open, openAt, PHONE, served } from "./browser.ts";
import { type Device, VirtualUno } from "./ports.ts";

const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

test("from localhost the page can be installed, opens without a network, and says when a newer one is there", async (test) => {
    const folder = mkdtempSync(join(tmpdir(), "weeder-app-"));
    test.after(() => rmSync(folder, { recursive: true }));
    cpSync("dist", folder, { recursive: true });
    const server = await served(test, folder);
    const opened = await openAt(browser, `http://127.0.0.1:${server.port}/#work`);
    const { page } = opened;
    await page.evaluate(() => navigator.serviceWorker.ready);
    const devtools = await page.context().newCDPSession(page);
    const { installabilityErrors } = await devtools.send("Page.getInstallabilityErrors");
    // The test browser has no window for installing apps.
    assert.deepEqual(
        installabilityErrors.filter(({ errorId }) => errorId !== "in-incognito"),
        [],
    );
    const newer = page.getByText("A newer page is there.");
    assert(await newer.isHidden());

    for (const name of ["index.html", "worker.js"]) {
        const text = readFileSync(join(folder, name), "utf8");
        writeFileSync(
            join(folder, name),
            name === "worker.js" ? `${text}\n` : text.replace("<h1>weeder", "<h1>weeder 2"),
        );
    }
    // In "Work with it": with a simulated row, a slow computer's browser delays the check.
    await page.reload();
    await newer.waitFor();
    await inspect(page, "desk-newer");
    assert.equal(await page.locator("h1").textContent(), "weeder");
    await page.getByRole("button", { name: "Load it" }).click();
    await page.locator("h1", { hasText: "weeder 2" }).waitFor();

    await server.close();
    await page.goto(`http://127.0.0.1:${server.port}/#try`);
    await page.locator("#try-panel [data-part=state]", { hasText: /hold|alarm/ }).waitFor();
    await page.context().close();
    assert.deepEqual(
        opened.errors.filter((error) => !error.includes("ERR_CONNECTION_REFUSED")),
        [],
    );
});

/** A device with changed lines in both directions. */
function changed(device: Device, change: (line: string) => string, sent: (line: string) => string): Device {
    let rest = "";
    return {
        open: () => device.open(),
        reset: () => device.reset(),
        close: () => device.close(),
        write: (bytes) => device.write(Buffer.from(sent(Buffer.from(bytes).toString("latin1")), "latin1")),
        read: () => {
            const bytes = device.read();
            if (!bytes) return undefined;
            const lines = (rest + Buffer.from(bytes).toString("latin1")).split("\n");
            rest = lines.pop() ?? "";
            return Buffer.from(lines.map((line) => `${change(line)}\n`).join(""), "latin1");
        },
    };
}

test("an Uno with another firmware is told with what changes, and gets its settings back when it is flashed", async (test) => {
    const before = await VirtualUno.start(test, "--elf", FIRMWARE, "--stand");
    const old = changed(
        before,
        (line) => line.replace(/weeder \d+\.\d+\.\d+/, "weeder 0.0.9").replace(/^no_plant_m\b/, "no_crop_m"),
        (line) => line.replace("no_crop_m", "no_plant_m"),
    );
    // The same board with the new firmware: its table is another one, so it has lost its settings.
    const flashed = await VirtualUno.start(test, "--bootloader", "optiboot", "--stand");
    const opened = await open(browser, "work", PHONE, [old, flashed]);
    const { page } = opened;
    const part = (name: string) => page.locator(`#view-work [data-part="${name}"]`);
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part("update-said")
        .filter({
            hasText:
                /This Uno has weeder 0\.0\.9, and this page has weeder \d.*no longer has no_crop_m\. It has no_plant_m as well\. The Uno loses its settings/,
        })
        .waitFor();
    await part("typed").fill("set margin_mm 40");
    await page.locator("#work-panel").getByRole("button", { name: "Send" }).click();
    await part("said").locator("div", { hasText: /^ok$/ }).waitFor();
    await inspect(page, "phone-update");
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "Save the settings and flash" }).click();
    await (await download).saveAs("build/files/before.toml");
    assert.match(readFileSync("build/files/before.toml", "utf8"), /\nno_crop_m = \d+\n/);
    await page.getByRole("button", { name: "Flash it" }).click();
    await page.getByRole("button", { name: "Work with it" }).click();
    await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    assert(await part("update").isHidden());
    await part("restore-go").click();
    await part("restore-said")
        .filter({ hasText: "The settings of before are saved. This firmware has no no_crop_m." })
        .waitFor();
    assert.equal(await page.locator("#work-panel [data-setting=margin_mm]").inputValue(), "40");
    await part("state").filter({ hasText: "hold" }).waitFor();
    assert(await part("restore").isHidden());
    await close(opened);
});
