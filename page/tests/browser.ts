// Shared code of the browser tests: starts headless Chromium, opens the page from the disk as without a network, and
// checks every page. A page must have no error, no request, nothing wider than the screen, and no finding of axe-core.
//
// CHROMIUM and FIREFOX name the browsers if they are not Debian's. Screenshots go to build/screenshots.

import assert from "node:assert/strict";
import { existsSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { createRequire } from "node:module";
import type { AddressInfo } from "node:net";
import { basename, extname, join, resolve } from "node:path";
import type { TestContext } from "node:test";
import { pathToFileURL } from "node:url";
import type { AxeResults } from "axe-core";
import { type Browser, chromium, firefox, type Page } from "playwright";
import { expect as patiently } from "playwright/test";
import type { Simulation } from "../src/try/simulation.ts";
import { type Device, offerPorts } from "./ports.ts";

/** The page's objects for tests. */
declare global {
    var simulation: Simulation;
}

/** The longest wait for anything on the page: CI's machines are slow, and share their cores. */
export const PATIENCE_MS = 60_000;

/** Waits until a part of the page is as expected. A single look, as by `assert`, may come before the page has drawn it. */
export const expect = patiently.configure({ timeout: PATIENCE_MS });

/** The screen of a page, and the browser's language if it is not American English. */
export interface Screen {
    readonly width: number;
    readonly height: number;
    readonly locale?: string;
}

export const PHONE: Screen = { width: 390, height: 844 };
export const DESK: Screen = { width: 1440, height: 900 };

const axe = readFileSync(createRequire(resolve("package.json")).resolve("axe-core/axe.min.js"), "utf8");

/**
 * Features that Chromium leaves out. It uses only the last such list, so the list repeats Playwright's. The last three
 * features load two pages with each new window, for suggestions below the address. No test sees them.
 */
const LEFT_OUT = [
    "AvoidUnnecessaryBeforeUnloadCheckSync",
    "BoundaryEventDispatchTracksNodeRemoval",
    "DestroyProfileOnBrowserClose",
    "DialMediaRouteProvider",
    "GlobalMediaControls",
    "HttpsUpgrades",
    "LensOverlay",
    "MediaRouter",
    "PaintHolding",
    "ThirdPartyStoragePartitioning",
    "Translate",
    "RenderDocument",
    "OptimizationHints",
    "WebUIOmniboxAimPopup",
    "WebUIOmniboxFullPopup",
    "WebUIOmniboxPopup",
];

export function launch(): Promise<Browser> {
    return chromium.launch({
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        args: [
            "--headless",
            // A host name other than this computer's own, as on another computer in the network.
            "--host-resolver-rules=MAP weeder.test 127.0.0.1",
            "--no-sandbox",
            "--disable-gpu",
            `--disable-features=${LEFT_OUT.join(",")}`,
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--no-first-run",
        ],
    });
}

/** Firefox, by WebDriver BiDi: Debian's browser, not Playwright's own build. */
export function launchFirefox(): Promise<Browser> {
    return firefox.launch({ channel: "moz-firefox", executablePath: process.env.FIREFOX ?? "/usr/bin/firefox-esr" });
}

const MEDIA: Readonly<Record<string, string>> = {
    ".css": "text/css",
    ".html": "text/html",
    ".js": "text/javascript",
    ".svg": "image/svg+xml",
    ".webmanifest": "application/manifest+json",
};

/** A plain web server that serves the files of a folder. */
export async function served(test: TestContext, folder: string): Promise<{ port: number; close(): Promise<void> }> {
    const server = createServer((request, response) => {
        const name = basename(new URL(request.url ?? "", "http://any").pathname) || "index.html";
        const path = join(folder, name);
        if (!existsSync(path)) response.writeHead(404).end();
        else response.writeHead(200, { "content-type": MEDIA[extname(name)] }).end(readFileSync(path));
    });
    await new Promise<void>((done) => server.listen(0, "127.0.0.1", done));
    const close = async () => {
        server.closeAllConnections();
        await new Promise((done) => server.close(done));
    };
    test.after(close);
    return { port: (server.address() as AddressInfo).port, close };
}

/** A page, and its errors. */
export interface Opened {
    readonly page: Page;
    readonly errors: string[];
}

/**
 * Has the page draw its moving pictures once a second, as for an operator who asks for little motion. In most tests these
 * pictures would take more of the processor than the chip. The machine rolls, because its speed was set at the start.
 */
const still = (page: Page) => page.emulateMedia({ reducedMotion: "reduce" });

/** Has the page draw its moving pictures in each frame, for a test of these pictures. */
export const moving = (page: Page): Promise<void> => page.emulateMedia({ reducedMotion: "no-preference" });

/** Opens an address, to which all requests must go. */
export async function openAt(browser: Browser, address: string, viewport = DESK): Promise<Opened> {
    const opened = await blank(browser, viewport, new URL(address).origin);
    await opened.page.goto(address);
    // The page is decompressed first. For an unpaired phone another page comes instead.
    await opened.page.waitForFunction(() => "simulation" in globalThis || !document.getElementById("view-try"));
    await still(opened.page);
    return opened;
}

/** Opens the page at a view. The operator chooses `ports` one after the other; without them there is no Web Serial. */
export async function open(browser: Browser, view: string, viewport = DESK, ports?: Device[]): Promise<Opened> {
    const opened = await blank(browser, viewport, "file:");
    if (ports) await offerPorts(opened.page, ports);
    const seed = process.env.WEEDER_SEED ?? "1";
    await opened.page.goto(`${pathToFileURL(resolve("dist/index.html")).href}?seed=${seed}#${view}`);
    await isReady(opened.page);
    await still(opened.page);
    return opened;
}

/** Loads the page again. */
export async function reload(page: Page): Promise<void> {
    await page.reload();
    await isReady(page);
}

/** Waits until the page is decompressed, and has started. */
async function isReady(page: Page): Promise<void> {
    await page.waitForFunction(() => "simulation" in globalThis);
}

/** A new page. Requests that do not begin with `own` are errors. */
async function blank(browser: Browser, { locale, ...viewport }: Screen, own: string): Promise<Opened> {
    // A context of its own can have several tabs.
    const context = await browser.newContext({ viewport, ...(locale && { locale }) });
    context.setDefaultTimeout(PATIENCE_MS);
    const page = await context.newPage();
    const errors: string[] = [];
    page.on("pageerror", (error) => errors.push(String(error)));
    page.on("console", (message) => {
        if (message.type() === "error") errors.push(message.text());
    });
    page.on("request", (request) => {
        if (!request.url().startsWith(own) && !/^(blob|data):/.test(request.url()))
            errors.push(`asks for ${request.url()}`);
    });
    return { page, errors };
}

/** Closes a page and asserts that it had no errors. */
export async function close({ page, errors }: Opened): Promise<void> {
    assert.deepEqual(errors, []);
    await page.context().close();
}

/**
 * Asserts that axe-core finds nothing in the page and that it is not wider than the screen, light and dark. Saves its
 * pictures.
 */
export async function inspect(page: Page, name: string): Promise<void> {
    const { width = 0 } = page.viewportSize() ?? {};
    for (const colorScheme of ["light", "dark"] as const) {
        await page.emulateMedia({ colorScheme });
        const wide = await page.evaluate(() => document.documentElement.scrollWidth);
        assert(wide <= width, `${name}, ${colorScheme}: ${wide} of ${width} pixels`);
        await page.screenshot({ path: `build/screenshots/${name}-${colorScheme}.png` });
        const { violations } = (await page.evaluate(`${axe}; axe.run({ preload: false })`)) as AxeResults;
        const found = violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ html }) => html).join(", ")}`);
        assert.deepEqual(found, [], `${name}, ${colorScheme}`);
    }
    await page.emulateMedia({ colorScheme: "light" });
}
