// Serial ports for the page: a replacement of `navigator.serial`, and the devices at their other ends.
//
// The page's side behaves as Chromium's: one opening at a time, streams that fail when the device is lost, and
// `readable` null from then on. Its bytes go through the browser's driver to a device in this process: the virtual
// Uno's pseudo terminal, or a device that is no Uno.

import { type ChildProcess, spawn } from "node:child_process";
import { closeSync, constants, existsSync, mkdtempSync, openSync, readSync, rmSync, writeSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { TestContext } from "node:test";
import { setTimeout as wait } from "node:timers/promises";
import type { Page } from "playwright";
import { WEEDER } from "./weeder.ts";

/** The device at the other end of a port. */
export interface Device {
    /** Why it cannot be opened: the browser's error, by name and message. */
    readonly refuses?: { name: string; message: string };
    open(): void;
    /** The modem lines were released and set again: this resets an Uno. */
    reset(): void;
    write(bytes: Uint8Array): void;
    /** The input since the last call; undefined if the device is gone. */
    read(): Uint8Array | undefined;
    close(): void;
}

/** Time between two reads of a device. */
const LOOK_MS = 2;

/** The virtual Uno, `weeder virtual-uno`, at its pseudo terminal. */
export class VirtualUno implements Device {
    readonly path: string;
    refuses?: { name: string; message: string };
    /** Number of bytes from the page after which the cable is unplugged. */
    pullAfterBytes = Number.POSITIVE_INFINITY;
    /** Indices of bytes that are lost on their way to it. */
    loseBytes: number[] = [];
    #written = 0;
    readonly #folder: string;
    readonly #process: ChildProcess;
    #fd: number | undefined;
    #isPulled = false;

    private constructor(folder: string, process: ChildProcess) {
        this.#folder = folder;
        this.#process = process;
        this.path = join(folder, "uno");
    }

    /** Starts one for a test, with further options. It stops at the test's end. */
    static async start(test: TestContext, ...options: string[]): Promise<VirtualUno> {
        const folder = mkdtempSync(join(tmpdir(), "weeder-page-"));
        const child = spawn(WEEDER, ["virtual-uno", "--link", join(folder, "uno"), ...options], {
            stdio: ["pipe", "ignore", "pipe"],
        });
        let said = "";
        child.stderr?.on("data", (text) => {
            said += text;
        });
        const uno = new VirtualUno(folder, child);
        test.after(() => uno.#stop());
        for (let waited = 0; !existsSync(uno.path); waited += 50) {
            if (child.exitCode !== null || waited > 60_000) throw new Error(`the virtual Uno does not start: ${said}`);
            await wait(50);
        }
        return uno;
    }

    /** Types a line in the terminal where it was started. */
    type(line: string): void {
        this.#process.stdin?.write(`${line}\n`);
    }

    open(): void {
        this.#fd = openSync(this.path, constants.O_RDWR | constants.O_NOCTTY | constants.O_NONBLOCK);
    }

    reset(): void {
        // A pseudo terminal has no modem lines: opening it resets the Uno.
        this.close();
        this.open();
    }

    write(bytes: Uint8Array): void {
        const before = this.#written;
        this.#written += bytes.length;
        if (this.#written > this.pullAfterBytes) this.pull();
        const lost = this.loseBytes.filter((place) => place < this.#written);
        this.loseBytes = this.loseBytes.filter((place) => place >= this.#written);
        const kept = bytes.filter((_, index) => !lost.includes(before + index));
        if (this.#fd !== undefined) writeSync(this.#fd, kept);
    }

    read(): Uint8Array | undefined {
        if (this.#isPulled) return undefined;
        const buffer = new Uint8Array(4096);
        try {
            return buffer.subarray(0, this.#fd === undefined ? 0 : readSync(this.#fd, buffer));
        } catch (error) {
            if ((error as NodeJS.ErrnoException).code === "EAGAIN") return new Uint8Array();
            throw error;
        }
    }

    close(): void {
        if (this.#fd !== undefined) closeSync(this.#fd);
        this.#fd = undefined;
    }

    /** Has it stand still, or go on. */
    pause(isPaused: boolean): void {
        this.#process.kill(isPaused ? "SIGSTOP" : "SIGCONT");
    }

    /** Pulls its cable. */
    pull(): void {
        this.#isPulled = true;
        this.close();
    }

    /** Plugs it in again. */
    plugIn(): void {
        this.#isPulled = false;
        this.pullAfterBytes = Number.POSITIVE_INFINITY;
    }

    /** Loses these of the bytes on their way to it, counted from the next one. */
    lose(...places: number[]): void {
        this.loseBytes = places.map((place) => this.#written + place);
    }

    async #stop(): Promise<void> {
        this.close();
        if (this.#process.exitCode === null) {
            const ended = new Promise((done) => this.#process.once("exit", done));
            this.pause(false);
            this.#process.kill();
            await ended;
        }
        rmSync(this.#folder, { recursive: true });
    }
}

/** A device that is no Uno: it answers with its own bytes, and sends others by itself. */
export class Foreign implements Device {
    readonly refuses?: { name: string; message: string };
    readonly #answer: (bytes: Uint8Array) => number[];
    readonly #babble: string;
    #waiting: number[] = [];

    constructor(answer: (bytes: Uint8Array) => number[], babble = "", refuses?: { name: string; message: string }) {
        this.#answer = answer;
        this.#babble = babble;
        if (refuses) this.refuses = refuses;
    }

    open(): void {}
    reset(): void {}
    close(): void {}

    write(bytes: Uint8Array): void {
        this.#waiting.push(...this.#answer(bytes), ...Buffer.from(this.#babble));
    }

    read(): Uint8Array {
        return Uint8Array.from(this.#waiting.splice(0));
    }
}

/** Replaces `navigator.serial` by ports with these devices, which the operator chooses one after the other. */
export async function offerPorts(page: Page, devices: Device[]): Promise<void> {
    const device = (index: number) => {
        const device = devices[index];
        if (!device) throw new Error(`there is no port ${index}`);
        return device;
    };
    const openings = devices.map(() => 0);
    await page.exposeFunction("deviceOpen", (index: number) => {
        const { refuses } = device(index);
        openings[index] = (openings[index] ?? 0) + 1;
        if (!refuses) device(index).open();
        return refuses;
    });
    await page.exposeFunction("deviceReset", (index: number) => device(index).reset());
    await page.exposeFunction("deviceClose", (index: number) => device(index).close());
    await page.exposeFunction("deviceWrite", (index: number, bytes: number[]) =>
        device(index).write(Uint8Array.from(bytes)),
    );
    // Waits some time for input; null if the device is gone. What comes after another opening is for that.
    await page.exposeFunction("deviceRead", async (index: number) => {
        const opening = openings[index];
        for (let looks = 0; ; looks++) {
            if (openings[index] !== opening) return [];
            const bytes = device(index).read();
            if (!bytes) return null;
            if (bytes.length > 0 || looks > 50) return [...bytes];
            await wait(LOOK_MS);
        }
    });
    await page.addInitScript(putPorts, devices.length);
}

/** The functions that `exposeFunction` adds to the page. */
interface Bridge {
    deviceOpen(index: number): Promise<{ name: string; message: string } | undefined>;
    deviceReset(index: number): Promise<void>;
    deviceClose(index: number): Promise<void>;
    deviceWrite(index: number, bytes: number[]): Promise<void>;
    deviceRead(index: number): Promise<number[] | null>;
}

/** Runs in the page before its own code. It is sent there as text, so it uses nothing from outside. */
function putPorts(count: number): void {
    const bridge = globalThis as unknown as Bridge;

    class Port extends EventTarget {
        readable: ReadableStream<Uint8Array> | null = null;
        writable: WritableStream<Uint8Array> | null = null;
        #isOpen = false;
        #lines = false;
        readonly #index: number;

        constructor(index: number) {
            super();
            this.#index = index;
        }

        getInfo() {
            return { usbVendorId: 0x2341, usbProductId: 0x43 };
        }

        async open({ baudRate }: { baudRate: number }) {
            if (!(baudRate > 0)) throw new TypeError("Requested baud rate must be greater than zero");
            if (this.#isOpen) throw new DOMException("The port is already open.", "InvalidStateError");
            const refuses = await bridge.deviceOpen(this.#index);
            if (refuses) throw new DOMException(refuses.message, refuses.name);
            this.#isOpen = true;
            this.#listen();
            this.#write();
        }

        #write() {
            this.writable = new WritableStream({
                write: async (bytes) => {
                    if (!this.#isOpen) throw new DOMException("The device has been lost.", "NetworkError");
                    await bridge.deviceWrite(this.#index, [...bytes]);
                },
                // It has another stream then.
                abort: () => {
                    if (this.#isOpen) this.#write();
                },
            });
        }

        #listen() {
            const stream = new ReadableStream<Uint8Array>({
                pull: async (controller) => {
                    for (;;) {
                        const bytes = await bridge.deviceRead(this.#index);
                        if (this.readable !== stream) return;
                        if (bytes === null) {
                            this.#isOpen = false;
                            this.readable = null;
                            this.writable = null;
                            controller.error(new DOMException("The device has been lost.", "NetworkError"));
                            return;
                        }
                        if (bytes.length === 0) continue;
                        controller.enqueue(Uint8Array.from(bytes));
                        return;
                    }
                },
                cancel: () => {
                    if (this.#isOpen) this.#listen();
                },
            });
            this.readable = stream;
        }

        async setSignals({ dataTerminalReady = false }) {
            if (!this.#isOpen) throw new DOMException("The port is closed.", "InvalidStateError");
            if (dataTerminalReady && !this.#lines) await bridge.deviceReset(this.#index);
            this.#lines = dataTerminalReady;
        }

        async close() {
            if (this.readable?.locked || this.writable?.locked) throw new TypeError("Cannot close a locked stream");
            this.#isOpen = false;
            this.readable = null;
            this.writable = null;
            await bridge.deviceClose(this.#index);
        }
    }

    class Ports extends EventTarget {
        readonly ports = Array.from({ length: count }, (_, index) => new Port(index));
        /** How often the operator has chosen. */
        chosen = 0;

        async requestPort() {
            const port = this.ports[this.chosen++ % (count || 1)];
            if (!port) throw new DOMException("No port selected by the user.", "NotFoundError");
            return port;
        }
    }

    Object.defineProperty(navigator, "serial", { value: new Ports() });
}
