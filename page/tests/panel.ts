// Shared code of the panel's tests: the panel at a virtual Uno, its parts and its console.

import { resolve } from "node:path";
import type { TestContext } from "node:test";
import type { Browser, Page } from "playwright";
import { DESK, type Opened, open } from "./browser.ts";
import { type Device, VirtualUno } from "./ports.ts";

export const FIRMWARE = resolve("../target/avr-none/firmware/weeder-firmware.elf");

/** A part of the panel. */
export const part = (page: Page, name: string) => page.locator(`#work-panel [data-part="${name}"]`);

/** Opens the panel and connects it to a device. */
export async function connect(browser: Browser, device: Device, viewport = DESK): Promise<Opened> {
    const opened = await open(browser, "work", viewport, [device]);
    await opened.page.getByRole("button", { name: "Connect an Uno" }).click();
    return opened;
}

/** The panel of a virtual Uno with saved settings, whose machine rolls. */
export async function atHold(
    browser: Browser,
    test: TestContext,
    viewport = DESK,
    ...row: string[]
): Promise<Opened & { uno: VirtualUno }> {
    const uno = await VirtualUno.start(test, "--elf", FIRMWARE, ...row);
    const opened = await connect(browser, uno, viewport);
    await type(opened.page, "save");
    await part(opened.page, "clear").click();
    await part(opened.page, "state").filter({ hasText: "hold" }).waitFor();
    return { ...opened, uno };
}

/** Types a command, and waits for its `ok`. */
export async function type(page: Page, command: string): Promise<void> {
    const said = part(page, "said");
    await page.getByRole("tab", { name: "Console" }).click();
    const before = await said.locator("div", { hasText: /^ok$/ }).count();
    await part(page, "typed").fill(command);
    try {
        await page.locator("#work-panel").getByRole("button", { name: "Send" }).click();
    } catch (error) {
        const told = await said.locator("div").allTextContents();
        throw new Error(
            `the console takes no ${command}: ${await part(page, "why").textContent()} ${told.join(" / ")}`,
            {
                cause: error,
            },
        );
    }
    await said.locator("div", { hasText: /^ok$/ }).nth(before).waitFor();
}
