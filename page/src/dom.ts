// The page's elements, by their names in `data-part` in index.html, each checked for its type.

import { show } from "./words/words.ts";

export class Parts {
    readonly root: HTMLElement;

    constructor(root: HTMLElement) {
        this.root = root;
    }

    get<Kind extends Element>(name: string, kind: new () => Kind): Kind {
        const element = this.root.querySelector(`[data-part="${name}"]`);
        if (!(element instanceof kind)) throw new Error(`there is no ${kind.name} called ${name} in the page`);
        return element;
    }

    html(name: string): HTMLElement {
        return this.get(name, HTMLElement);
    }

    button(name: string, use: () => void): HTMLButtonElement {
        const button = this.get(name, HTMLButtonElement);
        button.addEventListener("click", use);
        return button;
    }

    /** Replaces an element's text. */
    write(name: string, text: string): void {
        const element = this.html(name);
        show(element);
        if (element.textContent !== text) element.textContent = text;
    }

    /** Sets an element's text, and sets it again after a change of language. */
    say(name: string, text: () => string): void {
        show(this.html(name), text);
    }
}

/** A new element with a class and children. */
export function make<Name extends keyof HTMLElementTagNameMap>(
    name: Name,
    className: string,
    ...children: (Node | string)[]
): HTMLElementTagNameMap[Name] {
    const element = document.createElement(name);
    if (className !== "") element.className = className;
    element.append(...children);
    return element;
}

/** Hands the operator a file. */
export function download(name: string, text: string, type: string): void {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(new Blob([text], { type }));
    link.download = name;
    link.click();
    // The download has begun by then.
    setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
