// Starts the page after its compressed parts are decompressed.

import { ready } from "./core.ts";
import { words } from "./words/en.ts";

const { currentScript } = document;
const isOwn = currentScript instanceof HTMLScriptElement && currentScript.src.endsWith(`?${BUILD}`);
// A server whose upload is not complete, or a browser's cache, may have the files of two builds.
if (isOwn) void ready.then(() => import("./page.ts"));
else
    void ready
        .then(() => import("./words/words.ts"))
        .then(
            ({ say }) => say("twoBuilds"),
            () => words.twoBuilds,
        )
        .then((text) => {
            document.getElementById("not-started")?.remove();
            document.body.prepend(text);
        });
