// The boards that can be flashed, which differ in their bootloader alone.

import type { Plain } from "../words/words.ts";

export interface Board {
    readonly id: string;
    /** Its common name, or the key of a text. */
    readonly name: string | { readonly text: Plain };
    /** The bootloader's rate in bits a second, and the flash that remains for the firmware, of 32 KiB. */
    readonly baud: number;
    readonly roomBytes: number;
    /** Whether its bootloader is the one before optiboot. */
    readonly isOld: boolean;
}

export const BOARDS: readonly Board[] = [
    { id: "uno", name: "Arduino Uno", baud: 115_200, roomBytes: 32_256, isOld: false },
    { id: "nano", name: "Arduino Nano", baud: 115_200, roomBytes: 32_256, isOld: false },
    { id: "old", name: { text: "oldBoard" }, baud: 57_600, roomBytes: 30_720, isOld: true },
];
