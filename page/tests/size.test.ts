// The page's size: it is opened on phones in the field, and is part of a release and of `weeder`.

import assert from "node:assert/strict";
import { readdirSync, statSync } from "node:fs";
import test from "node:test";

/** Greatest size with the firmware, the Rust, and four languages. Raise it to the measured size, with a reason. */
const MOST_KIB = 600;

test("the page is not larger than it is meant to be", (test) => {
    const bytes = readdirSync("dist").reduce((sum, name) => sum + statSync(`dist/${name}`).size, 0);
    test.diagnostic(`${(bytes / 1024).toFixed(0)} KiB`);
    assert(bytes <= MOST_KIB * 1024, `${bytes} bytes are more than ${MOST_KIB} KiB`);
});
