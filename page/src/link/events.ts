// What the machine tells by itself: the table of events in control/src/say/event_table.rs, as types.
// `UPDATE_EXPECT=1 cargo test -p page events` writes this file.

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

/** What the machine tells by itself. */
export type Told =
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

/** What each of them is. */
export const TOLD: readonly Told["is"][] = [
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
