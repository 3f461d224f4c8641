// The row from above, as an SVG: the ground rolls from right to left below a standing machine.
//
// One unit is a millimetre on the ground. The machine rolls to the right; up is left of the row. Things on the ground
// are drawn once and moved with it, and removed when they have left the picture.

import { draw, set } from "../dom.ts";
import { span, type Thing, type Verdict } from "../row/machine.ts";
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
    readonly #svg: SVGSVGElement;
    readonly #ground = draw("g", {});
    readonly #specks = new Shapes();
    readonly #track = draw("path", { fill: "none", stroke: "var(--worked)" });
    readonly #zones = draw("g", {});
    readonly #things = new Shapes();
    readonly #soil = draw("rect", { fill: "var(--soil)" });
    readonly #beam = draw("line", { stroke: "var(--beam)", y1: -ACROSS_MM.out + 30, y2: ACROSS_MM.other - 10 });
    readonly #arm = draw("line", { stroke: "var(--ink)", "stroke-width": 11, "stroke-linecap": "round" });
    readonly #blade = draw("rect", { fill: "var(--ink)", rx: 6 });
    readonly #angle = draw("text", { fill: "var(--ink)", "font-size": 30, "text-anchor": "middle" });

    constructor(svg: SVGSVGElement, { machine }: Simulation) {
        this.#svg = svg;
        const { beamToToolMm, toolWidthMm } = machine.dimensions;
        set(this.#track, { "stroke-width": toolWidthMm });
        this.#ground.append(this.#specks.group, this.#track, this.#zones, this.#things.group);
        set(this.#beam, { x1: beamToToolMm, x2: beamToToolMm });
        const wheel = { fill: "var(--pale)", width: 190, height: 34, rx: 10, x: AXLE_MM - 150 };
        const frameMm = { left: -ACROSS_MM.out + 30, right: ACROSS_MM.other - 10 };
        svg.append(
            this.#soil,
            this.#ground,
            draw("path", {
                stroke: "var(--pale)",
                "stroke-width": 9,
                d: `M${AXLE_MM} ${frameMm.left}V${frameMm.right}M${AXLE_MM} 0H0`,
            }),
            draw("rect", { ...wheel, y: frameMm.left - 17 }),
            draw("rect", { ...wheel, y: frameMm.right - 17 }),
            this.#beam,
            this.#arm,
            this.#blade,
            draw("rect", { fill: "var(--ink)", width: SERVO_MM, height: 30, y: -15, rx: 5 }),
            this.#angle,
        );
    }

    draw(simulation: Simulation): void {
        const { machine, zones } = simulation;
        const { toolMm, degrees } = machine;
        const heightMm = ACROSS_MM.out + ACROSS_MM.other;
        const { clientWidth, clientHeight } = this.#svg;
        const lengthMm = (heightMm * Math.max(clientWidth, 1)) / Math.max(clientHeight, 1);
        const behindMm = Math.min(lengthMm * BEHIND.share, BEHIND.mostMm);
        const picture = { x: -behindMm, y: -ACROSS_MM.out, width: lengthMm, height: heightMm };
        this.#svg.setAttribute("viewBox", Object.values(picture).join(" "));
        set(this.#soil, picture);

        this.#ground.setAttribute("transform", `translate(${-toolMm} 0)`);
        const [fromMm, toMm] = [toolMm - behindMm, toolMm - behindMm + lengthMm];
        const { things } = machine;
        const isSeen = (thing: Thing) => span(thing).endMm > fromMm && span(thing).startMm < toMm;
        const seen = things.flatMap((thing, number) => (isSeen(thing) ? [number] : []));
        this.#things.show(seen, (number) => thingShape(things[number] as Thing));
        this.#drawVerdicts(simulation);
        this.#drawSpecks(fromMm, toMm);
        const way = simulation.track.map(({ alongMm, acrossMm }) => `${alongMm.toFixed(1)} ${(-acrossMm).toFixed(1)}`);
        this.#track.setAttribute("d", way.length > 1 ? `M${way.join("L")}` : "");
        this.#zones.replaceChildren(
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

        const { toolWidthMm } = machine.dimensions;
        const tool = { x: simulation.tool.alongMm - toolMm, y: -simulation.tool.acrossMm };
        const broken = machine.isBroken;
        set(this.#beam, { "stroke-width": broken ? 9 : 4, "stroke-dasharray": broken ? "none" : "12 7" });
        // A pendulum from above: it hangs from the servo over the row's line, and lifts the blade beside it.
        set(this.#arm, { x1: 0, y1: 0, x2: tool.x, y2: tool.y });
        set(this.#blade, { x: tool.x - 16, y: tool.y - toolWidthMm / 2, width: 32, height: toolWidthMm });
        set(this.#angle, { x: tool.x - 70, y: tool.y - 25 });
        // Added to 0, a negative 0 loses its sign.
        this.#angle.textContent = `${Math.round(degrees) + 0}\u00b0`;
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
