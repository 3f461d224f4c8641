// The ground between beam and tool, as the machine knows it: keep-out zones that move toward the tool.
//
// One unit is a millimetre along the row. The tool is at 0, and the beam ahead of it on the right.

import { draw } from "../dom.ts";
import { say } from "../words/words.ts";
import type { Machine } from "./machine.ts";

/**
 * Shown ground behind the tool, as a share of the distance from beam to tool, and the picture's height as a share of
 * its length.
 */
const BEHIND = 0.25;
const HEIGHT = 0.22;

export function drawStrip(svg: SVGSVGElement, machine: Machine, nowMs: number): void {
    const beamMm = machine.setting("beam_to_tool_mm") || 400;
    const [left, length] = [-BEHIND * beamMm, (1 + 2 * BEHIND) * beamMm];
    const height = HEIGHT * length;
    const position = machine.positionAt(nowMs);
    const bar = (kind: { class?: string; fill?: string }, fromMm: number, toMm: number, share: number) => {
        const [from, to] = [Math.max(fromMm, left), Math.min(toMm, left + length)];
        if (from >= to) return [];
        const [y, tall] = [height * (0.62 - share), height * share];
        return [draw("rect", { ...kind, x: from, width: to - from, y, height: tall })];
    };
    const marginMm = machine.setting("margin_mm");
    const zones = machine.zones.flatMap((seen) => {
        const fromMm = (seen.position + seen.delay - position) * machine.tickMm;
        const toMm = fromMm + seen.hold * machine.tickMm;
        if (seen.class === "weed")
            return bar(
                { class: "weed" },
                fromMm + marginMm,
                Math.max(toMm - marginMm, fromMm + marginMm + length / 100),
                0.3,
            );
        return [
            ...bar({ class: "window" }, fromMm, toMm, 0.4),
            ...bar({ class: "canopy" }, fromMm + marginMm, toMm - marginMm, 0.4),
        ];
    });
    const unseenMm = machine.status?.unseenMm ?? 0;
    const text = (words: string, x: number) => {
        const size = height * 0.2;
        return draw("text", { class: "note", x, y: height * 0.95, "font-size": size, "text-anchor": "middle" }, words);
    };
    const isKnown = machine.state !== "none" && machine.state !== "unknown";
    const toolY = height * (isKnown ? (machine.toolOut ? 0.1 : 0.4) : 0.25);
    svg.setAttribute("viewBox", `${left} 0 ${length} ${height}`);
    svg.replaceChildren(
        draw("rect", { fill: "var(--pale)", x: left, width: length, y: height * 0.62, height: height * 0.06 }),
        ...(machine.version === undefined || unseenMm <= 0 ? [] : bar({ fill: "var(--rule)" }, left, unseenMm, 0.12)),
        ...(machine.version === undefined ? [] : zones),
        draw("line", {
            stroke: "var(--beam)",
            x1: beamMm,
            x2: beamMm,
            y1: 0,
            y2: height * 0.68,
            "stroke-width": length / 150,
        }),
        draw("path", {
            fill: isKnown && !machine.toolOut ? "var(--ink)" : "none",
            stroke: "var(--ink)",
            d: `M${-length * 0.025} ${toolY}h${length * 0.05}l${-length * 0.025} ${height * 0.26}z`,
            "stroke-width": length / 200,
        }),
        text(isKnown ? say(machine.toolOut ? "toolDrawnOut" : "toolDrawnIn") : "?", 0),
        text(say("beam"), beamMm),
    );
}
