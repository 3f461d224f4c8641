// The page as an app that works without a network: where it comes from https or localhost, a browser can install it. From the disk it
// needs nothing of that, and from `weeder serve` it is of no use without that one.

import { isServed } from "../link/served.ts";

/** Time between two looks for a newer page. */
const LOOK_MS = 3_600_000;

/** Makes the page one that can be installed. Calls back when a newer page is there, with what loads it. */
export async function makeInstallable(onNewer: (load: () => void) => void): Promise<void> {
    const { serviceWorker } = navigator;
    if (isServed() || !globalThis.isSecureContext || !serviceWorker || !location.protocol.startsWith("http")) return;
    const manifest = document.createElement("link");
    [manifest.rel, manifest.href] = ["manifest", "manifest.webmanifest"];
    document.head.append(manifest);
    // Where the server does not give it, or the browser keeps nothing, the page works as it is.
    const registration = await serviceWorker.register("worker.js").catch(() => undefined);
    if (!registration) return;
    const look = () => {
        const newer = registration.waiting;
        // The first one of all is no newer one.
        if (!newer || !serviceWorker.controller) return;
        onNewer(() => {
            serviceWorker.addEventListener("controllerchange", () => location.reload());
            newer.postMessage("take over");
        });
    };
    const follow = () => registration.installing?.addEventListener("statechange", look);
    registration.addEventListener("updatefound", follow);
    // It may have been found before.
    follow();
    look();
    // The browser looks by itself when the page is opened. Without a network there is nothing to be found.
    setInterval(() => void registration.update().catch(() => {}), LOOK_MS);
}
