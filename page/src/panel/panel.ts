// The operator's panel of a machine, whichever Uno is at the other end of its wire: a real one, or the page's own.
//
// It is made of the page's template, and connected to one session after the other. It shows what the machine says, and types
// commands; it decides nothing.

import { download, Parts } from "../dom.ts";
import { Log } from "../link/log.ts";
import type { Allowed } from "../link/served.ts";
import { type Ask, type Happening, NoMachine, Session, type Wire } from "../link/session.ts";
import { Calibration } from "./calibration.ts";
import { Console } from "./console.ts";
import { Examples } from "./examples.ts";
import { fault, Machine, sentence } from "./machine.ts";
import { SettingsForm } from "./settings.ts";
import { drawStrip } from "./strip.ts";

/** At a machine's own port. */
const EVERYTHING: Allowed = { mayStart: true, mayChange: true };

/** What stands beside what is needed at work, a tab each. */
const TABS = ["settings", "calibrate", "examples", "console"] as const;

export class Panel {
    /** Told of all that happens, after the panel. */
    onHappening: (happening: Happening) => void = () => {};
    readonly machine = new Machine();
    readonly #parts: Parts;
    readonly #console: Console;
    readonly #settings: SettingsForm;
    readonly #calibration: Calibration;
    readonly #examples: Examples;
    readonly #strip: SVGSVGElement;
    #log = new Log();
    #session: Session | undefined;
    #now = 0;

    /** Fills an element. `name` tells it from the page's other panels, `allowed` says what may be typed from here. */
    constructor(into: HTMLElement, name: string, allowed = EVERYTHING) {
        const template = document.getElementById("panel");
        if (!(template instanceof HTMLTemplateElement)) throw new Error("the page has no template #panel");
        into.append(template.content.cloneNode(true));
        const parts = new Parts(into);
        this.#parts = parts;
        const ask: Ask = (command) => this.ask(command);
        this.#console = new Console(parts, (line) => void ask(line).catch((error) => this.#cannot(error)));
        this.#settings = new SettingsForm(parts, this.machine, ask, allowed.mayChange);
        this.#calibration = new Calibration(parts, this.machine, ask);
        this.#examples = new Examples(parts, this.machine, ask);
        this.#strip = parts.get("strip", SVGSVGElement);
        parts.button("hold", () => this.#session?.hold());
        parts.button("start", () => void ask("start").catch((error) => this.#say(error)));
        parts.button("clear", () => void ask("clear").catch((error) => this.#say(error)));
        parts.button("log-save", () => download("weeder-log.csv", this.#log.text(), "text/csv"));
        parts.button("log-clear", () => {
            this.#log = new Log();
            const { version, settings, examples } = this.machine;
            // So that what comes can be replayed by itself.
            if (version !== undefined) this.#log.add({ is: "connected", version, settings, examples }, this.#now);
        });
        this.machine.mayStart = allowed.mayStart;
        into.classList.toggle("may-not-start", !allowed.mayStart);
        into.classList.toggle("may-not-change", !allowed.mayChange);
        parts.html("limits").hidden = allowed.mayChange;
        parts.write("limits", limits(allowed));
        this.#wireTabs(
            name,
            TABS.filter((tab) => allowed.mayChange || tab !== "calibrate"),
        );
        this.#showConnected();
    }

    /** Talks to the machine at the other end of a wire from now on. */
    connect(wire: Wire, nowMs: number, resets: boolean): void {
        this.#now = nowMs;
        this.machine.lost = "Waiting for the machine to answer.";
        const session = new Session(wire, nowMs, resets);
        session.onHappening = (happening) => {
            if (session === this.#session) this.#take(happening);
        };
        this.#session = session;
    }

    /** Lets go of the machine. */
    async disconnect(): Promise<void> {
        await this.#session?.close();
        this.#session = undefined;
    }

    ask(command: string): Promise<string[]> {
        if (!this.#session) return Promise.reject(new NoMachine("no machine is connected"));
        return this.#session.ask(command);
    }

    /** Goes on, at the wire's time. */
    turn(nowMs: number): void {
        this.#now = nowMs;
        this.#session?.turn(nowMs);
    }

    /** Shows what has changed, and what moves. */
    show(): void {
        const { machine } = this;
        const parts = this.#parts;
        parts.root.dataset.state = machine.stateWord.replace(" ", "-");
        parts.write("state", machine.stateWord);
        parts.write("why", machine.why);
        parts.write("speed", machine.status ? (machine.status.speedMmS * 0.0036).toFixed(1) : "-");
        parts.write("tool", machine.version === undefined ? "-" : machine.toolOut ? "out" : "in the row");
        parts.write(
            "place",
            machine.status ? `${((machine.status.position * machine.tickMm) / 1000).toFixed(2)} m` : "-",
        );
        parts.write("windows", machine.status ? String(machine.status.windows) : "-");
        const trouble = machine.alarm ?? machine.warning;
        parts.html("alarm").hidden = trouble === undefined;
        parts.html("alarm").classList.toggle("warning", machine.alarm === undefined);
        parts.html("clear").hidden = machine.alarm === undefined;
        if (trouble !== undefined) {
            const { code, name, advice } = fault(trouble);
            parts.write("alarm-name", machine.alarm === undefined ? `Warning ${name}` : `Alarm ${code} ${name}`);
            parts.write("alarm-advice", sentence(advice));
        }
        drawStrip(this.#strip, machine, this.#now);
        this.#examples.show();
        this.#calibration.show();
        parts.write(
            "log-length",
            `${this.#log.length} lines${this.#log.isFull ? ": it is full, save it and begin anew" : ""}`,
        );
        this.#console.show();
    }

    #take(happening: Happening): void {
        this.machine.take(happening, this.#now);
        this.#log.add(happening, this.#now);
        switch (happening.is) {
            case "started":
                this.#console.add(happening.line, "happened");
                break;
            case "connected":
                this.#console.add(`connected to weeder ${happening.version}`, "happened");
                this.#parts.write("drive-said", "");
                this.#showConnected();
                this.#settings.show();
                this.#calibration.showSettings();
                this.#examples.showExamples();
                break;
            case "lost":
                this.#console.add(happening.why, "happened");
                this.#showConnected();
                break;
            case "settings":
            case "help":
                this.#settings.show();
                this.#calibration.showSettings();
                break;
            case "told":
                if (happening.said.is === "plot") break;
                if (happening.said.is === "calibrated") this.#calibration.take(happening.said);
                if (happening.said.is === "state") this.#parts.write("drive-said", "");
                this.#console.add(happening.line, happening.said.is === "alarm" ? "error" : "");
                break;
            case "command":
                this.#console.add(`> ${happening.line}`, "typed");
                break;
            case "answer":
                this.#console.add(happening.line, happening.line.startsWith("error:") ? "error" : "");
                break;
            default:
        }
        this.onHappening(happening);
    }

    /** Buttons work where a machine is there. */
    #showConnected(): void {
        const isThere = this.machine.version !== undefined;
        for (const button of this.#parts.root.querySelectorAll<HTMLButtonElement>("button.needs-machine"))
            button.disabled = !isThere;
    }

    /** What was typed could not be sent. */
    #cannot(error: unknown): void {
        if (error instanceof NoMachine) this.#console.add(error.message, "error");
    }

    #say(error: unknown): void {
        this.#parts.write("drive-said", sentence(error instanceof Error ? error.message : String(error)));
    }

    #wireTabs(name: string, tabs: readonly (typeof TABS)[number][]): void {
        const tab = (which: string) => this.#parts.get(`tab-${which}`, HTMLButtonElement);
        const body = (which: string) => this.#parts.html(`body-${which}`);
        const choose = (chosen: string) => {
            for (const which of tabs) {
                tab(which).ariaSelected = String(which === chosen);
                tab(which).tabIndex = which === chosen ? 0 : -1;
                body(which).hidden = which !== chosen;
            }
        };
        for (const which of TABS) {
            tab(which).hidden = body(which).hidden = !tabs.includes(which);
        }
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

/** What may be done from here, and where the rest may. */
function limits({ mayStart }: Allowed): string {
    return mayStart
        ? "From here the machine is watched, started and held. Settings, calibration and teaching are for the computer that has its port."
        : "From here the machine is watched and held. It is started, and its alarms are cleared, at the machine itself, or from here " +
              "where weeder serve was started with --allow-start. Settings, calibration and teaching are for the computer that has its port.";
}
