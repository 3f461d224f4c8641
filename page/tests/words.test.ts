// The page in the operator's language. No text is missing, left in English or too long for its place. The language can
// be chosen, is stored, and can change while a machine is connected.

import assert from "node:assert/strict";
import { readdirSync, readFileSync } from "node:fs";
import test, { after, before } from "node:test";
import faults from "faults.json";
import type { Browser, Page } from "playwright";
import { ask, module } from "../src/core.ts";
import { Rust } from "../src/rust.ts";
import * as en from "../src/words/en.ts";
import { type Code, LANGUAGES, type Language, speak, told } from "../src/words/words.ts";
import { assertOnScreen } from "./boxes.ts";
import { close, expect, inspect, launch, open } from "./browser.ts";
import { part, pass, tryIt } from "./trying.ts";

const OTHERS = (Object.keys(LANGUAGES) as Code[]).filter((code) => code !== "en");
/** Texts that are the same in another language. */
const SAME: Partial<Record<Code, readonly string[]>> = { es: ["kmh"], fr: ["kmh", "console", "place", "zones"] };
const SMALL = { width: 360, height: 640 };

/** A log with an alarm. */
const LOG = Buffer.from(`time_ms,kind,line
0,connected,0.2.0
0,setting,ticks_per_m=2000
0,status,state=work tool=in pos=0 speed_mm_s=500 windows=0 unseen_mm=0
900,event,plant pos=700 votes=3 spacing=1000 delay=680 hold=540 actuation=1220
9000,status,state=work tool=in pos=9000 speed_mm_s=500 windows=0 unseen_mm=0
9001,event,alarm code=3-1 name=too_fast pos=9000
`);

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

const found = (text: string, pattern: RegExp) => [...new Set(text.match(pattern))].sort();
const holes = (text: string) => found(text, /\{\w+\}/g);
/** Typed text, which is the same in every language. */
const typed = (text: string) => found(text, /`[^`]*`/g);

/** The settings, each with the machine's description. */
const helps = [
    ...readFileSync("../control/src/settings.rs", "utf8").matchAll(
        /^ +\w+ "(\w+)"(?: in "[^"]*")?: \d[^;]*,\s+"([^;]*(?:;[^;"]*)?)";$/gm,
    ),
].map(([, name = "", help = ""]) => ({ name, help }));
assert(helps.length >= 23);

for (const code of OTHERS)
    test(`no text is missing in ${LANGUAGES[code].name}, or left in English`, () => {
        const { words, heard, advice = {}, settings = {}, steps = {} }: Language = LANGUAGES[code];
        const texts: (readonly [name: string, english: string, text: string])[] = [
            ...Object.entries(en.words).map(([name, text]) => [name, text, words[name as keyof typeof words]] as const),
            ...Object.entries(en.heard).map(([name, text]) => [name, text, heard[name as keyof typeof heard]] as const),
            ...faults.map(({ name, advice: text }) => [name, text, advice[name] ?? ""] as const),
            ...helps.map(({ name, help }) => [name, help, settings[name] ?? ""] as const),
        ];
        for (const { title, how } of ask<{ steps: { title: string; how: string }[] }>({
            setUp: { lines: [], settings: {} },
        }).steps) {
            const [ownTitle = "", ...ownHow] = (steps[title] ?? "").split(/[.।] /);
            texts.push([title, title, ownTitle], [`how: ${title}`, how, ownHow.join(". ")]);
        }
        for (const [name, english, text] of texts) {
            assert(text.trim() === text && text !== "", `${name} is missing`);
            assert(text !== english || SAME[code]?.includes(name), `${name} is English`);
            assert.deepEqual(holes(text), holes(english), `the holes of ${name}`);
            assert.deepEqual(typed(text), typed(english), `what is typed in ${name}`);
            assert(text.split("|").length <= english.split("|").length, `the forms of ${name}`);
            const ownScript = code === "hi" ? /\p{Script=Devanagari}/u : /\p{Script=Latin}/u;
            assert.match(text.replaceAll(/\{\w+\}|`[^`]*`/g, "-"), ownScript, name);
        }
        assert.equal(Object.keys(advice).length, faults.length, "advice of nothing");
        assert.equal(Object.keys(settings).length, helps.length, "a setting that there is not");
        assert.equal(
            Object.keys(words).length +
                Object.keys(heard).length +
                faults.length +
                helps.length +
                2 * Object.keys(steps).length,
            texts.length,
        );
    });

test("the manual has a cause of each alarm and warning", () => {
    const manual = readFileSync("../docs/faults.md", "utf8");
    const causes = [...manual.matchAll(/^- `(?:\d-\d )?(\w+)`[^:\n]*: .*?\.\s/gms)].map(([, name]) => name);
    assert(faults.length > 10);
    for (const { name } of faults) assert(causes.includes(name), name);
});

test("no two texts of the page are the same in English, so that each is found in the HTML", () => {
    const texts = Object.values(en.words);
    assert.deepEqual(
        texts.filter((text, at) => texts.indexOf(text) !== at),
        [],
    );
});

test("the page has no text that is not in the tables", () => {
    const html = readFileSync("src/index.html", "utf8");
    const shown = html.slice(html.indexOf("<body>")).replaceAll(/<!--.*?-->|<pre>.*?<\/pre>/gs, "");
    const texts = shown.split(/<[^>]*>/).map((text) => text.trim());
    const labels = [...shown.matchAll(/(?:aria-label|title|alt)="([^"]*)"/g)].map(([, label = ""]) => label);
    const others = [...texts, ...labels].filter((text) => /\p{L}/u.test(text) && !/^\$\w+$/.test(text));
    assert.deepEqual([...new Set(others)], ["weeder"]);
    // In the code a sentence is a capital, words, and a full stop.
    const files = (readdirSync("src", { recursive: true }) as string[]).filter((path) => path.endsWith(".ts"));
    for (const path of files.filter((path) => !path.startsWith("words/"))) {
        const code = readFileSync(`src/${path}`, "utf8").replaceAll(/\/\*.*?\*\/|^\s*\/\/[^\n]*/gms, "");
        assert.deepEqual(found(code, /["`][A-Z][a-z]+ [^"`]* [^"`]*\.["`]/g), [], path);
    }
});

test("what weeder serve and the project's Rust say in English is known by the tables", () => {
    for (const [path, text] of [
        ["../host/link/src/error.rs", en.heard.servedGone],
        ["../host/link/src/error.rs", en.heard.noText],
        ["../host/link/src/error.rs", en.heard.nothingAnswers],
        ["../host/link/src/error.rs", en.heard.otherDevice.replace('"{text}"', "{0:?}")],
        ["../host/serve/src/hub.rs", en.heard.waitingForMachine],
        ["../host/link/src/error.rs", en.heard.unanswered],
        ["../host/link/src/session.rs", en.heard.wasReset],
        ["../host/serve/src/machine.rs", en.heard.servedNoAnswer],
        ["../host/serve/src/machine.rs", en.heard.tooMuchWaits],
        ["../host/serve/src/machine.rs", en.heard.servedNotThere],
        ["../host/serve/src/routes.rs", en.heard.mayBeDone],
    ] as const)
        assert(readFileSync(path, "utf8").includes(text), `${path} does not say: ${text}`);
});

test("the set-up's steps and warnings have no English word in another language", () => {
    const timing = (outMs: number) => `calibrated lead_out_ms=${outMs} lead_in_ms=52 set=yes`;
    const stretch = (ticks: number) => ["> calibrate 10000", `ticks_per_m=${ticks}`];
    const timed = [timing(150), timing(158)];
    const measured = [...timed, ...[1910, 1910, 1910].flatMap(stretch)];
    const slips = Array(12).fill("slip permille=5");
    const texts = new Set<string>();
    /** Takes the texts of a machine, and of the one that follows the advice. */
    const take = (lines: string[], settings: Record<string, number>) => {
        const heard = [...lines, `> set margin_mm ${settings.margin_mm}`];
        const { steps, next, missing, marginMm, warning } = new Rust(module).ask<{
            steps: { open: string | null }[];
            next: string | null;
            missing: string[];
            marginMm: number | null;
            warning: string | null;
        }>({ setUp: { lines: heard, settings } });
        for (const text of [...steps.map(({ open }) => open), next, ...missing, warning]) if (text) texts.add(text);
        assert.equal(marginMm === null, missing.length > 0);
        const [, name = "", value] = /`set ([a-z_]*(?:lead|margin)\w+) (\d+)`/.exec(next ?? "") ?? [];
        if (name === "margin_mm") assert.equal(marginMm, Number(value));
        if (value) take(lines, { ...settings, [name]: Number(value) });
    };
    for (const lines of [
        [],
        timed,
        measured.slice(1),
        measured,
        [...measured, ...slips],
        [timing(500), ...measured],
        [...measured, ...stretch(2400)],
        [...measured, ...slips, "slip permille=-150", "slip permille=150"],
    ])
        for (const own of [
            { lead_out_ms: 100 },
            { lead_out_ms: 500, beam_to_tool_mm: 1000 },
            { second_beam_mm: 200, beam_to_tool_mm: 1000 },
            { stem_zone_mm: 90 },
        ])
            for (const margin_mm of [5, 200])
                take(lines, { lead_out_ms: 158, lead_in_ms: 52, ticks_per_m: 1910, ...own, margin_mm });
    for (const [name, text] of Object.entries(en.heard).slice(Object.keys(en.heard).indexOf("timeServo"))) {
        const parts = text.split(/\{\w+\}/);
        assert(
            [...texts].some((text) => parts.every((part) => text.includes(part))),
            `no machine has ${name}`,
        );
    }
    /** The words, without what is typed, the names of settings, and one that is the same in Spanish and French. */
    const words = (text: string) =>
        found(text.replaceAll(/`[^`]*`/g, "").toLowerCase(), /[\p{L}_]{3,}/gu).filter(
            (word) => !word.includes("_") && word !== "servo",
        );
    for (const code of OTHERS) {
        speak(code);
        for (const text of texts) {
            const own = words(told(text));
            const left = words(text).filter((word) => own.includes(word));
            assert.deepEqual(left, [], `${code}: ${told(text)}`);
            if (code === "fr") assert.doesNotMatch(told(text), /\d\.\d/, "a decimal point");
        }
    }
    speak("en");
});

test("what the machine refuses, and settings that contradict each other, are known by the tables", () => {
    const source = (file: string) => readFileSync(`../control/src/${file}.rs`, "utf8");
    const texts = source("say/texts");
    const named = (name: string) => new RegExp(`\\b${name} = "([^"]*)"`).exec(texts)?.[1] ?? assert.fail(name);
    const again = named("LOOK_AGAIN");
    const refusals = [...source("operate/command_error").matchAll(/^ +(\w+) = "([^"]+)",$/gm)];
    const mistakes = [...(source("say/words").split(" Wrong {")[1] ?? "").matchAll(/^ +\w+ = "([^"]+)",$/gm)];
    assert(mistakes.length >= 5);
    const said = [
        ...refusals.map(([, name = "", text = ""]) =>
            name.startsWith("TakenFor")
                ? `${named("TAKEN_FOR")}${text}${again}`
                : text + (name === "WheelDiffers" ? again : ""),
        ),
        ...mistakes.map(([, text = ""]) => text),
        `${named("USAGE")}servo in|out|US`,
        `margin_mm${named("TAKES_A_NUMBER")}${named("RANGE")}`,
        `end_switch${named("TAKES")}${named("ON_OR_OFF")}`,
        `servo_in_us${named("HOLD_TO_SET")}`,
    ].map((text) => text.replaceAll("#", "123"));
    assert(said.length >= 26, said.join("\n"));
    const contradictions = [
        { servo_in_us: 2000 },
        { second_beam_mm: 10 },
        { ticks_per_m: 200 },
        { beam_to_tool_mm: 100 },
    ].map(
        (to) =>
            ask<{ contradiction?: string }>({ steps: { from: {}, to } }).contradiction ??
            assert.fail(JSON.stringify(to)),
    );
    for (const text of [...said, ...contradictions])
        for (const code of OTHERS) {
            speak(code);
            assert.notEqual(told(text), text, `${code}: ${text}`);
        }
    speak("en");
});

/** Visible parts that are cut off, wider than the screen, or outside their box. */
const cut = (page: Page) =>
    page.evaluate(() => {
        const width = document.documentElement.clientWidth;
        const problems: string[] = [];
        if (document.documentElement.scrollWidth > width)
            problems.push(`the page is ${document.documentElement.scrollWidth} wide`);
        for (const element of document.querySelectorAll<HTMLElement>("header *, main *, footer *")) {
            if (element.closest("svg, .unseen, .said, select") || element.getClientRects().length === 0) continue;
            const texts = [...element.childNodes].filter((node) => node instanceof Text && node.data.trim() !== "");
            if (texts.length === 0) continue;
            const { clipPath, overflow } = getComputedStyle(element);
            if (clipPath !== "none") continue;
            const box = element.getBoundingClientRect();
            const range = document.createRange();
            range.selectNodeContents(element);
            const text = range.getBoundingClientRect();
            const isOut =
                text.left < box.left - 1 ||
                text.right > box.right + 1 ||
                text.top < box.top - 2 ||
                text.bottom > box.bottom + 2;
            if (
                isOut ||
                text.left < 0 ||
                text.right > width ||
                (overflow !== "visible" && element.scrollWidth > element.clientWidth)
            )
                problems.push(`${element.tagName} ${element.textContent?.trim().slice(0, 60)}`);
        }
        for (const strip of document.querySelectorAll<SVGSVGElement>("svg.strip")) {
            if (strip.getClientRects().length === 0) continue;
            const { left, right } = strip.getBoundingClientRect();
            for (const note of strip.querySelectorAll("text")) {
                const box = note.getBoundingClientRect();
                if (box.left < left || box.right > right) problems.push(`${note.textContent} in the strip`);
            }
        }
        return problems;
    });

/** Asserts that nothing is cut, in all tabs of the shown view. */
async function assertNothingCut(page: Page, view: string): Promise<void> {
    const tabs = page.locator(`#view-${view} [role=tab]`);
    for (let tab = 0; tab < Math.max(await tabs.count(), 1); tab++) {
        if ((await tabs.count()) > 0) await tabs.nth(tab).click();
        assert.deepEqual(await cut(page), [], `${view}, tab ${tab}`);
    }
}

for (const code of Object.keys(LANGUAGES) as Code[])
    test(`in ${LANGUAGES[code].name} no text is too long for its place on a small phone, and state, reason and HOLD are on its screen`, async () => {
        const opened = await tryIt(browser, SMALL);
        const { page } = opened;
        const table: Language = LANGUAGES[code];
        await page.locator("#language").selectOption(code);
        await expect(page.locator("html")).toHaveAttribute("lang", code);
        await expect(page.locator("#unchecked")).toHaveText(table.words.unchecked);
        await part(page, "state").filter({ hasText: table.words.hold }).waitFor();
        await assertNothingCut(page, "try");
        // With output: plants, weeds, and the tool's swings.
        await page.locator("#switch").check();
        await part(page, "state").filter({ hasText: table.words.stateWork }).waitFor();
        await page.locator("#slip").fill("15");
        await pass(page, 14);
        await page.locator("#outcome", { hasText: /\d/ }).waitFor();
        assert.deepEqual(await cut(page), [], "try, at work");
        await page.locator("#dead").check();
        await pass(page, 5);
        await part(page, "alarm-name")
            .filter({ hasText: table.words.alarm.replace("{title}", "2-1 encoder_silent") })
            .waitFor();
        const advice =
            table.advice?.encoder_silent ?? faults.find(({ name }) => name === "encoder_silent")?.advice ?? "";
        await part(page, "alarm-advice")
            .filter({ hasText: advice.slice(1) })
            .waitFor();
        await page.locator("#time").selectOption("0");
        assert.deepEqual(await cut(page), [], "try, at an alarm");
        await assertOnScreen(page, "#try-panel", ["state", "why", "alarm", "clear", "hold", "start"], [SMALL]);
        await inspect(page, `phone-${code}`);
        for (const view of ["work", "flash", "record"]) {
            await page.locator(`nav a[href="#${view}"]`).click();
            await assertNothingCut(page, view);
        }
        await page
            .locator("[data-part=log-file]")
            .setInputFiles({ name: "row.csv", mimeType: "text/csv", buffer: LOG });
        await page.locator("[data-part=log-replay]").click();
        await page.locator("[data-part=alarm-next]").click();
        await page.locator("[data-part=log-replayed]:not(:empty)").waitFor();
        await assertNothingCut(page, "record");
        await inspect(page, `phone-log-${code}`);
        await close(opened);
    });

test("the browser's language is the first choice, its country writes the numbers, and a choice is kept", async () => {
    for (const [locale, lang, speed, hold] of [
        ["fr-FR", "fr", "2,0 km/h", "PAUSE"],
        ["es-MX", "es", "2.0 km/h", "PAUSA"],
        ["de-DE", "en", "2.0 km/h", "HOLD"],
        ["hi-IN", "hi", "2.0 कि॰मी॰/घं॰", "विराम"],
    ] as const) {
        const opened = await open(browser, "try", { ...SMALL, locale });
        const { page } = opened;
        await expect(page.locator("html"), locale).toHaveAttribute("lang", lang);
        await expect(page.locator("#speed-is")).toHaveText(speed);
        await expect(page.locator("#hold-is, [data-part=hold]").first()).toHaveText(hold);
        if (locale === "fr-FR") {
            await page.locator("#language").selectOption("es");
            await page.reload();
            await page.locator("html[lang=es]").waitFor();
        }
        await close(opened);
    }
});

test("another language leaves the machine connected, and what was said before is said in it", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await part(page, "tab-settings").click();
    await part(page, "settings-undo").waitFor();
    await part(page, "settings-read").click();
    await pass(page, 0.5);
    await part(page, "settings-said").filter({ hasText: en.words.areMachines }).waitFor();
    const connected = await page.evaluate(() => globalThis.simulation.uno.cycle);
    await page.locator("#language").selectOption("fr");
    const { words } = LANGUAGES.fr;
    await part(page, "settings-said").filter({ hasText: words.areMachines }).waitFor();
    await part(page, "settings-list")
        .filter({ hasText: LANGUAGES.fr.heard.range.split("{")[2]?.slice(-8) ?? "" })
        .waitFor();
    await part(page, "state").filter({ hasText: words.hold }).waitFor();
    await page.waitForFunction((before) => globalThis.simulation.uno.cycle > before, connected);
    await expect(part(page, "said").getByText("connected to weeder")).toHaveCount(1);
    await expect(part(page, "said")).toHaveAttribute("lang", "en");
    // A screen reader says an error in its language, and an answer in English.
    await part(page, "tab-console").click();
    for (const [line, text, lang] of [
        ["wed", LANGUAGES.fr.heard.refusedCommand, "fr"],
        ["hold", "ok", "en"],
    ] as const) {
        await part(page, "typed").fill(line);
        await part(page, "typed").press("Enter");
        await pass(page, 0.5);
        await part(page, "answered").filter({ hasText: text }).waitFor({ state: "attached" });
        await expect(part(page, "answered")).toHaveAttribute("lang", lang);
    }
    await close(opened);
});
