// The firmware's HEX file.

import assert from "node:assert/strict";
import test from "node:test";
import { readHex, usedBytes } from "../src/uno/hex.ts";

test("a file's bytes come to their addresses, and the rest is erased", () => {
    const flash = readHex(":03000200010203F5\n:0100060004F5\n:00000001FF\n", 8);
    assert.deepEqual([...flash], [255, 255, 1, 2, 3, 255, 4, 255]);
    assert.equal(usedBytes(flash), 7);
});
