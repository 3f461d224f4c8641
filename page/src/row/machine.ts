// The machine between row and Uno: wheel, encoder, beam, servo, arm and tool.
//
// The machine's place is what the beam sees; the tool works the ground beamToToolMm behind it. `runUntil` rolls the
// machine and lets the Uno's clock run side by side: encoder and beam change their pins at their exact cycles, and the
// servo hears each pulse. The arm swings sideways about a pivot beside the row: the tool is clear of the row only when it
// is fully out, and works the row's line while its middle is beside it by less than half its width.
//
// Speed, slip and the faults below may change on the way. What became of a plant is not judged here.

import { CYCLES_PER_SECOND, type Uno } from "../uno/uno.ts";
import type { Motion } from "./motion.ts";
import type { Row } from "./row.ts";
import { OUT_DEGREES, SERVO, Servo, type ServoKind } from "./servo.ts";

/** The Uno's pins that the machine is wired to (README, wiring). */
export const PIN = { encoderA: 2, encoderB: 3, workSwitch: 4, endSwitch: 5, beam: 8, servo: 9, lamp: 13 } as const;

/** Dimensions of the machine. */
export interface Dimensions {
    /** Diameter of the ground wheel, and encoder counts in a turn of it. */
    readonly wheelMm: number;
    readonly ticksPerRev: number;
    /** Distance from the beam back to the tool: the paper's X. */
    readonly beamToToolMm: number;
    /** Time after which the beam's sensor reports a change. A change that lasts less is not reported. */
    readonly beamResponseMs: number;
    /** Length of the arm from its pivot to the tool, and the tool's width, across the row. */
    readonly armMm: number;
    readonly toolWidthMm: number;
}

export const DIMENSIONS: Dimensions = {
    wheelMm: 400,
    ticksPerRev: 2400,
    beamToToolMm: 400,
    beamResponseMs: 1,
    armMm: 350,
    toolWidthMm: 55,
};

/**
 * An arm within this angle of fully out is fully out: half a millimetre at the tool's end, and 1 us of a pulse, whose edges
 * avr8js does not place more exactly (docs/simulators.md).
 */
export const CLEAR_WITHIN_DEGREES = 0.09;

/** Levels of the channels A and B in the four phases of forward motion. */
const CHANNELS = [
    [false, false],
    [true, false],
    [true, true],
    [false, true],
] as const;

/** What is broken on the machine. */
export interface Faults {
    /** The beam's wire is torn: its pin stays on the pull-up, as over bare ground. */
    beamWireTorn: boolean;
    /** The encoder says nothing more: its pins stay as they are. */
    encoderDead: boolean;
}

export class Machine {
    readonly uno: Uno;
    readonly row: Row;
    readonly motion: Motion;
    readonly dimensions: Dimensions;
    readonly servo: Servo;
    /** The servo has taken a pulse for a command: the cycles of its edges. */
    onCommand: (rise: number, fall: number) => void = () => {};
    readonly faults: Faults = { beamWireTorn: false, encoderDead: false };
    /** Counts of a perfect encoder, net, since the machine was put in front of the row. */
    ticks = 0;
    /** Whether something stands in the beam. */
    isBroken = false;
    readonly #startCycle: number;
    readonly #startWheelMm: number;
    /** Ends of things that the beam has passed. */
    #endsPassed = 0;
    /** When the sensor will report a change that it has not yet reported. */
    #reportS = Number.POSITIVE_INFINITY;
    #reported = false;
    #pulseRise = 0;

    /** Puts the machine, from the Uno's cycle on, in front of a row, as the motion has it then. */
    constructor(uno: Uno, row: Row, motion: Motion, dimensions: Dimensions = DIMENSIONS, servo: ServoKind = SERVO) {
        this.uno = uno;
        this.row = row;
        this.motion = motion;
        this.dimensions = dimensions;
        this.servo = new Servo(servo);
        this.#startCycle = uno.cycle;
        this.#startWheelMm = motion.wheelMm(0);
        const placeMm = motion.placeMm(0);
        while (placeMm >= (row.endOfThing(this.#endsPassed) ?? Number.POSITIVE_INFINITY)) this.#endsPassed += 1;
        this.isBroken = this.#endsPassed % 2 === 1;
        this.#reported = this.isBroken;
        uno.set(PIN.beam, !this.isBroken);
        this.#turnTo(0);
        uno.set(PIN.workSwitch, true);
        uno.set(PIN.endSwitch, true);
        uno.onLevel = (pin, high, cycle) => {
            if (pin !== PIN.servo) return;
            if (high) this.#pulseRise = cycle;
            else if (this.servo.hear(((cycle - this.#pulseRise) / CYCLES_PER_SECOND) * 1e6, this.timeS(cycle)))
                this.onCommand(this.#pulseRise, cycle);
        };
    }

    /** The motion's time at a cycle of the Uno's clock: now, where none is given. */
    timeS(cycle: number = this.uno.cycle): number {
        return (cycle - this.#startCycle) / CYCLES_PER_SECOND;
    }

    /** The Uno's cycle at a time of the motion. */
    cycleAt(timeS: number): number {
        return this.#startCycle + Math.round(timeS * CYCLES_PER_SECOND);
    }

    /** Distance rolled between two encoder counts. */
    get tickMm(): number {
        return (Math.PI * this.dimensions.wheelMm) / this.dimensions.ticksPerRev;
    }

    /** The ground that the beam sees. */
    get placeMm(): number {
        return this.motion.placeMm(this.timeS());
    }

    /** The ground under the tool. */
    get toolMm(): number {
        return this.placeMm - this.dimensions.beamToToolMm;
    }

    /** The tool's angle; 0 is in the row. */
    get degrees(): number {
        return this.servo.degrees(this.timeS());
    }

    /** Whether the tool is fully out of the row. */
    get isClear(): boolean {
        return this.degrees >= OUT_DEGREES - CLEAR_WITHIN_DEGREES;
    }

    /** How far the tool's middle is beside the row's line. */
    get acrossMm(): number {
        return this.dimensions.armMm * Math.sin((this.degrees / 180) * Math.PI);
    }

    /** Whether the tool works the row's line. */
    get isWeeding(): boolean {
        return this.acrossMm < this.dimensions.toolWidthMm / 2;
    }

    /** Tears the beam's wire, or mends it. */
    tearBeamWire(torn: boolean): void {
        this.faults.beamWireTorn = torn;
        this.#showBeam();
    }

    /** Kills the encoder, or has it live again. */
    killEncoder(dead: boolean): void {
        this.faults.encoderDead = dead;
        this.#showEncoder();
    }

    /**
     * Rolls on until a cycle. `onStep` is called at each change of encoder or beam, with the machine and the Uno there.
     */
    runUntil(cycle: number, onStep: () => void = () => {}): void {
        for (;;) {
            const [timeS, change] = this.#next();
            const due = this.cycleAt(timeS);
            if (due > cycle) break;
            this.uno.runUntil(due);
            change();
            onStep();
        }
        this.uno.runUntil(cycle);
        this.servo.forget(this.timeS());
    }

    /** The next change of encoder or beam, and when it is due. */
    #next(): [number, () => void] {
        const nowS = this.timeS();
        const { motion, tickMm, row } = this;
        const rimMm = (count: number) => this.#startWheelMm + count * tickMm;
        const tick = motion.nextTurning(nowS, rimMm(this.ticks + 0.5), rimMm(this.ticks - 0.5));
        const end = motion.nextPassing(
            nowS,
            row.endOfThing(this.#endsPassed) ?? Number.POSITIVE_INFINITY,
            row.endOfThing(this.#endsPassed - 1) ?? Number.NEGATIVE_INFINITY,
        );
        const tickS = tick?.timeS ?? Number.POSITIVE_INFINITY;
        const endS = end?.timeS ?? Number.POSITIVE_INFINITY;
        if (this.#reportS <= Math.min(tickS, endS)) return [this.#reportS, () => this.#report()];
        if (endS <= tickS) return [endS, () => this.#passEnd(end?.forward ? 1 : -1, endS)];
        return [tickS, () => this.#turnTo(this.ticks + (tick?.forward ? 1 : -1))];
    }

    #turnTo(ticks: number): void {
        this.ticks = ticks;
        this.#showEncoder();
    }

    #showEncoder(): void {
        if (this.faults.encoderDead) return;
        const [a, b] = CHANNELS[this.ticks & 3] ?? CHANNELS[0];
        this.uno.set(PIN.encoderA, a);
        this.uno.set(PIN.encoderB, b);
    }

    #passEnd(by: number, timeS: number): void {
        this.#endsPassed += by;
        this.isBroken = this.#endsPassed % 2 === 1;
        // A change that was not reported yet is taken back.
        const isNews = this.isBroken !== this.#reported;
        this.#reportS = isNews ? timeS + this.dimensions.beamResponseMs / 1000 : Number.POSITIVE_INFINITY;
    }

    #report(): void {
        this.#reportS = Number.POSITIVE_INFINITY;
        this.#reported = this.isBroken;
        this.#showBeam();
    }

    #showBeam(): void {
        this.uno.set(PIN.beam, this.faults.beamWireTorn || !this.#reported);
    }
}
