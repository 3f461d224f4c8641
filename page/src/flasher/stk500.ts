// The protocol of the Uno's bootloader: the parts of STK500 version 1 for flashing (Atmel's application note AVR061).
//
// A command ends with CRC_EOP. Its answer begins with INSYNC and ends with OK. The bootloader listens for a second or
// two after a reset. Addresses are in words. Optiboot and its predecessor erase each page before they write it.

import { wait } from "../clock.ts";
import type { PortError, SerialLine } from "../link/serial.ts";
import { english } from "../words/words.ts";

/**
 * The boards that can be flashed. They differ in their bootloader alone: its rate in bits a second, the flash that
 * remains for the firmware, of 32 KiB, and whether it is the one before optiboot, whose board's name is a text.
 */
export const BOARDS = [
    { id: "uno", name: "Arduino Uno", baud: 115_200, roomBytes: 32_256, isOld: false },
    { id: "nano", name: "Arduino Nano", baud: 115_200, roomBytes: 30_720, isOld: false },
    { id: "old", baud: 57_600, roomBytes: 30_720, isOld: true },
];
export type Board = (typeof BOARDS)[number];

/** An error of flashing, and what to do. */
export class FlashError extends Error {}

export interface Progress {
    readonly phase: "waiting" | "writing" | "verifying";
    /** From 0 to 1. */
    readonly share: number;
}

const CRC_EOP = 0x20;
const INSYNC = 0x14;
const OK = 0x10;
const GET_SYNC = 0x30;
const ENTER_PROGRAMMING = 0x50;
const LEAVE_PROGRAMMING = 0x51;
const LOAD_ADDRESS = 0x55;
const PROGRAM_PAGE = 0x64;
const READ_PAGE = 0x74;
const READ_SIGNATURE = 0x75;
const FLASH = "F".charCodeAt(0);

/** Bytes of a page of flash (data sheet, table 27-13). */
export const PAGE_BYTES = 128;

/** A first page that jumps to itself (rjmp .-2): the bootloader starts at address 0. */
const STANDSTILL = new Uint8Array(PAGE_BYTES).fill(0xff).fill(0xcf, 1, 2);

/** The signature of an ATmega328P, and of compatible chips. */
const SIGNATURE = "1e950f";
const OTHERS: Readonly<Record<string, string>> = {
    "1e9514": "ATmega328",
    "1e9516": "ATmega328PB",
    "1e9406": "ATmega168",
    "1e940b": "ATmega168P",
    "1e9587": "ATmega32U4 (Leonardo, Micro)",
    "1e9801": "ATmega2560 (Mega)",
};

/** Timeout of an answer: a page is written in 10 ms, and sent in 27 at 57600 baud. */
const ANSWER_MS = 1000;
/** Time between two sync commands, and their number after a reset: the old bootloader first blinks for a second. */
const CALL_MS = 150;
const CALLS = 12;
/** The most resets of the board, and tries of a page. */
const RESETS = 2;
const TRIES = 3;

export class Bootloader {
    #received: number[] = [];
    #gone: PortError | undefined;
    #arrived = () => {};

    constructor(
        private readonly line: SerialLine,
        private readonly board: Board,
    ) {
        line.onBytes = (bytes) => {
            // Another device may send without end: limits the buffer.
            if (this.#received.length < 4096) this.#received.push(...bytes);
            this.#arrived();
        };
        line.onEnd = (why) => {
            this.#gone = why;
            this.#arrived();
        };
    }

    /**
     * Writes a firmware and reads it back. Its first page is written last, so that a part of it never runs. Throws a
     * FlashError, or a PortError if the line is gone.
     */
    async flash(image: Uint8Array, onProgress: (progress: Progress) => void): Promise<void> {
        onProgress({ phase: "waiting", share: 0 });
        await this.#call();
        await this.#expectChip();
        await this.#command([ENTER_PROGRAMMING], 0);
        const pageAt = (at: number) => ({ at, page: image.subarray(at, at + PAGE_BYTES) });
        const writes: ReturnType<typeof pageAt>[] = [{ at: 0, page: STANDSTILL }];
        for (let at = PAGE_BYTES; at < image.length; at += PAGE_BYTES) writes.push(pageAt(at));
        writes.push(pageAt(0));
        for (const [done, { at, page }] of writes.entries()) {
            onProgress({ phase: "writing", share: done / writes.length });
            await this.#onPage(at, [PROGRAM_PAGE, 0, page.length, FLASH, ...page], 0);
        }
        for (let at = 0; at < image.length; at += PAGE_BYTES) {
            onProgress({ phase: "verifying", share: at / image.length });
            const { page } = pageAt(at);
            const found = await this.#onPage(at, [READ_PAGE, 0, page.length, FLASH], page.length);
            const wrong = page.findIndex((byte, index) => byte !== found[index]);
            if (wrong >= 0)
                throw new FlashError(
                    english("readsBack", { at: at + wrong, found: found[wrong] ?? "", written: page[wrong] ?? "" }),
                );
        }
        onProgress({ phase: "verifying", share: 1 });
        await this.#command([LEAVE_PROGRAMMING], 0);
    }

    /** Resets the board until its bootloader answers. */
    async #call(): Promise<void> {
        const heard: number[] = [];
        for (let reset = 0; reset < RESETS; reset++) {
            this.#received = [];
            await this.line.reset();
            for (let call = 0; call < CALLS; call++) {
                heard.push(...this.#received);
                if ((await this.#hears(heard)) && (await this.#isQuiet()) && (await this.#hears(heard))) return;
            }
        }
        throw new FlashError(this.#whoIsThere(String.fromCharCode(...heard, ...this.#received)));
    }

    /** Whether the bootloader answers a sync command. Other input is added to `heard`. */
    async #hears(heard: number[]): Promise<boolean> {
        this.#received = [];
        await this.line.write(Uint8Array.of(GET_SYNC, CRC_EOP));
        const answer = await this.#take(2, CALL_MS);
        if (answer?.[0] === INSYNC && answer[1] === OK) return true;
        heard.push(...(answer ?? []));
        return false;
    }

    /** Waits for the answers of all previous sync commands. Returns false if the input does not end. */
    async #isQuiet(): Promise<boolean> {
        for (let waits = 0; waits < CALLS; waits++) {
            this.#received = [];
            await wait(CALL_MS);
            if (this.#received.length === 0) return true;
        }
        return false;
    }

    /** Sends a command for the page at an address, as `#command`. Repeats it after a lost byte. */
    async #onPage(at: number, bytes: number[], answerBytes: number): Promise<number[]> {
        const words = at / 2;
        for (let tries = 1; ; tries++)
            try {
                await this.#command([LOAD_ADDRESS, words % 256, Math.floor(words / 256)], 0);
                return await this.#command(bytes, answerBytes);
            } catch (error) {
                if (!(error instanceof FlashError) || tries === TRIES) throw error;
                // Optiboot starts the firmware after an invalid command.
                await this.#call();
                await this.#command([ENTER_PROGRAMMING], 0);
            }
    }

    /** Why no bootloader answered, and what to do. */
    #whoIsThere(heard: string): string {
        const { baud, isOld } = this.board;
        const other = english(isOld ? "otherIsUno" : "otherIsOld");
        const text = heard.replaceAll(/[^ -~]+/g, " ").trim();
        if (text.includes("weeder ")) return english("firmwareAnswers", { other });
        if (text.length > 8 && text.length * 2 > heard.length)
            return english("deviceAnswers", { text: text.slice(0, 60), other });
        return english("noBootloader", { baud, other });
    }

    async #expectChip(): Promise<void> {
        const signature = await this.#command([READ_SIGNATURE], 3);
        const found = signature.map((byte) => byte.toString(16).padStart(2, "0")).join("");
        if (found === SIGNATURE) return;
        throw new FlashError(english("otherChip", { chip: OTHERS[found] ?? found }));
    }

    /** Sends a command and returns the data of its answer. */
    async #command(bytes: number[], answerBytes: number): Promise<number[]> {
        this.#received = [];
        await this.line.write(Uint8Array.of(...bytes, CRC_EOP));
        const answer = await this.#take(answerBytes + 2, ANSWER_MS);
        if (answer?.[0] === INSYNC && answer.at(-1) === OK) return answer.slice(1, -1);
        throw new FlashError(english("fellSilent"));
    }

    /** The next bytes; undefined if they do not come in time. */
    async #take(count: number, ms: number): Promise<number[] | undefined> {
        const by = performance.now() + ms;
        for (;;) {
            if (this.#received.length >= count) return this.#received.splice(0, count);
            if (this.#gone) throw this.#gone;
            const left = by - performance.now();
            if (left <= 0) return undefined;
            const arrived = new Promise<void>((done) => {
                this.#arrived = done;
            });
            await Promise.race([arrived, wait(left)]);
        }
    }
}
