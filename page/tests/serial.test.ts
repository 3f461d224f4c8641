// Which browsers have a serial port for an Uno, without a browser.

import assert from "node:assert/strict";
import test from "node:test";
import { whyNoSerial } from "../src/link/serial.ts";
import { english } from "../src/words/words.ts";

test("on Android, where Web Serial has Bluetooth devices only, the page says that there is none", () => {
    Object.assign(globalThis, { location: { search: "" } });
    for (const [userAgent, why] of [
        ["Mozilla/5.0 (X11; Linux x86_64) Chrome/138.0.0.0 Safari/537.36", undefined],
        ["Mozilla/5.0 (Linux; Android 10; K) Chrome/138.0.0.0 Mobile Safari/537.36", english("noSerial")],
    ]) {
        const value = { userAgent, serial: {} };
        Object.defineProperty(globalThis, "navigator", { value, configurable: true });
        assert.equal(whyNoSerial(), why);
    }
});
