// The firmware as a HEX file. It is compressed inside the page, and start.ts decompresses it before the page uses it.

import packed from "packed.hex";
import { unpack } from "./unpack.ts";

export let hex = "";

/** Resolves when it is decompressed. */
export const ready: Promise<void> = unpack(packed).then((bytes) => {
    hex = new TextDecoder().decode(bytes);
});
