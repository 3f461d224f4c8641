// The event lines that the drawing needs, out of all that the firmware says. The whole grammar is another's business: it
// is read by the project's Rust where more than this is wanted.

/** Something that the firmware told. */
export type Told =
    /** It has started. */
    | { is: "started" }
    /** It goes from one state to another. */
    | { is: "state"; state: string }
    /** It commands a swing. */
    | { is: "swing"; out: boolean }
    /** A fault was latched, whose code has two digits. */
    | { is: "alarm"; name: string; code: string }
    /** A thing was seen: ticks of its leading edge, of the distance from there at which the tool would leave, and of its hold. */
    | { is: "plant" | "weed" | "unknown"; pos: number; delay: number; hold: number };

/** Reads a line; nothing where it is none of these. */
export function told(line: string): Told | undefined {
    const [first = "", ...words] = line.split(" ");
    const values = new Map(words.map((word): [string, string] => [word.split("=")[0] ?? "", word.split("=")[1] ?? ""]));
    const number = (key: string) => Number(values.get(key) ?? Number.NaN);
    switch (first) {
        case "weeder":
            // The answer to `version` begins like the greeting.
            return line.includes(" reset by ") ? { is: "started" } : undefined;
        case "state":
            return { is: "state", state: values.get("is") ?? "" };
        case "swing":
            return { is: "swing", out: values.get("tool") === "out" };
        case "alarm":
            return { is: "alarm", name: values.get("name") ?? "", code: values.get("code") ?? "" };
        case "plant":
        case "weed":
        case "unknown": {
            const [pos, delay, hold] = [number("pos"), number("delay"), number("hold")];
            return Number.isFinite(pos + delay + hold) ? { is: first, pos, delay, hold } : undefined;
        }
        default:
            return undefined;
    }
}
