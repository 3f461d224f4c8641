// What a line of the machine means. This is the page's one door to the console's grammar: whoever wants to know what was
// said asks `read`, and nobody else takes a line apart.
//
// Keys that are not known are passed over, so that a newer firmware may say more; a line that lacks one of its keys is
// `other`. Commands are put together where they are typed; their words stand in the firmware's help.

/** What the machine is doing. */
export type Mode = "hold" | "work" | "alarm";

/** The first line of the answer to `status`. Positions are the encoder's counts. */
export interface Status {
    readonly mode: Mode;
    /** The latched alarm's name. */
    readonly alarm: string | undefined;
    readonly toolOut: boolean;
    /** Why the tool is out while the machine works, in the console's word. */
    readonly reason: string | undefined;
    readonly position: number;
    /** Negative backwards. */
    readonly speedMmS: number;
    /** Windows at the tool or ahead of it. */
    readonly windows: number;
    /** How far the machine has to roll until ground that the beam has seen reaches the tool. */
    readonly unseenMm: number;
}

/** An object that the beam saw, in the encoder's counts. */
export interface Seen {
    readonly class: "plant" | "weed" | "unknown";
    /** Its leading edge, when that was in the beam. */
    readonly position: number;
    readonly votes: number;
    /** Distance since the last plant. */
    readonly spacing: number;
    /** From the leading edge to the beginning of its window, and the window's length: canopy and both margins. */
    readonly delay: number;
    readonly hold: number;
}

/** A setting as `get` shows it. A switched one is 0 or 1. */
export interface Setting {
    readonly name: string;
    readonly value: number;
    readonly unit: string;
    readonly least: number;
    readonly greatest: number;
    readonly isSwitched: boolean;
    readonly default: number;
    /** Nothing where none are saved. */
    readonly saved: number | undefined;
}

/** What a line says. */
export type Said =
    /** The first line after a reset. */
    | { is: "greeting"; version: string; cause: string }
    /** The answer to `version`. */
    | { is: "version"; version: string }
    /** The end of an answer: what was wrong, and what would be right, where something was. */
    | { is: "end"; error: string | undefined }
    | { is: "status"; status: Status }
    | { is: "setting"; setting: Setting }
    /** What a setting or a command is. */
    | { is: "help"; name: string; help: string }
    | { is: "example"; fromField: boolean; number: number; label: string }
    | { is: "object"; seen: Seen }
    | { is: "state"; mode: Mode }
    | { is: "swing"; out: boolean }
    /** A fault was latched. */
    | { is: "alarm"; name: string }
    | { is: "warning"; name: string }
    /** The servo was timed: by the end switch, by the operator's eye, or in vain. */
    | { is: "calibrated"; by: "end switch" | "eye" | "none"; isSet: boolean }
    /** Points of a plotter's curves. */
    | { is: "plot" }
    | { is: "other" };

/** Whether the machine says it by itself, and not as a part of an answer. */
export function isTold({ is }: Said): boolean {
    return ["object", "state", "swing", "alarm", "warning", "calibrated", "plot"].includes(is);
}

const OTHER: Said = { is: "other" };
const SETTING =
    /^(\w+)=(\w+)(?: ([a-z/]+))?(?: from (\d+) to (\d+)| on or off), default (\w+)(?:, saved (\w+)|(, not saved))?$/;

/** Reads a line. */
export function read(line: string): Said {
    if (line === "ok") return { is: "end", error: undefined };
    if (line.startsWith("error:")) return { is: "end", error: line.slice("error:".length).trim() };
    const greeting = /^weeder (\S+), reset by (\w+)/.exec(line);
    if (greeting) return { is: "greeting", version: greeting[1] ?? "", cause: greeting[2] ?? "" };
    const version = /^weeder (\S+)$/.exec(line);
    if (version) return { is: "version", version: version[1] ?? "" };
    const example = /^(field|built_in) (\d+) (plant|weed) /.exec(line);
    if (example)
        return {
            is: "example",
            fromField: example[1] === "field",
            number: Number(example[2]),
            label: example[3] ?? "",
        };
    const help = /^(\w+)[^=]*? - (.*)$/.exec(line);
    if (help) return { is: "help", name: help[1] ?? "", help: help[2] ?? "" };
    if (/^>?\w+:-?\d+(,\w+:-?\d+)*$/.test(line)) return { is: "plot" };
    const setting = SETTING.exec(line);
    if (setting) return readSetting(setting);
    return readValues(line);
}

/** A setting's value, which may be switched. */
function value(word: string): number {
    return word === "on" ? 1 : word === "off" ? 0 : Number(word);
}

function readSetting([
    ,
    name = "",
    is = "",
    unit = "",
    least,
    greatest,
    usual = "",
    saved,
    unsaved,
]: RegExpExecArray): Said {
    const isSwitched = least === undefined;
    const setting = {
        name,
        value: value(is),
        unit,
        least: Number(least ?? 0),
        greatest: Number(greatest ?? 1),
        isSwitched,
        default: value(usual),
        saved: unsaved ? undefined : value(saved ?? is),
    };
    return { is: "setting", setting };
}

/** Reads what is `name key=value key=value`. */
function readValues(line: string): Said {
    const [first = ""] = line.split(" ");
    const values = new Map([...line.matchAll(/(\w+)=(\S+)/g)].map(([, key = "", value = ""]) => [key, value]));
    const text = (key: string) => values.get(key) ?? "";
    const number = (key: string) => Number.parseInt(text(key), 10);
    const mode = (key: string) => ["hold", "work", "alarm"].find((mode) => mode === text(key)) as Mode | undefined;
    switch (first) {
        case "plant":
        case "weed":
        case "unknown": {
            const seen = {
                class: first,
                position: number("pos"),
                votes: number("votes"),
                spacing: number("spacing"),
                delay: number("delay"),
                hold: number("hold"),
            } as const;
            return Number.isNaN(seen.position + seen.delay + seen.hold) ? OTHER : { is: "object", seen };
        }
        case "swing":
            return text("tool") === "" ? OTHER : { is: "swing", out: text("tool") === "out" };
        case "state": {
            const is = mode("is");
            return is ? { is: "state", mode: is } : OTHER;
        }
        case "alarm":
        case "warning":
            return text("name") === "" ? OTHER : { is: first, name: text("name") };
        case "calibrated": {
            const by = text("by").startsWith("eye") ? "eye" : text("by").startsWith("none") ? "none" : "end switch";
            return { is: "calibrated", by, isSet: text("set") === "yes" };
        }
        default:
    }
    const state = mode("state");
    if (!state || Number.isNaN(number("pos") + number("speed_mm_s") + number("unseen_mm"))) return OTHER;
    const status = {
        mode: state,
        alarm: values.get("alarm"),
        toolOut: text("tool") === "out",
        reason: values.get("for"),
        position: number("pos"),
        speedMmS: number("speed_mm_s"),
        windows: number("windows"),
        unseenMm: number("unseen_mm"),
    };
    return { is: "status", status };
}
