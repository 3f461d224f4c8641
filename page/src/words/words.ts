// The page in the operator's language: its texts, its numbers and its units.
//
// Each language has a table of texts: en.ts is the source, and the translations are JSON, which editors for translators
// open. The page has them compressed, so this module may be loaded only after core.ts is `ready`. The page's HTML has
// the English texts, and `translate` finds them there. Texts that were set by `show` or `translate` change with the
// language. Other texts must be written again by their own module.

import { translations } from "../core.ts";
import { chosen, keep } from "../preferences.ts";
import * as en from "./en.ts";

export type Word = keyof typeof en.words;
/** The keys of texts without placeholders. */
export type Plain = { [Key in Word]: [Holes<(typeof en.words)[Key]>] extends [never] ? Key : never }[Word];
type HeardWord = keyof typeof en.heard;

export interface Language {
    /** Its own name for itself. */
    readonly name: string;
    readonly words: Readonly<Record<Word, string>>;
    /** Texts that stay English until they are shown. */
    readonly heard: Readonly<Record<HeardWord, string>>;
    /** The advice for an alarm or a warning, by its name. In English it comes from the manual. */
    readonly advice?: Readonly<Record<string, string>>;
    /** The description of each setting, by its name. In English it comes from the machine. */
    readonly settings?: Readonly<Record<string, string>>;
    /** The steps of setting a machine up, by their titles in the manual: the title as a sentence, and how. */
    readonly steps?: Readonly<Record<string, string>>;
}

/** The names of the holes in a text. */
type Holes<Text extends string> = Text extends `${string}{${infer Hole}}${infer Rest}` ? Hole | Holes<Rest> : never;

const { hi, es, fr } = translations;
export const LANGUAGES = { en, hi, es, fr } as const satisfies Readonly<Record<string, Language>>;
export type Code = keyof typeof LANGUAGES;

/** The values of a text's placeholders; empty without any. Numbers are formatted for the language. */
type Filling<Text extends string> = [Holes<Text>] extends [never]
    ? []
    : [Readonly<Record<Holes<Text>, string | number>>];

const isCode = (code: string): code is Code => code in LANGUAGES;
const base = (locale: string) => locale.split("-")[0] ?? "";

/** The language that was chosen, or the first of the browser's that there is. */
function preferred(): Code {
    const kept = chosen("language") ?? "";
    if (isCode(kept)) return kept;
    const { languages = [] } = globalThis.navigator ?? {};
    return languages.map(base).find(isCode) ?? "en";
}

export let language: Code = preferred();
export let table: Language = LANGUAGES[language];
const changes: (() => void)[] = [];
const formats = new Map<string, Intl.NumberFormat>();

/** Chooses a language, and writes all texts again that are not updated continuously. */
export function speak(chosen: Code): void {
    keep("language", chosen);
    [language, table] = [chosen, LANGUAGES[chosen]];
    formats.clear();
    for (const change of changes) change();
}

/** Calls `change` after a change of language. */
export function onLanguage(change: () => void): void {
    changes.push(change);
}

/** Calls `write` now, and after a change of language. */
export function inLanguage(write: () => void): void {
    write();
    onLanguage(write);
}

/** The number format for the language, and for the browser's country if it names one. */
function format(options: Intl.NumberFormatOptions): Intl.NumberFormat {
    const key = JSON.stringify(options);
    let found = formats.get(key);
    if (!found) {
        const { languages = [] } = globalThis.navigator ?? {};
        const locale = languages.find((locale) => base(locale) === language) ?? language;
        found = new Intl.NumberFormat(locale, options);
        formats.set(key, found);
    }
    return found;
}

/** A number with this number of decimal places, and in the given style. */
export function number(value: number, digits = 0, style: Intl.NumberFormatOptions = {}): string {
    const places = { minimumFractionDigits: digits, maximumFractionDigits: digits };
    // Rounding a small negative number gives no negative 0.
    return format({ ...style, ...places, signDisplay: "negative" }).format(value);
}

/** A number with its unit, by the unit's name in `Intl.NumberFormat`. */
export function quantity(value: number, unit: string, digits = 0): string {
    return number(value, digits, { style: "unit", unit });
}

/** A text with its holes filled, in the form for `count`. */
function fill(text: string, holes: Readonly<Record<string, string | number>> = {}): string {
    const forms = text.split("|");
    const isOne = forms.length > 1 && new Intl.PluralRules(language).select(Number(holes.count)) === "one";
    const form = (isOne ? forms[0] : forms.at(-1)) ?? text;
    return form.replaceAll(/\{(\w+)\}/g, (_, hole: string) => {
        const value = holes[hole] ?? "";
        return typeof value === "number" ? format({}).format(value) : value;
    });
}

export function say<Key extends Word>(word: Key, ...[holes]: Filling<(typeof en.words)[Key]>): string {
    return fill(table.words[word], holes);
}

/** A text that stays English until it is shown. */
export function english<Key extends HeardWord>(word: Key, ...[holes]: Filling<(typeof en.heard)[Key]>): string {
    const texts = Object.entries(holes ?? {}).map(([hole, value]) => [hole, String(value)]);
    return fill(en.heard[word], Object.fromEntries(texts));
}

/** These texts as patterns, those with the longest texts first. */
const heard = Object.entries(en.heard)
    .sort(([, one], [, other]) => other.length - one.length)
    .map(([word, text]) => {
        const holes = [...text.matchAll(/\{(\w+)\}/g)].map(([, hole = ""]) => hole);
        const parts = text.split(/\{\w+\}/).map((part) => part.replaceAll(/[\\^$.*+?()[\]{}|]/g, "\\$&"));
        return { word: word as HeardWord, holes, pattern: new RegExp(`^${parts.join("(.*)")}$`, "s") };
    });

/** A text with its full stop: that of its script, as some text stays English. */
export function ended(text: string): string {
    const stop = /\p{Script=Devanagari}/u.test(text) ? "।" : ".";
    return /[.!?।]$/.test(text) ? text : text + stop;
}

export const reason = (error: unknown): string => (error instanceof Error ? error.message : String(error));

/** Translates such a text or an error's, with its values. Unknown text stays: the machine itself speaks English. */
export function told(english: unknown): string {
    const text = reason(english);
    if (language === "en") return text;
    // A number within such a text.
    const [, decimals] = /^\d+\.(\d+)$/.exec(text) ?? [];
    if (decimals) return number(Number(text), decimals.length);
    // The same text as a sentence or within one.
    const bare = `${text.charAt(0).toLowerCase()}${text.slice(1).replace(/\.$/, "")}`;
    for (const { word, holes, pattern } of heard) {
        const found = pattern.exec(text) ?? pattern.exec(bare);
        if (found)
            return fill(
                table.heard[word],
                Object.fromEntries(holes.map((hole, at) => [hole, told(found[at + 1] ?? "")])),
            );
    }
    return text;
}

const shown = new Map<Element, () => string>();
onLanguage(() => {
    for (const [element, text] of shown) if (element.isConnected) element.textContent = text();
});

/** Shows a text in an element, also after a change of language. Without a text, other code writes it. */
export function show(element: Element, text?: () => string): void {
    shown.delete(element);
    if (!text) return;
    shown.set(element, text);
    element.textContent = text();
}

const words = new Map(Object.entries(en.words).map(([word, text]) => [text as string, word as Word]));

/** Sets the texts and names of the page's elements in the current language, now and after each change. */
export function translate(root: Element | DocumentFragment): void {
    const nodes: (() => void)[] = [];
    const take = (text: string, write: (text: string) => void) => {
        const bare = text.trim();
        const word = words.get(bare);
        if (bare !== "" && word) nodes.push(() => write(text.replace(bare, () => table.words[word])));
    };
    const texts = document.createTreeWalker(root, NodeFilter.SHOW_TEXT);
    for (let node = texts.nextNode(); node; node = texts.nextNode()) {
        const text = node as Text;
        take(text.data, (data) => {
            text.data = data;
        });
    }
    for (const name of ["aria-label", "title", "label", "alt"])
        for (const element of root.querySelectorAll(`[${name}]`))
            take(element.getAttribute(name) ?? "", (value) => element.setAttribute(name, value));
    inLanguage(() => {
        for (const node of nodes) node();
    });
}
