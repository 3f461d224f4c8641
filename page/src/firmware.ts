// The firmware as a HEX file. It is inside of the page, packed: start.ts has it unpacked before the page uses it.

import packed from "packed.hex";
import { unpack } from "./unpack.ts";

export let hex = "";

/** When it is there. */
export const ready: Promise<void> = unpack(packed).then((bytes) => {
    hex = new TextDecoder().decode(bytes);
});
