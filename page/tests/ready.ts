// build.mjs puts this before every test: it decompresses the project's Rust and the translations before a test uses them.

import { ready } from "../src/core.ts";

await ready;
