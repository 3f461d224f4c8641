// The content of a crop row, as the beam sees it: crop plants and tall weeds, each with its position along the row and
// its width at the beam's height. All positions are millimetres along the ground.

/** The kinds of thing in the row. */
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
