// Keeps the keyboard's focus near its place. If a focused element is hidden, disabled or removed, the nearest element
// that can take the focus gets it, in the same group if possible. A browser would restart at the page's top.

const CAN_TAKE = "a[href], button, input, select, textarea, [tabindex]";

const canTake = (element: HTMLElement): boolean =>
    element.isConnected && !element.matches(":disabled") && element.getClientRects().length > 0;

export function keepFocus(): void {
    /** The last element with keyboard focus and its ancestors, from the inside out. */
    let last: HTMLElement[] = [];
    document.addEventListener("focusin", ({ target }) => {
        last = [];
        if (!(target instanceof HTMLElement) || !target.matches(":focus-visible")) return;
        for (let around: HTMLElement | null = target; around; around = around.parentElement) last.push(around);
    });
    document.addEventListener("pointerdown", () => {
        last = [];
    });
    const keep = () => {
        const [lost, ...groups] = last;
        if (document.activeElement === document.body && lost && !canTake(lost)) nearest(lost, groups)?.focus();
        requestAnimationFrame(keep);
    };
    keep();
}

/** The next focusable element in its innermost group that has one, or else the last one there. */
function nearest(lost: HTMLElement, groups: readonly HTMLElement[]): HTMLElement | undefined {
    for (const group of groups) {
        const all = [...group.querySelectorAll<HTMLElement>(CAN_TAKE)].filter(canTake);
        if (all.length === 0) continue;
        // An element that was removed has no position.
        if (!lost.isConnected) return all[0];
        const follows = (other: HTMLElement) => lost.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING;
        return all.find(follows) ?? all.at(-1);
    }
    return undefined;
}
