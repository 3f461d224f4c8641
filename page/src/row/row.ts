// What stands in a crop row, as the beam sees it: crop plants and tall weeds, each with its place along the row and its
// width at the beam's height. All places are millimetres along the ground.

/** What a thing in the row is. */
export type Kind = "plant" | "weed";

/** A plant or a tall weed: its centre along the row, and its width at the beam's height. */
export interface Thing {
    readonly kind: Kind;
    readonly placeMm: number;
    readonly widthMm: number;
}

/** The stretch of ground below a thing. */
export function span({ placeMm, widthMm }: Thing): { startMm: number; endMm: number } {
    return { startMm: placeMm - widthMm / 2, endMm: placeMm + widthMm / 2 };
}
