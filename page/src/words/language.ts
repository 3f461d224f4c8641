// What a language's table has to have: a text for each of the English ones.

import type { en } from "./en.ts";

export type Word = keyof typeof en.words;
/** Those whose texts have no holes. */
export type Plain = { [Key in Word]: [Holes<(typeof en.words)[Key]>] extends [never] ? Key : never }[Word];
export type HeardWord = keyof typeof en.heard;

/** A language's table. */
export interface Language {
    /** The texts of the page. */
    readonly words: Readonly<Record<Word, string>>;
    /** What is English until it is shown. */
    readonly heard: Readonly<Record<HeardWord, string>>;
    /** What to do about an alarm or a warning, by its name. In English the manual says it. */
    readonly advice: Readonly<Record<string, string>>;
    /** What each setting is, by its name. In English the machine says it. */
    readonly settings: Readonly<Record<string, string>>;
    /** The steps of setting a machine up, by their titles in the manual: the title, and how. */
    readonly steps: Readonly<Record<string, readonly [title: string, how: string]>>;
}

/** The names of the holes in a text. */
export type Holes<Text extends string> = Text extends `${string}{${infer Hole}}${infer Rest}`
    ? Hole | Holes<Rest>
    : never;
