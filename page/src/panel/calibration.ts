// Calibration, step by step: the wheel over a measured stretch, then the servo's pulses and times.

import type { Parts } from "../dom.ts";
import { read, type Said } from "../link/grammar.ts";
import { type Ask, Refused } from "../link/session.ts";
import type { Machine } from "./machine.ts";

/** Which of the servo's two places. */
type Place = "in" | "out";

export class Calibration {
    readonly #parts: Parts;
    readonly #machine: Machine;
    readonly #ask: Ask;
    /** Where the stretch began. */
    #from: number | undefined;

    constructor(parts: Parts, machine: Machine, ask: Ask) {
        [this.#parts, this.#machine, this.#ask] = [parts, machine, ask];
        parts.button("wheel-begin", () => void this.#begin());
        parts.button("wheel-end", () => void this.#end(""));
        parts.button("wheel-force", () => void this.#end(" force"));
        parts.button("wheel-save", () => void this.#do("wheel-said", "save", "Saved."));
        const pulse = parts.get("servo-pulse", HTMLInputElement);
        for (const place of ["in", "out"] as const) {
            parts.button(`servo-${place}`, () => void this.#move(place));
            parts.button(
                `servo-${place}-is`,
                () =>
                    void this.#do(
                        "servo-said",
                        `set servo_${place}_us ${pulse.value}`,
                        `${pulse.value} us is the tool ${place === "in" ? "in the row" : "out"} now. Not saved yet.`,
                    ),
            );
        }
        for (const [name, by] of [
            ["servo-less", -10],
            ["servo-more", 10],
        ] as const)
            parts.button(name, () => {
                pulse.value = String(pulse.valueAsNumber + by);
                void this.#byHand(pulse.value);
            });
        pulse.addEventListener("change", () => void this.#byHand(pulse.value));
        parts.button("servo-time", () => void this.#time());
        parts.button("servo-leads", () => void this.#leads());
        parts.button("servo-save", () => void this.#do("servo-said", "save", "Saved."));
    }

    /** Shows what changes while the machine rolls. */
    show(): void {
        const { status, tickMm } = this.#machine;
        const isOn = this.#from !== undefined && status !== undefined;
        const rolledMm = isOn ? (status.position - (this.#from ?? 0)) * tickMm : 0;
        this.#parts.write(
            "wheel-rolled",
            isOn ? `${(rolledMm / 1000).toFixed(2)} m by the present setting` : "not begun",
        );
    }

    /** The settings have changed. */
    showSettings(): void {
        this.#parts.get("servo-pulse", HTMLInputElement).value ||= String(this.#machine.setting("servo_out_us"));
        for (const name of ["lead_out_ms", "lead_in_ms"]) {
            const input = this.#parts.get(name, HTMLInputElement);
            if (document.activeElement !== input) input.value = String(this.#machine.setting(name));
        }
    }

    /** What came of timing the servo. */
    take(said: Extract<Said, { is: "calibrated" }>): void {
        const text = {
            "end switch": said.isSet
                ? "The end switch has timed it, and both leads are set. Not saved yet."
                : "The end switch has timed it, but these leads need the beam farther ahead, or a lower top speed: nothing is set.",
            eye: "It has swung three times. Put in what you saw, the longest way out and the shortest wait before it came in.",
            none: "The end switch did not follow: see to it, or set end_switch off and go by eye.",
        }[said.by];
        this.#parts.write("servo-said", text);
    }

    async #begin(): Promise<void> {
        if (!(await this.#do("wheel-said", "calibrate start", "Roll to the other mark, then give the distance.")))
            return;
        this.#from = this.#machine.status?.position;
    }

    async #end(force: string): Promise<void> {
        const force_ = this.#parts.get("wheel-force", HTMLButtonElement);
        force_.hidden = true;
        const distance = this.#parts.get("wheel-mm", HTMLInputElement).value;
        try {
            const said = (await this.#ask(`calibrate ${distance}${force}`)).map(read);
            const measured = said.find((said) => said.is === "setting");
            const counts = measured ? `${measured.setting.value} encoder counts a metre. ` : "";
            this.#parts.write("wheel-said", `${counts}Not saved yet.`);
        } catch (error) {
            this.#parts.write("wheel-said", error instanceof Error ? error.message : String(error));
            force_.hidden = !(error instanceof Refused && error.message.includes("force"));
        }
    }

    async #move(place: Place): Promise<void> {
        const pulse = this.#machine.setting(`servo_${place}_us`);
        this.#parts.get("servo-pulse", HTMLInputElement).value = String(pulse);
        await this.#do("servo-said", `servo ${place}`, `The tool has ${pulse} us.`);
    }

    async #byHand(pulse: string): Promise<void> {
        await this.#do("servo-said", `servo ${pulse}`, `The tool has ${pulse} us.`);
    }

    async #time(): Promise<void> {
        await this.#do("servo-said", "calibrate servo", "The tool swings in and out three times. Keep clear of it.");
    }

    async #leads(): Promise<void> {
        for (const name of ["lead_out_ms", "lead_in_ms"]) {
            const { value } = this.#parts.get(name, HTMLInputElement);
            if (!(await this.#do("servo-said", `set ${name} ${value}`, "Both leads are set. Not saved yet."))) return;
        }
    }

    /** Types a command and says what came of it; whether it was carried out. */
    async #do(said: string, command: string, done: string): Promise<boolean> {
        try {
            await this.#ask(command);
            this.#parts.write(said, done);
            return true;
        } catch (error) {
            this.#parts.write(said, error instanceof Error ? error.message : String(error));
            return false;
        }
    }
}
