// The row from above, as an SVG: the ground rolls from right to left below a standing machine.
//
// One unit is a millimetre on the ground. The machine rolls to the right; up is left of the row. Things on the ground
// are drawn once and moved with it, and removed when they have left the picture.

import { draw } from "../dom.ts";
import { type Machine, span, type Thing, type Verdict } from "../row/machine.ts";
import type { Simulation } from "./simulation.ts";

/** The picture's width across the row, from its line: to the side of the tool's swing, and to the other side. */
const ACROSS_MM = { out: 330, other: 170 };
/** Ground behind the tool in the picture: a share of its length, with a limit. */
const BEHIND = { share: 0.3, mostMm: 700 };
/** The servo's length along the row, and the axle's distance ahead of the tool. */
const SERVO_MM = 50;
const AXLE_MM = 350;
/** Mean distance between two short weeds, and their greatest distance from the row's line. */
const SPECK_SPACING_MM = 14;
const SPECK_ACROSS_MM = 150;

/** A tick for a kept plant, a bar for a cut margin, a slash for a reached zone, and a cross for a damaged plant. */
const SIGNS: Readonly<Record<Verdict, string>> = {
    kept: "M-16 0L-5 12L17 -13",
    marginCut: "M-16 0H16",
    reached: "M-14 14L14 -14",
    damaged: "M-14 -14L14 14M-14 14L14 -14",
};

/** A pseudo-random number from 0 to 1, from a whole number. */
function spread(number: number): number {
    const value = Math.sin(number * 12.9898) * 43758.5453;
    return value - Math.floor(value);
}

/** A plant or a tall weed from above, as wide as the beam sees it. */
function thingShape(thing: Thing): SVGElement {
    const isPlant = thing.kind === "plant";
    const leaves = isPlant ? 7 : 5;
    const radius = thing.widthMm / 2;
    const turn = spread(thing.placeMm) * 360;
    const shape = draw("g", { transform: `translate(${thing.placeMm} 0)`, "data-kind": thing.kind });
    for (let leaf = 0; leaf < leaves; leaf++)
        shape.append(
            draw("ellipse", {
                class: isPlant ? "canopy" : "weed",
                ...(isPlant && { stroke: "var(--vein)" }),
                cx: radius / 2,
                rx: radius / 2,
                ry: isPlant ? radius / 3.2 : Math.max(radius / 3, 4),
                transform: `rotate(${turn + (leaf * 360) / leaves})`,
            }),
        );
    return shape;
}

/** A group of shapes on the ground, by number. */
class Shapes {
    readonly group = draw("g", {});
    readonly shown = new Map<number, SVGElement>();

    /** Removes the shapes that are not seen, and makes those that are seen now. */
    show(seen: readonly number[], make: (number: number) => SVGElement): void {
        for (const [number, shape] of this.shown) {
            if (seen.includes(number)) continue;
            shape.remove();
            this.shown.delete(number);
        }
        for (const number of seen) {
            if (this.shown.has(number)) continue;
            const shape = make(number);
            this.shown.set(number, shape);
            this.group.append(shape);
        }
    }
}

export class Drawing {
    readonly #specks = new Shapes();
    /** The tool's track, and the keep-out zones. */
    readonly #marks = draw("g", {});
    readonly #things = new Shapes();
    readonly #ground = draw("g", {}, this.#specks.group, this.#marks, this.#things.group);
    readonly #machine = draw("g", {});

    constructor(private readonly svg: SVGSVGElement) {
        svg.append(this.#ground, this.#machine);
    }

    draw(simulation: Simulation): void {
        const { toolMm, things } = simulation.machine;
        const heightMm = ACROSS_MM.out + ACROSS_MM.other;
        const { clientWidth, clientHeight } = this.svg;
        const lengthMm = (heightMm * Math.max(clientWidth, 1)) / Math.max(clientHeight, 1);
        const behindMm = Math.min(lengthMm * BEHIND.share, BEHIND.mostMm);
        this.svg.setAttribute("viewBox", `${-behindMm} ${-ACROSS_MM.out} ${lengthMm} ${heightMm}`);
        this.#ground.setAttribute("transform", `translate(${-toolMm} 0)`);
        const [fromMm, toMm] = [toolMm - behindMm, toolMm - behindMm + lengthMm];
        const isSeen = (thing: Thing) => span(thing).endMm > fromMm && span(thing).startMm < toMm;
        const seen = things.flatMap((thing, number) => (isSeen(thing) ? [number] : []));
        this.#things.show(seen, (number) => thingShape(things[number] as Thing));
        this.#drawVerdicts(simulation);
        this.#drawSpecks(fromMm, toMm);
        this.#drawMarks(simulation, fromMm, toMm);
        this.#drawMachine(simulation.machine);
    }

    #drawMarks({ track, zones, machine }: Simulation, fromMm: number, toMm: number): void {
        const way = track.map(({ alongMm, acrossMm }) => `${alongMm.toFixed(1)} ${(-acrossMm).toFixed(1)}`);
        this.#marks.replaceChildren(
            draw("path", {
                fill: "none",
                stroke: "var(--worked)",
                "stroke-width": machine.dimensions.toolWidthMm,
                d: way.length > 1 ? `M${way.join("L")}` : "",
            }),
            ...zones
                .filter(({ startMm, endMm }) => endMm > fromMm && startMm < toMm)
                .map(({ startMm, endMm }) =>
                    draw("rect", {
                        class: "window",
                        "stroke-width": 2,
                        x: startMm,
                        width: endMm - startMm,
                        y: -105,
                        height: 210,
                        rx: 8,
                    }),
                ),
        );
    }

    #drawMachine({ degrees, acrossMm, isBroken, dimensions }: Machine): void {
        const { beamToToolMm, toolWidthMm } = dimensions;
        const [left, right] = [-ACROSS_MM.out + 30, ACROSS_MM.other - 10];
        const wheel = { fill: "var(--pale)", width: 190, height: 34, rx: 10, x: AXLE_MM - 150 };
        const beam = isBroken ? { "stroke-width": 9 } : { "stroke-width": 4, "stroke-dasharray": "12 7" };
        // Added to 0, a negative 0 loses its sign.
        const angle = `${Math.round(degrees) + 0}\u00b0`;
        this.#machine.replaceChildren(
            draw("path", {
                stroke: "var(--pale)",
                "stroke-width": 9,
                d: `M${AXLE_MM} ${left}V${right}M${AXLE_MM} 0H0`,
            }),
            draw("rect", { ...wheel, y: left - 17 }),
            draw("rect", { ...wheel, y: right - 17 }),
            draw("line", { ...beam, stroke: "var(--beam)", x1: beamToToolMm, x2: beamToToolMm, y1: left, y2: right }),
            // A pendulum from above: it hangs from the servo over the row's line, and lifts the blade beside it.
            draw("line", { stroke: "var(--ink)", "stroke-width": 11, "stroke-linecap": "round", y2: -acrossMm }),
            draw("rect", {
                fill: "var(--ink)",
                rx: 6,
                x: -16,
                y: -acrossMm - toolWidthMm / 2,
                width: 32,
                height: toolWidthMm,
            }),
            draw("rect", { fill: "var(--ink)", width: SERVO_MM, height: 30, y: -15, rx: 5 }),
            draw(
                "text",
                { fill: "var(--ink)", "font-size": 30, "text-anchor": "middle", x: -70, y: -acrossMm - 25 },
                angle,
            ),
        );
    }

    #drawVerdicts({ machine, outcome }: Simulation): void {
        for (const [index, shape] of this.#things.shown) {
            const [thing, verdict] = [machine.things[index], outcome.plants.get(index)];
            if (!thing || !verdict || shape.dataset.verdict === verdict) continue;
            shape.dataset.verdict = verdict;
            const sign = draw("path", {
                class: "verdict",
                fill: "none",
                stroke: verdict === "damaged" ? "var(--beam)" : "var(--ink)",
                "stroke-width": verdict === "damaged" ? 11 : 7,
                d: SIGNS[verdict],
                transform: `translate(0 ${thing.widthMm / 2 + 32})`,
            });
            shape.querySelector(".verdict")?.remove();
            shape.append(sign);
        }
    }

    #drawSpecks(fromMm: number, toMm: number): void {
        const [first, last] = [Math.ceil(fromMm / SPECK_SPACING_MM), Math.floor(toMm / SPECK_SPACING_MM)];
        const seen = Array.from({ length: last - first + 1 }, (_, index) => first + index);
        this.#specks.show(seen, (number) => {
            const across = (2 * spread(number) - 1) * SPECK_ACROSS_MM;
            return draw("circle", {
                fill: "var(--speck)",
                cx: number * SPECK_SPACING_MM,
                cy: across * Math.abs(spread(number + 0.5)),
                r: 3 + 4 * spread(number + 0.25),
            });
        });
    }
}
