// An endless simulation: the real firmware on the virtual Uno, a machine, and a row that continues while it rolls.
//
// `advance` lets time pass. The operator may change the machine or the row between two calls. `outcome` has the result
// for each plant behind the tool.

import type { Line } from "../link/console_line.ts";
import type { Happening } from "../link/session.ts";
import { Machine, PIN } from "../row/machine.ts";
import { CYCLES_PER_SECOND, Uno } from "../uno/uno.ts";
import { groundInWords, Losses, whyInWords, type Zone } from "./losses.ts";
import { Outcome } from "./outcome.ts";

/** The first parameters of the row, and the first plant's position, ahead of the beam. */
const SOWING = { spacingMm: 550, weedShare: 0.25, firstMm: 800 };
/** Stored length of tracks and zones behind the tool. */
const KEPT_MM = 3000;
/** Cycles between two checks of the PC's clock: a millisecond. */
const SLICE_CYCLES = CYCLES_PER_SECOND / 1000;

export class Simulation {
    readonly uno: Uno;
    readonly machine: Machine;
    readonly outcome = new Outcome();
    readonly losses: Losses;
    onText: (text: string) => void = () => {};
    /** Keep-out zones at the tool or ahead of it, from the firmware's output. */
    zones: Zone[] = [];
    /** The tool's path over the ground: along the row, and across it from the row's line. */
    track: { readonly alongMm: number; readonly acrossMm: number }[] = [];
    /** The machine's count when the firmware began to count. */
    #zero = 0;

    /** A simulation with the machine from the box, or with the machine that is set up. */
    constructor(hex: string, seed: number, isSetUp = false) {
        this.uno = new Uno(hex);
        this.machine = new Machine(this.uno, { ...SOWING, seed }, { isSetUp });
        this.losses = new Losses(this.machine.toolMm);
        this.uno.onByte = (byte) => this.onText(String.fromCharCode(byte));
        this.#mark();
    }

    /** Lets time pass on the chip, for at most `budgetMs` of the PC's time. Returns how much passed. */
    advance(seconds: number, budgetMs: number): number {
        const { uno, machine, losses, outcome } = this;
        const begin = uno.cycle;
        const end = begin + seconds * CYCLES_PER_SECOND;
        const until = performance.now() + budgetMs;
        while (uno.cycle < end && performance.now() < until) {
            machine.runUntil(Math.min(end, uno.cycle + SLICE_CYCLES));
            this.#mark();
            losses.pass(machine, this.zones, outcome.marginMm);
        }
        outcome.judge(machine, this.zones);
        this.#forget();
        return (uno.cycle - begin) / CYCLES_PER_SECOND;
    }

    work(on: boolean): void {
        this.uno.set(PIN.workSwitch, !on);
    }

    /** The parts of the ground, and why tall weeds were left and plants not kept, in words. */
    get why(): string {
        const { losses, outcome } = this;
        const left = [...outcome.weeds].filter(([, cut]) => !cut).map(([number]) => losses.below.get(number));
        return `${whyInWords(left, [...outcome.notKept.values()])} ${groundInWords(losses.groundMm)}`.trim();
    }

    get isLampLit(): boolean {
        return this.uno.isHigh(PIN.lamp);
    }

    take(happening: Happening): void {
        if (happening.is === "started") {
            this.#zero = this.machine.ticks;
            this.zones = [];
        }
        if (happening.is === "connected" || happening.is === "settings") {
            const { outcome } = this;
            for (const { name, value } of happening.settings) {
                if (name === "margin_mm") outcome.marginMm = value;
                if (name === "stem_zone_mm") outcome.stemZoneMm = value;
            }
        }
        if (happening.is === "status") {
            this.losses.isAtWork = happening.status.mode === "work";
            this.losses.reason = happening.status.reason;
        }
        if (happening.is !== "event") return;
        const { event } = happening;
        if (event.is === "state" || event.is === "alarm")
            this.losses.isAtWork = event.is === "state" && event.mode === "work";
        if (event.is === "alarm") this.zones = [];
        if (event.is === "detection" && event.class !== "weed") this.zones.push(this.#zone(event));
    }

    /**
     * The ground of a zone. The paper's delay and hold count from the moment when the leading edge is in the beam and
     * the tool is beamToToolMm behind it. Counts are converted to ground by the present slip.
     */
    #zone({ position, delay, hold }: Line<"detection">): Zone {
        const { placeMm, ticks, groundMmATick, dimensions } = this.machine;
        const startMm = placeMm + (position + delay + this.#zero - ticks) * groundMmATick - dimensions.beamToToolMm;
        return { startMm, endMm: startMm + hold * groundMmATick };
    }

    /** Adds the tool's position to its track. On a straight line only its end moves. */
    #mark(): void {
        const { track, machine } = this;
        const { toolMm: alongMm, acrossMm } = machine;
        if (track.length > 1 && track.slice(-2).every((point) => point.acrossMm === acrossMm)) track.pop();
        track.push({ alongMm, acrossMm });
    }

    #forget(): void {
        const behindMm = this.machine.toolMm - KEPT_MM;
        const gone = this.track.findIndex(({ alongMm }) => alongMm > behindMm);
        // The point before it is the start of the straight line.
        if (gone > 100) this.track.splice(0, gone - 1);
        this.zones = this.zones.filter(({ endMm }) => endMm > behindMm);
    }
}
