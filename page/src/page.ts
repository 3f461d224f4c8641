// The page: its views, and their shared parts. The panel beside the row in "Try it" is the same as the panel for a real
// Uno; only its connection differs.

import { makeInstallable } from "./app/install.ts";
import { hex } from "./core.ts";
import { Parts } from "./dom.ts";
import { Flasher } from "./flasher/flasher.ts";
import { keepFocus } from "./focus.ts";
import { isServed } from "./link/served.ts";
import { Session, type Wire } from "./link/session.ts";
import { Connection } from "./panel/connection.ts";
import { Panel } from "./panel/panel.ts";
import { showServed } from "./panel/served.ts";
import { chosen, isStill, keep } from "./preferences.ts";
import { RecordView } from "./record/record.ts";
import { isOn, isWaiting, turn, wakeOnTouch } from "./signals.ts";
import { Drawing } from "./try/drawing.ts";
import { inWords } from "./try/outcome.ts";
import { commandsSetUp, machineSetUp } from "./try/set_up.ts";
import { Trial } from "./try/trial.ts";
import { CYCLES_PER_SECOND } from "./uno/uno.ts";
import {
    type Code,
    inLanguage,
    LANGUAGES,
    language,
    number,
    quantity,
    say,
    show,
    speak,
    told,
    translate,
} from "./words/words.ts";

/** Share of a frame's time for the chip. The rest is for the picture and the operator's clicks. */
const CHIP_SHARE = 0.75;
/** Longest time that passes in a frame: a page that was hidden does not catch up. */
const LONGEST_FRAME_S = 0.1;
/** Time between two pictures of the row under reduced motion. */
const STILL_MS = 1000;
/** Time over which the pace is measured. */
const PACE_S = 1;
/** The views, by their sections and the address behind #. */
const VIEWS = ["try", "work", "flash", "record"] as const;

function find<Kind extends Element>(id: string, kind: new () => Kind): Kind {
    const element = document.getElementById(id);
    if (!(element instanceof kind)) throw new Error(`the page has no ${kind.name} #${id}`);
    return element;
}

/** Replaces an element's text. */
function write(id: string, text: string): void {
    const element = find(id, HTMLElement);
    if (element.textContent !== text) element.textContent = text;
}

translate(document.body);
inLanguage(() => {
    document.documentElement.lang = language();
});
const languages = find("language", HTMLSelectElement);
for (const [code, { name }] of Object.entries(LANGUAGES)) {
    const option = new Option(name, code);
    option.lang = code;
    languages.append(option);
}
languages.value = language();
languages.addEventListener("change", () => speak(languages.value as Code));
show(find("unchecked", HTMLElement), () => say("unchecked"));

const trial = new Trial(hex, Date.now(), machineSetUp());
const drawing = new Drawing(find("drawing", SVGSVGElement), trial);
const trialPanel = new Panel(find("try-panel", HTMLElement), "try");
const wire: Wire = {
    onText: () => {},
    onEnd: () => {},
    send: (text) => trial.uno.send(text),
    close: async () => {},
};
trial.onText = (text) => wire.onText(text);
/** The chip's time. Timeouts use it, so that a slow or paused trial causes no timeout. */
const trialMs = () => (trial.uno.cycle / CYCLES_PER_SECOND) * 1000;
trialPanel.connect(new Session(wire, trialMs(), true), trialMs());
trialPanel.onHappening = (happening) => {
    trial.take(happening);
    // A board without saved settings raises an alarm. Then this machine's settings are sent and saved.
    if (happening.is === "started" && happening.line.includes("settings_lost")) settleAt = "connected";
    if (happening.is !== settleAt) return;
    settleAt = undefined;
    for (const command of [...commandsSetUp(), "save", "clear"]) trialPanel.ask(command).catch(() => {});
};
/** The event to wait for before the settings are saved. */
let settleAt: "connected" | undefined;

new RecordView(new Parts(find("view-record", HTMLElement)));

/** The panels of real machines. */
let workPanels: Panel[] = [];
const flasher = new Flasher(new Parts(find("view-flash", HTMLElement)), hex);
if (isServed()) void workServed();
else workHere();

/** The machine at this computer's own port. */
function workHere(): void {
    const panel = new Panel(find("work-panel", HTMLElement), "work");
    workPanels = [panel];
    const connection = new Connection(new Parts(find("connection", HTMLElement)), panel);
    connection.onFlash = () => {
        location.hash = "#flash";
    };
    flasher.onBegin = (port) => connection.release(port);
    flasher.onWork = (port) => {
        location.hash = "#work";
        void connection.connect(port);
    };
}

/** The machines at the ports of the computer that serves this page. */
async function workServed(): Promise<void> {
    const served = find("served", HTMLElement);
    served.hidden = false;
    for (const id of ["connection", "work-panel"]) find(id, HTMLElement).hidden = true;
    try {
        workPanels = await showServed(served);
    } catch (error) {
        const said = document.createElement("p");
        show(said, () => say("noMachinesList", { why: told(error) }));
        served.append(said);
    }
}

/** Shows the chosen view. */
function choose(): void {
    const shown = VIEWS.find((view) => `#${view}` === location.hash) ?? "try";
    const focused = document.activeElement;
    for (const view of VIEWS) find(`view-${view}`, HTMLElement).hidden = view !== shown;
    for (const link of document.querySelectorAll<HTMLElement>("nav a")) {
        const isShown = link.getAttribute("href") === `#${shown}`;
        link.ariaCurrent = isShown ? "page" : null;
        if (isShown && focused?.closest("main [hidden]")) link.focus();
    }
}
globalThis.addEventListener("hashchange", choose);
choose();

keepFocus();

void makeInstallable((load) => {
    find("newer", HTMLElement).hidden = false;
    button("load-newer", load);
});

/** The key for HOLD, for every shown machine. */
globalThis.addEventListener("keydown", ({ key }) => {
    if (key !== "Escape") return;
    if (!find("view-try", HTMLElement).hidden) trialPanel.hold();
    else for (const panel of workPanels) panel.hold();
});

/** Light or dark as in the system, or always light, for sunlight. */
const light = find("light", HTMLButtonElement);
function lighten(on: boolean): void {
    light.ariaPressed = String(on);
    document.documentElement.classList.toggle("light", on);
}
lighten(chosen("light") === "on");
light.addEventListener("click", () => {
    const on = light.ariaPressed !== "true";
    keep("light", on ? "on" : "off");
    lighten(on);
});

const sound = find("sound", HTMLButtonElement);
function showSound(): void {
    sound.ariaPressed = String(isOn());
    sound.classList.toggle("waiting", isWaiting());
    sound.ariaLabel = say(isWaiting() ? "soundWaits" : "sound");
}
inLanguage(showSound);
wakeOnTouch(showSound);
sound.addEventListener("click", () => {
    turn(!isOn());
    showSound();
});

/** Shows a slider's value beside it and applies it, now and after each move. */
function slider(id: string, shown: (value: number) => string, use: (value: number) => void): void {
    const [input, output] = [find(id, HTMLInputElement), find(`${id}-is`, HTMLOutputElement)];
    const apply = () => {
        output.value = shown(input.valueAsNumber);
        use(input.valueAsNumber);
    };
    input.addEventListener("input", apply);
    inLanguage(apply);
}

function toggle(id: string, use: (on: boolean) => void): void {
    const input = find(id, HTMLInputElement);
    // A browser may remember the earlier state.
    input.checked = false;
    input.addEventListener("change", () => use(input.checked));
}

function button(id: string, use: () => void): void {
    find(id, HTMLButtonElement).addEventListener("click", use);
}

for (const form of ["drive", "bench"]) find(form, HTMLFormElement).reset();
// Under reduced motion the machine stands until the operator drives it.
if (isStill()) find("speed", HTMLInputElement).value = "0";
slider(
    "speed",
    (speed) => quantity(speed, "kilometer-per-hour", 1),
    (speedKmH) => trial.machine.change({ speedKmH }),
);
slider(
    "spacing",
    (spacing) => quantity(spacing, "millimeter"),
    (spacingMm) => trial.machine.change({ spacingMm }),
);
slider(
    "weeds",
    (share) => say("ofGaps", { share: quantity(share, "percent") }),
    (share) => trial.machine.change({ weedShare: share / 100 }),
);
slider(
    "slip",
    (slip) => quantity(slip, "percent"),
    (slip) => trial.machine.change({ slip: slip / 100 }),
);
toggle("switch", (on) => trial.work(on));
toggle("torn", (beamWireTorn) => trial.machine.change({ beamWireTorn }));
toggle("dead", (encoderDead) => trial.machine.change({ encoderDead }));
button("brown-out", () => trial.uno.reset("brown-out"));
button("press-reset", () => trial.uno.reset("external"));

const time = find("time", HTMLSelectElement);
const workSwitch = find("switch", HTMLInputElement);
const lamp = find("lamp", HTMLElement);
const hint = find("hint", HTMLElement);
const outcome = find("outcome", HTMLElement);

function showTrial(): void {
    const { machine } = trial;
    trialPanel.show();
    write("true-tool", say(machine.isWeeding ? "toolIn" : machine.isClear ? "toolOut" : "swings"));
    lamp.classList.toggle("lit", trial.isLampLit);
    lamp.ariaLabel = say(trial.isLampLit ? "lampLit" : "lampDark");
    const { totals } = trial.outcome;
    write("outcome", inWords(totals));
    write("why", trial.why);
    outcome.classList.toggle("damaged", totals.plants.damaged > 0);
    hint.hidden = !(workSwitch.checked && trialPanel.machine.mode !== "work");
    if (isStill() && performance.now() - drawnMs < STILL_MS) return;
    drawnMs = performance.now();
    drawing.draw(trial);
}
let drawnMs = Number.NEGATIVE_INFINITY;

/** Time on the chip and outside since the pace was last shown. */
const passed = { chipS: 0, outsideS: 0 };
let lastMs = performance.now();

function frame(nowMs: number): void {
    const outsideS = Math.min(Math.max((nowMs - lastMs) / 1000, 0), LONGEST_FRAME_S);
    lastMs = nowMs;
    // A hidden trial is paused.
    if (!find("view-try", HTMLElement).hidden) {
        passed.chipS += trial.advance(outsideS * Number(time.value), outsideS * 1000 * CHIP_SHARE);
        passed.outsideS += outsideS;
        if (passed.outsideS > PACE_S) {
            write("pace", `${number(passed.chipS / passed.outsideS, 2)} x`);
            passed.chipS = passed.outsideS = 0;
        }
        trialPanel.turn(trialMs());
        showTrial();
    } else if (!find("view-work", HTMLElement).hidden) for (const panel of workPanels) panel.show();
    requestAnimationFrame(frame);
}

requestAnimationFrame(frame);

// For tests, and for the browser's console.
Object.assign(globalThis, { trial });
