// The page's elements, by their names in index.html, each checked for its type.

import { show, told } from "./words/words.ts";

export class Parts {
    /** `attribute` has the names. */
    constructor(
        readonly root: HTMLElement,
        private readonly attribute: "data-part" | "id" = "data-part",
    ) {}

    get<Kind extends Element>(name: string, kind: new () => Kind): Kind {
        const element = this.root.querySelector(`[${this.attribute}="${name}"]`);
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

    /** Lets a button open files with a file input. */
    files(button: string, input: string, use: (files: readonly File[]) => void): void {
        const field = this.get(input, HTMLInputElement);
        this.button(button, () => field.click());
        field.addEventListener("change", () => {
            const files = [...(field.files ?? [])];
            field.value = "";
            if (files.length > 0) use(files);
        });
    }

    write(name: string, text: string): void {
        const element = this.html(name);
        show(element);
        const shown = plain(text);
        if (element.textContent !== shown) element.textContent = shown;
    }

    /** Sets an element's text, and sets it again after a change of language. */
    say(name: string, text: () => string): void {
        show(this.html(name), () => plain(text()));
    }

    /** Waits for work, and shows that it is done, or its error. Returns the error, if any. */
    async attempt<Result>(
        name: string,
        work: Promise<Result>,
        done?: (result: Result) => string,
        failed: (error: unknown) => string = told,
    ): Promise<unknown> {
        try {
            const result = await work;
            if (done) this.say(name, () => done(result));
            return undefined;
        } catch (error) {
            this.say(name, () => failed(error));
            return error;
        }
    }
}

/** A text as the page shows it: without the backticks around commands. */
export const plain = (text: string): string => text.replaceAll("`", "");

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

export function makeButton(className: string, use: () => void, text = ""): HTMLButtonElement {
    const button = make("button", className, text);
    button.type = "button";
    button.addEventListener("click", use);
    return button;
}

export function draw<Name extends keyof SVGElementTagNameMap>(
    name: Name,
    attributes: Readonly<Record<string, string | number>>,
    ...children: (Node | string)[]
): SVGElementTagNameMap[Name] {
    const element = document.createElementNS("http://www.w3.org/2000/svg", name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
    element.append(...children);
    return element;
}

export function download(file: File): void {
    const link = make("a", "");
    link.href = URL.createObjectURL(file);
    link.download = file.name;
    link.click();
    // The download has begun by then, also where the browser asks first.
    setTimeout(() => URL.revokeObjectURL(link.href), 60_000);
}
