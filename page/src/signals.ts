// Sounds, and where the device can, vibrations: an alarm, a machine that was lost, and a HOLD that was obeyed. The driver looks at
// the row, and not at the screen.
//
// A browser lets a page sound only after the operator has touched it. Until then `isWaiting` is true.

import { chosen, keep } from "./preferences.ts";

export type Signal = "alarm" | "lost" | "held";

/** Tones one after the other, in Hz and ms, with the same pause behind each; and the vibration, on and off in ms. */
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
/** Time in which the same signal is given once: several machines may obey together. */
const ONCE_MS = 300;
/** How loud, of 1. A square wave is louder than it looks. */
const GAIN = 0.4;

let context: AudioContext | undefined;
/** When the last tone ends, by the context's clock. */
let busyUntilS = 0;
const lastMs: Partial<Record<Signal, number>> = {};

/** Whether signals are given. */
export const isOn = (): boolean => chosen("sound") !== "off";

/** Whether signals are on, and the browser gives none before the page is touched. */
export const isWaiting = (): boolean => isOn() && context?.state !== "running";

/** Turns signals on or off. Turned on, one is given, to hear. */
export function turn(on: boolean): void {
    keep("sound", on ? "on" : "off");
    if (on) signal("held");
    else navigator.vibrate?.(0);
}

/** Calls back when that may have changed what `isWaiting` says. */
export function wakeOnTouch(changed: () => void): void {
    const wake = async () => {
        context ??= new AudioContext();
        if (context.state !== "running") await context.resume();
        changed();
    };
    // What comes first of these is a touch to the browser.
    for (const touch of ["pointerup", "keydown"])
        document.addEventListener(touch, () => void wake(), { capture: true });
}

/** Gives a signal, behind those that are still heard. */
export function signal(which: Signal): void {
    const nowMs = performance.now();
    if (!isOn() || nowMs - (lastMs[which] ?? Number.NEGATIVE_INFINITY) < ONCE_MS) return;
    lastMs[which] = nowMs;
    const { tones, pauseMs, vibration } = SOUNDS[which];
    // A page that was not touched may not, and the browser complains of it.
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
