// Splits received text into lines. Any input is accepted.
//
// A line ends with CR, LF or both, or when it is longer than any line of the firmware. A character that is not
// printable ASCII becomes U+FFFD. Empty lines are dropped.

/** The longest line: 256 characters. The firmware's own lines are shorter than 128. */
const LINE = /[^\r\n]{256}|[^\r\n]+(?=[\r\n])/g;

export class LineReader {
    #partial = "";

    /** Takes received text, and returns the complete lines. */
    take(text: string): string[] {
        const received = this.#partial + text.replaceAll(/[^ -~\r\n]/g, "\u{fffd}");
        let end = 0;
        const lines = [...received.matchAll(LINE)].map((found) => {
            end = found.index + found[0].length;
            return found[0];
        });
        this.#partial = received.slice(end).replace(/^[\r\n]+/, "");
        return lines;
    }
}
