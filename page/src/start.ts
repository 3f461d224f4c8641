// Starts the page after its compressed parts are decompressed.

import { ready } from "./core.ts";

const { currentScript } = document;
const isOwn = currentScript instanceof HTMLScriptElement && currentScript.src.endsWith(`?${BUILD}`);
// A server whose upload is not complete, or a browser's cache, may have the files of two builds.
if (isOwn) void ready.then(() => import("./page.ts"));
else void import("./words/words.ts").then(({ say }) => document.body.prepend(say("twoBuilds")));
