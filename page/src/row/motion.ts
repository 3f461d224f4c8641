// How the machine rolls: its position in millimetres as an exact function of time, changed on the way.
//
// A motion is a chain of pieces of constant acceleration, the last of which goes on for ever. Each piece keeps its
// direction, so the moment at which a place is passed follows from one quadratic equation and no time step is involved:
// the edges of an encoder come out at their exact times. `changeSpeed` and `slipFrom` change what is yet to come; what was
// is kept until somebody has it forgotten.
//
// A driven wheel turns farther than the machine rolls: its slip is the share of the wheel's way that is lost.

/** Walking speed in millimetres a second for a speed in kilometres an hour. */
export function mmS(speedKmH: number): number {
    return (speedKmH / 3.6) * 1000;
}

/** A place was passed: when, and whether towards larger positions. */
export interface Passing {
    readonly timeS: number;
    readonly forward: boolean;
}

/** How it rolled for a time. */
export interface Rolled {
    readonly durationS: number;
    readonly speedMmS: number;
    readonly accelerationMmS2: number;
}

/** A stretch of constant acceleration in which the direction does not change. */
interface Piece {
    readonly startS: number;
    readonly endS: number;
    readonly startMm: number;
    readonly speedMmS: number;
    readonly accelerationMmS2: number;
    /** Where the wheel's rim is when the piece begins, and how far it turns while the machine rolls a millimetre. */
    readonly wheelStartMm: number;
    readonly wheelMmAMm: number;
}

function placeMm(piece: Piece, timeS: number): number {
    const t = timeS - piece.startS;
    return piece.startMm + piece.speedMmS * t + (piece.accelerationMmS2 * t * t) / 2;
}

function speedMmS(piece: Piece, timeS: number): number {
    return piece.speedMmS + piece.accelerationMmS2 * (timeS - piece.startS);
}

function wheelMm(piece: Piece, timeS: number): number {
    return piece.wheelStartMm + (placeMm(piece, timeS) - piece.startMm) * piece.wheelMmAMm;
}

/**
 * When a piece reaches a place in its own direction, were it without end. The form of the quadratic's root that adds two
 * terms of one sign stays exact for small accelerations as well as from standstill.
 */
function timeAtS(piece: Piece, place: number, forward: boolean): number {
    const distanceMm = place - piece.startMm;
    if (distanceMm === 0) return piece.startS;
    const squared = piece.speedMmS ** 2 + 2 * piece.accelerationMmS2 * distanceMm;
    const speedThere = Math.sqrt(Math.max(squared, 0)) * (forward ? 1 : -1);
    return piece.startS + (2 * distanceMm) / (piece.speedMmS + speedThere);
}

export class Motion {
    /** In order of time, without gaps; never empty. */
    #pieces: Piece[];

    /** The machine stands at a place, from a time on. */
    constructor(startMm: number, startS = 0) {
        const standing = { startMm, speedMmS: 0, accelerationMmS2: 0, wheelStartMm: startMm, wheelMmAMm: 1 };
        this.#pieces = [{ ...standing, startS, endS: Number.POSITIVE_INFINITY }];
    }

    /** Where the machine is; of times that are forgotten it knows nothing. */
    placeMm(timeS: number): number {
        return placeMm(this.#pieceAt(timeS), timeS);
    }

    /** Where a point on the wheel's rim is, counted as if it had rolled on the ground without slip. */
    wheelMm(timeS: number): number {
        return wheelMm(this.#pieceAt(timeS), timeS);
    }

    /** The speed, negative when rolling back. */
    speedMmS(timeS: number): number {
        return speedMmS(this.#pieceAt(timeS), timeS);
    }

    /** How far the machine rolls while the wheel's rim turns by a millimetre. */
    groundMmAMm(timeS: number): number {
        return 1 / this.#pieceAt(timeS).wheelMmAMm;
    }

    /** From a time on, changes to a speed, negative for rolling back, with an acceleration above 0. */
    changeSpeed(fromS: number, toMmS: number, accelerationMmS2: number): void {
        const slowing = this.#cut(fromS);
        const speed = slowing.speedMmS;
        if (speed * toMmS < 0) {
            this.#reach(0, accelerationMmS2);
            this.#reach(toMmS, accelerationMmS2);
        } else {
            this.#reach(toMmS, accelerationMmS2);
        }
    }

    /** From a time on, loses a share of the wheel's way, below 1. */
    slipFrom(fromS: number, share: number): void {
        if (!(share < 1)) throw new RangeError(`the wheel cannot slip by ${share} of its way: less than 1`);
        // What is yet to come of a change of speed goes on as it was to.
        const coming = this.#pieces.filter((piece) => piece.endS > fromS);
        this.#cut(fromS);
        this.#pieces.pop();
        for (const piece of coming) {
            const startS = Math.max(piece.startS, fromS);
            const before = this.#pieces.at(-1);
            this.#pieces.push({
                startS,
                endS: piece.endS,
                startMm: placeMm(piece, startS),
                speedMmS: speedMmS(piece, startS),
                accelerationMmS2: piece.accelerationMmS2,
                wheelStartMm: before ? wheelMm(before, startS) : wheelMm(piece, startS),
                wheelMmAMm: 1 / (1 - share),
            });
        }
    }

    /**
     * The next time, at or after `fromS`, at which the machine reaches a place ahead or falls below one behind it; nothing
     * where it never does.
     */
    nextPassing(fromS: number, aheadMm: number, behindMm: number): Passing | undefined {
        return this.#next(fromS, (_, forward) => (forward ? aheadMm : behindMm));
    }

    /** The same of the wheel's rim. */
    nextTurning(fromS: number, aheadMm: number, behindMm: number): Passing | undefined {
        return this.#next(fromS, (piece, forward) => {
            const rimMm = forward ? aheadMm : behindMm;
            return piece.startMm + (rimMm - piece.wheelStartMm) / piece.wheelMmAMm;
        });
    }

    /** How it rolled from one time to another: pieces without a gap, each with its speed at its beginning. */
    rolled(fromS: number, toS: number): Rolled[] {
        const within = this.#pieces.filter(({ startS, endS }) => endS > fromS && startS < toS);
        return within.map((piece) => {
            const startS = Math.max(piece.startS, fromS);
            const durationS = Math.min(piece.endS, toS) - startS;
            return { durationS, speedMmS: speedMmS(piece, startS), accelerationMmS2: piece.accelerationMmS2 };
        });
    }

    /** Forgets what was before a time. */
    forget(beforeS: number): void {
        this.#pieces = this.#pieces.filter(({ endS }) => endS > beforeS);
    }

    #next(fromS: number, target: (piece: Piece, forward: boolean) => number): Passing | undefined {
        for (const piece of this.#pieces) {
            if (piece.endS < fromS || (piece.speedMmS === 0 && piece.accelerationMmS2 === 0)) continue;
            const forward = piece.speedMmS > 0 || (piece.speedMmS === 0 && piece.accelerationMmS2 > 0);
            const place = target(piece, forward);
            if (!Number.isFinite(place)) continue;
            const endMm = Number.isFinite(piece.endS)
                ? placeMm(piece, piece.endS)
                : Number.POSITIVE_INFINITY * (forward ? 1 : -1);
            if (forward ? endMm < place : endMm > place) continue;
            return { timeS: Math.max(fromS, timeAtS(piece, place, forward)), forward };
        }
        return undefined;
    }

    #pieceAt(timeS: number): Piece {
        const piece = this.#pieces.find(({ endS }) => timeS < endS) ?? this.#pieces.at(-1);
        if (!piece) throw new Error("a motion has at least one piece");
        return piece;
    }

    /** Keeps what was, and goes on from a time at the speed then reached: that piece, without end. */
    #cut(fromS: number): Piece {
        const piece = this.#pieceAt(fromS);
        const going: Piece = {
            startS: fromS,
            endS: Number.POSITIVE_INFINITY,
            startMm: placeMm(piece, fromS),
            speedMmS: speedMmS(piece, fromS),
            accelerationMmS2: 0,
            wheelStartMm: wheelMm(piece, fromS),
            wheelMmAMm: piece.wheelMmAMm,
        };
        const was = this.#pieces.filter(({ startS }) => startS < fromS);
        this.#pieces = [...was.map((piece) => ({ ...piece, endS: Math.min(piece.endS, fromS) })), going];
        return going;
    }

    /** The last piece, which goes on for ever, becomes the change to a speed, and the next one goes on at that. */
    #reach(toMmS: number, accelerationMmS2: number): void {
        const going = this.#pieces.pop();
        if (!going) throw new Error("a motion has at least one piece");
        const change = toMmS - going.speedMmS;
        if (change === 0) {
            this.#pieces.push(going);
            return;
        }
        const endS = going.startS + Math.abs(change) / accelerationMmS2;
        const changing = { ...going, endS, accelerationMmS2: accelerationMmS2 * Math.sign(change) };
        this.#pieces.push(changing, {
            ...going,
            startS: endS,
            startMm: placeMm(changing, endS),
            speedMmS: toMmS,
            wheelStartMm: wheelMm(changing, endS),
        });
    }
}
