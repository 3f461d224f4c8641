// Starts the page when what is packed in it is unpacked.

import { ready as rust } from "./core.ts";
import { ready as firmware } from "./firmware.ts";

void Promise.all([rust, firmware]).then(() => import("./page.ts"));
