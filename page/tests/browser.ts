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
import { type Browser, chromium, firefox, type Page } from "playwright-core";
import type { Trial } from "../src/try/trial.ts";
import { type Device, offerPorts } from "./ports.ts";

/** What the page leaves for tests. */
declare global {
    var trial: Trial;
}

/** The longest that anything on the page may take: CI's machines are slow, and share their cores. */
export const PATIENCE_MS = 60_000;

/** What a page is shown on, and the browser's language where that is another one than American English. */
export interface Screen {
    readonly width: number;
    readonly height: number;
    readonly locale?: string;
}

export const PHONE: Screen = { width: 390, height: 844 };
export const DESK: Screen = { width: 1440, height: 900 };

const axe = readFileSync(createRequire(resolve("package.json")).resolve("axe-core/axe.min.js"), "utf8");

export function launch(): Promise<Browser> {
    return chromium.launch({
        executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
        args: [
            "--headless",
            // A name that is not this computer's own, as another one in the network has it.
            "--host-resolver-rules=MAP weeder.test 127.0.0.1",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            "--no-first-run",
        ],
    });
}

/** Firefox, by WebDriver BiDi: the browser as Debian has it, and not a build of Playwright's own. */
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

/** A web server that knows nothing of the page gives away what lies in a folder. */
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

/** A page, and what went wrong in it. */
export interface Opened {
    readonly page: Page;
    readonly errors: string[];
}

/** Opens an address, to which all requests go. */
export async function openAt(browser: Browser, address: string, viewport = DESK): Promise<Opened> {
    const opened = await blank(browser, viewport, new URL(address).origin);
    await opened.page.goto(address);
    // The page is unpacked first. Where a phone is to be paired, another page comes instead.
    await opened.page.waitForFunction(() => "trial" in globalThis || !document.getElementById("view-try"));
    return opened;
}

/** Opens the page at a view. `ports` are the serial ports from which the operator chooses one after the other; none: no Web Serial. */
export async function open(browser: Browser, view: string, viewport = DESK, ports?: Device[]): Promise<Opened> {
    const opened = await blank(browser, viewport, "file:");
    if (ports) await offerPorts(opened.page, ports);
    await opened.page.goto(`${pathToFileURL(resolve("dist/index.html")).href}#${view}`);
    await opened.page.waitForFunction(() => "trial" in globalThis);
    return opened;
}

/** A page that has opened nothing yet, and is to ask for nothing that does not begin like this. */
async function blank(browser: Browser, { locale, ...viewport }: Screen, own: string): Promise<Opened> {
    const page = await browser.newPage({ viewport, ...(locale && { locale }) });
    page.setDefaultTimeout(PATIENCE_MS);
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

/** Closes a page in which nothing went wrong. */
export async function close({ page, errors }: Opened): Promise<void> {
    assert.deepEqual(errors, []);
    await page.close();
}

/** Holds against the page that axe-core finds nothing in it and it is not wider than the screen, light and dark; keeps its pictures. */
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
