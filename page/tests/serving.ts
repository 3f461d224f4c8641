// Shared code of tests with `weeder serve` and virtual Unos. 127.0.0.2 stands for the computer's address in the
// network, which needs a code.

import assert from "node:assert/strict";
import { type ChildProcess, spawn } from "node:child_process";
import { existsSync, mkdtempSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { createInterface } from "node:readline";
import type { TestContext } from "node:test";
import { setTimeout as wait } from "node:timers/promises";
import type { Locator, Page } from "playwright";
import { WEEDER } from "./weeder.ts";

const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");

/** A part of a machine's panel, by the machine's name. */
export const part = (page: Page, machine: string, name: string): Locator =>
    page.getByRole("region", { name: machine, exact: true }).locator(`[data-part="${name}"]`);

/** Ends a process by Ctrl-C. */
export async function end(child: ChildProcess): Promise<void> {
    if (child.exitCode !== null || child.signalCode !== null) return;
    const ended = new Promise((done) => child.once("exit", done));
    // Also one that is stopped, or hangs.
    for (const signal of ["SIGCONT", "SIGINT"] as const) child.kill(signal);
    const killing = setTimeout(() => child.kill("SIGKILL"), 20_000);
    await ended;
    clearTimeout(killing);
}

/** Starts a virtual Uno whose port has this path, until the test ends. */
export async function plugIn(test: TestContext, path: string): Promise<ChildProcess> {
    const uno = spawn(WEEDER, ["virtual-uno", "--elf", FIRMWARE, "--link", path], { stdio: "ignore" });
    test.after(() => end(uno));
    for (let waited = 0; !existsSync(path); waited += 50) {
        assert(uno.exitCode === null && waited < 60_000, "the virtual Uno does not start");
        await wait(50);
    }
    return uno;
}

export interface Served {
    /** The page's addresses for the computer itself, and for a phone without the code and with it. */
    readonly here: string;
    readonly lan: string;
    readonly code: string;
    readonly process: ChildProcess;
    /** Types a line at the computer itself. */
    type(line: string, machine?: number): Promise<void>;
}

/** Serves machines at ports. */
export async function serve(test: TestContext, ports: string[], ...options: string[]): Promise<Served> {
    const named = ports.flatMap((port) => ["--port", port]);
    const words = ["serve", "--page", "dist", "--http-port", "0", "--lan", "127.0.0.2", ...named, ...options];
    const child = spawn(WEEDER, words, { stdio: ["ignore", "pipe", "inherit"] });
    test.after(() => end(child));
    const said: string[] = [];
    for await (const line of createInterface({ input: child.stdout })) if (said.push(line) === 2) break;
    const [here = "", withCode = ""] = said.map((line) => line.split(" ")[0] ?? "");
    const [lan = "", code = ""] = withCode.split("#");
    const origin = new URL(here).origin;
    return {
        here,
        lan,
        code,
        process: child,
        async type(line, machine = 0) {
            const address = `${origin}/machines/${machine}/command`;
            // A machine that was just plugged in is not there at once.
            for (let tries = 0; ; tries++) {
                const seen = await lastMessage(`${origin}/events`);
                const headers = { Origin: origin, "Weeder-Seen": seen };
                const answer = await fetch(address, { method: "POST", body: line, headers });
                if (answer.ok) return;
                // Or a busy computer is too late.
                assert([412, 503].includes(answer.status) && tries < 600, `${line}: ${await answer.text()}`);
                await wait(100);
            }
        },
    };
}

/** The number of a message of an event stream. */
async function lastMessage(address: string): Promise<string> {
    const stream = new AbortController();
    const { body } = await fetch(address, { signal: stream.signal });
    const { value } = (await body?.getReader().read()) ?? {};
    stream.abort();
    return /^id: ?(\d+)$/m.exec(new TextDecoder().decode(value))?.[1] ?? "";
}

/** A folder that is deleted at the test's end. */
export function folder(test: TestContext): string {
    const folder = mkdtempSync(join(tmpdir(), "weeder-served-"));
    test.after(() => rmSync(folder, { recursive: true }));
    return folder;
}
