// The page: connects the operator's controls, the drawing and the console to a trial, and lets its time pass.

import hex from "weeder.hex";
import { Console } from "./console.ts";
import { Drawing } from "./try/drawing.ts";
import { Trial } from "./try/trial.ts";

/** Share of a frame's time that the chip may take: the rest is for the picture, and for the operator's clicks. */
const CHIP_SHARE = 0.75;
/** Longest time that passes in a frame: a page that was hidden does not catch up. */
const LONGEST_FRAME_S = 0.1;
/** Time over which the pace is measured. */
const PACE_S = 1;

function find<Kind extends Element>(id: string, kind: new () => Kind): Kind {
    const element = document.getElementById(id);
    if (!(element instanceof kind)) throw new Error(`the page has no ${kind.name} #${id}`);
    return element;
}

const trial = new Trial(hex, Date.now());
const drawing = new Drawing(find("drawing", SVGSVGElement), trial);
const machineConsole = new Console(
    trial.uno,
    find("said", HTMLElement),
    find("line", HTMLFormElement),
    find("typed", HTMLInputElement),
);

trial.onText = (text) => {
    for (const line of machineConsole.hear(text)) {
        trial.take(line);
        if (line.includes(" reset by ")) greet(line);
    }
};

/** What an operator types to a machine that has just started. */
function greet(greeting: string): void {
    machineConsole.type("events on");
    // A board without settings says so: its own are right for this machine.
    if (greeting.includes("settings_lost")) for (const command of ["save", "clear"]) machineConsole.type(command);
}

/** Shows a slider's value beside it, and does with it what it is for, now and whenever it is moved. */
function slider(id: string, shown: (value: number) => string, use: (value: number) => void): void {
    const [input, output] = [find(id, HTMLInputElement), find(`${id}-is`, HTMLOutputElement)];
    const apply = () => {
        output.value = shown(input.valueAsNumber);
        use(input.valueAsNumber);
    };
    input.addEventListener("input", apply);
    apply();
}

function toggle(id: string, use: (on: boolean) => void): void {
    const input = find(id, HTMLInputElement);
    // A browser may remember how it was left.
    input.checked = false;
    input.addEventListener("change", () => use(input.checked));
}

function button(id: string, use: () => void): void {
    find(id, HTMLButtonElement).addEventListener("click", use);
}

find("controls", HTMLFormElement).reset();
slider(
    "speed",
    (speed) => `${speed.toFixed(1)} km/h`,
    (speed) => trial.rollAt(speed),
);
slider(
    "spacing",
    (spacing) => `${spacing} mm`,
    (spacing) => {
        trial.planting.spacingMm = spacing;
    },
);
slider(
    "weeds",
    (share) => `${share} % of gaps`,
    (share) => {
        trial.planting.weedShare = share / 100;
    },
);
slider(
    "slip",
    (slip) => `${slip} %`,
    (slip) => trial.slipBy(slip / 100),
);
toggle("work", (on) => trial.work(on));
toggle("torn", (on) => trial.machine.tearBeamWire(on));
toggle("dead", (on) => trial.machine.killEncoder(on));
button("brown-out", () => trial.uno.reset("brown-out"));
button("press-reset", () => trial.uno.reset("external"));
button("clear", () => machineConsole.type("clear"));

const time = find("time", HTMLSelectElement);
const work = find("work", HTMLInputElement);
const lamp = find("lamp", HTMLElement);
const alarm = find("alarm", HTMLElement);
const hint = find("hint", HTMLElement);

/** Puts a text where another was. */
function write(id: string, text: string): void {
    const element = find(id, HTMLElement);
    if (element.textContent !== text) element.textContent = text;
}

function show(): void {
    const { machine } = trial;
    write("state", trial.state);
    write("tool", machine.isWeeding ? "in the row" : machine.isClear ? "out" : "swings");
    write("rolls", `${(machine.motion.speedMmS(machine.timeS()) * 0.0036).toFixed(1)} km/h`);
    write("rolled", `${(machine.placeMm / 1000).toFixed(2)} m`);
    lamp.classList.toggle("lit", trial.isLampLit);
    lamp.ariaLabel = trial.isLampLit ? "status lamp, lit" : "status lamp, dark";
    alarm.hidden = trial.alarm === undefined;
    const { name = "", code = "" } = trial.alarm ?? {};
    write("alarm-name", `Alarm ${[...code].join("-")} ${name}`);
    hint.hidden = !(work.checked && trial.state !== "work");
    drawing.draw(trial);
    machineConsole.show();
}

/** How much time passed, on the chip and outside, since the pace was last shown. */
const passed = { chipS: 0, outsideS: 0 };
let lastMs = performance.now();

function frame(nowMs: number): void {
    const outsideS = Math.min(Math.max((nowMs - lastMs) / 1000, 0), LONGEST_FRAME_S);
    lastMs = nowMs;
    passed.chipS += trial.advance(outsideS * Number(time.value), outsideS * 1000 * CHIP_SHARE);
    passed.outsideS += outsideS;
    if (passed.outsideS > PACE_S) {
        write("pace", `${(passed.chipS / passed.outsideS).toFixed(2)} x`);
        passed.chipS = passed.outsideS = 0;
    }
    show();
    requestAnimationFrame(frame);
}

requestAnimationFrame(frame);

// For tests, and for who opens the browser's own console.
Object.assign(globalThis, { trial });
