// HEX files, good and bad.

import assert from "node:assert/strict";
import test from "node:test";
import { HexError, readHex } from "../src/uno/hex.ts";

const END = ":00000001FF";

test("a file's bytes come to their addresses, and the rest is erased", () => {
    const flash = readHex(`:020000040000FA\r\n:03000200010203F5\r\n${END}\r\n`, 8);
    assert.deepEqual([...flash], [255, 255, 1, 2, 3, 255, 255, 255]);
});

test("a bad file is refused with its line and what would be right", () => {
    for (const [text, reason] of [
        ["", /no end/],
        [END, /empty/],
        ["<html>", /line 1 .* is it a HEX file/],
        [":0300020001020FF5", /line 1 .* wrong checksum/],
        [":03000200010203", /line 1 .* cut off/],
        [`:03000600010203F1\n${END}`, /line 1 .* beyond the 8 bytes/],
        [":00000009F7", /line 1 .* unknown kind 9/],
        [":03000200010203F5", /no end/],
    ] as const)
        assert.throws(
            () => readHex(text, 8),
            (error) => error instanceof HexError && reason.test(error.message),
            text,
        );
});
