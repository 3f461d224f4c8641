// Sounds, and vibrations if the device can: an alarm, a lost machine, and an obeyed HOLD. The driver watches the row,
// not the screen.
//
// A browser lets a page sound only after the operator has touched it. Until then `isWaiting` is true.

import { chosen, keep } from "./preferences.ts";

export type Signal = "alarm" | "lost" | "held";

/** Tones one after the other, in Hz and ms, with the same pause after each; and the vibration, on and off in ms. */
interface Sound {
    readonly tones: readonly (readonly [hz: number, ms: number])[];
    readonly pauseMs: number;
    readonly vibration: readonly number[];
}

const SOUNDS: Readonly<Record<Signal, Sound>> = {
    alarm: {
        tones: [1, 2, 3, 4].map(() => [1760, 180] as const),
        pauseMs: 90,
        vibration: [300, 100, 300, 100, 300],
    },
    lost: {
        tones: [
            [660, 350],
            [440, 350],
            [330, 500],
        ],
        pauseMs: 30,
        vibration: [1000],
    },
    held: {
        tones: [
            [660, 110],
            [990, 160],
        ],
        pauseMs: 20,
        vibration: [80, 60, 80],
    },
};
/** Time in which the same signal is given only once: several machines may obey together. */
const ONCE_MS = 300;
/** Gain, from 0 to 1. A square wave sounds louder than its value. */
const GAIN = 0.4;

let context: AudioContext | undefined;
/** End of the last tone, by the context's clock. */
let busyUntilS = 0;
const lastMs: Partial<Record<Signal, number>> = {};

export const isOn = (): boolean => chosen("sound") !== "off";

/** Whether signals are on, but the browser plays none before the page is touched. */
export const isWaiting = (): boolean => isOn() && context?.state !== "running";

/** Turns signals on or off. Turning on plays one as a test. */
export function turn(on: boolean): void {
    keep("sound", on ? "on" : "off");
    if (on) signal("held");
    else navigator.vibrate?.(0);
}

/** Calls `changed` when `isWaiting` may have changed. */
export function wakeOnTouch(changed: () => void): void {
    const wake = async () => {
        context ??= new AudioContext();
        if (context.state !== "running") await context.resume();
        changed();
    };
    // The first of these events is a touch for the browser.
    for (const touch of ["pointerup", "keydown"])
        document.addEventListener(touch, () => void wake(), { capture: true });
}

/** Plays a signal, after those that are still playing. */
export function signal(which: Signal): void {
    const nowMs = performance.now();
    if (!isOn() || nowMs - (lastMs[which] ?? Number.NEGATIVE_INFINITY) < ONCE_MS) return;
    lastMs[which] = nowMs;
    const { tones, pauseMs, vibration } = SOUNDS[which];
    // An untouched page may not vibrate, and the browser logs an error.
    if (navigator.userActivation?.hasBeenActive !== false) navigator.vibrate?.([...vibration]);
    if (!context) return;
    let atS = Math.max(context.currentTime, busyUntilS);
    for (const [hz, ms] of tones) {
        const [tone, volume] = [context.createOscillator(), context.createGain()];
        tone.type = "square";
        tone.frequency.value = hz;
        volume.gain.value = GAIN;
        tone.connect(volume).connect(context.destination);
        tone.start(atS);
        tone.stop(atS + ms / 1000);
        atS += (ms + pauseMs) / 1000;
    }
    busyUntilS = atS;
}
