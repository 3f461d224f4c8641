// What is known of the machine at the other end of the wire, and how that changes with what happens; and its words for the
// operator.

import faults from "faults.json";
import type { Mode, Seen, Setting, Status } from "../link/grammar.ts";
import type { Happening } from "../link/session.ts";

/** Objects that are remembered. */
const OBJECTS = 50;

/** What the manual says of an alarm or a warning. */
export interface Fault {
    /** The digits that the lamp blinks, such as 1-1; empty for a warning. */
    readonly code: string;
    readonly name: string;
    readonly cause: string;
    readonly advice: string;
}

/** What the manual says of an alarm or a warning; what is not in it can still be looked up. */
export function fault(name: string): Fault {
    const unknown = { code: "", name, cause: "", advice: "look it up in the manual, docs/faults.md" };
    return faults.find((fault) => fault.name === name) ?? unknown;
}

/** Why the tool is out at work, in words for the operator. */
const REASONS: Readonly<Record<string, string>> = {
    plant: "A plant is at the tool, or comes up.",
    unseen_ground: "The beam has not seen this ground yet.",
    too_fast: "Too fast: a plant behind the beam would be reached before the tool is out. Drive slower.",
    encoder_doubtful: "The encoder says too little: nobody knows how far the machine has rolled.",
};

export class Machine {
    /** The firmware's version, where the machine is there. */
    version: string | undefined;
    /** Whether it may be started from here. */
    mayStart = true;
    /** Why it is not there. */
    lost = "No machine is connected.";
    mode: Mode = "hold";
    toolOut = true;
    /** The latched alarm's name. */
    alarm: string | undefined;
    /** The last warning's name. */
    warning: string | undefined;
    status: Status | undefined;
    /** When the status came. */
    statusMs = 0;
    settings: readonly Setting[] = [];
    help: ReadonlyMap<string, string> = new Map();
    examples: readonly string[] = [];
    /** The last objects, the newest first, and those of them whose windows the machine still knows of. */
    objects: Seen[] = [];
    windows: Seen[] = [];

    /** Takes what happened, at a time. */
    take(happening: Happening, nowMs: number): void {
        switch (happening.is) {
            case "connected":
                this.version = happening.version;
                this.settings = happening.settings;
                this.examples = happening.examples;
                [this.objects, this.windows] = [[], []];
                [this.warning, this.status] = [undefined, undefined];
                break;
            case "lost":
                this.version = undefined;
                this.lost = sentence(happening.why);
                // Whoever is at the machine has to know where HOLD is now.
                if (happening.forGood && !happening.isWanted && this.mode === "work")
                    this.lost += " A machine with power of its own weeds on: its work switch takes the tool out.";
                [this.alarm, this.warning, this.status] = [undefined, undefined, undefined];
                break;
            case "settings":
                this.settings = happening.settings;
                break;
            case "help":
                this.help = happening.help;
                break;
            case "status": {
                const { status } = happening;
                this.status = status;
                this.statusMs = nowMs;
                [this.mode, this.toolOut, this.alarm] = [status.mode, status.toolOut, status.alarm];
                const behind = this.ticks(this.setting("beam_to_tool_mm"));
                this.windows = this.windows.filter(
                    ({ position, delay, hold }) => position + delay + hold > status.position - behind,
                );
                break;
            }
            case "told":
                this.#take(happening.said);
                break;
            default:
        }
    }

    #take(said: Extract<Happening, { is: "told" }>["said"]): void {
        switch (said.is) {
            case "object":
                this.objects = [said.seen, ...this.objects].slice(0, OBJECTS);
                this.windows = [said.seen, ...this.windows].slice(0, OBJECTS);
                if (said.seen.class === "plant" && this.warning === "no_plants") this.warning = undefined;
                break;
            case "state":
                this.mode = said.mode;
                if (said.mode !== "alarm") this.alarm = undefined;
                if (said.mode === "hold") this.warning = undefined;
                break;
            case "swing":
                this.toolOut = said.out;
                break;
            case "alarm":
                [this.mode, this.toolOut, this.alarm, this.windows] = ["alarm", true, said.name, []];
                break;
            case "warning":
                this.warning = said.name;
                break;
            default:
        }
    }

    /** A setting's value; 0 where the machine has not shown it. */
    setting(name: string): number {
        return this.settings.find((setting) => setting.name === name)?.value ?? 0;
    }

    /** Distance of an encoder count. */
    get tickMm(): number {
        const perMetre = this.setting("ticks_per_m");
        if (perMetre > 0) return 1000 / perMetre;
        return (Math.PI * this.setting("wheel_mm")) / Math.max(this.setting("ticks_per_rev"), 1);
    }

    ticks(millimetres: number): number {
        return millimetres / Math.max(this.tickMm, 1e-6);
    }

    /** How wide an object was. */
    widthMm({ hold }: Seen): number {
        return hold * this.tickMm - 2 * this.setting("margin_mm");
    }

    /** The position now, in counts: the last status', and what was rolled since. */
    positionAt(nowMs: number): number {
        const { status } = this;
        if (!status) return 0;
        return status.position + this.ticks((status.speedMmS * Math.min(nowMs - this.statusMs, 500)) / 1000);
    }

    /** What the machine does, in a word. */
    get stateWord(): string {
        return this.version === undefined ? "no machine" : this.mode;
    }

    /** What the tool does and why, in a sentence. */
    get why(): string {
        if (this.version === undefined) return this.lost;
        if (this.mode === "alarm") return "The tool is out until the alarm is cleared.";
        if (this.mode === "hold")
            return this.toolOut
                ? `The tool is out: the machine holds until it is started, by the work switch${this.mayStart ? " or here" : ""}.`
                : "The tool is moved by hand. Keep clear of it.";
        if (!this.toolOut) return "The tool is in the row, and weeds.";
        const reason = this.status?.reason ?? "plant";
        const toGo =
            reason === "unseen_ground" && this.status ? ` ${(this.status.unseenMm / 1000).toFixed(2)} m to go.` : "";
        return `The tool is out. ${REASONS[reason] ?? `The machine says: ${reason}.`}${toGo}`;
    }
}

/** A text as a sentence, its commands as they are typed. */
export function sentence(text: string): string {
    const plain = text.replaceAll("`", "");
    return `${plain.charAt(0).toUpperCase()}${plain.slice(1)}${/[.!?]$/.test(plain) ? "" : "."}`;
}
