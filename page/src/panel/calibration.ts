// Calibration, step by step: the wheel over a measured stretch, then the servo's pulses and times.

import type { Parts } from "../dom.ts";
import type { EventLine } from "../link/console_line.ts";
import { linesOf } from "../link/grammar.ts";
import { type Ask, mayForce } from "../link/session.ts";
import { ended, type Plain, quantity, say } from "../words/words.ts";
import type { Machine } from "./machine.ts";

export class Calibration {
    /** The position at the stretch's beginning. */
    #from: number | undefined;
    /** The last `servo_out_us` that was put into the field for the pulse. */
    #out = "";

    constructor(
        private readonly parts: Parts,
        private readonly machine: Machine,
        private readonly ask: Ask,
    ) {
        parts.button("wheel-begin", () => void this.#begin());
        parts.button("wheel-end", () => void this.#end(""));
        parts.button("wheel-force", () => void this.#end(" force"));
        parts.button("wheel-save", () => void this.#do("wheel-said", "save", () => say("isSavedNow")));
        const pulse = parts.get("servo-pulse", HTMLInputElement);
        const drive = (to: string, us: number) => {
            pulse.value = String(us);
            void this.#do("servo-said", `servo ${to}`, () => say("toolHas", { pulse: String(us) }));
        };
        for (const place of ["in", "out"] as const) {
            parts.button(`servo-${place}`, () => drive(place, machine.setting(`servo_${place}_us`)));
            parts.button(`servo-${place}-is`, () => {
                const { value } = pulse;
                const done = () => say(place === "in" ? "pulseIn" : "pulseOut", { pulse: value });
                void this.#do("servo-said", `set servo_${place}_us ${value}`, done);
            });
        }
        for (const [name, by] of Object.entries({ "servo-less": -10, "servo-more": 10 }))
            parts.button(name, () => {
                const us = pulse.valueAsNumber + by;
                drive(String(us), us);
            });
        pulse.addEventListener("change", () => drive(pulse.value, pulse.valueAsNumber));
        parts.button("servo-time", () => void this.#do("servo-said", "calibrate servo", () => say("swingsSix")));
        parts.button("servo-leads", () => void this.#leads());
        parts.button("servo-save", () => void this.#do("servo-said", "save", () => say("isSavedNow")));
    }

    /** Begins again, after a reset: positions begin at 0, the tool is out, and what was not saved is gone. */
    forget(): void {
        this.#from = undefined;
        this.#out = "";
        for (const said of ["wheel-said", "servo-said"]) this.parts.write(said, "");
        this.parts.html("wheel-force").hidden = true;
    }

    show(): void {
        const { status, tickMm } = this.machine;
        const isOn = this.#from !== undefined && status !== undefined;
        const rolledMm = isOn ? (status.position - (this.#from ?? 0)) * tickMm : 0;
        this.parts.write(
            "wheel-rolled",
            ended(isOn ? say("rolled", { distance: quantity(rolledMm / 1000, "meter", 2) }) : say("notBegun")),
        );
    }

    showSettings(): void {
        const out = String(this.machine.setting("servo_out_us"));
        if (out !== this.#out) this.parts.get("servo-pulse", HTMLInputElement).value = this.#out = out;
        for (const name of ["lead_out_ms", "lead_in_ms"]) {
            const input = this.parts.get(name, HTMLInputElement);
            if (document.activeElement !== input) input.value = String(this.machine.setting(name));
        }
    }

    /** Shows the result of timing the servo, if this event is one. */
    take(event: EventLine): void {
        let text: Plain;
        if (event.is === "calibratedBySwitch") text = event.isSet ? "timedSet" : "timedNotSet";
        else if (event.is === "calibratedByEye") text = "timedByEye";
        else if (event.is === "notCalibrated") text = "notTimed";
        else return;
        this.parts.say("servo-said", () => say(text));
    }

    async #begin(): Promise<void> {
        const error = await this.#do("wheel-said", "calibrate start", () => say("rollOn"));
        if (!error) this.#from = this.machine.status?.position;
    }

    async #end(force: string): Promise<void> {
        const insist = this.parts.html("wheel-force");
        insist.hidden = true;
        const distance = this.parts.get("wheel-mm", HTMLInputElement).value;
        const error = await this.#do("wheel-said", `calibrate ${distance}${force}`, (lines) => {
            const [measured] = linesOf("setting", lines);
            const counts = measured ? `${say("countsPerMetre", { count: measured.value })} ` : "";
            return `${counts}${say("notSavedYet")}`;
        });
        insist.hidden = !mayForce(error);
    }

    async #leads(): Promise<void> {
        for (const name of ["lead_out_ms", "lead_in_ms"]) {
            const { value } = this.parts.get(name, HTMLInputElement);
            if (await this.#do("servo-said", `set ${name} ${value}`, () => say("bothSet"))) return;
        }
    }

    #do(said: string, command: string, done: (answer: string[]) => string): Promise<unknown> {
        return this.parts.attempt(said, this.ask(command), done);
    }
}
