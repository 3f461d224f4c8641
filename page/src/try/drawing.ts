// The row from above, as an SVG: the ground rolls from right to left below a standing machine.
//
// One unit is a millimetre on the ground. The machine rolls to the right; up is left of the row. Things on the ground
// are drawn once and moved with it, and removed when they have left the picture.

import type { Verdict } from "../row/machine.ts";
import { span, type Thing } from "../row/row.ts";
import type { Trial } from "./trial.ts";

const SVG = "http://www.w3.org/2000/svg";

/** The picture's width across the row, from its line: to the side of the tool's swing, and to the other side. */
const ACROSS_MM = { out: 330, other: 170 };
/** Ground behind the tool in the picture: a share of its length, with a limit. */
const BEHIND = { share: 0.3, mostMm: 700 };
/** Mean distance between two short weeds, and their greatest distance from the row's line. */
const SPECK_SPACING_MM = 14;
const SPECK_ACROSS_MM = 150;

/** A tick for a kept plant, a bar for a cut margin, and a cross for a damaged plant. */
const SIGNS: Readonly<Record<Verdict, string>> = {
    kept: "M-16 0L-5 12L17 -13",
    marginCut: "M-16 0H16",
    damaged: "M-14 -14L14 14M-14 14L14 -14",
};

function make<Name extends keyof SVGElementTagNameMap>(
    name: Name,
    attributes: Record<string, string | number>,
    ...children: SVGElement[]
): SVGElementTagNameMap[Name] {
    const element = document.createElementNS(SVG, name);
    for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, String(value));
    element.append(...children);
    return element;
}

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
    const shape = make("g", { transform: `translate(${thing.placeMm} 0)`, "data-kind": thing.kind });
    for (let leaf = 0; leaf < leaves; leaf++)
        shape.append(
            make("ellipse", {
                class: isPlant ? "leaf" : "tall-leaf",
                cx: radius / 2,
                rx: radius / 2,
                ry: isPlant ? radius / 3.2 : Math.max(radius / 3, 4),
                transform: `rotate(${turn + (leaf * 360) / leaves})`,
            }),
        );
    return shape;
}

export class Drawing {
    readonly #svg: SVGSVGElement;
    readonly #ground = make("g", {});
    readonly #specks = make("g", { class: "specks" });
    readonly #track = make("path", { class: "worked-ground" });
    readonly #zones = make("g", { class: "zones" });
    readonly #things = make("g", { class: "things" });
    readonly #soil = make("rect", { class: "ground" });
    readonly #beam = make("line", { class: "beam-line", y1: -ACROSS_MM.out + 30, y2: ACROSS_MM.other - 10 });
    readonly #arm = make("line", { class: "arm" });
    readonly #blade = make("rect", { class: "blade", rx: 6 });
    readonly #angle = make("text", { class: "drawn-note", "text-anchor": "middle" });
    readonly #shapes = new Map<number, SVGElement>();
    readonly #specksShown = new Map<number, SVGElement>();

    constructor(svg: SVGSVGElement, { machine }: Trial) {
        this.#svg = svg;
        const { beamToToolMm, armMm, toolWidthMm } = machine.dimensions;
        this.#track.setAttribute("stroke-width", String(toolWidthMm));
        this.#ground.append(this.#specks, this.#track, this.#zones, this.#things);
        for (const end of ["x1", "x2"]) this.#beam.setAttribute(end, String(beamToToolMm));
        const wheel = { class: "wheel", width: 190, height: 34, rx: 10, x: armMm - 150 };
        const frameMm = { left: -ACROSS_MM.out + 30, right: ACROSS_MM.other - 10 };
        svg.append(
            this.#soil,
            this.#ground,
            make("path", { class: "frame", d: `M${armMm} ${frameMm.left}V${frameMm.right}` }),
            make("rect", { ...wheel, y: frameMm.left - 17 }),
            make("rect", { ...wheel, y: frameMm.right - 17 }),
            this.#beam,
            this.#arm,
            this.#blade,
            make("circle", { class: "blade", cx: armMm, r: 15 }),
            this.#angle,
        );
    }

    draw(trial: Trial): void {
        const { machine, zones } = trial;
        const { toolMm, degrees } = machine;
        const heightMm = ACROSS_MM.out + ACROSS_MM.other;
        const { clientWidth, clientHeight } = this.#svg;
        const lengthMm = (heightMm * Math.max(clientWidth, 1)) / Math.max(clientHeight, 1);
        const behindMm = Math.min(lengthMm * BEHIND.share, BEHIND.mostMm);
        const picture = { x: -behindMm, y: -ACROSS_MM.out, width: lengthMm, height: heightMm };
        this.#svg.setAttribute("viewBox", Object.values(picture).join(" "));
        for (const [key, value] of Object.entries(picture)) this.#soil.setAttribute(key, String(value));

        this.#ground.setAttribute("transform", `translate(${-toolMm} 0)`);
        const [fromMm, toMm] = [toolMm - behindMm, toolMm - behindMm + lengthMm];
        this.#drawThings(machine.things, fromMm, toMm);
        this.#drawVerdicts(trial);
        this.#drawSpecks(fromMm, toMm);
        const way = trial.track.map(({ alongMm, acrossMm }) => `${alongMm.toFixed(1)} ${(-acrossMm).toFixed(1)}`);
        this.#track.setAttribute("d", way.length > 1 ? `M${way.join("L")}` : "");
        this.#zones.replaceChildren(
            ...zones
                .filter(({ startMm, endMm }) => endMm > fromMm && startMm < toMm)
                .map(({ startMm, endMm }) =>
                    make("rect", {
                        class: "zone-ground",
                        x: startMm,
                        width: endMm - startMm,
                        y: -105,
                        height: 210,
                        rx: 8,
                    }),
                ),
        );

        const { armMm, toolWidthMm } = machine.dimensions;
        const tool = { x: trial.tool.alongMm - toolMm, y: -trial.tool.acrossMm };
        this.#beam.classList.toggle("broken", machine.isBroken);
        const arm = { x1: armMm, y1: 0, x2: tool.x, y2: tool.y };
        for (const [key, value] of Object.entries(arm)) this.#arm.setAttribute(key, String(value));
        const blade = { x: tool.x - 16, y: tool.y - toolWidthMm / 2, width: 32, height: toolWidthMm };
        for (const [key, value] of Object.entries(blade)) this.#blade.setAttribute(key, String(value));
        this.#angle.setAttribute("x", String(tool.x - 70));
        this.#angle.setAttribute("y", String(tool.y - 25));
        // Added to 0, a negative 0 loses its sign.
        this.#angle.textContent = `${Math.round(degrees) + 0}\u00b0`;
    }

    #drawThings(things: readonly Thing[], fromMm: number, toMm: number): void {
        const seen = (thing: Thing | undefined) => thing && span(thing).endMm > fromMm && span(thing).startMm < toMm;
        for (const [index, shape] of this.#shapes) {
            if (seen(things[index])) continue;
            shape.remove();
            this.#shapes.delete(index);
        }
        for (let index = things.length - 1; index >= 0; index--) {
            const thing = things[index];
            if (!thing || span(thing).endMm <= fromMm) break;
            if (!seen(thing) || this.#shapes.has(index)) continue;
            const shape = thingShape(thing);
            this.#shapes.set(index, shape);
            this.#things.append(shape);
        }
    }

    /** Draws a sign at each judged plant. */
    #drawVerdicts({ machine, outcome }: Trial): void {
        for (const [index, shape] of this.#shapes) {
            const [thing, verdict] = [machine.things[index], outcome.plants.get(index)];
            if (!thing || !verdict || shape.dataset.verdict === verdict) continue;
            shape.dataset.verdict = verdict;
            const way = SIGNS[verdict];
            const sign = make("path", {
                class: "verdict",
                d: way,
                transform: `translate(0 ${thing.widthMm / 2 + 32})`,
            });
            shape.querySelector(".verdict")?.remove();
            shape.append(sign);
        }
    }

    #drawSpecks(fromMm: number, toMm: number): void {
        const [first, last] = [Math.ceil(fromMm / SPECK_SPACING_MM), Math.floor(toMm / SPECK_SPACING_MM)];
        for (const [number, speck] of this.#specksShown) {
            if (number >= first && number <= last) continue;
            speck.remove();
            this.#specksShown.delete(number);
        }
        for (let number = first; number <= last; number++) {
            if (this.#specksShown.has(number)) continue;
            const across = (2 * spread(number) - 1) * SPECK_ACROSS_MM;
            const speck = make("circle", {
                class: "speck",
                cx: number * SPECK_SPACING_MM,
                cy: across * Math.abs(spread(number + 0.5)),
                r: 3 + 4 * spread(number + 0.25),
            });
            this.#specksShown.set(number, speck);
            this.#specks.append(speck);
        }
    }
}
