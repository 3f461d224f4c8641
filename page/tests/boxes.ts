// Checks of parts that must be on the screen without scrolling, by their boxes.

import assert from "node:assert/strict";
import type { Page } from "playwright";
import type { Screen } from "./browser.ts";

const SCREENS = [
    { width: 390, height: 844 },
    { width: 360, height: 640 },
    { width: 1280, height: 800 },
];

/**
 * Asserts in each tab, on each screen, at the page's top and at its end, that these parts of a panel are completely
 * visible.
 */
export async function assertOnScreen(
    page: Page,
    panel: string,
    parts: readonly string[],
    screens: readonly Screen[] = SCREENS,
): Promise<void> {
    for (const screen of screens) {
        await page.setViewportSize(screen);
        const cut = await page.evaluate(
            async ([panel, parts]) => {
                const isCut = (part: string) => {
                    const element = document.querySelector(`${panel} [data-part=${part}]`);
                    if (!element) return true;
                    const { left, right, top, bottom } = element.getBoundingClientRect();
                    const { clientWidth: width, clientHeight: height } = document.documentElement;
                    if (left < 0 || right > width || top < 0 || bottom > height) return true;
                    const isOnTop = (x: number, y: number) => {
                        const found = document.elementFromPoint(x, y);
                        return found !== null && (element.contains(found) || found.contains(element));
                    };
                    const corners = [left + 3, right - 3].flatMap((x) =>
                        [top + 3, bottom - 3].map((y) => [x, y] as const),
                    );
                    return element.scrollWidth > element.clientWidth || !corners.every(([x, y]) => isOnTop(x, y));
                };
                const tabs = document.querySelectorAll<HTMLElement>(`${panel} [role=tab]`);
                if (tabs.length !== 4) return [`there are ${tabs.length} tabs`];
                const cut: string[] = [];
                for (const tab of tabs) {
                    tab.click();
                    // Laid out in the first frame, with room for the dock in the second.
                    for (let frames = 0; frames < 2; frames++) await new Promise((done) => requestAnimationFrame(done));
                    for (const [end, at] of [
                        [0, "at the top"],
                        [document.documentElement.scrollHeight, "at the end"],
                    ] as const) {
                        scrollTo(0, end);
                        cut.push(...parts.filter(isCut).map((part) => `${part} in ${tab.textContent} ${at}`));
                    }
                }
                scrollTo(0, 0);
                return cut;
            },
            [panel, parts] as const,
        );
        assert.deepEqual(cut, [], `${screen.width}x${screen.height}: not whole on the screen`);
    }
}
