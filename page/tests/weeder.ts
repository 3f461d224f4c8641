// The command `weeder` for the tests: the one that WEEDER names, or else this repository's.

import { existsSync } from "node:fs";
import { resolve } from "node:path";

export const WEEDER = process.env.WEEDER ?? resolve("../target/debug/weeder");
if (!existsSync(WEEDER))
    throw new Error(`${WEEDER} is not there: \`cargo build -p weeder-cli\` makes it, or name it in WEEDER`);
