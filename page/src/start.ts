// Starts the page after its compressed parts are decompressed.

import { ready } from "./core.ts";

void ready.then(() => import("./page.ts"));
