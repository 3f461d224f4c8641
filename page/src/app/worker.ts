// The service worker: stores the page's files on the device, so that it opens without a network.
//
// A newer page is stored beside the shown one, and replaces it when the operator confirms. BUILD differs for each
// version of the page (build.mjs).

declare const BUILD: string;

/** The used events and objects of a service worker: the page's own types are only those of a window. */
interface Lasting extends Event {
    waitUntil(done: Promise<unknown>): void;
}
interface Asked extends Event {
    readonly request: Request;
    respondWith(answer: Promise<Response>): void;
}
interface Worker {
    readonly clients: { claim(): Promise<void> };
    skipWaiting(): Promise<void>;
    addEventListener(type: "install" | "activate", take: (event: Lasting) => void): void;
    addEventListener(type: "fetch", take: (event: Asked) => void): void;
    addEventListener(type: "message", take: () => void): void;
}

const FILES = ["./", "page.css", "page.js", "manifest.webmanifest", "icon.svg"];
const PREFIX = "weeder-page-";
const NAME = PREFIX + BUILD;
const worker = globalThis as unknown as Worker;

worker.addEventListener("install", (event) => {
    const fresh = FILES.map((file) => new Request(file, { cache: "reload" }));
    event.waitUntil(caches.open(NAME).then((cache) => cache.addAll(fresh)));
});

worker.addEventListener("activate", (event) => {
    const forget = async () => {
        const names = await caches.keys();
        await Promise.all(
            names.filter((name) => name.startsWith(PREFIX) && name !== NAME).map((name) => caches.delete(name)),
        );
        await worker.clients.claim();
    };
    event.waitUntil(forget());
});

worker.addEventListener("fetch", (event) => {
    const { request } = event;
    if (request.method !== "GET") return;
    const answer = async () => {
        const cache = await caches.open(NAME);
        const kept = await cache.match(request.mode === "navigate" ? "./" : request, { ignoreSearch: true });
        return kept ?? fetch(request);
    };
    event.respondWith(answer());
});

worker.addEventListener("message", () => void worker.skipWaiting());
