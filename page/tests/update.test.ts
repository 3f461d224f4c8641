// The page as an app without a network, a newer page, a firmware that differs from the page's, and another Uno.

import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { cpSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import test, { after, before, type TestContext } from "node:test";
import type { Browser } from "playwright";
import {
    close,
    expect,
    inspect,
    launch,
    type Opened,
    open,
    openAt,
    PATIENCE_MS,
    PHONE,
    reload,
    served,
} from "./browser.ts";
import { type Device, VirtualUno } from "./ports.ts";

const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

/** A copy of the page on a server. */
async function installed(
    test: TestContext,
    isPatient = true,
): Promise<{ folder: string; address: string; close(): Promise<void> }> {
    const folder = mkdtempSync(join(tmpdir(), "weeder-app-"));
    test.after(() => rmSync(folder, { recursive: true }));
    cpSync("dist", folder, { recursive: true });
    // A busy computer may not start a page within the worker's 10 s.
    const worker = readFileSync(join(folder, "worker.js"), "utf8");
    assert.match(worker, /=1e4\b/);
    if (isPatient) writeFileSync(join(folder, "worker.js"), worker.replace(/=1e4\b/, "=6e4"));
    const { port, close } = await served(test, folder);
    // In "Work with it": with a simulated row, a slow computer's browser delays the check.
    return { folder, address: `http://127.0.0.1:${port}/#work`, close };
}

/** Makes another build of a copy: `change` changes the content of page.js, `html` that of index.html. */
function rebuild(folder: string, html: (text: string) => string, change = (text: string) => text): void {
    const read = (name: string) => readFileSync(join(folder, name), "utf8");
    const hash = (text: string) => createHash("sha256").update(text).digest("hex");
    const [page, script] = [read("index.html"), read("page.js")];
    const build = page.match(/page\.js\?(\w+)/)?.[1] ?? "";
    const other = hash(build).slice(0, 16);
    const texts = {
        "index.html": html(page).replaceAll(build, other),
        "page.js": change(script.replaceAll(build, other)),
    };
    const worker = read("worker.js")
        .replaceAll(build, other)
        .replace(hash(page), hash(texts["index.html"]))
        .replace(hash(script), hash(texts["page.js"]));
    for (const [name, text] of Object.entries({ ...texts, "worker.js": worker }))
        writeFileSync(join(folder, name), text);
}

const second = (text: string) => text.replace("<h1>weeder", "<h1>weeder 2");

/** Opens an address in a browser of its own, and waits until its page is stored. */
async function install(address: string): Promise<Opened> {
    const opened = await openAt(browser, address);
    await opened.page.evaluate(() => navigator.serviceWorker.ready);
    await reload(opened.page);
    return opened;
}

test("from localhost the page can be installed, opens without a network, and says when a newer one is there", async (test) => {
    const { folder, address, close } = await installed(test);
    const opened = await openAt(browser, address);
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
    await expect(newer).toBeHidden();

    rebuild(folder, second);
    await page.reload();
    await newer.waitFor();
    await inspect(page, "desk-newer");
    await expect(page.locator("h1")).toHaveText("weeder");
    const other = await page.context().newPage();
    // The server may have another page beside it.
    writeFileSync(join(folder, "other.html"), "<h1>other");
    await other.goto(address.replace("#work", "other.html"));
    await expect(other.locator("h1")).toHaveText("other");
    await other.goto(address);
    await page.getByRole("button", { name: "Load it" }).click();
    await page.locator("h1", { hasText: "weeder 2" }).waitFor();
    // The other tab has the button too, and the newer page is already there.
    await expect(other.locator("h1")).toHaveText("weeder");
    await other.getByRole("button", { name: "Load it" }).click();
    await other.locator("h1", { hasText: "weeder 2" }).waitFor();
    await page.waitForFunction(async () => (await caches.keys()).length === 1);

    await close();
    await page.goto(address.replace("work", "try"));
    await page.locator("#try-panel [data-part=state]", { hasText: /hold|work|alarm/ }).waitFor();
    await page.context().close();
    assert.deepEqual(
        opened.errors.filter((error) => !error.includes("ERR_CONNECTION_REFUSED")),
        [],
    );
});

test("a captive portal and every half of an upload leave the installed page as it is", async (test) => {
    const { folder, address } = await installed(test);
    const opened = await install(address);
    const { page } = opened;
    const PORTAL = "<!doctype html><title>Accept the terms</title>";
    const names = ["index.html", "page.css", "page.js", "manifest.webmanifest", "icon.svg", "worker.js"];
    rebuild(folder, second);
    const texts = names.map((name) => [name, readFileSync(join(folder, name), "utf8")] as const);
    const isInstalled = () =>
        page.evaluate(async () => {
            const registration = await navigator.serviceWorker.ready;
            await registration.update().catch(() => {});
            const { installing } = registration;
            const changed = new Promise((done) => installing?.addEventListener("statechange", done));
            if (installing) await changed;
            return registration.waiting !== null;
        });
    for (const [name, text] of texts)
        for (const content of [PORTAL, text.slice(0, text.length / 2)]) {
            writeFileSync(join(folder, name), content);
            assert.equal(await isInstalled(), false, `${name}: ${content.slice(0, 60)}`);
            writeFileSync(join(folder, name), text);
        }
    assert.equal(await isInstalled(), true);
    await page.context().close();
});

test("a newer page that does not start gives way to the older one, and can be tried again", async (test) => {
    const { folder, address } = await installed(test, false);
    const opened = await install(address);
    const { page } = opened;
    rebuild(folder, second, () => "throw new Error('broken')");
    await page.reload();
    await page.getByRole("button", { name: "Load it" }).click();
    await page.locator("h1", { hasText: "weeder 2" }).waitFor();
    // It is shown, and dead.
    await page.locator("h1", { hasText: /^weeder$/ }).waitFor();
    await page.waitForFunction(() => "simulation" in globalThis);
    await page.getByText("A newer page is there.").waitFor();
    await page.getByRole("button", { name: "Load it" }).click();
    await page.locator("h1", { hasText: "weeder 2" }).waitFor();
    await page.context().close();
});

test("a page of two builds does not start, and says so", async (test) => {
    const { folder, address } = await installed(test);
    const script = readFileSync(join(folder, "page.js"), "utf8");
    rebuild(folder, second);
    writeFileSync(join(folder, "page.js"), script);
    const page = await browser.newPage();
    await page.goto(address);
    await page.getByText("This page's files are of two versions").waitFor();
    assert.equal(await page.evaluate(() => "simulation" in globalThis), false);
    await page.close();
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
    for (const name of ["clear", "start"]) await part(name).click();
    await part("state").filter({ hasText: "work" }).waitFor();
    await page.getByRole("button", { name: "Save the settings and flash" }).click();
    await part("connection-said").filter({ hasText: "The machine is at work, hold first." }).waitFor();
    await part("hold").click();
    await part("state").filter({ hasText: "hold" }).waitFor();
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "Save the settings and flash" }).click();
    await (await download).saveAs("build/files/before.toml");
    assert.match(readFileSync("build/files/before.toml", "utf8"), /\nno_crop_m = \d+\n/);
    await page.getByRole("button", { name: "Flash it" }).click();
    await page.getByRole("button", { name: "Work with it" }).click({ timeout: 5 * PATIENCE_MS });
    await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    await expect(part("update")).toBeHidden();
    await part("restore-go").click();
    await part("restore-said")
        .filter({ hasText: "The settings of before are saved. This firmware has no no_crop_m." })
        .waitFor();
    await expect(page.locator("#work-panel [data-setting=margin_mm]")).toHaveValue("40");
    await part("state").filter({ hasText: "hold" }).waitFor();
    await expect(part("restore")).toBeHidden();
    await close(opened);
});

test("kept settings can be put back until the machine has saved them, with the calibration and the old gap", async (test) => {
    const uno = await VirtualUno.start(test, "--elf", FIRMWARE, "--stand");
    const opened = await open(browser, "work", PHONE, [uno]);
    const { page } = opened;
    const part = (name: string) => page.locator(`#view-work [data-part="${name}"]`);
    const kept = { ticks_per_rev: 2400, wheel_mm: 410, ticks_per_m: 1862, merge_gap_ticks: 100, lead_out_ms: 180 };
    await page.evaluate((kept) => localStorage.setItem("weeder.settings", kept), JSON.stringify(Object.entries(kept)));
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    for (const [at, line] of ["set ticks_per_m 1862", "save", "clear"].entries()) {
        await part("typed").fill(line);
        await page.locator("#work-panel").getByRole("button", { name: "Send" }).click();
        await part("said").locator("div", { hasText: /^ok$/ }).nth(at).waitFor();
    }
    const again = async () => {
        await page.getByRole("button", { name: "Disconnect" }).click();
        await part("state").filter({ hasText: "no machine" }).waitFor();
        await page.getByRole("button", { name: "Connect an Uno" }).click();
        await part("state").filter({ hasText: "hold" }).waitFor();
    };
    // It has saved settings now, but not these.
    await again();
    await part("restore-go").click();
    await part("restore-said")
        .filter({ hasText: /^The settings of before are saved\.$/ })
        .waitFor();
    await again();
    await expect(part("restore")).toBeHidden();
    // The factory's lead of the version with the old gap is not safe.
    for (const [name, value] of Object.entries({
        wheel_mm: 410,
        ticks_per_m: 1862,
        merge_gap_mm: 54,
        lead_out_ms: 230,
    }))
        await expect(page.locator(`#work-panel [data-setting=${name}]`), name).toHaveValue(String(value));
    await close(opened);
});

test("another Uno is not said to have restarted at work because the one before was at work", async (test) => {
    const before = await VirtualUno.start(test, "--elf", FIRMWARE);
    const other = await VirtualUno.start(test, "--elf", FIRMWARE, "--stand");
    const opened = await open(browser, "work", PHONE, [before, other]);
    const { page } = opened;
    const part = (name: string) => page.locator(`#view-work [data-part="${name}"]`);
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    for (const name of ["clear", "start"]) await part(name).click();
    await part("state").filter({ hasText: "work" }).waitFor();
    await page.getByRole("button", { name: "Disconnect" }).click();
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    await expect(part("alarm-advice")).toHaveText(/^Check get, /);
    await close(opened);
});

test("another Uno that is plugged in does not get what was typed for the one before, and the same one does", async (test) => {
    const uno = await VirtualUno.start(test, "--elf", FIRMWARE, "--stand");
    const other = await VirtualUno.start(test, "--elf", FIRMWARE, "--stand");
    const opened = await open(browser, "work", PHONE, [uno, other, uno]);
    const { page } = opened;
    const part = (name: string) => page.locator(`#view-work [data-part="${name}"]`);
    /** Pulls the cable, and plugs one in at another port. */
    const plugIn = async (port: number) => {
        uno.pull();
        await part("state").filter({ hasText: "no machine" }).waitFor();
        uno.plugIn();
        await page.evaluate((port) => {
            const { serial } = navigator as unknown as { serial: { ports: SerialPort[] } & EventTarget };
            const event = new Event("connect");
            Object.defineProperty(event, "target", { value: serial.ports[port] });
            serial.dispatchEvent(event);
        }, port);
    };
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    for (const [at, line] of ["save", "clear"].entries()) {
        await part("typed").fill(line);
        await page.locator("#work-panel").getByRole("button", { name: "Send" }).click();
        await part("said").locator("div", { hasText: /^ok$/ }).nth(at).waitFor();
    }
    await part("tab-settings").click();
    // The page knows by what is saved that it is the same one.
    await page.locator('#view-work [data-part="settings-send"]:disabled').waitFor();
    await page.locator("#work-panel [data-setting=margin_mm]").fill("31");
    await plugIn(2);
    await part("state").filter({ hasText: "hold" }).waitFor();
    await part("settings-send").filter({ hasText: "Send 1 change and save" }).waitFor();
    // Also at a later attempt.
    other.refuses = { name: "NetworkError", message: "Failed to open serial port." };
    await plugIn(1);
    await page.getByText(/Not connected: /).waitFor();
    delete other.refuses;
    await part("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    await part("settings-send")
        .filter({ hasText: /^Save$/ })
        .waitFor();
    await close(opened);
});
