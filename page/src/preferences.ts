// The operator's choices, stored by the browser between visits: by name, as text.
//
// A browser that stores nothing, such as a private window, forgets them when the page is closed.

const PREFIX = "weeder.";
const now = new Map<string, string>();

export function chosen(name: string): string | undefined {
    const inPage = now.get(name);
    if (inPage !== undefined) return inPage;
    try {
        return localStorage.getItem(PREFIX + name) ?? undefined;
    } catch {
        return undefined;
    }
}

export function keep(name: string, value: string): void {
    now.set(name, value);
    try {
        localStorage.setItem(PREFIX + name, value);
    } catch {
        // Kept for this visit.
    }
}

/** Whether the operator's system asks for little motion. */
export const isStill = (): boolean => matchMedia("(prefers-reduced-motion: reduce)").matches;

/** Time between two pictures of something that moves, under reduced motion. */
export const STILL_MS = 1000;
