// The service worker: stores the page's files on the device, so that it opens without a network.
//
// A newer page is stored beside the shown one, and replaces it when the operator confirms. FILES has the hash of each
// file (build.mjs): with any other content, such as the form of a captive portal or half an upload, the newer page is
// not installed. The older page stays stored until the newer one has started. If that does not start, the older one is
// shown again.

export {};

declare const FILES: Readonly<Record<string, { readonly hash: string; readonly media: string }>>;

const PREFIX = "weeder-page-";
const NAME = PREFIX + BUILD;
/** The entry of a page that was shown, and did not start. */
const DEAD = "dead";
/** Time for a start: a slow phone takes three seconds. */
const START_MS = 10_000;
/** The addresses of the page itself. A server may have other pages beside it. */
const PAGE = ["./", "index.html"].map((name) => new URL(name, location.href).pathname);
const worker = globalThis as unknown as ServiceWorkerGlobalScope;
const starts = new Set<() => void>();

async function install(): Promise<void> {
    const cache = await caches.open(NAME);
    try {
        for (const [name, { hash, media }] of Object.entries(FILES)) {
            const content = await (await fetch(name, { cache: "no-store" })).arrayBuffer();
            const digest = new Uint8Array(await crypto.subtle.digest("SHA-256", content));
            const found = [...digest].map((byte) => byte.toString(16).padStart(2, "0")).join("");
            if (found !== hash) throw new Error(`${name} is not the file of this page`);
            await cache.put(name, new Response(content, { headers: { "content-type": media } }));
        }
    } catch (error) {
        await caches.delete(NAME);
        throw error;
    }
}

/** The stored pages other than this worker's own. */
const others = async () => (await caches.keys()).filter((name) => name.startsWith(PREFIX) && name !== NAME);

async function forgetOthers(): Promise<void> {
    await Promise.all((await others()).map((name) => caches.delete(name)));
    await (await caches.open(NAME)).delete(DEAD);
}

/** Shows the older page instead of one that does not start. */
async function watch(id: string): Promise<void> {
    const isStarted = await new Promise<boolean>((done) => {
        starts.add(() => done(true));
        setTimeout(() => done(false), START_MS);
    });
    if (isStarted) return;
    const client = await worker.clients.get(id);
    // The operator may have closed it.
    if (!(client instanceof WindowClient)) return;
    await (await caches.open(NAME)).put(DEAD, new Response());
    await client.navigate(client.url);
}

/** Shows the newer page once more. The request for it must not overtake the message. */
async function tryAgain(client: unknown): Promise<void> {
    await (await caches.open(NAME)).delete(DEAD);
    if (client instanceof WindowClient) await client.navigate(client.url);
}

/** A file of the page, and whether it is a newer page that was not seen to start. */
async function choose(request: Request): Promise<{ file: Response; isNew: boolean }> {
    const own = await caches.open(NAME);
    const isPage = request.mode === "navigate" && PAGE.includes(new URL(request.url).pathname);
    const [older] = isPage ? await others() : [];
    if (older !== undefined && (await own.match(DEAD))) {
        const file = await (await caches.open(older)).match("./");
        if (file) return { file, isNew: false };
    }
    // Script and style are named with their build, so that no two builds are mixed.
    const stored = isPage ? await own.match("./") : ((await own.match(request)) ?? (await caches.match(request)));
    return { file: stored ?? (await fetch(request)), isNew: older !== undefined };
}

worker.addEventListener("install", (event) => event.waitUntil(install()));

worker.addEventListener("activate", (event) => event.waitUntil(worker.clients.claim()));

worker.addEventListener("fetch", (event) => {
    if (event.request.method !== "GET") return;
    const chosen = choose(event.request);
    event.respondWith(chosen.then(({ file }) => file));
    event.waitUntil(chosen.then(({ isNew }) => (isNew ? watch(event.resultingClientId) : undefined)));
});

worker.addEventListener("message", (event) => {
    const { data, source } = event;
    if (data === "take over") void worker.skipWaiting();
    else if (data === "try again") event.waitUntil(tryAgain(source));
    else if (data.started !== BUILD) source?.postMessage("newer");
    else {
        for (const start of starts) start();
        starts.clear();
        event.waitUntil(forgetOthers());
    }
});
