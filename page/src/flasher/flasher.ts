// Flashing, as the operator sees it: a board, a button, how far it is, and what came of it.

import { download, Parts } from "../dom.ts";
import { choosePort, NO_PORT_CHOSEN, PortError, SerialLine, whyNoSerial } from "../link/serial.ts";
import { FLASH_BYTES } from "../uno/chip.ts";
import { readHex, usedBytes } from "../uno/hex.ts";
import { BOARDS, type Board } from "./boards.ts";
import { Bootloader, FlashError, PAGE_BYTES, type Progress } from "./stk500.ts";

const PHASES: Readonly<Record<Progress["phase"], string>> = {
    waiting: "Waiting for the bootloader",
    writing: "Writing",
    verifying: "Reading it back",
};

export class Flasher {
    /** Called before a port is opened for flashing: whoever has it lets go of it. */
    onBegin: (port: SerialPort) => Promise<void> = async () => {};
    /** The operator wants to work with the board that was just flashed. */
    onWork: (port: SerialPort) => void = () => {};
    readonly #parts: Parts;
    readonly #image: Uint8Array;
    #flashed: SerialPort | undefined;
    #isBusy = false;

    constructor(root: HTMLElement, hex: string) {
        const parts = new Parts(root);
        this.#parts = parts;
        const flash = readHex(hex, FLASH_BYTES);
        // Whole pages: the rest of the last one is erased.
        this.#image = flash.subarray(0, Math.ceil(usedBytes(flash) / PAGE_BYTES) * PAGE_BYTES);
        parts.write("size", `The firmware takes ${usedBytes(flash)} bytes.`);
        const choice = parts.get("board", HTMLSelectElement);
        choice.append(...BOARDS.map(({ id, name }) => new Option(name, id)));
        parts.button("hex", () => download("weeder.hex", hex, "text/plain"));
        parts.button("to-work", () => this.#flashed && this.onWork(this.#flashed));
        const why = whyNoSerial();
        const start = parts.button("flash", () => void this.#start(choice.value));
        start.disabled = why !== undefined;
        parts.html("no-serial").hidden = why === undefined;
        parts.write("no-serial", why ?? "");
        globalThis.addEventListener("beforeunload", (event) => {
            if (this.#isBusy) event.preventDefault();
        });
    }

    async #start(id: string): Promise<void> {
        const board = BOARDS.find((board) => board.id === id);
        if (!board || this.#isBusy) return;
        this.#isBusy = true;
        const flash = this.#parts.get("flash", HTMLButtonElement);
        flash.disabled = true;
        this.#parts.html("to-work").hidden = true;
        this.#say("", "");
        try {
            const port = await choosePort();
            if (!port) {
                this.#say("failed", NO_PORT_CHOSEN);
                return;
            }
            await this.onBegin(port);
            const startedMs = performance.now();
            await this.#flash(port, board);
            const seconds = ((performance.now() - startedMs) / 1000).toFixed(1);
            this.#flashed = port;
            this.#say(
                "done",
                `Done: ${this.#image.length} bytes were written and read back in ${seconds} s.${board.isOld ? OLD : ""}`,
            );
            this.#parts.html("to-work").hidden = false;
        } catch (error) {
            this.#say("failed", `Not flashed: ${error instanceof Error ? error.message : error}.`);
            if (!(error instanceof PortError || error instanceof FlashError)) throw error;
        } finally {
            this.#isBusy = false;
            flash.disabled = false;
            this.#parts.html("progress").hidden = true;
        }
    }

    async #flash(port: SerialPort, board: Board): Promise<void> {
        if (this.#image.length > board.roomBytes)
            throw new FlashError(
                `the firmware takes ${this.#image.length} bytes, and this board's bootloader leaves ${board.roomBytes}: ` +
                    "give it the Uno's bootloader, which is smaller",
            );
        const line = await SerialLine.open(port, board.baud);
        let share = 0;
        try {
            await new Bootloader(line, board).flash(this.#image, (progress) => {
                share = progress.share;
                this.#show(progress);
            });
        } catch (error) {
            if (error instanceof PortError && share > 0)
                throw new PortError(
                    `${error.message}, and flash it again: half a firmware does not run, and the bootloader is still there`,
                );
            throw error;
        } finally {
            await line.close();
        }
    }

    #show({ phase, share }: Progress): void {
        const bar = this.#parts.get("bar", HTMLProgressElement);
        this.#parts.html("progress").hidden = false;
        if (phase === "waiting") bar.removeAttribute("value");
        else bar.value = share;
        this.#parts.write(
            "phase",
            phase === "waiting" ? PHASES[phase] : `${PHASES[phase]}: ${Math.round(share * 100)} %`,
        );
    }

    #say(kind: "done" | "failed" | "", text: string): void {
        const said = this.#parts.html("flash-said");
        said.className = kind;
        // Commands stand between backticks where they are printed.
        said.textContent = text.replaceAll("`", "").replace(/\.\.$/, ".");
    }
}

/** What the old bootloader cannot do. */
const OLD =
    " Behind this bootloader the machine does not come back by itself where its watchdog has had to stop it: the tool has no " +
    "signal until power is taken away and given back. Optiboot, which Arduino's IDE can burn, has no such fault.";
