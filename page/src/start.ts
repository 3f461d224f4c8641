// Starts the page after its compressed parts are decompressed.

import { ready as rust } from "./core.ts";
import { ready as firmware } from "./firmware.ts";

void Promise.all([rust, firmware]).then(() => import("./page.ts"));
