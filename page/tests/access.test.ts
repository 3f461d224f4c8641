// The page without sight, without a mouse, and in sunlight: the output of a screen reader, all of "Work with it" and
// "Flash it" by the keyboard, and the contrast of the parts that the operator must read.

import assert from "node:assert/strict";
import test, { after, before } from "node:test";
import type { Browser, Page } from "playwright";
import { close, launch, open, PATIENCE_MS } from "./browser.ts";
import { VirtualUno } from "./ports.ts";
import { part, pass, rollTo, tryIt } from "./trying.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

declare global {
    var saidAloud: string[];
}

/** Records the output of a screen reader from now on: the texts of live regions, each after its change. */
const listen = (page: Page) =>
    page.evaluate(() => {
        globalThis.saidAloud = [];
        const isLive = (element: Element) =>
            element.matches("[role=status], [role=alert], [role=log], output, [aria-live]") &&
            element.getAttribute("aria-live") !== "off";
        for (const region of [...document.querySelectorAll("#view-try *")].filter(isLive))
            new MutationObserver(() => {
                const text = region.textContent?.replace(/\s+/g, " ").trim() ?? "";
                const isHidden = region.closest("[hidden]") !== null;
                if (!isHidden && text !== globalThis.saidAloud.at(-1)) globalThis.saidAloud.push(text);
            }).observe(region, { subtree: true, childList: true, characterData: true, attributeFilter: ["hidden"] });
    });

/** The output since the last call. */
const heard = (page: Page) => page.evaluate(() => globalThis.saidAloud.splice(0));

test("a screen reader says a state, a reason that lasts and an alarm, and no number that changes often", async () => {
    const opened = await tryIt(browser);
    const { page } = opened;
    await part(page, "heard")
        .filter({ hasText: /^Hold\. The tool is out: the machine holds until it is started/ })
        .waitFor({ state: "attached" });
    // A region that appears with its text is not read out.
    const away = await page.evaluate(() =>
        [...document.querySelectorAll("[role=status]")]
            .filter((region) => getComputedStyle(region).display === "none" || region.matches("[hidden]"))
            .map(({ outerHTML }) => outerHTML),
    );
    assert.deepEqual(away, []);
    await listen(page);
    await part(page, "start").click();
    await part(page, "heard")
        .filter({ hasText: /^Work\./ })
        .waitFor({ state: "attached" });
    const numbers = async () => [await part(page, "place").textContent(), await part(page, "why").textContent()];
    const before = await numbers();
    await rollTo(page, 4000);
    await part(page, "heard")
        .filter({ hasText: /^Work\.$/ })
        .waitFor({ state: "attached" });
    assert.notDeepEqual(await numbers(), before);
    const atWork = await heard(page);
    // Eight plants have passed.
    assert(atWork.length >= 1 && atWork.length <= 4, atWork.join(" / "));
    for (const text of atWork)
        assert.match(text, /^Work\.( The tool is out\. The beam has not seen this ground yet\.)?$/);

    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await part(page, "heard")
        .filter({ hasText: "Alarm. The tool is out until the alarm is cleared." })
        .waitFor({ state: "attached" });
    const alarm = await heard(page);
    assert(
        alarm.some((text) => /^Alarm 2-1 encoder_silent See to the encoder's coupling/.test(text)),
        alarm.join(" / "),
    );

    // From the console only answers to typed lines are read out.
    await part(page, "typed").fill("get k");
    await part(page, "typed").press("Enter");
    await part(page, "answered").filter({ hasText: /^k=3 / }).waitFor({ state: "attached" });
    await close(opened);
});

/** Presses Tab until this has the focus, each time seeing that the focus is visible and on the screen. */
async function tabTo(page: Page, name: string | RegExp): Promise<void> {
    for (let tabs = 0; tabs < 150; tabs++) {
        const focus = await focused(page);
        if (focus && (typeof name === "string" ? focus === name : name.test(focus))) return;
        await page.keyboard.press("Tab");
    }
    assert.fail(`the Tab key does not come to ${name}`);
}

/** The name of the focused element, whose focus must be visible; empty if the browser itself has the focus. */
async function focused(page: Page): Promise<string> {
    // Scrolling ends in the next frame.
    const { name, problem } = await page.evaluate(async () => {
        await new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done)));
        const element = document.activeElement;
        if (!(element instanceof HTMLElement) || element === document.body) return { name: "", problem: "" };
        const label =
            element instanceof HTMLInputElement || element instanceof HTMLSelectElement ? element.labels?.[0] : null;
        const name =
            element.dataset.setting ??
            element.ariaLabel ??
            label?.querySelector("span")?.textContent ??
            element.textContent;
        const { outlineStyle, outlineWidth } = getComputedStyle(element);
        if (outlineStyle === "none" || Number.parseFloat(outlineWidth) < 2)
            return { name, problem: "it has no outline" };
        const { left, right, top, bottom } = element.getBoundingClientRect();
        const { clientWidth, clientHeight } = document.documentElement;
        if (left < 0 || right > clientWidth || top < 0 || bottom > clientHeight)
            return { name, problem: `it is at ${left} to ${right}, ${top} to ${bottom}` };
        const onTop = document.elementFromPoint((left + right) / 2, (top + bottom) / 2);
        return { name, problem: element.contains(onTop) ? "" : `it is below ${onTop?.outerHTML.slice(0, 80)}` };
    });
    assert.equal(problem, "", `the focus is at ${name}`);
    return name?.trim() ?? "";
}

/** Moves to an element by Tab, and presses a key there. */
async function press(page: Page, name: string | RegExp, key: string): Promise<void> {
    await tabTo(page, name);
    await page.keyboard.press(key);
}

test("an Uno is flashed, connected, set, started and held by Tab, Enter, Space and Escape alone, and the focus is always seen", async (test) => {
    const flashed = await VirtualUno.start(test, "--bootloader", "optiboot", "--stand");
    const opened = await open(browser, "flash", undefined, [flashed]);
    const { page } = opened;
    const inWork = (name: string) => page.locator(`#view-work [data-part="${name}"]`);
    await press(page, "Flash it", "Enter");
    await page.locator("[data-part=flash-said]", { hasText: "Done" }).waitFor({ timeout: 5 * PATIENCE_MS });
    assert.equal(await focused(page), "Flash it");
    await press(page, "Work with it", "Space");
    await inWork("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    assert.equal(await focused(page), "Work");

    await press(page, "Disconnect", "Enter");
    await inWork("state").filter({ hasText: "no machine" }).waitFor();
    assert.equal(await focused(page), "Connect an Uno");
    await page.keyboard.press("Enter");
    await inWork("alarm-name").filter({ hasText: "settings_lost" }).waitFor();
    assert.equal(await focused(page), "Disconnect");

    await press(page, "Settings", "Enter");
    await tabTo(page, "margin_mm");
    await page.keyboard.type("55");
    await press(page, /^Send 1 change and save$/, "Enter");
    await inWork("settings-said").filter({ hasText: "Saved" }).waitFor();
    await press(page, "Clear", "Space");
    await inWork("state").filter({ hasText: "hold" }).waitFor();
    assert.equal(await focused(page), "HOLD");
    await press(page, "Start", "Enter");
    await inWork("state").filter({ hasText: "work" }).waitFor();
    await page.keyboard.press("Escape");
    await inWork("state").filter({ hasText: "hold" }).waitFor();
    await page.keyboard.press("Space");
    await inWork("state").filter({ hasText: "work" }).waitFor();
    await press(page, "HOLD", "Space");
    await inWork("state").filter({ hasText: "hold" }).waitFor();

    for (const tab of ["Console", "Calibrate", "Taught"]) await press(page, tab, "Space");
    await press(page, "It was a plant", "Enter");
    await inWork("teach-said").filter({ hasText: /./ }).waitFor();
    await press(page, "Console", "Enter");
    const answered = inWork("answered").filter({ hasText: /./ });
    for (let tries = 1; ; tries++) {
        await tabTo(page, "Type to the machine");
        await page.keyboard.type("get margin_mm");
        await page.keyboard.press("Enter");
        await answered.waitFor({ state: "attached" });
        const answer = (await answered.textContent()) ?? "";
        if (/^margin_mm=55 /.test(answer)) break;
        // A busy computer loses the machine for a moment, and the page says so.
        assert(tries < 3, answer);
    }
    await close(opened);
});

/** The contrast of these parts of a panel with their background, by the formula of WCAG 2. */
const contrasts = (page: Page, panel: string, names: readonly string[]) =>
    page.evaluate(
        ([panel, names]) => {
            const numbers = (color: string) => color.match(/[\d.]+/g)?.map(Number) ?? [];
            const light = (color: string) => {
                const [red = 0, green = 0, blue = 0] = numbers(color).map((part) => {
                    const share = part / 255;
                    return share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4;
                });
                return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
            };
            /** The first opaque colour below it. */
            const below = (element: Element | null): string => {
                if (!element) throw new Error("there is no ground");
                const { backgroundColor } = getComputedStyle(element);
                const [, , , opaque = 1] = numbers(backgroundColor);
                if (opaque !== 0 && opaque !== 1) throw new Error(`${backgroundColor} lets something through`);
                return opaque === 1 ? backgroundColor : below(element.parentElement);
            };
            return names.map((name) => {
                const element = document.querySelector(`${panel} [data-part=${name}]`);
                if (!element) throw new Error(`there is no ${name}`);
                const [dark = 0, bright = 0] = [light(getComputedStyle(element).color), light(below(element))].sort(
                    (one, other) => one - other,
                );
                return { name, contrast: (bright + 0.05) / (dark + 0.05) };
            });
        },
        [panel, names] as const,
    );

/** Asserts that these parts are readable in sunlight, in the dark, and if the operator has chosen the light page. */
async function assertReadable(page: Page, panel: string, names: readonly string[]): Promise<void> {
    const light = page.getByRole("button", { name: "Light" });
    for (const [colorScheme, isMadeLight] of [
        ["light", false],
        ["dark", false],
        ["dark", true],
    ] as const) {
        await page.emulateMedia({ colorScheme });
        if (isMadeLight) await light.click();
        for (const { name, contrast } of await contrasts(page, panel, names))
            assert(contrast >= 7, `${name} in ${colorScheme}, ${isMadeLight}: ${contrast.toFixed(2)}`);
        if (isMadeLight) await light.click();
    }
}

test("state, reason, alarm and HOLD have a contrast of 7 to 1 and more in each state, light, dark, and made light", async () => {
    const alone = await open(browser, "work");
    await assertReadable(alone.page, "#work-panel", ["state", "why", "hold"]);
    // As above several machines of `weeder serve`.
    const states = ["none", "unknown", "hold", "work", "alarm"];
    await alone.page.evaluate((states) => {
        const row = (state: string) =>
            `<li><span class="overview-state" data-state="${state}" data-part="row-${state}">${state}</span></li>`;
        const overview = `<section class="overview"><ul>${states.map(row).join("")}</ul></section>`;
        document.querySelector("#work-panel")?.insertAdjacentHTML("beforeend", overview);
    }, states);
    const rows = states.map((state) => `row-${state}`);
    await assertReadable(alone.page, "#work-panel", rows);
    await close(alone);
    const opened = await tryIt(browser);
    const { page } = opened;
    const state = (word: string) => part(page, "state").filter({ hasText: word }).waitFor();
    await state("hold");
    await assertReadable(page, "#try-panel", ["state", "why", "hold"]);
    await page.getByLabel("Work switch").check();
    await state("work");
    await assertReadable(page, "#try-panel", ["state", "why", "hold"]);
    await page.getByLabel("Kill the encoder").check();
    await pass(page, 5);
    await state("alarm");
    await assertReadable(page, "#try-panel", ["state", "why", "hold", "alarm-name", "alarm-advice", "clear"]);
    await close(opened);
});

test("an unknown detection is seen in its zone, light and dark", async () => {
    const opened = await open(browser, "record");
    const { page } = opened;
    for (const colorScheme of ["light", "dark"] as const) {
        await page.emulateMedia({ colorScheme });
        const contrast = await page.evaluate(() => {
            const brush = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
            if (!brush) throw new Error("there is no canvas");
            const lightness = (...fills: string[]) => {
                for (const fill of fills) {
                    brush.fillStyle = fill;
                    brush.fillRect(0, 0, 1, 1);
                }
                const [red = 0, green = 0, blue = 0] = [...brush.getImageData(0, 0, 1, 1).data].map(
                    (part) => ((part / 255 + 0.055) / 1.055) ** 2.4,
                );
                return 0.2126 * red + 0.7152 * green + 0.0722 * blue;
            };
            const probe = document.body.appendChild(document.createElement("i"));
            const colour = (name: string) => {
                probe.style.color = `var(--${name})`;
                return getComputedStyle(probe).color;
            };
            const zone = lightness(colour("card"), colour("window"));
            const [dark = 0, bright = 0] = [zone, lightness(colour("unknown"))].sort((one, other) => one - other);
            return (bright + 0.05) / (dark + 0.05);
        });
        assert(contrast >= 3, `${colorScheme}: ${contrast.toFixed(2)}`);
    }
    await close(opened);
});

test("with the system's own few colours the legend and the lamp keep theirs, and one view is marked", async () => {
    const opened = await open(browser, "try");
    const { page } = opened;
    await page.emulateMedia({ forcedColors: "active" });
    const found = await page.evaluate(() => {
        const colours = (selector: string, name: "backgroundColor" | "borderBottomColor", pseudo?: string) =>
            new Set([...document.querySelectorAll(selector)].map((one) => getComputedStyle(one, pseudo)[name])).size;
        document.querySelector("#lamp")?.classList.add("lit");
        return {
            legend: colours("#view-try .legend li:not(.sign)", "backgroundColor", "::before"),
            lamp: colours("#lamp, body", "backgroundColor"),
            views: colours("nav a", "borderBottomColor"),
            tabs: colours("#try-panel [role=tab]", "borderBottomColor"),
        };
    });
    assert.deepEqual(found, { legend: 5, lamp: 2, views: 2, tabs: 2 });
    await close(opened);
});
