// What the tests in a browser share: headless Chromium, the page opened from the disk as somebody without a network does, and
// what is held against every page: no error, no request, nothing wider than the screen, nothing that axe-core finds.
//
// CHROMIUM names the browser where it is not Debian's. Screenshots go to build/screenshots.

import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";
import { pathToFileURL } from "node:url";
import type { AxeResults } from "axe-core";
import { type Browser, chromium, type Page } from "playwright-core";
import type { Trial } from "../src/try/trial.ts";
import { type Device, offerPorts } from "./ports.ts";

/** What the page leaves for tests. */
declare global {
    var trial: Trial;
}

/** The longest that anything on the page may take: CI's machines are slow, and share their cores. */
export const PATIENCE_MS = 60_000;

export const PHONE = { width: 390, height: 844 };
export const DESK = { width: 1440, height: 900 };

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

/** A page, and what went wrong in it. */
export interface Opened {
    readonly page: Page;
    readonly errors: string[];
}

/** Opens an address, to which all requests go. */
export async function openAt(browser: Browser, address: string, viewport = DESK): Promise<Opened> {
    const opened = await blank(browser, viewport, new URL(address).origin);
    await opened.page.goto(address);
    return opened;
}

/** Opens the page at a view. `ports` are the serial ports from which the operator chooses one after the other; none: no Web Serial. */
export async function open(browser: Browser, view: string, viewport = DESK, ports?: Device[]): Promise<Opened> {
    const opened = await blank(browser, viewport, "file:");
    if (ports) await offerPorts(opened.page, ports);
    await opened.page.goto(`${pathToFileURL(resolve("dist/index.html")).href}#${view}`);
    return opened;
}

/** A page that has opened nothing yet, and is to ask for nothing that does not begin like this. */
async function blank(browser: Browser, viewport: typeof DESK, own: string): Promise<Opened> {
    const page = await browser.newPage({ viewport });
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
