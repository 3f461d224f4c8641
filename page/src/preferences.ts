// What the operator has chosen, kept by the browser from one visit to the next: by name, as text.
//
// A browser that keeps nothing, as a private window may be, forgets it when the page is closed.

const PREFIX = "weeder.";
const now = new Map<string, string>();

/** What was chosen; nothing where nothing was. */
export function chosen(name: string): string | undefined {
    const inPage = now.get(name);
    if (inPage !== undefined) return inPage;
    try {
        return localStorage.getItem(PREFIX + name) ?? undefined;
    } catch {
        return undefined;
    }
}

/** Keeps what was chosen. */
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
