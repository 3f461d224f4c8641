// A serial port of the browser (Web Serial), as a line of bytes: open, listen, write, reset the Uno, close.
//
// Every error has its cause and what to do. The browser does not distinguish a busy port from one without permission,
// so the message names both. Garbled input is lost, and does not end the line. A pulled cable does.

import { wait } from "../clock.ts";
import { english } from "../words/words.ts";
import { isServed } from "./served.ts";
import { Session } from "./session.ts";

export class PortError extends Error {}

/** How long DTR and RTS are released, so that the board's capacitor sees an edge, and the wait after it. */
const RESET_MS = 250;
const AFTER_RESET_MS = 50;

/** Why this browser offers no serial port here, and the alternative; undefined if it does. */
export function whyNoSerial(): string | undefined {
    if (isServed()) return english("noSerialServed");
    if (globalThis.isSecureContext === false) return english("noSerialHttp");
    // On Android it lists Bluetooth devices only.
    if (!("serial" in navigator) || /Android/.test(navigator.userAgent)) return english("noSerial");
    return undefined;
}

/** Asks the operator for a port; undefined if none was chosen. */
export async function choosePort(): Promise<SerialPort | undefined> {
    try {
        return await navigator.serial.requestPort();
    } catch (error) {
        if (error instanceof DOMException && error.name === "NotFoundError") return undefined;
        if (error instanceof DOMException && error.name === "SecurityError")
            throw new PortError(english("portForbidden"));
        throw error;
    }
}

/** The name of this page's lock while it has a port open, so that the browser's other tabs can say so. */
const LOCKS = "weeder-port-";
const LOCK = LOCKS + Math.random();

/** Whether another tab of this page has a port open. False where the browser does not tell. */
async function isInOtherTab(): Promise<boolean> {
    const { held = [] } = (await navigator.locks?.query().catch(() => undefined)) ?? {};
    return held.some(({ name = "" }) => name.startsWith(LOCKS) && name !== LOCK);
}

async function whyNotOpened(error: unknown): Promise<PortError> {
    const { name, message } = error instanceof Error ? error : { name: "", message: String(error) };
    if (name === "InvalidStateError") return new PortError(english("portOpen"));
    if (name !== "NetworkError") return new PortError(english("portRefused", { text: message }));
    if (await isInOtherTab()) return new PortError(english("portInTab"));
    const isLinux = /Linux/.test(navigator.userAgent);
    return new PortError(english("portTaken", { or: english(isLinux ? "noPermission" : "driverHangs") }));
}

/** Errors of a lost line are known by its reads. */
const ignore = () => {};

export class SerialLine {
    onBytes: (bytes: Uint8Array) => void = () => {};
    /** The line is gone, and why; never called after `close`. */
    onEnd: (why: PortError) => void = () => {};
    #writer: Promise<WritableStreamDefaultWriter<Uint8Array>>;
    readonly #listening: Promise<void>;
    #reader: ReadableStreamDefaultReader<Uint8Array> | undefined;
    #isClosing = false;
    #closed: Promise<void> | undefined;
    #unlock = () => {};

    /** Opens a port. Throws a PortError. */
    static async open(port: SerialPort, baudRate: number): Promise<SerialLine> {
        try {
            await port.open({ baudRate, bufferSize: 4096 });
        } catch (error) {
            throw await whyNotOpened(error);
        }
        return new SerialLine(port);
    }

    private constructor(private readonly port: SerialPort) {
        if (!port.writable) throw new PortError(english("portGone"));
        const isOver = new Promise<void>((done) => {
            this.#unlock = done;
        });
        void navigator.locks?.request(LOCK, { mode: "shared" }, () => isOver).catch(() => {});
        this.#writer = Promise.resolve(port.writable.getWriter());
        this.#listening = this.#listen();
    }

    /** Writes bytes, after earlier ones. Throws a PortError if the line is gone, or the bytes were discarded. */
    async write(bytes: Uint8Array): Promise<void> {
        const writer = this.#writer;
        try {
            await (await writer).write(bytes);
        } catch {
            if (writer === this.#writer) this.#lose();
            throw new PortError(english("portGone"));
        }
    }

    /** Discards the bytes that have not left this computer yet, as a stalled port keeps them. Later ones come behind that. */
    discard(): void {
        this.#writer = this.#writer.then(async (writer) => {
            await writer.abort().catch(ignore);
            writer.releaseLock();
            // The port has another stream then. A lost port has none.
            if (!this.port.writable) throw new PortError(english("portGone"));
            return this.port.writable.getWriter();
        });
        // The next byte reports it.
        this.#writer.catch(ignore);
    }

    /** Resets the board, as opening its port does: its bootloader runs then. */
    async reset(): Promise<void> {
        const set = async (level: boolean) =>
            // A port without these lines, such as a pseudo terminal, must be reset by hand.
            this.port.setSignals({ dataTerminalReady: level, requestToSend: level }).catch(() => {});
        await set(false);
        await wait(RESET_MS);
        await set(true);
        await wait(AFTER_RESET_MS);
    }

    /** Closes the port, so that it can be opened again. */
    close(): Promise<void> {
        this.#closed ??= this.#close();
        return this.#closed;
    }

    async #close(): Promise<void> {
        this.#isClosing = true;
        await this.#reader?.cancel().catch(ignore);
        await this.#listening;
        await this.#writer.then((writer) => writer.releaseLock(), ignore);
        await this.port.close().catch(ignore);
        this.#unlock();
    }

    async #listen(): Promise<void> {
        // A framing error ends a stream, and the port then has another one. A lost port has none.
        while (this.port.readable && !this.#isClosing) {
            const reader: ReadableStreamDefaultReader<Uint8Array> = this.port.readable.getReader();
            this.#reader = reader;
            try {
                for (;;) {
                    const { value, done } = await reader.read();
                    if (done) break;
                    this.onBytes(value);
                }
            } catch {
                // Reported by `readable`, as above.
            } finally {
                reader.releaseLock();
                this.#reader = undefined;
            }
        }
        if (!this.#isClosing) this.#lose();
    }

    #lose(): void {
        if (this.#isClosing) return;
        this.#isClosing = true;
        this.onEnd(new PortError(english("portGone")));
    }
}

export function sessionOver(line: SerialLine, now: number): Session {
    const encoder = new TextEncoder();
    // A lost line has reported its error.
    const send = (text: string) => void line.write(encoder.encode(text)).catch(() => {});
    const wire = { send, discard: () => line.discard(), close: () => line.close() };
    const session = new Session(wire, now, true, Date.now);
    // A byte is one character: the input may be noise, which is no valid UTF-8.
    line.onBytes = (bytes) => session.receive(String.fromCharCode(...bytes));
    line.onEnd = ({ message }) => session.end(message);
    return session;
}
