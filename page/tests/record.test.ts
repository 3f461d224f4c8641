// Viewing a log in the page: the page's own log, drawn, moved, zoomed and replayed; and the log of a long day.

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright";
import { close, expect, inspect, launch, type Opened, open, openAt } from "./browser.ts";
import { folder, plugIn, serve } from "./serving.ts";
import { part, tryIt } from "./trying.ts";
import { WEEDER } from "./weeder.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
    mkdirSync("build/files", { recursive: true });
});

after(() => browser?.close());

const inView = (page: Page, name: string) => page.locator(`#view-record [data-part="${name}"]`);

async function openLog(file: string): Promise<Opened> {
    const opened = await open(browser, "record");
    await inView(opened.page, "log-file").setInputFiles(file);
    await inView(opened.page, "log-said").filter({ hasText: /./ }).waitFor();
    return opened;
}

test("a log of the page is drawn with what was seen, kept free and worked, led through by its alarms, and replayed", async () => {
    const tried = await tryIt(browser);
    await tried.page.getByLabel("Work switch").check();
    await part(tried.page, "state").filter({ hasText: "work" }).waitFor();
    // As a page has time for, so that the statuses come as often as they do.
    await tried.page.locator("#time").selectOption("4");
    await tried.page.waitForFunction(() => globalThis.simulation.machine.toolMm > 4000);
    await tried.page.getByLabel("Kill the encoder").check();
    await part(tried.page, "alarm-name").filter({ hasText: "encoder_silent" }).waitFor();
    const saved = tried.page.waitForEvent("download");
    await part(tried.page, "log-save").click();
    await (await saved).saveAs("build/files/look.csv");
    // A new log drops nothing: what came since is saved first.
    await part(tried.page, "hold").click();
    const savedFirst = tried.page.waitForEvent("download");
    await part(tried.page, "log-clear").click();
    await savedFirst;
    await close(tried);

    const log = readFileSync("build/files/look.csv", "utf8");
    const lines = (kind: RegExp) => log.split("\n").filter((line) => kind.test(line)).length;
    const opened = await openLog("build/files/look.csv");
    const { page } = opened;
    const told = (await inView(page, "log-said").textContent()) ?? "";
    const [, detections, swings, alarms] = /(\d+) detections, (\d+) swings, (\d+) alarm/.exec(told) ?? [];
    assert.equal(Number(detections), lines(/,event,(plant|weed|unknown) /), told);
    assert.equal(Number(swings), lines(/,event,swing /), told);
    assert.equal(Number(alarms), lines(/,event,(alarm|warning) /), told);
    assert(Number(detections) >= 6 && Number(alarms) >= 1, told);
    const drawn = async (selector: string) => {
        // It is drawn in the next frame.
        await page.evaluate(() => new Promise(requestAnimationFrame));
        return inView(page, "log-drawing").locator(selector).count();
    };
    assert((await drawn(".canopy")) >= 5 && (await drawn(".window")) >= 5);
    assert((await drawn(".worked")) >= 4);
    const all = await drawn(".canopy");
    for (let presses = 0; presses < 3; presses++) await inView(page, "log-closer").click();
    assert((await drawn(".canopy")) < all, "closer there is less");
    const place = async () => Number(await inView(page, "log-place").inputValue());
    await inView(page, "log-place").fill("0");
    await inView(page, "alarm-next").click();
    await inView(page, "log-alarm")
        .filter({ hasText: /^(Alarm|Warning) .*: [A-Z].*\.$/ })
        .waitFor();
    assert((await place()) > 0);
    // There may be a warning beside it.
    const alarmsDrawn = await drawn(".flag");
    assert(alarmsDrawn >= 1 && alarmsDrawn <= Number(alarms), `${alarmsDrawn} of ${alarms} alarms`);
    while (!/no alarm behind/.test((await inView(page, "log-alarm").textContent()) ?? ""))
        await inView(page, "alarm-next").click();
    await inView(page, "alarm-before").click();
    await inView(page, "log-replay").click();
    await inView(page, "log-replayed")
        .filter({
            hasText:
                /^On \d+ detections, \d+ alarms and \d+ swings both agree\. The decisions are those of this version\./,
        })
        .waitFor();
    await inspect(page, "desk-log");
    await close(opened);
});

test("a file that is no log is told, and so is one without a machine", async () => {
    writeFileSync("build/files/diary.csv", "day,what\n1,rain\n");
    writeFileSync("build/files/none.csv", "time_ms,kind,line\n0,lost,gone\n");
    for (const [file, said] of [
        ["diary.csv", /^diary\.csv is no log: .*time_ms/],
        ["none.csv", /^none\.csv has no machine in it\./],
    ] as const) {
        const opened = await openLog(`build/files/${file}`);
        await expect(inView(opened.page, "log-said")).toHaveText(said);
        await expect(inView(opened.page, "log-body")).toBeHidden();
        await close(opened);
    }
});

test("a log that lacks the settings behind revert says from when on it is not drawn", async () => {
    const status = (ms: number) => `${ms},status,state=work tool=in pos=${ms} speed_mm_s=500 windows=0 unseen_mm=0`;
    const reverted = ["2000,command,revert", "3000,answer,ok"];
    const connected = ["0,connected,0.2.0", "0,setting,ticks_per_m=2000"];
    const lines = ["time_ms,kind,line", ...connected, status(0), status(2000), ...reverted, status(9000)];
    writeFileSync("build/files/reverted.csv", `${lines.join("\n")}\n`);
    const opened = await openLog("build/files/reverted.csv");
    await expect(inView(opened.page, "log-said")).toHaveText(
        /^reverted\.csv: .* From 9\.0 sec on nothing is drawn or counted, /,
    );
    await close(opened);
});

test("the buttons lead to each of several alarms at one position", async () => {
    const status = (ms: number) => `${ms},status,state=work tool=in pos=${ms} speed_mm_s=500 windows=0 unseen_mm=0`;
    const lines = ["time_ms,kind,line", "0,connected,0.2.0", "0,setting,ticks_per_m=2000", status(0), status(2000)];
    lines.push("2000,event,warning name=no_plants pos=2000", "2000,event,alarm code=3-1 name=too_fast pos=2000");
    writeFileSync("build/files/two.csv", `${[...lines, status(4000)].join("\n")}\n`);
    const opened = await openLog("build/files/two.csv");
    const { page } = opened;
    await inView(page, "log-place").fill("0");
    for (const [button, said] of [
        ["alarm-next", "no_plants"],
        ["alarm-next", "too_fast"],
        ["alarm-next", "no alarm behind"],
        ["alarm-before", "no_plants"],
    ] as const) {
        await inView(page, button).click();
        await inView(page, "log-alarm").filter({ hasText: said }).waitFor();
    }
    await close(opened);
});

test("a finger moves the rows also in a browser that does not tell its movement", async () => {
    const status = (ms: number) => `${ms},status,state=work tool=in pos=${ms} speed_mm_s=500 windows=0 unseen_mm=0`;
    const lines = ["time_ms,kind,line", "0,connected,0.2.0", "0,setting,ticks_per_m=1000", status(0), status(9000)];
    writeFileSync("build/files/finger.csv", `${lines.join("\n")}\n`);
    const opened = await openLog("build/files/finger.csv");
    await inView(opened.page, "log-place").fill("0");
    await inView(opened.page, "log-rows").evaluate((rows) => {
        // Their movementX is 0.
        for (const [type, clientX] of [
            ["pointerdown", 300],
            ["pointermove", 200],
        ] as const)
            rows.dispatchEvent(new PointerEvent(type, { isPrimary: true, buttons: 1, clientX }));
    });
    await expect(inView(opened.page, "log-place")).not.toHaveValue("0");
    await close(opened);
});

/**
 * A log of this many hours as `weeder record` writes it: at 2.5 km/h, with a status ten times a second, a plant each
 * 0.3 m, its swings, and an alarm an hour.
 */
function longLog(hours: number): string {
    const lines = ["time_ms,kind,line", "0,connected,0.2.0", "0,setting,ticks_per_m=2000"];
    const [perMs, plantTicks] = [2000 * 0.694e-3, 600];
    let plants = 0;
    for (let ms = 0; ms < hours * 3_600_000; ms += 100) {
        const pos = Math.round(ms * perMs);
        const figures = `speed_mm_s=694 windows=2 unseen_mm=0 votes=3 spacing=${plantTicks}`;
        lines.push(`${ms},status,state=work tool=in pos=${pos} ${figures}`);
        for (; plants * plantTicks < pos; plants++) {
            const at = plants * plantTicks;
            lines.push(`${ms},event,plant pos=${at} votes=3 spacing=${plantTicks} delay=700 hold=300 actuation=1000`);
            lines.push(`${ms},event,swing tool=out pos=${at + 450}`, `${ms},event,swing tool=in pos=${at + 930}`);
        }
        if (ms % 3_600_000 === 0) lines.push(`${ms},event,alarm code=3-1 name=too_fast pos=${pos}`);
    }
    return `${lines.join("\n")}\n`;
}

/** A sentence of a satellite receiver. */
function sentence(text: string): string {
    const sum = [...text].reduce((sum, letter) => sum ^ letter.charCodeAt(0), 0);
    return `$${text}*${sum.toString(16).toUpperCase().padStart(2, "0")}`;
}

/**
 * The log of a row of 30 m to the north, with a receiver, and a plant each half metre; `eastM` metres east of the first
 * row.
 */
function placedLog(eastM: number): string {
    const lines = ["time_ms,kind,line", "0,antenna,beam_ahead_mm=0 beam_right_mm=0 delay_ms=0", "0,connected,0.2.0"];
    lines.push("0,setting,ticks_per_m=2000", "0,setting,beam_to_tool_mm=400", "0,setting,margin_mm=50");
    for (let ms = 0; ms <= 60_000; ms += 100) {
        const metres = ms / 2000;
        // 2000 ticks a metre, at half a metre a second.
        const pos = ms;
        if (ms % 1000 === 0) {
            const minutes = (degrees: number) => (60 * degrees).toFixed(7).padStart(10, "0");
            const [north, east] = [minutes(metres / 111_000), minutes(eastM / 111_000)];
            const clock = `1200${String(ms / 1000).padStart(2, "0")}`;
            if (ms < 60_000)
                lines.push(
                    `${ms},gps,"${sentence(`GPGGA,${clock}.000,00${north},N,010${east},E,4,12,0.7,10,M,0,M,,`)}"`,
                );
        }
        const tool = metres % 0.5 < 0.25 ? "out" : "in";
        lines.push(`${ms},status,state=work tool=${tool} pos=${pos} speed_mm_s=500 windows=1 unseen_mm=0`);
        if (metres % 0.25 === 0) lines.push(`${ms},event,swing tool=${tool} pos=${pos}`);
        if (metres % 0.5 === 0.25)
            lines.push(`${ms},event,plant pos=${pos - 200} votes=3 spacing=1000 delay=600 hold=400 actuation=1000`);
    }
    return `${lines.join("\n")}\n`;
}

test("logs of several rows are moved together, and their map is that of weeder", async () => {
    const files = ["left", "right"].map((name) => `build/files/${name}.csv`);
    for (const [at, file] of files.entries()) writeFileSync(file, placedLog(0.75 * at));
    const opened = await open(browser, "record");
    const { page } = opened;
    await inView(page, "log-file").setInputFiles(files);
    await inView(page, "log-said")
        .filter({ hasText: /^left\.csv: .* 60 detections, .* right\.csv: .* 60 detections, / })
        .waitFor();
    const rows = inView(page, "log-drawing");
    await expect(rows).toHaveCount(2);
    await inView(page, "log-place").fill("20000");
    await inView(page, "log-closer").click();
    // Three statuses of a second are read, and the nearest is shown.
    await page
        .locator(".log-at")
        .filter({ hasText: /^At 20\.0 m, after (39\.[89]|40\.[0-2]) / })
        .nth(1)
        .waitFor();
    const marks = () => rows.locator(".note").allTextContents();
    await rows.nth(1).locator(".note", { hasText: "20.0" }).waitFor();
    const [left, right] = [
        (await marks()).slice(0, (await marks()).length / 2),
        (await marks()).slice(-((await marks()).length / 2)),
    ];
    assert.deepEqual(left, right);
    await inView(page, "log-map").click();
    await inView(page, "log-mapped")
        .filter({ hasText: /^The map has \d+ positions\.$/ })
        .waitFor();
    const drawn = inView(page, "log-map-drawn");
    const svg = await drawn.evaluate(async (image) => (await fetch((image as HTMLImageElement).src)).text());
    const byWeeder = ["map", ...files, "--out", "build/files/rows.geojson", "--svg", "build/files/rows.svg", "--force"];
    execFileSync(WEEDER, byWeeder);
    assert.equal(svg.trim(), readFileSync("build/files/rows.svg", "utf8").trim());
    assert.equal(svg.match(/<circle /g)?.length, 116, "plants have places");
    assert.deepEqual(await drawn.evaluate((image) => (image as HTMLImageElement).decode()), undefined);
    await inspect(page, "desk-logs");
    await close(opened);
});

test("the page of weeder serve reads a log and draws its map too", async (test) => {
    const port = join(folder(test), "uno");
    await plugIn(test, port);
    const served = await serve(test, [port]);
    writeFileSync("build/files/served.csv", placedLog(0).replace("swing tool=out pos=", "swing tool=o"));
    const opened = await openAt(browser, served.here);
    await opened.page.locator('a[href="#record"]').click();
    await inView(opened.page, "log-file").setInputFiles("build/files/served.csv");
    await inView(opened.page, "log-said")
        .filter({ hasText: /60 detections/ })
        .waitFor();
    await inView(opened.page, "log-map").click();
    await inView(opened.page, "log-mapped")
        .filter({ hasText: /^The map has \d+ positions\. Lines left out, .*: 1\.$/ })
        .waitFor();
    const drawn = inView(opened.page, "log-map-drawn");
    await drawn.waitFor();
    await drawn.evaluate((image) => (image as HTMLImageElement).decode());
    await close(opened);
});

test("a log of a day opens, is moved through with only what is in the window, and its replay can be cancelled", async (test) => {
    const hours = 24;
    writeFileSync("build/files/day.csv", longLog(hours));
    const opened = await open(browser, "record");
    const { page } = opened;
    const startedMs = performance.now();
    await inView(page, "log-file").setInputFiles("build/files/day.csv");
    await inView(page, "log-said").filter({ hasText: /./ }).waitFor();
    const openMs = performance.now() - startedMs;
    await expect(inView(page, "log-said")).toHaveText(new RegExp(`, ${hours} alarms`));
    for (let presses = 0; presses < 8; presses++) await inView(page, "log-farther").click();
    const { perFrameMs, most, texts } = await page.evaluate(async () => {
        const place = document.querySelector<HTMLInputElement>("[data-part=log-place]");
        const drawing = document.querySelector("[data-part=log-drawing]");
        if (!place || !drawing) throw new Error("there is no slider");
        const texts = new Set<string>();
        let most = 0;
        const moves = 60;
        const startedMs = performance.now();
        for (let move = 1; move <= moves; move++) {
            place.value = String((move / moves) * Number(place.max));
            place.dispatchEvent(new Event("input"));
            // It is drawn in the next frame, before this is called.
            await new Promise((done) => requestAnimationFrame(done));
            most = Math.max(most, drawing.childElementCount);
            texts.add(document.querySelector(".log-at")?.textContent ?? "");
        }
        return { perFrameMs: (performance.now() - startedMs) / moves, most, texts: texts.size };
    });
    test.diagnostic(
        `${hours} h opened in ${openMs.toFixed(0)} ms, and moves at ${(1000 / perFrameMs).toFixed(0)} pictures a second`,
    );
    // 200 m have 667 plants, each with canopy, zone and ground behind it.
    assert(most > 1000 && most < 2500, `${most} elements are drawn`);
    assert.equal(texts, 60, "each move is drawn");
    await inView(page, "log-replay").click();
    const share = () => inView(page, "log-progress").evaluate((bar) => (bar as HTMLProgressElement).value);
    while ((await share()) < 0.06) await page.waitForTimeout(10);
    // The page can be used meanwhile.
    await inView(page, "log-place").fill("0");
    await page
        .locator(".log-at")
        .filter({ hasText: /^At 0\.0 m/ })
        .waitFor();
    const before = await share();
    await inView(page, "log-cancel").click();
    await inView(page, "log-replayed").filter({ hasText: "Cancelled." }).waitFor();
    assert(before < 1);
    await expect(inView(page, "log-busy")).toBeHidden();
    await close(opened);
});

test("without a log of its own, the page offers the log of Try, which is drawn and replayed", async () => {
    const opened = await open(browser, "record");
    const { page } = opened;
    await page.getByRole("button", { name: "An example" }).click();
    await page
        .locator("[data-part=log-said]", { hasText: /weeder-log\.csv: .*[1-9]\d* detections, [1-9]\d* swings/ })
        .waitFor();
    await page.getByRole("button", { name: "Replay it" }).click();
    await page.locator("[data-part=log-replayed]", { hasText: "The decisions are those of this version" }).waitFor();
    await close(opened);
});
