// The flasher in a real browser: it flashes the HEX to a virtual Uno through the Uno's own bootloader, and reports
// errors.

import assert from "node:assert/strict";
import { resolve } from "node:path";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright";
import { hex } from "../src/core.ts";
import { BOARDS, type Board, Bootloader } from "../src/flasher/stk500.ts";
import type { SerialLine } from "../src/link/serial.ts";
import { FLASH_BYTES } from "../src/uno/chip.ts";
import { readHex, usedBytes } from "../src/uno/hex.ts";
import { close, expect, inspect, launch, open, PATIENCE_MS, PHONE, served } from "./browser.ts";
import { type Device, Foreign, offerPorts, VirtualUno } from "./ports.ts";

const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");
const OPTIBOOT = ["--bootloader", "optiboot"];
const OLD = ["--bootloader", "/usr/share/arduino/hardware/arduino/avr/bootloaders/atmega/ATmegaBOOT_168_atmega328.hex"];

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

/** Presses the button and waits until it is enabled again. Returns the message. */
async function flash(page: Page): Promise<string> {
    const button = page.getByRole("button", { name: "Flash it" });
    await button.click();
    await page.locator("[data-part=flash-said]:not(:empty)").waitFor({ timeout: 5 * PATIENCE_MS });
    return (await page.locator("[data-part=flash-said]").textContent()) ?? "";
}

/** Flashes until it is done: a busy computer may be too late for the bootloader. Returns the message. */
async function flashed(page: Page, before = () => {}): Promise<string> {
    for (let tries = 1; ; tries++) {
        before();
        const said = await flash(page);
        if (said.startsWith("Done: ")) return said;
        assert(tries < 5 && said.includes("bootloader"), said);
    }
}

/** The message after flashing this device. */
async function said(device: Device): Promise<string> {
    const opened = await open(browser, "flash", undefined, [device]);
    const text = await flash(opened.page);
    assert.match(text, /^Not flashed: .*\.$/);
    await expect(opened.page.getByRole("button", { name: "Flash it" })).toBeEnabled();
    await close(opened);
    return text;
}

test("an Uno with an empty flash is flashed through its bootloader, and is worked with then", async (test) => {
    const uno = await VirtualUno.start(test, ...OPTIBOOT);
    const opened = await open(browser, "flash", PHONE, [uno]);
    const { page } = opened;
    const flashing = flashed(page);
    await page.locator("[data-part=phase]", { hasText: /Writing: [1-9]\d*%/ }).waitFor();
    await inspect(page, "phone-flashing");
    const done = await flashing;
    assert.match(done, /^Done: \d\d,\d{3} bytes were written and read back in [\d.]+ sec\.$/);
    test.diagnostic(done);
    await inspect(page, "phone-flashed");
    await page.getByRole("button", { name: "Work with it" }).click();
    await page.locator("#work-panel [data-part=alarm-name]", { hasText: "5-1 settings_lost" }).waitFor();
    await close(opened);
});

test("the Uno alone leaves more than 30 KiB: a Nano starts at 0x7800 with each bootloader", () => {
    const roomy = BOARDS.filter(({ roomBytes }) => roomBytes > 0x7800).map(({ id }) => id);
    assert.deepEqual(roomy, ["uno"]);
});

test("an old bootloader is flashed at its own rate and its fault is told, or that it leaves too little", async (test) => {
    const uno = await VirtualUno.start(test, ...OLD);
    const opened = await open(browser, "flash", undefined, [uno]);
    const board = BOARDS.find(({ isOld }) => isOld);
    assert(board);
    await opened.page.getByLabel("Board").selectOption(board.id);
    // Before it is flashed.
    const fault = opened.page.getByText("the machine does not restart after a stop by its watchdog");
    await fault.waitFor();
    await inspect(opened.page, "desk-old-board");
    const fits = usedBytes(readHex(hex, FLASH_BYTES)) <= board.roomBytes;
    if (fits) await flashed(opened.page);
    else
        assert.match(
            await flash(opened.page),
            /^Not flashed: the firmware takes \d+ bytes, and this board's bootloader leaves 30720: give it the Uno's bootloader/,
        );
    await close(opened);
});

test("a cable that is pulled while it is flashed is told, and the same board is flashed when it is back", async (test) => {
    const uno = await VirtualUno.start(test, ...OPTIBOOT);
    const opened = await open(browser, "flash", undefined, [uno]);
    uno.pullAfterBytes = 5000;
    assert.match(await flash(opened.page), /^Not flashed: the port is gone: .*plug it in again, and flash it again/);
    uno.plugIn();
    await flashed(opened.page);
    await close(opened);
});

test("the first page jumps to itself until all others are written", async () => {
    // Timers as the browser's worker has them.
    class Timers extends EventTarget {
        postMessage([data, ms]: [number, number]) {
            setTimeout(() => this.dispatchEvent(new MessageEvent("message", { data })), ms);
        }
    }
    Object.assign(globalThis, { Worker: Timers });
    for (const pages of [1, 3]) {
        const [writes, memory]: [number[], number[]] = [[], new Array(384).fill(0xee)];
        let at = 0;
        const answer = ([command = 0, low = 0, high = 0, , ...data]: number[]): number[] => {
            if (command === 0x75) return [0x1e, 0x95, 0x0f];
            if (command === 0x55) at = 2 * (low + 256 * high);
            if (command === 0x64) {
                writes.push(at);
                memory.splice(at, 128, ...data.slice(0, -1));
                if (writes.length <= pages) assert.deepEqual(memory.slice(0, 3), [0xff, 0xcf, 0xff]);
            }
            return command === 0x74 ? memory.slice(at, at + 128) : [];
        };
        const line = {
            onBytes: (_: number[]) => {},
            reset: async () => {},
            write: async (bytes: Uint8Array) => line.onBytes([0x14, ...answer([...bytes]), 0x10]),
        };
        const image = Uint8Array.from({ length: 128 * pages }, (_, place) => place % 251);
        const shares: number[] = [];
        const bootloader = new Bootloader(line as unknown as SerialLine, BOARDS[0] as Board);
        await bootloader.flash(image, ({ phase, share }) => phase === "writing" && shares.push(share));
        assert.deepEqual(writes, [0, ...[128, 256].slice(0, pages - 1), 0]);
        assert.deepEqual(memory.slice(0, image.length), [...image]);
        assert.deepEqual(
            shares,
            shares.map((_, done) => done / (pages + 1)),
        );
    }
});

test("a byte that is lost on the way is sent again", async (test) => {
    const uno = await VirtualUno.start(test, ...OPTIBOOT);
    const opened = await open(browser, "flash", undefined, [uno]);
    await flashed(opened.page, () => uno.lose(3000, 9000));
    assert.deepEqual(uno.loseBytes, []);
    await close(opened);
});

/** Puts the page into the background, where each of its own timers takes a second or more. */
async function hide(page: Page): Promise<void> {
    await page.evaluate(() => {
        Object.defineProperty(document, "hidden", { value: true });
        document.dispatchEvent(new Event("visibilitychange"));
        const later = setTimeout;
        Object.assign(globalThis, {
            setTimeout: (done: () => void, ms = 0) => later(done, Math.max(ms, 1100)),
        });
    });
}

test("an Uno is flashed in a hidden tab too, through the bootloader's second", async (test) => {
    const uno = await VirtualUno.start(test, ...OPTIBOOT);
    const opened = await open(browser, "flash", undefined, [uno]);
    await hide(opened.page);
    await flashed(opened.page);
    await close(opened);
});

test("a failure in a hidden tab names that first thing to change", async () => {
    const opened = await open(browser, "flash", undefined, [new Foreign(() => [])]);
    const flashing = flash(opened.page);
    await opened.page.getByText("keep this tab in front").waitFor();
    await hide(opened.page);
    assert.match(await flashing, /^Not flashed: no bootloader.*\. This tab was hidden meanwhile: keep it in front/);
    await close(opened);
});

test("a port that another tab of the page has open is told, and free when that tab disconnects", async (test) => {
    const uno = await VirtualUno.start(test, "--elf", FIRMWARE);
    const first = await open(browser, "work", undefined, [uno]);
    const { page } = first;
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await page.locator("#work-panel [data-part=state]", { hasText: "alarm" }).waitFor();
    // As Chromium refuses a port that is open elsewhere.
    const taken = new Foreign(() => [], "", { name: "NetworkError", message: "Failed to open serial port." });
    const tab = await page.context().newPage();
    await offerPorts(tab, [taken]);
    await tab.goto(page.url().replace("#work", "#flash"));
    await tab.waitForFunction(() => "simulation" in globalThis);
    assert.match(await flash(tab), /^Not flashed: another tab of this page has a port open: disconnect there/);
    await page.getByRole("button", { name: "Disconnect" }).click();
    await page.getByRole("button", { name: "Connect an Uno" }).waitFor();
    assert.match(await flash(tab), /^Not flashed: the port cannot be opened\./);
    await close(first);
});

test("a device that babbles is told from an Uno by what it says", async () => {
    const text = await said(new Foreign(() => [], "$GPGGA,123519,4807.038,N,01131.000,E\r\n"));
    assert.match(text, /something else answers at this port: \u201c\$GPGGA,123519/);
});

test("a port at which nothing answers is told with what to try", async () => {
    assert.match(await said(new Foreign(() => [])), /no bootloader answers at 115200 baud.*old bootloader.*D0 and D1/);
});

test("the firmware without a bootloader is known by its greeting", async () => {
    const text = await said(new Foreign(() => [], "weeder 0.2.0, reset by power_on, state hold, tool out\r\n"));
    assert.match(text, /the weeder's firmware answers, and no bootloader.*press the board's reset/);
});

test("another chip is named, and nothing is written to it", async () => {
    const commands: number[] = [];
    const mega = new Foreign(([command = 0]) => {
        commands.push(command);
        return command === 0x75 ? [0x14, 0x1e, 0x98, 0x01, 0x10] : [0x14, 0x10];
    });
    assert.match(await said(mega), /this board has another chip, ATmega2560 \(Mega\): nothing was written/);
    assert.deepEqual(
        commands.filter((command) => command !== 0x30 && command !== 0x75),
        [],
    );
});

test("a byte that reads back wrong is told", async () => {
    const worn = new Foreign(([command = 0]) => {
        if (command === 0x75) return [0x14, 0x1e, 0x95, 0x0f, 0x10];
        return command === 0x74 ? [0x14, ...new Array(128).fill(0), 0x10] : [0x14, 0x10];
    });
    assert.match(await said(worn), /byte \d+ reads back as 0, and \d+ was written: flash it again/);
});

test("a port that cannot be opened is told with both causes, as the browser tells neither", async () => {
    const refuses = { name: "NetworkError", message: "Failed to open serial port." };
    const text = await said(new Foreign(() => [], "", refuses));
    assert.match(text, /tab or another program has it: close the other tab first.*usermod -aG dialout.*snap connect/);
});

test("where no port is chosen, the way to one is told", async () => {
    const opened = await open(browser, "flash", undefined, []);
    assert.match(await flash(opened.page), /No port was chosen.*a cable that carries data.*snap connect chromium/);
    await close(opened);
});

test("a browser without Web Serial is told so, with the HEX and the command that works there", async () => {
    const page = await browser.newPage({ viewport: PHONE });
    await page.addInitScript(() => {
        // As in Firefox and Safari.
        Reflect.deleteProperty(Navigator.prototype, "serial");
    });
    await page.goto(new URL("dist/index.html#flash", `file://${process.cwd()}/`).href);
    await page.locator("#view-flash").getByText("This browser has no Web Serial.").waitFor();
    await expect(page.getByRole("button", { name: "Flash it" })).toBeDisabled();
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "Save the HEX as a file" }).click();
    const file = await download;
    assert.equal(file.suggestedFilename(), "weeder.hex");
    // A browser may ask before it reads the file.
    await page.waitForTimeout(1500);
    assert((await page.evaluate(async (url) => (await fetch(url)).text(), file.url())).startsWith(":"));
    await inspect(page, "phone-no-serial");
    await page.close();
});

test("over plain http from another computer the page says why there is no port, and where there is one", async (test) => {
    const { port } = await served(test, "dist");
    const page = await browser.newPage({ viewport: PHONE });
    await page.goto(`http://weeder.test:${port}/#work`);
    await page
        .locator("#view-work")
        .getByText(/plain http.* Open the page's folder on the computer that has the Uno/)
        .waitFor();
    await expect(page.getByRole("button", { name: "Connect an Uno" })).toBeDisabled();
    await inspect(page, "phone-plain-http");
    await page.close();
});
