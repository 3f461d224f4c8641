// What comes over a wire, to lines, whatever it is.
//
// A line ends with CR, LF or both, or where it has more characters than any that the firmware writes. What is not printable
// ASCII becomes U+FFFD. Empty lines say nothing.

/** Characters after which a line ends by itself: the firmware's own have less than 128. */
const LIMIT = 256;

export class LineReader {
    #partial = "";

    /** Takes what has come, and gives back the lines that are complete. */
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
