// build.mjs puts this in front of every test: the project's Rust is unpacked before a test asks it.

import { ready } from "../src/core.ts";

await ready;
