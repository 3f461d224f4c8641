// What a line of the machine says: the tables of control/src/say/line_tables.rs and host/link/src/console_line.rs, as types.
// `UPDATE_EXPECT=1 cargo test -p page lines` writes this file.

/** What the machine is doing. */
export type Mode = "hold" | "work" | "alarm";

/** A detection was seen in full and classified. */
export interface Detection {
    readonly is: "detection";
    /** What it was taken for. */
    readonly class: "plant" | "weed" | "unknown";
    /** Its leading edge, in encoder ticks. */
    readonly position: number;
    /** How many of the `k` nearest examples voted for its class. */
    readonly votes: number;
    /** Ticks since the last plant's leading edge. */
    readonly spacing: number;
    /** Ticks from the leading edge until the tool leaves the row (Y of the paper). */
    readonly delay: number;
    /** Ticks for which the tool stays out (Z). */
    readonly hold: number;
    /** Ticks until the tool comes back (R). */
    readonly actuation: number;
}

/** Ground is kept on which a plant was expected and none was seen. */
export interface Guarded {
    readonly is: "guarded";
    /** The middle of that ground, in encoder ticks. */
    readonly position: number;
}

/** The tool was commanded in or out. */
export interface Swing {
    readonly is: "swing";
    /** Where it is to be. */
    readonly out: boolean;
    /** The machine's position at the command, in encoder ticks. */
    readonly position: number;
}

/** A plant passed both beams and told the wheel's slip. */
export interface Slip {
    readonly is: "slip";
    /** In thousandths, above 0 where the wheel turns farther than the machine rolls. */
    readonly permille: number;
}

/** The state changed. */
export interface State {
    readonly is: "state";
    /** The new one. */
    readonly mode: Mode;
}

/** Something that the operator should know of. */
export interface Warning {
    readonly is: "warning";
    /** Which warning. */
    readonly warning: string;
}

/** An alarm was latched, and the tool is out. */
export interface Alarm {
    readonly is: "alarm";
    /** Which alarm. */
    readonly alarm: string;
    /** The machine's position, in encoder ticks. */
    readonly position: number;
}

/** The end switch timed the servo. */
export interface CalibratedBySwitch {
    readonly is: "calibratedBySwitch";
    /** The longest time until the tool was out, in ms. */
    readonly outMs: number;
    /** The shortest time until it began to come back, in ms. */
    readonly inMs: number;
    /** Whether the leads are set to these times. */
    readonly isSet: boolean;
}

/** The servo was shown without an end switch: set the leads that you saw. */
export interface CalibratedByEye {
    readonly is: "calibratedByEye";
}

/** The end switch did not follow the servo. */
export interface NotCalibrated {
    readonly is: "notCalibrated";
}

/** Points of a plotter's curves. */
export interface Plot {
    readonly is: "plot";
}

/** The first line of the answer to `status`. */
export interface Status {
    readonly is: "status";
    /** The machine's state. */
    readonly mode: Mode;
    /** In an alarm: which one. */
    readonly alarm?: string;
    /** Where the tool is to be. */
    readonly toolOut: boolean;
    /** At work: why the tool is out (`plant`, `unseen_ground`, `too_fast`, `encoder_doubtful`). */
    readonly reason?: string;
    /** The machine's position, in encoder ticks. */
    readonly position: number;
    /** The machine's speed in mm/s, negative backwards. */
    readonly speedMmS: number;
    /** Keep-out zones at the tool or ahead of it. */
    readonly zones: number;
    /** Distance until the tool has left unseen ground and its margin, in mm. */
    readonly unseenMm: number;
    /** With a second beam: the wheel's slip in thousandths, as the event has it, or `none`. */
    readonly slipPermille?: number;
}

/** The second line of the answer to `status`, with what was counted since the reset. */
export interface Counts {
    readonly is: "counts";
    /** Encoder steps without a direction. */
    readonly lost: number;
    /** Changes of both channels at once, which are not counted. */
    readonly jumps: number;
    /** Commands to the tool that came too late. */
    readonly late: number;
    /** Events that were dropped, because the monitor reads too slowly. */
    readonly missed: number;
    /** Console lines with an error. */
    readonly commandErrors: number;
    /** Detections narrower than `min_width_mm`. */
    readonly dust: number;
    /** Bytes of stack that were never used. */
    readonly stackFree: number;
    /** Cause of the last reset. */
    readonly cause: string;
    /** The present warning. */
    readonly warning?: string;
}

/** The first line after a reset. */
export interface Greeting {
    readonly is: "greeting";
    /** The firmware's version. */
    readonly version: string;
    /** The reset cause, in the firmware's word. */
    readonly cause: string;
}

/** The answer to `version`. */
export interface Version {
    readonly is: "version";
    /** The firmware's version. */
    readonly version: string;
}

/** The end of an answer. */
export interface End {
    readonly is: "end";
    /** The error, and what would be right; missing if the command succeeded. */
    readonly error?: string;
}

/** A setting: a line of the answer to `get`, or the measured value in the answer to `calibrate MM`. A switch is 0 or 1. */
export interface Setting {
    readonly is: "setting";
    /** Its name. */
    readonly name: string;
    /** Its value in use. */
    readonly value: number;
    /** Its unit; empty for a count. */
    readonly unit: string;
    /** The least value. */
    readonly least: number;
    /** The greatest value. */
    readonly greatest: number;
    /** Whether it is a switch. */
    readonly isSwitched: boolean;
    /** Its value on a new machine. */
    readonly default: number;
    /** The saved value, if there is one. */
    readonly saved?: number;
}

/** A line of the answer to `help`. */
export interface Help {
    readonly is: "help";
    /** A setting's or a command's name. */
    readonly name: string;
    /** What it is. */
    readonly help: string;
}

/** A line of the answer to `examples`. */
export interface Example {
    readonly is: "example";
    /** True for a taught example, false for a built-in one. */
    readonly fromField: boolean;
    /** Its number, of its kind. */
    readonly number: number;
    /** Its class. */
    readonly label: "plant" | "weed" | "unknown";
    /** Its features, on the scale of the firmware's own examples. */
    readonly features: readonly number[];
}

/** Something else. */
export interface Other {
    readonly is: "other";
}

/** What the machine tells by itself. */
export type EventLine =
    | Detection
    | Guarded
    | Swing
    | Slip
    | State
    | Warning
    | Alarm
    | CalibratedBySwitch
    | CalibratedByEye
    | NotCalibrated
    | Plot;

/** The events' names. */
export const EVENT_NAMES: readonly EventLine["is"][] = [
    "detection",
    "guarded",
    "swing",
    "slip",
    "state",
    "warning",
    "alarm",
    "calibratedBySwitch",
    "calibratedByEye",
    "notCalibrated",
    "plot",
];

/** What a line says. */
export type ConsoleLine = EventLine | Status | Counts | Greeting | Version | End | Setting | Help | Example | Other;
