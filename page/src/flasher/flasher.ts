// Flashing, for the operator: a board, a button, the progress, and the result.

import { download, type Parts } from "../dom.ts";
import { choosePort, PortError, SerialLine, whyNoSerial } from "../link/serial.ts";
import { sentence } from "../panel/machine.ts";
import { chosen, keep } from "../preferences.ts";
import { FLASH_BYTES } from "../uno/chip.ts";
import { readHex, usedBytes } from "../uno/hex.ts";
import { english, quantity, say, show, told } from "../words/words.ts";
import { BOARDS, type Board, Bootloader, FlashError, PAGE_BYTES, type Progress } from "./stk500.ts";

const PHASES = { waiting: "phaseWaiting", writing: "phaseWriting", verifying: "phaseVerifying" } as const;

export class Flasher {
    /** Called before a port is opened for flashing. The owner of the port must close it. */
    onBegin: (port: SerialPort) => Promise<void> = async () => {};
    /** The operator wants to work with the board that was just flashed. */
    onWork: (port: SerialPort) => void = () => {};
    readonly #image: Uint8Array;
    #flashed: SerialPort | undefined;
    #isBusy = false;
    /** Whether the tab was hidden since the button was pressed. */
    #wasHidden = false;

    constructor(
        private readonly parts: Parts,
        hex: string,
    ) {
        const flash = readHex(hex, FLASH_BYTES);
        // Whole pages: the rest of the last one is erased.
        this.#image = flash.subarray(0, Math.ceil(usedBytes(flash) / PAGE_BYTES) * PAGE_BYTES);
        parts.say("size", () => say("flashSize", { count: usedBytes(flash) }));
        const choice = parts.get("board", HTMLSelectElement);
        for (const { id, name } of BOARDS) {
            const option = new Option("", id);
            show(option, () => name ?? say("oldBoard"));
            choice.append(option);
        }
        const last = BOARDS.find(({ id }) => id === chosen("board"));
        if (last) choice.value = last.id;
        const warn = () => {
            const board = BOARDS[choice.selectedIndex];
            parts.say("board-said", () => (board?.isOld ? say("oldBootloader") : ""));
        };
        warn();
        choice.addEventListener("change", () => {
            keep("board", choice.value);
            warn();
        });
        parts.button("hex", () => download(new File([hex], "weeder.hex", { type: "text/plain" })));
        parts.button("to-work", () => this.#flashed && this.onWork(this.#flashed));
        const why = whyNoSerial();
        const start = parts.button("flash", () => void this.#start(BOARDS[choice.selectedIndex]));
        start.disabled = why !== undefined;
        parts.say("no-serial", () => told(why ?? ""));
        globalThis.addEventListener("beforeunload", (event) => {
            if (this.#isBusy) event.preventDefault();
        });
        document.addEventListener("visibilitychange", () => {
            this.#wasHidden ||= document.hidden;
        });
    }

    async #start(board: Board | undefined): Promise<void> {
        if (!board || this.#isBusy) return;
        this.#isBusy = true;
        const flash = this.parts.get("flash", HTMLButtonElement);
        // It keeps the focus.
        flash.ariaDisabled = "true";
        this.parts.html("to-work").hidden = true;
        this.#say("", () => "");
        try {
            const port = await choosePort();
            if (!port) {
                this.#say("failed", () => told(english("noPort")));
                return;
            }
            this.#wasHidden = document.hidden;
            await this.onBegin(port);
            const startedMs = performance.now();
            await this.#flash(port, board);
            const seconds = (performance.now() - startedMs) / 1000;
            this.#flashed = port;
            this.#say("done", () =>
                say("flashed", { count: this.#image.length, time: quantity(seconds, "second", 1) }),
            );
            this.parts.html("to-work").hidden = false;
        } catch (error) {
            const wasHidden = this.#wasHidden;
            this.#say("failed", () => {
                const why = sentence(say("notFlashed", { why: told(error) }));
                return wasHidden ? `${why} ${say("wasHidden")}` : why;
            });
            if (!(error instanceof PortError || error instanceof FlashError)) throw error;
        } finally {
            this.#isBusy = false;
            flash.ariaDisabled = null;
            this.parts.html("progress").hidden = true;
        }
    }

    async #flash(port: SerialPort, board: Board): Promise<void> {
        if (this.#image.length > board.roomBytes)
            throw new FlashError(english("tooLarge", { bytes: this.#image.length, room: board.roomBytes }));
        const line = await SerialLine.open(port, board.baud);
        let share = 0;
        try {
            await new Bootloader(line, board).flash(this.#image, (progress) => {
                share = progress.share;
                this.#show(progress);
            });
        } catch (error) {
            if (error instanceof PortError && share > 0)
                throw new PortError(english("goneMidway", { why: error.message }));
            throw error;
        } finally {
            await line.close();
        }
    }

    #show({ phase, share }: Progress): void {
        const bar = this.parts.get("bar", HTMLProgressElement);
        this.parts.html("progress").hidden = false;
        if (phase === "waiting") bar.removeAttribute("value");
        else bar.value = share;
        this.parts.write("phase", say(PHASES[phase], { share: quantity(share * 100, "percent") }));
    }

    #say(kind: "done" | "failed" | "", text: () => string): void {
        const said = this.parts.html("flash-said");
        said.className = kind;
        show(said, () => (text() === "" ? "" : sentence(text())));
    }
}
