// A timer of avr8js that is called only when something happens.
//
// avr8js calls a timer at each of its steps: two million times a second at a prescaler of 8. One call can count any number of steps
// (`count`). So a call is needed only at a compare match, at the top and at the end of the period, and `addTimer` postpones it up to
// there. A write to a register calls the timer first, and at the next step again. tests/timer.test.ts compares both.

import { AVRTimer, type AVRTimerConfig, type CPU } from "avr8js";

/** avr8js's number of the mode in which a timer counts up from 0 and starts again: all but the phase correct ones. */
const COUNTS_UP = [0, 2, 3];

/** A timer's private state, as avr8js 0.21 has it. */
interface State {
    readonly tcnt: number;
    readonly ocrA: number;
    readonly ocrB: number;
    readonly TOP: number;
    readonly divider: number;
    readonly timerMode: number;
}

export function addTimer(cpu: CPU, config: AVRTimerConfig): void {
    const timer = new AVRTimer(cpu, config);
    const { count } = timer;
    const add = cpu.addClockEvent.bind(cpu);
    cpu.addClockEvent = (callback, cycles) =>
        add(callback, callback === count && cycles > 1 ? cycles + moreCycles(timer as unknown as State) : cycles);
    for (const register of [config.TCCRA, config.TCCRB, config.OCRA, config.OCRB, config.ICR]) {
        const write = cpu.writeHooks[register];
        if (!register || !write) continue;
        cpu.writeHooks[register] = (...change) => {
            count(false);
            const done = write(...change);
            cpu.updateClockEvent(count, 1);
            return done;
        };
    }
}

/** Cycles from a timer's next step to the first step at which something happens. */
function moreCycles({ tcnt, ocrA, ocrB, TOP, divider, timerMode }: State): number {
    // A top that was set below the count ends the period at once.
    if (!COUNTS_UP.includes(timerMode) || tcnt > TOP) return 0;
    // From 0 to 0 in one call would look like no step: the top comes between.
    return (Math.min(...[ocrA, ocrB, TOP, TOP + 1].filter((value) => value > tcnt)) - tcnt - 1) * divider;
}
