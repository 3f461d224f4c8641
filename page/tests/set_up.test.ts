// The steps of the set-up in the panel, at a virtual Uno in a real browser.

import test, { after, before } from "node:test";
import type { Browser } from "playwright";
import { close, expect, inspect, launch, PHONE } from "./browser.ts";
import { atHold, part, type } from "./panel.ts";

let browser: Browser;

before(async () => {
    browser = await launch();
});

after(() => browser?.close());

test("the steps of the set-up take a value each, set and save it, and keep what is being typed", async (test) => {
    const { page, errors } = await atHold(browser, test, PHONE, "--stand");
    await page.getByRole("tab", { name: "Calibrate" }).click();
    const steps = part(page, "set-up-steps");
    const beam = steps.locator("[data-step=beam_to_tool_mm]");
    await expect(beam).toHaveValue("400");
    await expect(steps.getByLabel("ticks_per_rev", { exact: true })).toHaveValue("2400");
    const step = steps.locator("li").filter({ has: page.locator("[data-step=beam_to_tool_mm]") });
    await beam.fill("4000");
    await step.getByRole("button", { name: "Set and save" }).click();
    await step.getByText("beam_to_tool_mm takes a whole number from").waitFor();
    await expect(beam).toHaveValue("4000");
    await beam.fill("430");
    await step.getByRole("button", { name: "Set and save" }).click();
    await step.getByText("Saved.").waitFor();
    // What the machine shows is marked, and the operator marks the other steps.
    await steps.getByText("Open: second_beam_mm is 0").waitFor();
    await part(page, "set-up-done").filter({ hasText: "0 of 8 steps are done." }).waitFor();
    await step.getByRole("checkbox", { name: "I have done it" }).check();
    await steps.locator("[data-step=stem_zone_mm]").fill("110");
    const stem = steps.locator("li").filter({ has: page.locator("[data-step=stem_zone_mm]") });
    // The factory's lead is too long for a zone, and a short stroke without the zone would reach canopies.
    await stem.locator("[data-step=servo_out_us]").fill("1750");
    await stem.getByRole("button", { name: "Set and save" }).click();
    await stem.getByText("together need a beam_to_tool_mm of").waitFor();
    await expect(part(page, "said").getByText("set servo_out_us")).toHaveCount(0);
    await stem.locator("[data-step=lead_out_ms]").fill("156");
    await stem.getByRole("button", { name: "Set and save" }).click();
    await stem.getByText("✓ Done").waitFor();
    await part(page, "set-up-done").filter({ hasText: "2 of 8 steps are done." }).waitFor();
    await inspect(page, "phone-set-up");
    await type(page, "revert");
    await type(page, "get beam_to_tool_mm");
    await part(page, "said")
        .getByText(/^beam_to_tool_mm=430/)
        .first()
        .waitFor();
    await page.getByRole("tab", { name: "Calibrate" }).click();
    await steps.getByRole("button", { name: "Swing six times" }).click();
    await steps.getByText("The tool swings in and out six times.").waitFor();
    await page.locator("#language").selectOption("fr");
    await expect(beam).toHaveValue("430");
    await close({ page, errors });
});
