// Splits received text into lines. Any input is accepted.
//
// A line ends with CR, LF or both, or when it is longer than any line of the firmware. A character that is not
// printable ASCII becomes U+FFFD. Empty lines are dropped.

/** The longest line in characters. The firmware's own lines are shorter than 128. */
const LIMIT = 256;

export class LineReader {
    #partial = "";

    /** Takes received text, and returns the complete lines. */
    take(text: string): string[] {
        const lines: string[] = [];
        const end = () => {
            if (this.#partial !== "") lines.push(this.#partial);
            this.#partial = "";
        };
        for (const character of text) {
            if (character === "\r" || character === "\n") end();
            else {
                this.#partial += character >= " " && character <= "~" ? character : "\u{fffd}";
                if (this.#partial.length === LIMIT) end();
            }
        }
        return lines;
    }
}
