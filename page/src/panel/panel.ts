// The operator's panel of a machine, for a real Uno or the page's own.
//
// It is made from the page's template, and connected to one session after the other. It shows the machine's output, and
// types commands. It makes no decisions.

import { download, Parts } from "../dom.ts";
import type { EventLine, Setting } from "../link/console_line.ts";
import { Log } from "../link/log.ts";
import type { Allowed } from "../link/served.ts";
import { type Ask, type Happening, isHold, type Link, NoMachine, NotSent } from "../link/session.ts";
import { isStill, STILL_MS } from "../preferences.ts";
import { signal } from "../signals.ts";
import { english, language, number, onLanguage, quantity, say, told, translate } from "../words/words.ts";
import { Calibration } from "./calibration.ts";
import { Console } from "./console.ts";
import { Examples } from "./examples.ts";
import { fault, Machine, sentence } from "./machine.ts";
import { SetUp } from "./set_up.ts";
import { SettingsForm } from "./settings.ts";
import { drawStrip } from "./strip.ts";

/** At a machine's own port. */
const EVERYTHING: Allowed = { mayStart: true, mayChange: true };

/** Time between two turns of a real machine's panel. */
export const TURN_MS = 20;

/** Time between a HOLD that has not come through and the next one. */
const HOLD_AGAIN_MS = 500;

/** How long a reason must last before a screen reader says it. A state is said at once. */
const LASTING_MS = 1000;

/** The tabs beside the parts that are needed at work. */
const TABS = ["settings", "calibrate", "examples", "console"] as const;

export class Panel {
    onHappening: (happening: Happening) => void = () => {};
    /** Whether the next machine may be another than the last one. Its saved settings then show that. */
    mayBeOther = false;
    readonly machine = new Machine();
    /** The row's name for a screen reader, if there are several. */
    readonly #row: string;
    readonly #parts: Parts;
    readonly #console: Console;
    readonly #settings: SettingsForm;
    readonly #calibration: Calibration;
    readonly #setUp: SetUp;
    readonly #examples: Examples;
    readonly #strip: SVGSVGElement;
    #log = new Log();
    /** The next text for a screen reader, its state, and when that state began. */
    #heard = { text: "", state: "", sinceMs: 0 };
    /** Whether the next state follows this page's own HOLD, whose answer is already signalled. */
    #isHolding = false;
    /** A HOLD that has not come through: when it is sent again, or undefined while it is on its way; and the reason. */
    #holdPending: { againMs: number | undefined; why?: string } | undefined;
    #link: Link | undefined;
    #now = 0;
    #drawnMs = Number.NEGATIVE_INFINITY;

    /**
     * Fills an element. `name` distinguishes it from the page's other panels. `allowed` are the commands that may be
     * typed here. `row` is read out before events of this machine, if there are several.
     */
    constructor(into: HTMLElement, name: string, allowed = EVERYTHING, row = "") {
        this.#row = row === "" ? "" : `${row}: `;
        const template = new Parts(document.body, "id").get("panel", HTMLTemplateElement);
        into.append(template.content.cloneNode(true));
        translate(into);
        const parts = new Parts(into);
        this.#parts = parts;
        const ask: Ask = (command) => this.ask(command);
        this.#console = new Console(parts, (line) => void this.#type(line));
        this.#settings = new SettingsForm(parts, this.machine, ask, allowed.mayChange);
        this.#calibration = new Calibration(parts, this.machine, ask);
        this.#setUp = new SetUp(parts, this.machine, ask);
        this.#examples = new Examples(parts, this.machine, ask);
        this.#strip = parts.get("strip", SVGSVGElement);
        parts.button("hold", () => this.hold());
        const why = (error: unknown) => sentence(told(error));
        for (const command of ["start", "clear"])
            parts.button(command, () => void parts.attempt("drive-said", ask(command), undefined, why));
        const save = () => download(this.log);
        parts.button("log-save", save);
        parts.button("log-clear", () => {
            if (this.#log.isUnsaved) save();
            this.#log = new Log();
            const { version, settings, examples, help } = this.machine;
            // So that the later lines can be replayed by themselves.
            if (version !== undefined) this.#log.add({ is: "connected", version, settings, examples, help }, this.#now);
        });
        this.machine.mayStart = allowed.mayStart;
        into.classList.toggle("may-not-start", !allowed.mayStart);
        into.classList.toggle("may-not-change", !allowed.mayChange);
        parts.html("limits").hidden = allowed.mayChange;
        parts.say("limits", () => say(allowed.mayStart ? "watchAndStart" : "watchOnly"));
        this.#wireTabs(
            name,
            TABS.filter((tab) => allowed.mayChange || tab !== "calibrate"),
        );
        this.#showConnected();
        onLanguage(() => {
            this.#settings.show();
            this.#examples.showExamples();
            this.#setUp.show();
        });
        if (into.classList.contains("alone")) followDock(parts.html("dock"));
    }

    /** The log so far, as a file. */
    get log(): File {
        return new File([this.#log.text()], "weeder-log.csv", { type: "text/csv" });
    }

    /** Whether closing the page would leave a machine at work, or drop an unsaved log. */
    get isNeeded(): boolean {
        return this.machine.isAtWork || this.#log.isUnsaved;
    }

    /**
     * Holds the machine, before all waiting commands. It is sent again until the machine has obeyed, also by the next
     * connection. Returns false if no machine was connected.
     */
    hold(): boolean {
        if (this.#link) void this.#holdNow().catch(() => {});
        else this.#parts.say("drive-said", () => sentence(told(english("noneConnected"))));
        return this.#link !== undefined;
    }

    #holdNow(): Promise<void> {
        this.#isHolding = this.machine.mode === "work";
        this.#holdPending = { againMs: undefined };
        return this.#sendHold(this.#holdPending);
    }

    /** Sends a HOLD. If it does not come through, it is sent again later, and this fails with the reason. */
    async #sendHold(pending: { againMs: number | undefined; why?: string }): Promise<void> {
        pending.againMs = undefined;
        try {
            await this.#link?.hold();
            signal("held");
            if (this.#holdPending === pending) this.#dropHold();
        } catch (error) {
            pending.againMs = this.#now + HOLD_AGAIN_MS;
            const { message } = error as Error;
            // The same reason again would hide what was told since.
            if (this.#holdPending === pending && pending.why !== message) {
                pending.why = message;
                this.#parts.say("drive-said", () => say("holdFailed", { why: told(error).replace(/\.$/, "") }));
            }
            throw error;
        }
    }

    #dropHold(): void {
        this.#holdPending = undefined;
        this.#parts.write("drive-said", "");
    }

    connect(link: Link, nowMs: number): void {
        this.#now = nowMs;
        if (this.#holdPending) this.#holdPending.againMs = nowMs;
        this.machine.lost = english("waitingForMachine");
        link.onHappening = (happening) => {
            if (link === this.#link) this.#take(happening);
        };
        this.#link = link;
    }

    /** Forgets what was measured at another machine, typed for it and said about it. */
    forget(): void {
        [this.machine.mode, this.machine.restarted] = [undefined, undefined];
        this.#forgetTyped();
    }

    #forgetTyped(): void {
        this.mayBeOther = false;
        this.#setUp.forget();
        this.#settings.forget();
        this.#parts.write("teach-said", "");
    }

    async disconnect(): Promise<void> {
        await this.#link?.close?.();
        this.#link = undefined;
        this.#dropHold();
    }

    ask(command: string): Promise<string[]> {
        if (!this.#link) return Promise.reject(new NoMachine(english("noneConnected")));
        if (this.#holdPending && /^\s*start\b/i.test(command))
            return Promise.reject(new NotSent(english("holdPending")));
        if (isHold(command)) return this.#holdNow().then(() => []);
        return this.#link.ask(command);
    }

    /** Saves these settings on the machine, and clears the alarm for lost ones. Returns whether it has accepted all. */
    async putBack(values: ReadonlyMap<string, number>): Promise<boolean> {
        if (!(await this.#settings.putBack(values))) return false;
        if (this.machine.alarm === "settings_lost") await this.ask("clear");
        return true;
    }

    turn(nowMs: number): void {
        this.#now = this.machine.nowMs = nowMs;
        const pending = this.#holdPending;
        if (pending?.againMs !== undefined && nowMs >= pending.againMs) void this.#sendHold(pending).catch(() => {});
        this.#link?.turn?.(nowMs);
    }

    show(): void {
        const { machine } = this;
        const { status } = machine;
        const parts = this.#parts;
        parts.root.dataset.state = machine.state;
        parts.write("state", machine.stateWord);
        parts.write("why", machine.why);
        this.#tell();
        parts.write("speed", status ? number(status.speedMmS * 0.0036, 1) : "-");
        const isKnown = machine.state !== "none" && machine.state !== "unknown";
        parts.write("tool", isKnown ? say(machine.toolOut ? "toolOut" : "toolIn") : "-");
        parts.write("place", status ? quantity((status.position * machine.tickMm) / 1000, "meter", 2) : "-");
        parts.write("zones", status ? String(status.zones) : "-");
        const trouble = machine.alarm ?? machine.warning;
        const { restarted } = machine;
        const restart = restarted === undefined ? "" : say("restarted", { cause: restarted });
        parts.html("alarm").hidden = trouble === undefined && restarted === undefined;
        parts.html("clear").hidden = machine.alarm === undefined;
        if (trouble !== undefined) {
            const { title, advice } = fault(trouble);
            parts.write("alarm-name", say(machine.alarm === undefined ? "warning" : "alarm", { title }));
            parts.write("alarm-advice", [restart, sentence(advice)].join(" ").trim());
        } else if (restarted !== undefined) {
            parts.write("alarm-name", restart);
            parts.write("alarm-advice", say("notWeeded"));
        }
        const nowMs = performance.now();
        if (!isStill() || nowMs - this.#drawnMs > STILL_MS) {
            this.#drawnMs = nowMs;
            drawStrip(this.#strip, machine, this.#now);
        }
        this.#examples.show();
        this.#calibration.show();
        const lines = say("logLines", { count: this.#log.length });
        parts.write("log-length", this.#log.isFull ? say("logFull", { lines }) : lines);
        this.#console.show();
    }

    #take(happening: Happening): void {
        const { alarm, restarted } = this.machine;
        if (happening.is === "connected") {
            if (this.mayBeOther && !isSame(happening.settings, this.machine.settings)) {
                this.machine.restarted = undefined;
                this.#forgetTyped();
            }
            this.mayBeOther = false;
        }
        this.machine.take(happening, this.#now);
        this.#signal(happening, this.machine.alarm !== alarm);
        if (this.machine.restarted !== undefined && this.machine.restarted !== restarted) signal("alarm");
        this.#log.add(happening, this.#now);
        this.#setUp.take(happening);
        const { is } = happening;
        if (!this.#holdPending && (is === "connected" || (is === "event" && happening.event.is === "state")))
            this.#parts.write("drive-said", "");
        if (is === "event") this.#calibration.take(happening.event);
        if (is === "connected") this.#calibration.forget();
        if (is === "connected" || is === "lost") this.#showConnected();
        if (is === "connected" || is === "settings") {
            this.#settings.show();
            this.#calibration.showSettings();
        }
        if (is === "connected" || is === "examples") this.#examples.showExamples();
        const said = inConsole(happening);
        if (said) this.#console.add(...said);
        this.onHappening(happening);
    }

    /** Gives the operator audible signals for events that must be noticed without looking. */
    #signal(happening: Happening, isOtherAlarm: boolean): void {
        const isNew = happening.is === "event" && happening.event.is === "newer" && happening.event.isAlarm;
        if ((isOtherAlarm && this.machine.alarm !== undefined) || isNew) signal("alarm");
        if (happening.is === "lost" && !happening.isWanted) signal("lost");
        const event = happening.is === "event" ? happening.event : undefined;
        if (event?.is !== "state" && !(event && isAlarm(event)) && happening.is !== "lost") return;
        // By its switch, or by another page's HOLD. This page's own HOLD is signalled by its answer, which comes before
        // or after this.
        if (event?.is === "state" && event.mode === "hold" && !this.#isHolding) signal("held");
        this.#isHolding = false;
    }

    #showConnected(): void {
        const isThere = this.machine.version !== undefined;
        for (const button of this.#parts.root.querySelectorAll<HTMLButtonElement>("button.needs-machine"))
            button.disabled = !isThere;
    }

    /** Types a line of the console. A screen reader says its answer, but not the machine's other output. */
    async #type(line: string): Promise<void> {
        const answered = this.#parts.html("answered");
        answered.lang = "en";
        this.#parts.write("answered", "");
        try {
            const answer = await this.ask(line);
            this.#parts.write("answered", answer.join("\n") || "ok");
        } catch (error) {
            const { message } = error as Error;
            const text = told(message);
            if (text !== message) answered.lang = language;
            this.#parts.write("answered", text);
            // The console has no line of what was not sent.
            if (error instanceof NotSent) this.#console.add(`${line}: ${message}`, "error");
            if (error instanceof NoMachine) this.#console.add(message, "error");
        }
    }

    /** Lets a screen reader say the state at once, and its reason if that lasts. */
    #tell(): void {
        const { heard, state } = this.machine;
        const nowMs = performance.now();
        const isOther = state !== this.#heard.state;
        if (isOther || heard !== this.#heard.text) this.#heard = { text: heard, state, sinceMs: nowMs };
        if (isOther || nowMs - this.#heard.sinceMs > LASTING_MS) this.#parts.write("heard", this.#row + heard);
    }

    #wireTabs(name: string, tabs: readonly (typeof TABS)[number][]): void {
        const tab = (which: string) => this.#parts.get(`tab-${which}`, HTMLButtonElement);
        const body = (which: string) => this.#parts.html(`body-${which}`);
        const choose = (chosen: string) => {
            for (const which of tabs) {
                tab(which).ariaSelected = String(which === chosen);
                body(which).hidden = which !== chosen;
            }
        };
        for (const which of TABS) tab(which).hidden = body(which).hidden = !tabs.includes(which);
        for (const [index, which] of tabs.entries()) {
            tab(which).id = `${name}-tab-${which}`;
            body(which).id = `${name}-body-${which}`;
            tab(which).setAttribute("aria-controls", body(which).id);
            body(which).setAttribute("aria-labelledby", tab(which).id);
            tab(which).addEventListener("click", () => choose(which));
            tab(which).addEventListener("keydown", ({ key }) => {
                const by = { ArrowLeft: -1, ArrowRight: 1 }[key];
                if (by === undefined) return;
                const next = tabs[(index + by + tabs.length) % tabs.length] ?? which;
                choose(next);
                tab(next).focus();
            });
        }
        choose("console");
    }
}

/** Whether a machine has saved what another one had. A machine without saved settings may be any. */
const isSame = (settings: readonly Setting[], others: readonly Setting[]) =>
    settings.every(({ saved }, at) => saved !== undefined && saved === others[at]?.saved);

/** Whether an event is an alarm, also one that only a newer firmware knows. */
function isAlarm(event: EventLine): boolean {
    return event.is === "alarm" || (event.is === "newer" && event.isAlarm);
}

function inConsole(happening: Happening): Parameters<Console["add"]> | undefined {
    switch (happening.is) {
        case "started":
            return [happening.line, "happened"];
        case "connected":
            return [`connected to weeder ${happening.version}`, "happened"];
        case "lost":
            return [happening.why, "happened"];
        case "event":
            if (happening.event.is === "plot") return undefined;
            return [happening.line, isAlarm(happening.event) ? "error" : ""];
        case "command":
            return [`> ${happening.line}`, "typed"];
        case "answer":
            return [happening.line, happening.line.startsWith("error:") ? "error" : ""];
        default:
            return undefined;
    }
}

/** Reserves room for the dock at the page's end, so that the browser scrolls the focused element above it. */
function followDock(dock: HTMLElement): void {
    new ResizeObserver(() => {
        if (dock.offsetHeight > 0) document.documentElement.style.setProperty("--dock", `${dock.offsetHeight}px`);
    }).observe(dock);
}
