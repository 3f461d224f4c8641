// The page as an app that works without a network. A browser can install it from https or localhost. A page on the disk
// needs no installation, and a page from `weeder serve` is useless without its network.

import { isServed } from "../link/served.ts";

/** Time between two checks for a newer page. */
const LOOK_MS = 3_600_000;

/** Makes the page installable. Calls `onNewer` when a newer page is ready, with a function that loads it. */
export async function makeInstallable(onNewer: (load: () => void) => void): Promise<void> {
    const { serviceWorker } = navigator;
    if (isServed() || !globalThis.isSecureContext || !serviceWorker || !location.protocol.startsWith("http")) return;
    const manifest = document.createElement("link");
    [manifest.rel, manifest.href] = ["manifest", "manifest.webmanifest"];
    document.head.append(manifest);
    // If the server lacks the worker, or the browser stores nothing, the page still works.
    const registration = await serviceWorker.register("worker.js").catch(() => undefined);
    if (!registration) return;
    // Before the worker's first installation there is no controller, and nothing older to forget.
    serviceWorker.controller?.postMessage({ started: BUILD });
    const look = () => {
        const newer = registration.waiting;
        // The first installation is no update.
        if (!newer || !serviceWorker.controller) return;
        onNewer(() => {
            // Another tab may have let it take over.
            if (newer.state !== "installed") location.reload();
            serviceWorker.addEventListener("controllerchange", () => location.reload());
            newer.postMessage("take over");
        });
    };
    // The worker has a newer page, which did not start.
    serviceWorker.addEventListener("message", ({ data }) => {
        if (data !== "newer") return;
        onNewer(() => serviceWorker.controller?.postMessage("try again"));
    });
    const follow = () => registration.installing?.addEventListener("statechange", look);
    registration.addEventListener("updatefound", follow);
    // It may have been found before this listener was added.
    follow();
    look();
    // The browser checks when the page is opened. Without a network the check fails, and this is ignored.
    setInterval(() => void registration.update().catch(() => {}), LOOK_MS);
}
