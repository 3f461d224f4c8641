// The keyboard's focus stays near where it was: what is hidden, disabled or taken away while it has the focus leaves it to the
// nearest thing that can take it, in the same group if there is one. A browser would begin at the page's top again.

const CAN_TAKE = "a[href], button, input, select, textarea, [tabindex]";

const canTake = (element: HTMLElement): boolean =>
    element.isConnected && !element.matches(":disabled") && element.getClientRects().length > 0;

/** Follows the focus from now on. */
export function keepFocus(): void {
    /** What had the focus by the keyboard, and all around it, from the inside out. */
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

/** What follows it in the innermost of its groups that has something, or else stands there last. */
function nearest(lost: HTMLElement, groups: readonly HTMLElement[]): HTMLElement | undefined {
    for (const group of groups) {
        const all = [...group.querySelectorAll<HTMLElement>(CAN_TAKE)].filter(canTake);
        if (all.length === 0) continue;
        // What was taken out of the page stands nowhere.
        if (!lost.isConnected) return all[0];
        const follows = (other: HTMLElement) => lost.compareDocumentPosition(other) & Node.DOCUMENT_POSITION_FOLLOWING;
        return all.find(follows) ?? all.at(-1);
    }
    return undefined;
}
