// The page: its views, and their shared parts. The panel beside the row in "Try it" is the same as the panel for a real
// Uno; only its connection differs.

import { makeInstallable } from "./app/install.ts";
import { hex } from "./core.ts";
import { make, Parts } from "./dom.ts";
import { Flasher } from "./flasher/flasher.ts";
import { keepFocus } from "./focus.ts";
import { isServed } from "./link/served.ts";
import { Session } from "./link/session.ts";
import { Connection } from "./panel/connection.ts";
import { Panel } from "./panel/panel.ts";
import { showServed } from "./panel/served.ts";
import { chosen, isStill, keep, STILL_MS } from "./preferences.ts";
import type { Work } from "./record/picture.ts";
import { RecordView } from "./record/record.ts";
import type { Change } from "./row/machine.ts";
import { isOn, isWaiting, turn, wakeOnTouch } from "./signals.ts";
import { Drawing } from "./try/drawing.ts";
import { inWords } from "./try/outcome.ts";
import { Simulation } from "./try/simulation.ts";
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
const CHIP_SHARE = 0.8;
/** Longest time that passes in a frame: a page that was hidden does not catch up. */
const LONGEST_FRAME_S = 0.1;
/** Where the tool of "Try it" has to be for an example of a log, and the time after which a standing one has none. */
const EXAMPLE_MM = 4000;
const EXAMPLE_CYCLES = 3 * CYCLES_PER_SECOND;
/** Time over which the pace is measured. */
const PACE_S = 1;
/** The views, by their sections and the address behind #. */
const VIEWS = ["try", "work", "flash", "record"] as const;

const page = new Parts(document.body, "id");

translate(document.body);
inLanguage(() => {
    document.documentElement.lang = language;
});
const languages = page.get("language", HTMLSelectElement);
for (const [code, { name }] of Object.entries(LANGUAGES)) {
    const option = new Option(name, code);
    option.lang = code;
    languages.append(option);
}
languages.value = language;
languages.addEventListener("change", () => speak(languages.value as Code));
page.say("unchecked", () => say("unchecked"));

/** The row's seed: another row at each visit, or that of an address with `?seed=7`. */
const seed = Number(new URLSearchParams(location.search).get("seed"));
const simulation = new Simulation(hex, Number.isSafeInteger(seed) && seed > 0 ? seed : Date.now(), true);
const drawing = new Drawing(page.get("drawing", SVGSVGElement));
const tryPanel = new Panel(page.html("try-panel"), "try");
/** The chip's time. Timeouts use it, so that a slow or paused simulation causes no timeout. */
const chipMs = () => (simulation.uno.cycle / CYCLES_PER_SECOND) * 1000;
const wire = { send: (text: string) => simulation.uno.send(text), close: async () => {} };
const session = new Session(wire, chipMs(), true);
simulation.onText = (text) => session.receive(text);
tryPanel.connect(session, chipMs());
tryPanel.onHappening = (happening) => {
    simulation.take(happening);
    // A board without saved settings raises an alarm. Then this machine's settings are sent and saved.
    if (happening.is === "started" && happening.line.includes("settings_lost")) settleAt = "connected";
    if (happening.is !== settleAt) return;
    settleAt = undefined;
    // Then the work switch is thrown, so that the first machine weeds at once.
    const start = () => {
        workSwitch.checked = true;
        simulation.work(true);
    };
    const drive = () => {
        isSettled = true;
        simulation.machine.change({ speedKmH: speed.valueAsNumber });
    };
    void setUp()
        .then(start, () => {})
        .finally(drive);
};
/** Types one command after the other: one that waits too long for those before it is not sent. A HOLD ends it. */
async function setUp(): Promise<void> {
    for (const command of simulation.machine.setUp) await tryPanel.ask(command);
    await Promise.all(["save", "clear"].map((command) => tryPanel.ask(command)));
}
/** Whether the machine is set up. Until then it stands: it would pass plants with other settings than are shown. */
let isSettled = false;
/** The event to wait for before the settings are saved. */
let settleAt: "connected" | undefined;

new RecordView(new Parts(page.html("view-record")), tryLog);

/** The log of "Try it", which weeds on until some plants are in it. */
async function tryLog({ progress, cancel }: Work): Promise<File> {
    for (;;) {
        cancel.throwIfAborted();
        const share = simulation.machine.toolMm / EXAMPLE_MM;
        progress(Math.min(Math.max(share, 0), 1));
        // A machine that stands makes the log no longer.
        if (share >= 1 || (Number(speed.value) <= 0 && simulation.uno.cycle > EXAMPLE_CYCLES)) return tryPanel.log;
        simulation.advance(LONGEST_FRAME_S, Number.POSITIVE_INFINITY);
        tryPanel.turn(chipMs());
        await new Promise((done) => setTimeout(done));
    }
}

/** The panels of real machines. */
let workPanels: Panel[] = [];
const flasher = new Flasher(new Parts(page.html("view-flash")), hex);
if (isServed()) void workServed();
else workHere();

/** The machine at this computer's own port. */
function workHere(): void {
    const panel = new Panel(page.html("work-panel"), "work");
    workPanels = [panel];
    const connection = new Connection(new Parts(page.html("connection")), panel);
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
    const served = page.html("served");
    served.hidden = false;
    for (const id of ["connection", "work-panel"]) page.html(id).hidden = true;
    try {
        workPanels = await showServed(served);
    } catch (error) {
        const said = make("p", "");
        show(said, () => say("noMachinesList", { why: told(error) }));
        served.append(said);
    }
}

function choose(): void {
    const shown = VIEWS.find((view) => `#${view}` === location.hash) ?? "try";
    const focused = document.activeElement;
    for (const view of VIEWS) page.html(`view-${view}`).hidden = view !== shown;
    for (const link of document.querySelectorAll<HTMLElement>("nav a")) {
        const isShown = link.getAttribute("href") === `#${shown}`;
        link.ariaCurrent = isShown ? "page" : null;
        if (isShown && focused?.closest("main [hidden]")) link.focus();
    }
}
globalThis.addEventListener("hashchange", choose);
choose();

keepFocus();

// Loading another page closes the port, which resets a machine at work, and drops the log.
globalThis.addEventListener("beforeunload", (event) => {
    if (workPanels.some(({ isNeeded }) => isNeeded)) event.preventDefault();
});

/** The key for HOLD: for the simulated machine while it is shown, and for every real one in each view. */
globalThis.addEventListener("keydown", ({ key }) => {
    if (key !== "Escape") return;
    if (!page.html("view-try").hidden) tryPanel.hold();
    // Its result is shown there.
    if (workPanels.filter((panel) => panel.hold()).length > 0) location.hash = "#work";
});

// The wheel scrolls. Chromium would change the number in the field that has the focus.
document.addEventListener(
    "wheel",
    ({ target: field }) => {
        if (!(field instanceof HTMLInputElement && field.type === "number")) return;
        field.readOnly = true;
        setTimeout(() => {
            field.readOnly = false;
        });
    },
    { capture: true, passive: true },
);

// The keyboard of an iPhone covers the page's end, where HOLD is. A larger page has no keyboard there.
const { visualViewport } = globalThis;
for (const changed of ["resize", "scroll"])
    visualViewport?.addEventListener(changed, () => {
        const { height, offsetTop, scale } = visualViewport;
        const covered = scale > 1 ? 0 : Math.max(innerHeight - height - offsetTop, 0);
        document.documentElement.style.setProperty("--keyboard", `${covered}px`);
    });

/** Light or dark as in the system, or always light, for sunlight: the style looks at the button. */
const light = page.button("light", () => {
    const on = light.ariaPressed !== "true";
    keep("light", on ? "on" : "off");
    light.ariaPressed = String(on);
});
light.ariaPressed = String(chosen("light") === "on");

const sound = page.button("sound", () => {
    turn(!isOn());
    showSound();
});
function showSound(): void {
    sound.ariaPressed = String(isOn());
    sound.classList.toggle("waiting", isWaiting());
    sound.ariaLabel = say(isWaiting() ? "soundWaits" : "sound");
}
inLanguage(showSound);
wakeOnTouch(showSound);

// A browser may remember an earlier state.
for (const form of ["drive", "bench"]) page.get(form, HTMLFormElement).reset();
// Under reduced motion the machine stands until the operator drives it.
const speed = page.get("speed", HTMLInputElement);
if (isStill()) speed.value = "0";

/** Shows a slider's value beside it, in a text if there is one, and makes its change, now and after each move. */
function slider(id: string, unit: string, digits: number, change: (value: number) => Change, text?: "ofGaps"): void {
    const [input, output] = [page.get(id, HTMLInputElement), page.get(`${id}-is`, HTMLOutputElement)];
    const apply = () => {
        const share = quantity(input.valueAsNumber, unit, digits);
        output.value = text ? say(text, { share }) : share;
        simulation.machine.change(change(input.valueAsNumber));
    };
    input.addEventListener("input", apply);
    inLanguage(apply);
}
slider("speed", "kilometer-per-hour", 1, (speedKmH) => ({ speedKmH: isSettled ? speedKmH : 0 }));
slider("spacing", "millimeter", 0, (spacingMm) => ({ spacingMm }));
slider("weeds", "percent", 0, (share) => ({ weedShare: share / 100 }), "ofGaps");
slider("slip", "percent", 0, (slip) => ({ slip: slip / 100 }));

function toggle(id: string, use: (on: boolean) => void): HTMLInputElement {
    const input = page.get(id, HTMLInputElement);
    input.addEventListener("change", () => use(input.checked));
    return input;
}
const workSwitch = toggle("switch", (on) => simulation.work(on));
toggle("torn", (beamWireTorn) => simulation.machine.change({ beamWireTorn }));
toggle("dead", (encoderDead) => simulation.machine.change({ encoderDead }));
page.button("brown-out", () => simulation.uno.reset("brown-out"));
page.button("press-reset", () => simulation.uno.reset("external"));

const time = page.get("time", HTMLSelectElement);
const lamp = page.html("lamp");
const outcome = page.html("outcome");

function showTrial(): void {
    const { machine } = simulation;
    tryPanel.show();
    page.write("true-tool", say(machine.isWeeding ? "toolIn" : machine.isClear ? "toolOut" : "swings"));
    lamp.classList.toggle("lit", simulation.isLampLit);
    lamp.ariaLabel = say(simulation.isLampLit ? "lampLit" : "lampDark");
    const { totals } = simulation.outcome;
    page.write("outcome", inWords(totals));
    page.write("why", simulation.why);
    outcome.classList.toggle("damaged", totals.plants.damaged > 0);
    if (isStill() && performance.now() - drawnMs < STILL_MS) return;
    drawnMs = performance.now();
    drawing.draw(simulation);
}
let drawnMs = Number.NEGATIVE_INFINITY;

/** Time on the chip and outside since the pace was last shown. */
const passed = { chipS: 0, outsideS: 0 };
let lastMs = performance.now();

function frame(nowMs: number): void {
    const outsideS = Math.min(Math.max((nowMs - lastMs) / 1000, 0), LONGEST_FRAME_S);
    lastMs = nowMs;
    // A hidden simulation is paused.
    if (!page.html("view-try").hidden) {
        passed.chipS += simulation.advance(outsideS * Number(time.value), outsideS * 1000 * CHIP_SHARE);
        passed.outsideS += outsideS;
        if (passed.outsideS > PACE_S) {
            page.write("pace", `${number(passed.chipS / passed.outsideS, 2)} x`);
            passed.chipS = passed.outsideS = 0;
        }
        tryPanel.turn(chipMs());
        showTrial();
    } else if (!page.html("view-work").hidden) for (const panel of workPanels) panel.show();
    requestAnimationFrame(frame);
}

requestAnimationFrame(frame);

page.html("not-started").remove();

// For tests, and for the browser's console.
Object.assign(globalThis, { simulation });

let loadNewer = () => {};
page.button("load-newer", () => loadNewer());
// At the end, because it says that this page has started.
void makeInstallable((load) => {
    page.html("newer").hidden = false;
    loadNewer = load;
});
