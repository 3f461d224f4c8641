// The panel of a real Uno in a real browser: a virtual Uno at a serial port, with a machine that rolls along a row.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import test, { after, before, type TestContext } from "node:test";
import type { Browser, Page } from "playwright";
import { close, DESK, expect, inspect, launch, moving, PATIENCE_MS, PHONE } from "./browser.ts";
import * as panel from "./panel.ts";
import { FIRMWARE, part, type } from "./panel.ts";
import { type Device, Foreign, VirtualUno } from "./ports.ts";
import { WEEDER } from "./weeder.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
    mkdirSync("build/files", { recursive: true });
});

after(() => browser?.close());

/** Opens the panel and connects it to a device. */
const connect = (device: Device, viewport = DESK) => panel.connect(browser, device, viewport);

/** The panel of a virtual Uno with saved settings, whose machine rolls. */
const atHold = (test: TestContext, viewport = DESK, ...row: string[]) => panel.atHold(browser, test, viewport, ...row);

test("a new board shows its alarm with what to do, works, and holds, and all of that is on a phone's screen", async (test) => {
    const uno = await VirtualUno.start(test, "--elf", FIRMWARE);
    const opened = await connect(uno, PHONE);
    const { page } = opened;
    await moving(page);
    await part(page, "alarm-name").filter({ hasText: "Alarm 5-1 settings_lost" }).waitFor();
    await expect(part(page, "alarm-advice")).toHaveText(/^Check get, set what differs, save, clear\.$/);
    await inspect(page, "phone-alarm");
    await assertOnOneScreen(page, ["state", "why", "alarm-advice", "clear", "strip", "speed", "hold", "start"]);
    await part(page, "start").click();
    await part(page, "drive-said").filter({ hasText: "An alarm is latched" }).waitFor();
    await type(page, "save");
    await part(page, "clear").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await part(page, "why")
        .filter({ hasText: /weeds\.$/ })
        .waitFor();
    await part(page, "last-object")
        .filter({ hasText: /plant, 1\d\d mm wide, \d vote/ })
        .waitFor();
    await part(page, "why").filter({ hasText: "A plant is at the tool" }).waitFor();
    await expect(page.locator("#work-panel .canopy"), "a window is drawn").not.toHaveCount(0);
    await expect(part(page, "speed")).toHaveText(/^2\.[3-7]$/);
    await page.evaluate(() => globalThis.scrollTo(0, 0));
    await inspect(page, "phone-work");
    await assertOnOneScreen(page, "state why strip speed place teach-plant teach-weed hold start".split(" "));
    await part(page, "hold").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await close(opened);
});

test("the log of a row at work is replayed by weeder without a difference", async (test) => {
    const { page, errors } = await atHold(test);
    await part(page, "start").click();
    for (const object of [1, 2, 3])
        await part(page, "said")
            .getByText(/^(plant|unknown) pos=/)
            .nth(object)
            .waitFor();
    await part(page, "hold").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    const download = page.waitForEvent("download");
    await part(page, "log-save").click();
    await (await download).saveAs("build/files/log.csv");
    const replayed = execFileSync(WEEDER, ["replay", "build/files/log.csv"], { encoding: "utf8" });
    assert.match(replayed, /^The same: ([3-9]|[1-9]\d+) detections, 0 alarms and [1-9]\d* swings/);
    await close({ page, errors });
});

/** Asserts that these parts are visible without scrolling, and that buttons are as large as a thumb. */
async function assertOnOneScreen(page: Page, names: string[]): Promise<void> {
    for (const name of names) {
        const box = await part(page, name).boundingBox();
        assert(box && box.y >= 0 && box.y + box.height <= PHONE.height, `${name} is at ${JSON.stringify(box)}`);
        const isButton = await part(page, name).evaluate((element) => element instanceof HTMLButtonElement);
        if (isButton) assert(box.height >= 44 && box.width >= 44, `${name} is ${box.width} x ${box.height}`);
    }
}

test("a setting that is sent is saved, and there after a reset", async (test) => {
    const { page, errors } = await atHold(test);
    await page.getByRole("tab", { name: "Settings" }).click();
    const margin = page.locator("#work-panel [data-setting=margin_mm]");
    await page.getByText(/kept on both sides of a canopy \(0 to 200 mm, default 50\)/).waitFor();
    await margin.fill("55");
    await page.getByRole("button", { name: "Send 1 change and save" }).click();
    await part(page, "settings-said").filter({ hasText: "Saved" }).waitFor();
    await inspect(page, "desk-settings");
    // A change that was not sent is this machine's. The next one that is chosen may be another.
    await margin.fill("60");
    await page.getByRole("button", { name: "Disconnect" }).click();
    await part(page, "state").filter({ hasText: "no machine" }).waitFor();
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await expect(margin).toHaveValue("55");
    await expect(part(page, "settings-said")).toHaveText("");
    await close({ page, errors });
});

test("a value that cannot be is refused beside its field, in the machine's words", async (test) => {
    const { page, errors } = await atHold(test);
    await page.getByRole("tab", { name: "Settings" }).click();
    // The second is four thousand to some operators, and 4 to the browser.
    for (const [name, value, range] of [
        ["k", "99", "1 to 15"],
        ["ticks_per_m", "4.000", "0 to 20000"],
    ] as const) {
        await page.locator(`#work-panel [data-setting=${name}]`).fill(value);
        await page.getByRole("button", { name: "Send 1 change and save" }).click();
        await page.locator("#work-panel .problem", { hasText: `${name} takes a whole number from ${range}` }).waitFor();
        await part(page, "settings-said").filter({ hasText: "1 of 1 were refused, and nothing is saved" }).waitFor();
        await page.locator("#work-panel [data-part=settings-undo]").click();
    }
    await close({ page, errors });
});

test("settings go to a file that weeder reads, and come from one, in any order", async (test) => {
    const { page, errors } = await atHold(test);
    await page.getByRole("tab", { name: "Settings" }).click();
    // The settings' descriptions come after the settings.
    await page.getByText(/X, from the tool to the beam/).waitFor();
    const download = page.waitForEvent("download");
    await page.getByRole("button", { name: "To a file" }).click();
    await (await download).saveAs("build/files/machine.toml");
    const text = readFileSync("build/files/machine.toml", "utf8");
    assert.match(text, /\n# wheel diameter\n# 200 to 800 mm, default 400\nwheel_mm = 400\n/);
    // A lead that needs a longer distance from beam to tool comes before it.
    writeFileSync(
        "build/files/other.toml",
        "# mine\nlead_out_ms = 400\nbeam_to_tool_mm = 900 # far\nend_switch = false\n",
    );
    await part(page, "settings-file").setInputFiles("build/files/other.toml");
    await part(page, "settings-said").filter({ hasText: "2 differ from the machine's" }).waitFor();
    await page.getByRole("button", { name: "Send 2 changes and save" }).click();
    await part(page, "settings-said").filter({ hasText: "Saved" }).waitFor();
    writeFileSync("build/files/wrong.toml", "k = 3\nwheel = 400\n");
    await part(page, "settings-file").setInputFiles("build/files/wrong.toml");
    await part(page, "settings-said")
        .filter({ hasText: "wrong.toml, line 2 of the file: there is no setting wheel" })
        .waitFor();
    await close({ page, errors });
});

/** Lets the browser notice that a cable is back. */
function plugIn(page: Page): Promise<void> {
    return page.evaluate(() => {
        const { serial } = navigator as unknown as { serial: { ports: SerialPort[] } & EventTarget };
        const event = new Event("connect");
        Object.defineProperty(event, "target", { value: serial.ports[0] });
        serial.dispatchEvent(event);
    });
}

test("a cable that is pulled at work is told, and the machine is there again when it is back", async (test) => {
    const { page, errors, uno } = await atHold(test);
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    uno.pull();
    await part(page, "state").filter({ hasText: "no machine" }).waitFor();
    await part(page, "why")
        .filter({
            hasText:
                /The port is gone: its cable was pulled.*plug it in again.*weeds on: its work switch takes the tool out/,
        })
        .waitFor();
    await expect(part(page, "start")).toBeDisabled();
    await page.getByText("If it does not connect by itself, press Connect an Uno.").waitFor();
    await inspect(page, "desk-pulled");
    await page.getByRole("link", { name: "Log" }).click();
    await page.keyboard.press("Escape");
    await part(page, "drive-said").filter({ hasText: "HOLD has not come through" }).waitFor();
    // Another program is faster the first time.
    uno.plugIn();
    uno.refuses = { name: "NetworkError", message: "Failed to open serial port." };
    await plugIn(page);
    await page.getByText(/Not connected: /).waitFor();
    delete uno.refuses;
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await close({ page, errors });
});

test("a machine at work is not flashed, and one that is disconnected at work weeds on", async (test) => {
    const { page, errors } = await atHold(test);
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await page.getByRole("link", { name: "Flash" }).click();
    await page.getByRole("button", { name: "Flash it" }).click();
    await page.getByText("Not flashed: the machine is at work, hold first.").waitFor();
    await page.getByRole("link", { name: "Work" }).click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    // A HOLD that has not come through by then is not sent again, and the page does not promise it.
    await page.evaluate(() => {
        for (const name of ["hold", "disconnect"])
            document.querySelector<HTMLElement>(`#view-work [data-part=${name}]`)?.click();
    });
    await part(page, "why")
        .filter({ hasText: /No machine is connected\. .* weeds on: its work switch takes the tool out/ })
        .waitFor();
    await part(page, "drive-said").filter({ hasText: /^$/ }).waitFor({ state: "attached" });
    await close({ page, errors });
});

test("a device that is no weeder is told by what it says, and the port is let go of", async () => {
    const opened = await connect(new Foreign(() => [], "$GPGGA,123519,4807.038,N\r\n"));
    await part(opened.page, "why")
        .filter({ hasText: "It is not the weeder's firmware that answers, but \"$GPGGA" })
        .waitFor();
    await opened.page.getByRole("button", { name: "Connect an Uno" }).waitFor();
    await close(opened);
});

test("a port that another program has is told with the way out", async () => {
    const refuses = { name: "NetworkError", message: "Failed to open serial port." };
    const opened = await connect(new Foreign(() => [], "", refuses));
    await opened.page.getByText(/Not connected: .*close the other tab first, then the serial monitor/).waitFor();
    await close(opened);
});

test("the wheel is calibrated over a measured stretch", async (test) => {
    const { page, errors, uno } = await atHold(test, PHONE, "--roll");
    await page.getByRole("tab", { name: "Calibrate" }).click();
    await part(page, "wheel-end").click();
    await part(page, "wheel-said").filter({ hasText: "calibrate start first, then roll" }).waitFor();
    await part(page, "wheel-begin").click();
    await part(page, "wheel-said").filter({ hasText: "Roll to the other mark" }).waitFor();
    uno.type("4000");
    const rolled = part(page, "wheel-rolled").filter({ hasText: /^(3\.9|4\.)/ });
    await rolled.waitFor();
    // A stretch ends where the machine stands.
    await part(page, "speed").filter({ hasText: /^0\.0/ }).waitFor();
    // Twice the wheel's value: no wheel has such a large error.
    const measuredMm = 2000 * Number.parseFloat((await rolled.textContent()) ?? "");
    await part(page, "wheel-mm").fill(measuredMm.toFixed(0));
    await part(page, "wheel-end").click();
    await part(page, "wheel-said").filter({ hasText: "look again, or add force" }).waitFor();
    await part(page, "wheel-force").click();
    await part(page, "wheel-said")
        .filter({ hasText: /^[\d,]+ encoder counts a metre/ })
        .waitFor();
    // After a reset the position begins at 0, and no stretch has begun.
    await page.getByRole("button", { name: "Disconnect" }).click();
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await part(page, "wheel-rolled").filter({ hasNotText: /\d/ }).waitFor();
    await close({ page, errors });
});

test("a machine that stood still for seconds is there again over the same port, and takes commands", async (test) => {
    const { page, errors, uno } = await atHold(test, PHONE, "--stand");
    uno.pause(true);
    await part(page, "state").filter({ hasText: "no machine" }).waitFor();
    uno.pause(false);
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await type(page, "get k");
    await close({ page, errors });
});

test("the servo is calibrated by eye, and timed, while the machine stands", async (test) => {
    const { page, errors, uno } = await atHold(test, PHONE, "--stand");
    await page.getByRole("tab", { name: "Calibrate" }).click();
    await part(page, "servo-in").click();
    await part(page, "servo-said").filter({ hasText: "The tool has 1500 us." }).waitFor();
    await part(page, "servo-more").click();
    await part(page, "servo-said").filter({ hasText: "The tool has 1510 us." }).waitFor();
    await part(page, "servo-in-is").click();
    await part(page, "servo-said").filter({ hasText: "1510 us is the tool in the row now" }).waitFor();
    await part(page, "servo-time").click();
    // Six swings take 20 s of the chip's time.
    await part(page, "servo-said")
        .filter({ hasText: "Enter the longest swing out" })
        .waitFor({ timeout: 5 * PATIENCE_MS });
    await part(page, "lead_out_ms").fill("150");
    await part(page, "servo-leads").click();
    await part(page, "servo-said").filter({ hasText: "Both leads are set" }).waitFor();
    // The steps and the next step are the manual's.
    await part(page, "set-up-steps").filter({ hasText: "Time the servo" }).waitFor();
    await part(page, "margin-said")
        .filter({ hasText: "Next, time the servo: calibrate servo (1 of 2 done)" })
        .waitFor();
    await inspect(page, "phone-calibrate");
    await part(page, "servo-save").click();
    await part(page, "servo-said").filter({ hasText: "Saved." }).waitFor();
    // The measurements and marks are this machine's. The next one that is chosen may be another.
    const mark = part(page, "set-up-steps").getByRole("checkbox").first();
    await mark.check();
    const beam = part(page, "set-up-steps").locator("[data-step=beam_to_tool_mm]");
    await beam.fill("777");
    uno.pull();
    await part(page, "state").filter({ hasText: "no machine" }).waitFor();
    uno.plugIn();
    await plugIn(page);
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await part(page, "margin-said").filter({ hasText: "(1 of 2 done)" }).waitFor();
    await expect(mark).toBeChecked();
    // A reset has taken the tool out.
    await expect(part(page, "servo-pulse")).toHaveValue("2000");
    await expect(part(page, "servo-said")).toHaveText("");
    await page.getByRole("button", { name: "Disconnect" }).click();
    await page.getByRole("button", { name: "Connect an Uno" }).click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await part(page, "margin-said").filter({ hasNotText: "(1 of 2 done)" }).waitFor();
    await expect(mark).not.toBeChecked();
    await expect(beam).toHaveValue("400");
    await type(page, "set servo_out_us 1900");
    await page.waitForFunction(
        () => document.querySelector<HTMLInputElement>("#work-panel [data-part=servo-pulse]")?.value === "1900",
    );
    await close({ page, errors });
});

test("an object is taught by a button, and one that the built-in examples know better is insisted on", async (test) => {
    const { page, errors, uno } = await atHold(test, PHONE, "--weeds", "0", "--plants", "2", "--roll");
    uno.type("");
    await page.getByRole("tab", { name: "Taught" }).click();
    await part(page, "examples-count").filter({ hasText: "0 of 32" }).waitFor();
    await part(page, "last-object").filter({ hasText: "Last: plant" }).waitFor();
    await part(page, "speed").filter({ hasText: /^0\.0/ }).waitFor();
    await part(page, "teach-weed").click();
    await part(page, "teach-said").filter({ hasText: "the built-in examples say plant, look again" }).waitFor();
    await inspect(page, "phone-teach");
    // The machine would label another detection than the operator has seen.
    const insist = page.getByRole("button", { name: "It is a weed" });
    await insist.waitFor();
    uno.type("");
    await insist.waitFor({ state: "hidden" });
    await part(page, "speed").filter({ hasText: /^0\.0/ }).waitFor();
    await part(page, "teach-weed").click();
    await insist.click();
    await part(page, "examples-count").filter({ hasText: "1 of 32" }).waitFor();
    await page.getByRole("button", { name: "Forget example 0" }).click();
    await part(page, "examples-count").filter({ hasText: "0 of 32" }).waitFor();
    // A list that is not read says why.
    await page.evaluate(() => {
        for (const name of ["examples-read", "examples-read", "examples-read", "hold"])
            document.querySelector<HTMLElement>(`#work-panel [data-part=${name}]`)?.click();
    });
    await part(page, "teach-said").filter({ hasText: "HOLD" }).waitFor();
    await close({ page, errors });
});

test("closing the page is asked for while a machine is at work or the log is not saved", async (test) => {
    const { page, errors } = await atHold(test);
    /** Whether the browser asks before it closes the page. The answer is no. */
    const asks = async () => {
        const asked = page.waitForEvent("dialog");
        await Promise.race([page.close({ runBeforeUnload: true }), asked]);
        const dialog = await asked;
        assert.equal(dialog.type(), "beforeunload");
        await dialog.dismiss();
    };
    await part(page, "start").click();
    await part(page, "state").filter({ hasText: "work" }).waitFor();
    await asks();
    await part(page, "hold").click();
    await part(page, "state").filter({ hasText: "hold" }).waitFor();
    await asks();
    const download = page.waitForEvent("download");
    await part(page, "log-save").click();
    await download;
    // The machine stands in hold, so that no new detection is logged.
    assert.deepEqual(errors, []);
    await page.getByRole("button", { name: "Disconnect" }).click();
    const closed = page.waitForEvent("close");
    await page.close({ runBeforeUnload: true });
    await closed;
});

test("pasted lines are typed one by one, whatever ends them, and HOLD drops the rest", async (test) => {
    const { page, errors } = await atHold(test, DESK, "--stand");
    const typed = part(page, "typed");
    const paste = (text: string) =>
        typed.evaluate((input, text) => {
            const clipboardData = new DataTransfer();
            clipboardData.setData("text/plain", text);
            input.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        }, text);
    const lines = () => part(page, "said").locator("div.typed").allTextContents();
    const before = (await lines()).length;
    await paste("set margin_mm 41\nset stem_zone_mm 0\r\n\r  get margin_mm\r");
    await part(page, "said")
        .getByText(/^margin_mm=41/)
        .waitFor();
    assert.deepEqual((await lines()).slice(before), ["> set margin_mm 41", "> set stem_zone_mm 0", "> get margin_mm"]);
    await paste("x".repeat(200));
    await part(page, "said").getByText("send 80 characters at most").waitFor();
    await page.evaluate(() => {
        const input = document.querySelector("#work-panel [data-part=typed]");
        const clipboardData = new DataTransfer();
        clipboardData.setData("text/plain", `${"examples\n".repeat(30)}start`);
        input?.dispatchEvent(new ClipboardEvent("paste", { clipboardData, bubbles: true, cancelable: true }));
        document.querySelector<HTMLElement>("#work-panel [data-part=hold]")?.click();
    });
    await part(page, "said").locator("div.typed", { hasText: "> hold" }).waitFor();
    await type(page, "get k");
    assert(!(await lines()).includes("> start"));
    await part(page, "said").getByText("start: hold came first, so this was not sent").waitFor();
    await close({ page, errors });
});

test("the console follows again after another tab, unless it was scrolled back", async (test) => {
    const { page, errors } = await atHold(test, PHONE, "--stand");
    const said = part(page, "said");
    const isAtTheEnd = () => said.evaluate((it) => it.scrollHeight - it.scrollTop - it.clientHeight < 8);
    for (let time = 0; time < 3; time++) await type(page, "get");
    assert(await isAtTheEnd());
    for (const [leave, back] of [
        [page.getByRole("tab", { name: "Settings" }), page.getByRole("tab", { name: "Console" })],
        [page.getByRole("link", { name: "Flash" }), page.getByRole("link", { name: "Work" })],
    ] as const) {
        await leave.click();
        await said.waitFor({ state: "hidden" });
        await back.click();
        await said.waitFor();
        await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
        assert(await isAtTheEnd());
        await type(page, "get k");
        assert(await isAtTheEnd());
    }
    await said.evaluate((it) => it.scrollTo(0, 0));
    await type(page, "get k");
    assert.equal(await said.evaluate((it) => it.scrollTop), 0);
    await close({ page, errors });
});
