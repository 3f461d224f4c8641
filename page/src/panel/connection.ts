// The real Uno at the browser's serial port: buttons connect and disconnect it. After its cable was unplugged and
// plugged in again, it is connected automatically.

import { every, wait } from "../clock.ts";
import { type Parts, plain } from "../dom.ts";
import { choosePort, PortError, SerialLine, sessionOver, whyNoSerial } from "../link/serial.ts";
import { english, say, told } from "../words/words.ts";
import { sentence } from "./machine.ts";
import { type Panel, TURN_MS } from "./panel.ts";
import { Update } from "./update.ts";

const BAUD = 115_200;

/** How often a port is opened that is back, and the time between: another program may have it for some seconds. */
const TRIES = 10;
const AGAIN_MS = 1000;

/** Why a machine is not flashed. */
const AT_WORK = english("refusedAtWork");

export class Connection {
    /** Called after the port was closed, so that the operator can flash the machine. */
    onFlash: () => void = () => {};
    #port: SerialPort | undefined;
    #isOpen = false;
    #isBusy = false;
    /** Keeps a phone's screen on while a machine is connected. */
    #light: WakeLockSentinel | undefined;

    constructor(
        private readonly parts: Parts,
        private readonly panel: Panel,
    ) {
        parts.button("connect", () => void this.#attempt(() => this.#choose()));
        parts.button("disconnect", () => void this.disconnect());
        const why = whyNoSerial();
        parts.say("no-serial", () => told(why ?? ""));
        parts.get("connect", HTMLButtonElement).disabled = why !== undefined;
        if (why !== undefined) return;
        navigator.serial.addEventListener("connect", ({ target }) => {
            if (this.#port && !this.#isOpen && (target === this.#port || isAlike(target, this.#port)))
                void this.#comeBack(target as SerialPort);
        });
        const update = new Update(parts, panel, async () => {
            if (panel.machine.isAtWork) {
                this.#say(() => sentence(told(AT_WORK)));
                return;
            }
            await this.disconnect();
            this.onFlash();
        });
        panel.onHappening = (happening) => {
            update.take(happening);
            if (happening.is === "connected") this.#say(() => `weeder ${happening.version}`);
            if (happening.is !== "lost" || !happening.forGood) return;
            this.#isOpen = false;
            // Some ports are not there again for this page.
            const isGone = happening.why === english("portGone");
            this.#say(() => (isGone ? say("pressConnect", { connect: say("connect") }) : ""));
            this.#show();
        };
        // A hidden page has lost it.
        document.addEventListener("visibilitychange", () => void this.#stayLit());
        every(TURN_MS, () => panel.turn(performance.now()));
        this.#show();
    }

    /** Opens a port and talks to its machine: `isBack` if the operator has not chosen it again. */
    async connect(port: SerialPort, isBack = false): Promise<void> {
        while (this.#isBusy) {
            if (isBack) return;
            await wait(AGAIN_MS / 10);
        }
        this.#isBusy = true;
        await this.#attempt(async () => {
            // A browser may give the same machine another port.
            if (isBack && port !== this.#port) this.panel.mayBeOther = true;
            await this.disconnect();
            // Also where it does not open: its next cable is then noticed.
            this.#port = port;
            const line = await SerialLine.open(port, BAUD);
            // It was released meanwhile.
            if (this.#port !== port) return line.close();
            this.#isOpen = true;
            if (!isBack) this.panel.forget();
            const now = performance.now();
            this.panel.connect(sessionOver(line, now), now);
            this.#say(() => say("waitingForAnswer"));
        });
        this.#isBusy = false;
        this.#show();
    }

    /** Connects a port whose cable is back, unless the operator has chosen another one meanwhile. */
    async #comeBack(port: SerialPort): Promise<void> {
        for (let tries = 0; tries < TRIES; tries++) {
            await this.connect(port, true);
            if (!this.#isOpen) await wait(AGAIN_MS);
            if (this.#isOpen || this.#port !== port) return;
        }
    }

    async disconnect(): Promise<void> {
        this.#port = undefined;
        if (!this.#isOpen) return;
        this.#isOpen = false;
        await this.panel.disconnect();
        this.#show();
    }

    /** Closes a port that is to be flashed. Throws a PortError if its machine is at work. */
    async release(port: SerialPort): Promise<void> {
        if (port !== this.#port) return;
        if (this.panel.machine.isAtWork) throw new PortError(AT_WORK);
        await this.disconnect();
    }

    async #stayLit(): Promise<void> {
        await this.#light?.release();
        // A device without this function, or with little power left, may switch the screen off.
        this.#light = this.#isOpen ? await navigator.wakeLock?.request("screen").catch(() => undefined) : undefined;
    }

    async #choose(): Promise<void> {
        this.#say(() => "");
        const port = await choosePort();
        if (port) await this.connect(port);
        else this.#say(() => told(english("noPort")));
    }

    async #attempt(work: () => Promise<void>): Promise<void> {
        await work().catch((error) => {
            if (!(error instanceof PortError)) throw error;
            this.#say(() => say("notConnected", { why: told(error) }));
        });
    }

    #say(text: () => string): void {
        // The same text again would be read out again.
        if (this.parts.html("connection-said").textContent !== plain(text())) this.parts.say("connection-said", text);
    }

    #show(): void {
        void this.#stayLit();
        this.parts.html("connect").hidden = this.#isOpen;
        this.parts.html("connect-hint").hidden = this.#isOpen;
        this.parts.html("disconnect").hidden = !this.#isOpen;
    }
}

/** Whether two ports have the same kind of board. A browser may give a port that was unplugged another object. */
function isAlike(one: EventTarget | null, other: SerialPort): boolean {
    if (!one || !("getInfo" in one)) return false;
    const [a, b] = [(one as SerialPort).getInfo(), other.getInfo()];
    return a.usbVendorId !== undefined && a.usbVendorId === b.usbVendorId && a.usbProductId === b.usbProductId;
}
