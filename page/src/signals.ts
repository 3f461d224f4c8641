// Sounds, and vibrations if the device can: an alarm, a lost machine, and an obeyed HOLD. The driver watches the row,
// not the screen.
//
// A browser lets a page sound only after the operator has touched it. Until then `isWaiting` is true.

import { chosen, keep } from "./preferences.ts";

/** Tones one after the other, each with its length and the same pause after it; and the vibration, on and off in ms. */
const SOUNDS = {
    alarm: {
        hz: [1760, 1760, 1760, 1760],
        ms: [180, 180, 180, 180],
        pauseMs: 90,
        vibration: [300, 100, 300, 100, 300],
    },
    lost: { hz: [660, 440, 330], ms: [350, 350, 500], pauseMs: 30, vibration: [1000] },
    held: { hz: [660, 990], ms: [110, 160], pauseMs: 20, vibration: [80, 60, 80] },
};
type Signal = keyof typeof SOUNDS;
/** Time in which the same signal is given only once: several machines may obey together. */
const ONCE_MS = 300;
/** Gain, from 0 to 1. A square wave sounds louder than its value. */
const GAIN = 0.4;

let context: AudioContext | undefined;
let changed = () => {};
/** End of the last tone, by the context's clock. */
let busyUntilS = 0;
const lastMs: Partial<Record<Signal, number>> = {};

export const isOn = (): boolean => chosen("sound") !== "off";

/** Whether signals are on, but the browser plays none before the page is touched. */
export const isWaiting = (): boolean => isOn() && context?.state !== "running";

/** Turns signals on or off. Turning on plays one as a test. */
export function turn(on: boolean): void {
    keep("sound", on ? "on" : "off");
    if (on) void wake().then(() => signal("held"));
    else navigator.vibrate?.(0);
}

/** Calls `changed` when `isWaiting` may have changed. */
export function wakeOnTouch(use: () => void): void {
    changed = use;
    // The first of these events is a touch for the browser.
    for (const touch of ["pointerup", "keydown"])
        document.addEventListener(touch, () => void wake(), { capture: true });
}

async function wake(): Promise<void> {
    // Otherwise the ring switch of an iPhone turns the sound off.
    const { audioSession } = navigator as Navigator & { audioSession?: { type: string } };
    if (audioSession) audioSession.type = isOn() ? "playback" : "auto";
    context ??= new AudioContext();
    // A call or a locked screen stops it.
    context.onstatechange = changed;
    if (context.state !== "running") await context.resume();
    changed();
}

/** Plays a signal, after those that are still playing. */
export function signal(which: Signal): void {
    const nowMs = performance.now();
    if (!isOn() || nowMs - (lastMs[which] ?? Number.NEGATIVE_INFINITY) < ONCE_MS) return;
    lastMs[which] = nowMs;
    const { hz, ms, pauseMs, vibration } = SOUNDS[which];
    // An untouched page may not vibrate, and the browser logs an error.
    if (navigator.userActivation?.hasBeenActive !== false) navigator.vibrate?.(vibration);
    // Its clock stands: the tones would all come at the next touch.
    if (context?.state !== "running") return;
    let atS = Math.max(context.currentTime, busyUntilS);
    for (const [number, frequency] of hz.entries()) {
        const lengthMs = ms[number] ?? 0;
        const tone = new OscillatorNode(context, { type: "square", frequency });
        tone.connect(new GainNode(context, { gain: GAIN })).connect(context.destination);
        tone.start(atS);
        tone.stop(atS + lengthMs / 1000);
        atS += (lengthMs + pauseMs) / 1000;
    }
    busyUntilS = atS;
}
