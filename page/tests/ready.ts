// build.mjs puts this before every test: it decompresses the project's Rust before a test uses it.

import { ready } from "../src/core.ts";

await ready;
