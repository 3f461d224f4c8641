// The state of the machine at the other end of the wire, updated by events, with its texts for the operator.

import faults from "faults.json";
import { plain } from "../dom.ts";
import type { EventLine, Line, Mode, Setting } from "../link/console_line.ts";
import { read, tickMm } from "../link/grammar.ts";
import type { Happening } from "../link/session.ts";
import { ended, english, type Plain, quantity, say, table, told } from "../words/words.ts";

const OBJECTS = 50;

/**
 * The manual's entry for an alarm or a warning. Its title is its common name: for an alarm, the digits that the lamp
 * blinks and the word, as in "3-1 too_fast". An unknown one refers to the manual.
 */
export function fault(name: string): { title: string; advice: string } {
    const found = faults.find((fault) => fault.name === name) ?? { title: name, advice: say("lookItUp") };
    return { title: found.title, advice: table.advice?.[name] ?? found.advice };
}

/** Why the tool is out at work, in words for the operator. */
const REASONS: Readonly<Record<string, Plain>> = {
    plant: "reasonPlant",
    unseen_ground: "reasonUnseen",
    too_fast: "reasonTooFast",
    encoder_doubtful: "reasonEncoder",
};
const STATES = {
    none: "stateNone",
    unknown: "stateUnknown",
    hold: "hold",
    work: "stateWork",
    alarm: "stateAlarm",
} as const;

/** Time after a status in which it counts as the present one. */
const FRESH_MS = 1000;

export class Machine {
    /** The firmware's version, if the machine is connected. */
    version: string | undefined;
    mayStart = true;
    /** Why it is lost, in English. */
    lost: string = english("noneConnected");
    /** Whether it may be weeding without a connection. */
    #mayWeedOn = false;
    /** The last known ones. */
    mode: Mode | undefined;
    toolOut: boolean | undefined;
    /** The cause of a restart at work, until the machine works again. */
    restarted: string | undefined;
    /** The present time, as `statusMs`. */
    nowMs = 0;
    alarm: string | undefined;
    warning: string | undefined;
    status: Line<"status"> | undefined;
    statusMs = 0;
    settings: readonly Setting[] = [];
    help: ReadonlyMap<string, string> = new Map();
    examples: readonly string[] = [];
    /** The last detections, the newest first, and those with a zone that the machine still stores. */
    objects: Line<"detection">[] = [];
    zones: Line<"detection">[] = [];

    take(happening: Happening, nowMs: number): void {
        switch (happening.is) {
            case "connected":
                this.version = happening.version;
                this.settings = happening.settings;
                this.examples = happening.examples;
                this.help = happening.help;
                this.#mayWeedOn = false;
                [this.objects, this.zones] = [[], []];
                [this.warning, this.status, this.mode, this.toolOut] = [undefined, undefined, undefined, undefined];
                break;
            case "started": {
                const said = read(happening.line);
                if (said.is === "greeting" && (said.wasAtWork || happening.wasAtWork || this.mode === "work"))
                    this.restarted = said.cause;
                this.mode = undefined;
                break;
            }
            case "lost":
                this.version = undefined;
                this.lost = happening.why;
                // The operator must know where to find HOLD now.
                this.#mayWeedOn = happening.forGood && this.mode === "work";
                [this.alarm, this.warning, this.status] = [undefined, undefined, undefined];
                break;
            case "settings":
                this.settings = happening.settings;
                break;
            case "examples":
                this.examples = happening.examples;
                break;
            case "status": {
                const { status } = happening;
                this.status = status;
                this.statusMs = nowMs;
                [this.mode, this.toolOut, this.alarm] = [status.mode, status.toolOut, status.alarm];
                if (status.mode === "work") this.restarted = undefined;
                const behind = this.ticks(this.setting("beam_to_tool_mm"));
                this.zones = this.zones.filter(
                    ({ position, delay, hold }) => position + delay + hold > status.position - behind,
                );
                break;
            }
            case "warning":
                this.warning = happening.warning;
                break;
            case "event":
                this.#take(happening.event);
                break;
        }
    }

    #take(event: EventLine): void {
        switch (event.is) {
            case "detection":
                this.objects = [event, ...this.objects].slice(0, OBJECTS);
                this.zones = [event, ...this.zones].slice(0, OBJECTS);
                break;
            case "state":
                this.mode = event.mode;
                if (event.mode === "work") this.restarted = undefined;
                if (event.mode !== "alarm") this.alarm = undefined;
                break;
            case "swing":
                this.toolOut = event.out;
                break;
            case "alarm":
                [this.mode, this.toolOut, this.alarm, this.zones] = ["alarm", true, event.alarm, []];
                break;
        }
    }

    /** A setting's value; 0 if the machine has not shown it. */
    setting(name: string): number {
        return this.settings.find((setting) => setting.name === name)?.value ?? 0;
    }

    get tickMm(): number {
        return tickMm((name) => this.setting(name));
    }

    ticks(millimetres: number): number {
        return millimetres / Math.max(this.tickMm, 1e-6);
    }

    widthMm({ hold }: Line<"detection">): number {
        return hold * this.tickMm - 2 * this.setting("margin_mm");
    }

    /** The position now, in counts: that of the last status, and the distance since. */
    positionAt(nowMs: number): number {
        const { status } = this;
        if (!status) return 0;
        return status.position + this.ticks((status.speedMmS * Math.min(nowMs - this.statusMs, 500)) / 1000);
    }

    /** Whether it is connected and works, as far as it has told. */
    get isAtWork(): boolean {
        return this.version !== undefined && this.mode === "work";
    }

    get state(): Mode | "none" | "unknown" {
        if (this.version === undefined) return "none";
        return this.status && this.mode && this.nowMs - this.statusMs <= FRESH_MS ? this.mode : "unknown";
    }

    /** The same in a word for the operator. */
    get stateWord(): string {
        // A button has one of them in capitals.
        return say(STATES[this.state]).toLowerCase();
    }

    /**
     * The text for a screen reader: the state, and its reason if that lasts. Distances and swings at plants are left
     * out, as they would never end.
     */
    get heard(): string {
        if (this.state === "work" && !this.#isKeptOut) return sentence(this.stateWord);
        return `${sentence(this.stateWord)} ${this.#reason}`;
    }

    /** The tool's state and its reason, in a sentence or two. */
    get why(): string {
        const { status } = this;
        const isUnseen = this.state === "work" && this.#isKeptOut && status?.reason === "unseen_ground";
        return isUnseen
            ? `${this.#reason} ${say("toGo", { distance: quantity(status.unseenMm / 1000, "meter", 2) })}`
            : this.#reason;
    }

    /** Whether the tool is out at work for another reason than a plant. */
    get #isKeptOut(): boolean {
        return this.toolOut === true && (this.status?.reason ?? "plant") !== "plant";
    }

    get #reason(): string {
        if (this.version === undefined)
            return `${sentence(told(this.lost))}${this.#mayWeedOn ? ` ${say("weedsOn")}` : ""}`;
        if (this.state === "unknown") return say("notTold");
        if (this.mode === "alarm") return say("outUntilCleared");
        if (this.mode === "hold" && !this.toolOut) return say("movedByHand");
        if (this.mode === "hold") return say(this.mayStart ? "outUntilStart" : "outUntilSwitch");
        if (!this.toolOut) return say("weeds");
        const reason = this.status?.reason ?? "plant";
        const known = REASONS[reason];
        return say("toolIsOut", { reason: known ? say(known) : say("reasonOther", { reason }) });
    }
}

export function sentence(text: string): string {
    const shown = plain(text);
    return ended(`${shown.charAt(0).toUpperCase()}${shown.slice(1)}`);
}
