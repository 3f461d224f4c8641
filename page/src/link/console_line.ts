// What a line of the machine says. The tables of control/src/say/line_tables.rs and
// host/link/src/console_line.rs have the meaning and the unit of each field.
// `UPDATE_EXPECT=1 cargo test -p page lines` writes this file.

export type Mode = "hold" | "work" | "alarm";
type Class = "plant" | "weed" | "unknown";

interface Events {
    detection: {
        class: Class;
        position: number;
        votes: number;
        spacing: number;
        delay: number;
        hold: number;
        actuation: number;
    };
    guarded: { position: number };
    swing: { out: boolean; position: number };
    slip: { permille: number };
    state: { mode: Mode };
    warning: { warning: string };
    alarm: { alarm: string; position: number };
    calibratedBySwitch: { outMs: number; inMs: number; isSet: boolean };
    calibratedByEye: object;
    notCalibrated: object;
    plot: object;
    newer: { isAlarm: boolean };
}

interface Answers {
    status: {
        mode: Mode;
        alarm?: string;
        toolOut: boolean;
        reason?: string;
        position: number;
        speedMmS: number;
        zones: number;
        unseenMm: number;
        slipPermille?: number;
    };
    counts: {
        lost: number;
        jumps: number;
        late: number;
        missed: number;
        commandErrors: number;
        dust: number;
        stackFree: number;
        cause: string;
        was?: Mode;
        warning?: string;
    };
    greeting: { version: string; cause: string; wasAtWork: boolean };
    version: { version: string };
    end: { error?: string };
    setting: {
        name: string;
        value: number;
        unit: string;
        least: number;
        greatest: number;
        isSwitched: boolean;
        default: number;
        saved?: number;
    };
    help: { name: string; help: string };
    example: { fromField: boolean; number: number; label: Class; features: readonly number[] };
    other: object;
}

type Named<Lines> = { [Name in keyof Lines]: { readonly is: Name } & Readonly<Lines[Name]> }[keyof Lines];

/** What the machine tells by itself. */
export type EventLine = Named<Events> & { readonly isEvent: true };
export type ConsoleLine = EventLine | Named<Answers>;
export type Line<Name extends ConsoleLine["is"]> = Extract<ConsoleLine, { readonly is: Name }>;
export type Setting = Line<"setting">;
