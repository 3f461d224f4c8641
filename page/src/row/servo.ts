// The servo that swings the tool: from the pulses on its line to its angle at any time.
//
// A servo knows a pulse's width at the pulse's falling edge. From there it takes a dead time until it begins to move, and
// then it turns at a constant rate until it has the angle asked for. A command that comes during a stroke takes the same
// dead time; then the servo turns from wherever it is. Widths that are no servo's are ignored.

/** Angle of the tool that is fully out of the row. */
export const OUT_DEGREES = 45;

/** A hobby servo and how it is set up. */
export interface ServoKind {
    /** Pulse widths for the tool in the row, at 0 degrees, and out of it, at 45. */
    readonly inUs: number;
    readonly outUs: number;
    /** Time from a pulse's falling edge until the servo moves, and time in which it then turns by 45 degrees. */
    readonly deadTimeMs: number;
    readonly travelMs: number;
}

/** A 60 kg cm hobby servo unloaded. */
export const SERVO: ServoKind = { inUs: 1500, outUs: 2000, deadTimeMs: 60, travelMs: 120 };

/** Pulse widths that differ by less than this ask for the same angle: the dead band of a digital servo. */
const DEAD_BAND_US = 2;
/** Widths that a servo takes for a command. */
const WIDTHS_US = { least: 400, greatest: 2600 };

/** From a time on, the servo turns towards an angle. */
interface Turn {
    readonly fromS: number;
    readonly fromDegrees: number;
    readonly toDegrees: number;
}

export class Servo {
    readonly kind: ServoKind;
    /** Commands so far: pulses that asked for another angle than the one before them. The first is not a swing. */
    commands = 0;
    #widthUs = Number.NEGATIVE_INFINITY;
    /** Turns that are not over, oldest first; the first has begun. */
    #turns: Turn[] = [{ fromS: Number.NEGATIVE_INFINITY, fromDegrees: OUT_DEGREES, toDegrees: OUT_DEGREES }];

    constructor(kind: ServoKind = SERVO) {
        this.kind = kind;
    }

    /** Hears a pulse, at its falling edge; whether it is a command. */
    hear(widthUs: number, timeS: number): boolean {
        if (widthUs < WIDTHS_US.least || widthUs > WIDTHS_US.greatest) return false;
        if (Math.abs(widthUs - this.#widthUs) < DEAD_BAND_US) return false;
        this.#widthUs = widthUs;
        this.commands += 1;
        const { inUs, outUs, deadTimeMs } = this.kind;
        const fromS = timeS + deadTimeMs / 1000;
        const toDegrees = ((widthUs - inUs) / (outUs - inUs)) * OUT_DEGREES;
        this.#turns.push({ fromS, fromDegrees: this.degrees(fromS), toDegrees });
        return true;
    }

    /** The angle at a time, which must not lie before the last one asked for by more than the dead time; 0 is in the row. */
    degrees(timeS: number): number {
        const turn = this.#turns.findLast(({ fromS }) => fromS <= timeS) ?? this.#turns[0];
        if (!turn) return OUT_DEGREES;
        const way = turn.toDegrees - turn.fromDegrees;
        const turned = ((timeS - turn.fromS) / (this.kind.travelMs / 1000)) * OUT_DEGREES;
        return Math.abs(way) <= turned ? turn.toDegrees : turn.fromDegrees + Math.sign(way) * turned;
    }

    /** Forgets the turns that are over at a time. */
    forget(timeS: number): void {
        const running = this.#turns.findLastIndex(({ fromS }) => fromS <= timeS);
        if (running > 0) this.#turns.splice(0, running);
    }
}
