// The required content of a language's table: a text for each English one.

import type * as en from "./en.ts";

export type Word = keyof typeof en.words;
/** The keys of texts without placeholders. */
export type Plain = { [Key in Word]: [Holes<(typeof en.words)[Key]>] extends [never] ? Key : never }[Word];
export type HeardWord = keyof typeof en.heard;

/** A language's table. */
export interface Language {
    /** Its own name for itself. */
    readonly name: string;
    /** The texts of the page. */
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
export type Holes<Text extends string> = Text extends `${string}{${infer Hole}}${infer Rest}`
    ? Hole | Holes<Rest>
    : never;
