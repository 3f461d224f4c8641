// Recorded logs, as rows one below the other: detections and keep-out zones, the tool in the row, the machine's speed,
// and its alarms. The buttons, the slider and the wheel move and zoom all rows at once. Each log can be replayed.
//
// Only the visible part of a log is drawn. Reading and replay run beside the page, which can be used meanwhile.

import { draw, make, type Parts } from "../dom.ts";
import { fault, sentence } from "../panel/machine.ts";
import { onLanguage, quantity, reason, say } from "../words/words.ts";
import {
    type Mapped,
    type Picture,
    type Problem,
    picture,
    type Replayed,
    read,
    type Speed,
    type Trouble,
    type Work,
} from "./picture.ts";

/** Ground in the window: at first, the least and the most. */
const WINDOW_MM = { first: 8000, least: 1000, most: 200_000 };
/** The zoom of a press, and the share of the window that it moves. */
const ZOOM = 2;
const STEP = 0.5;
/** The picture's height, and its parts from above: alarms, canopies, the tool's track, and the speed. */
const HEIGHT = 200;
const AT = { alarm: 0, row: 24, rowEnd: 84, track: 100, speed: 120, speedEnd: 180, note: 196 };
/** The possible distances between two marks. The first with few enough marks in the window is used. */
const MARKS_MM = [200, 500, 1000, 2000, 5000, 10_000, 20_000, 50_000];
const MARKS = 8;
/** Ground beside the window from which the line of the speed comes. Speeds are nearer to each other. */
const BESIDE_MM = 1500;
/** From here on a duration is shown in minutes, and in hours. */
const MINUTE_S = 120;
const HOUR_S = 7200;
/** The look of a detection, by its class. */
const CLASSES = ["canopy", "weed", "canopy unknown"];
/** The legend of the map: see host/gps/src/picture.rs. */
const MAP_LEGEND = ["mapWeeded", "mapLeft", "plant", "mapKept", "legendWeed", "mapLabel", "mapAlarm"] as const;

interface Row {
    readonly file: File;
    readonly picture: Picture;
    readonly drawing: SVGSVGElement;
    /** The text about the window's middle. */
    readonly at: HTMLElement;
}

export class RecordView {
    readonly #place: HTMLInputElement;
    readonly #resized = new ResizeObserver(() => this.#draw());
    #rows: readonly Row[] = [];
    #windowMm = WINDOW_MM.first;
    #middleMm = 0;
    /** The flag that the rows were moved to, until they are moved on. */
    #flag: Trouble | undefined;
    #isToBeDrawn = false;
    #work = new AbortController();

    /** `example` makes a log to look at, and takes a function to tell how far it is. */
    constructor(
        private readonly parts: Parts,
        private readonly example: (work: Work) => Promise<File>,
    ) {
        this.#place = parts.get("log-place", HTMLInputElement);
        parts.files("log-open", "log-file", (files) => void this.#open(files));
        parts.button("log-example", () => void this.#openExample());
        for (const [name, by] of Object.entries({ "log-back": -STEP, "log-on": STEP }))
            parts.button(name, () => this.#go(this.#middleMm + by * this.#windowMm));
        parts.button("log-closer", () => this.#zoom(1 / ZOOM));
        parts.button("log-farther", () => this.#zoom(ZOOM));
        parts.button("alarm-before", () => this.#toAlarm(-1));
        parts.button("alarm-next", () => this.#toAlarm(1));
        parts.button("log-replay", () => void this.#replay());
        parts.button("log-map", () => void this.#map());
        parts.button("log-cancel", () => this.#work.abort());
        this.#place.addEventListener("input", () => this.#go(this.#place.valueAsNumber));
        const rows = parts.html("log-rows");
        rows.addEventListener(
            "wheel",
            (event) => {
                event.preventDefault();
                if (event.ctrlKey) this.#zoom(event.deltaY > 0 ? ZOOM : 1 / ZOOM);
                else this.#go(this.#middleMm + ((event.deltaX + event.deltaY) / 1000) * this.#windowMm);
            },
            { passive: false },
        );
        // Not every browser has `movementX`, or counts it in these pixels.
        let lastX = 0;
        for (const type of ["pointerdown", "pointermove"] as const)
            rows.addEventListener(type, ({ isPrimary, buttons, clientX }) => {
                if (!isPrimary) return;
                const byX = (clientX - lastX) / Math.max(rows.clientWidth, 1);
                if (type === "pointermove" && buttons === 1) this.#go(this.#middleMm - byX * this.#windowMm);
                lastX = clientX;
            });
        onLanguage(() => this.#draw());
    }

    async #open(files: readonly File[]): Promise<void> {
        this.#show([]);
        for (const name of ["log-replayed", "log-alarm", "log-mapped"]) this.parts.write(name, "");
        const texts: (() => string)[] = [];
        const rows: Row[] = [];
        const isWhole = await this.#eachOf(files, "log-said", async (file, work) => {
            const found = await picture(file, work);
            if ("problem" in found) texts.push(() => say("noLog", { file: file.name, why: found.problem }));
            else if (found.speeds.length === 0) texts.push(() => say("emptyLog", { file: file.name }));
            else {
                const drawing = draw("svg", { class: "log-row", role: "img", "data-part": "log-drawing" });
                rows.push({ file, picture: found, drawing, at: make("p", "log-at") });
                texts.push(() => inWords(file, found));
            }
        });
        if (!isWhole) return;
        this.parts.say("log-said", () => texts.map((text) => text()).join(" "));
        this.#show(rows);
    }

    async #openExample(): Promise<void> {
        let log: File | undefined;
        const isWhole = await this.#eachOf([new File([], "weeder-log.csv")], "log-said", async (_, work) => {
            log = await this.example(work);
        });
        if (isWhole && log) await this.#open([log]);
    }

    /**
     * Works on each file, and shows the progress of all. Another such work, or the operator, cancels it: then returns
     * false. Errors are shown in this part.
     */
    async #eachOf(
        files: readonly File[],
        said: string,
        use: (file: File, work: Work) => Promise<void>,
    ): Promise<boolean> {
        this.#work.abort();
        const work = new AbortController();
        this.#work = work;
        const bar = this.parts.get("log-progress", HTMLProgressElement);
        const busy = this.parts.html("log-busy");
        bar.value = 0;
        busy.hidden = false;
        this.parts.write(said, "");
        let at = "";
        try {
            for (const [done, file] of files.entries()) {
                at = file.name;
                const progress = (share: number) => {
                    bar.value = (done + share) / files.length;
                };
                await use(file, { progress, cancel: work.signal });
            }
            return true;
        } catch (error) {
            if (this.#work !== work) return false;
            const { aborted } = work.signal;
            this.parts.say(said, () => say(aborted ? "cancelled" : "notRead", { file: at, why: reason(error) }));
            return false;
        } finally {
            if (this.#work === work) busy.hidden = true;
        }
    }

    #show(rows: readonly Row[]): void {
        this.#rows = rows;
        this.#resized.disconnect();
        this.parts.html("log-body").hidden = rows.length === 0;
        this.parts.html("log-places").hidden = !rows.some(({ picture }) => picture.hasPlaces);
        this.#showMap(null);
        this.parts.html("log-rows").replaceChildren(...rows.map(({ drawing, at }) => make("div", "", drawing, at)));
        for (const { drawing } of rows) this.#resized.observe(drawing);
        this.#place.max = String(Math.ceil(this.#endMm));
        this.#windowMm = WINDOW_MM.first;
        this.#go(this.#windowMm / 2);
    }

    get #endMm(): number {
        return this.#rows.reduce((most, { picture }) => Math.max(most, picture.lengthMm), 0);
    }

    #zoom(by: number): void {
        this.#windowMm = Math.min(Math.max(this.#windowMm * by, WINDOW_MM.least), WINDOW_MM.most);
        this.#draw();
    }

    #go(middleMm: number): void {
        this.#flag = undefined;
        this.#middleMm = Math.min(Math.max(middleMm, 0), this.#endMm);
        this.#place.value = String(Math.round(this.#middleMm));
        this.#draw();
    }

    #toAlarm(way: 1 | -1): void {
        // After rolling back, the machine may have reached an alarm's position again.
        const flags = this.#rows
            .flatMap(({ file, picture }) => picture.alarms.map((flag) => ({ flag, file })))
            .sort((one, other) => one.flag.mm - other.flag.mm);
        // Several flags may be at the same position.
        const shown = flags.findIndex(({ flag }) => flag === this.#flag);
        const ahead = flags.filter(({ flag }, at) =>
            shown < 0 ? way * (flag.mm - this.#middleMm) > 0.5 : way * (at - shown) > 0,
        );
        const next = ahead.at(way > 0 ? 0 : -1);
        if (next) {
            this.#go(next.flag.mm);
            this.#flag = next.flag;
        }
        this.parts.say("log-alarm", () => {
            if (!next) return say(way > 0 ? "noAlarmNext" : "noAlarmBefore");
            const { title, advice } = fault(next.flag.name);
            return this.#of(
                next.file,
                `${say(next.flag.isWarning ? "warning" : "alarm", { title })}: ${sentence(advice)}`,
            );
        });
    }

    /** The text about a file, with its name if there are others. */
    #of(file: File, text: string): string {
        return this.#rows.length > 1 ? `${file.name}: ${text}` : text;
    }

    async #replay(): Promise<void> {
        const files = this.#rows.map(({ file }) => file);
        const results: (() => string)[] = [];
        const isWhole = await this.#eachOf(files, "log-replayed", async (file, work) => {
            const result = await read<Replayed | Problem>([file], "replay", work);
            results.push(() => this.#of(file, "problem" in result ? sentence(result.problem) : agreement(result)));
        });
        if (isWhole) this.parts.say("log-replayed", () => results.map((result) => result()).join(" "));
    }

    async #map(): Promise<void> {
        const files = this.#rows.map(({ file }) => file);
        const words = {
            legend: MAP_LEGEND.map((word) => say(word)),
            withoutPlace: say("mapMissing"),
            north: say("north"),
        };
        await this.#eachOf(files.slice(0, 1), "log-mapped", async (_, work) => {
            const { svg, placed, leftOut } = await read<Mapped>(files, { map: words }, work);
            const left = () => (leftOut > 0 ? ` ${say("mapLeftOut", { count: leftOut })}` : "");
            this.parts.say("log-mapped", () => (svg ? say("mapped", { count: placed }) : say("noMap")) + left());
            this.#showMap(svg);
        });
    }

    #showMap(svg: string | null): void {
        const drawn = this.parts.get("log-map-drawn", HTMLImageElement);
        URL.revokeObjectURL(drawn.src);
        drawn.hidden = svg === null;
        if (svg) drawn.src = URL.createObjectURL(new Blob([svg], { type: "image/svg+xml" }));
    }

    /** Draws the rows once in the browser's next frame, after any number of moves. */
    #draw(): void {
        if (this.#isToBeDrawn) return;
        this.#isToBeDrawn = true;
        requestAnimationFrame(() => {
            this.#isToBeDrawn = false;
            for (const row of this.#rows) this.#drawRow(row);
        });
    }

    #drawRow({ file, picture: shown, drawing, at }: Row): void {
        const { clientWidth } = drawing;
        if (clientWidth === 0) return;
        const fromMm = this.#middleMm - this.#windowMm / 2;
        const toMm = fromMm + this.#windowMm;
        const x = (mm: number) => ((mm - fromMm) / this.#windowMm) * clientWidth;
        const bar = (className: string, one: number, other: number, top: number, height: number) =>
            draw("rect", { class: className, x: x(one), width: Math.max(x(other) - x(one), 1), y: top, height });
        const objects = shown.objects.near(fromMm, toMm);
        const row = AT.rowEnd - AT.row;
        const middle = x(this.#middleMm);
        drawing.ariaLabel = `${file.name}: ${say("logDrawing")}`;
        drawing.setAttribute("viewBox", `0 0 ${clientWidth} ${HEIGHT}`);
        drawing.replaceChildren(
            ...objects
                .filter((object) => CLASSES[object.class] !== "weed")
                .map(({ zoneMm, zoneEndMm }) => bar("window", zoneMm, zoneEndMm, AT.row, row)),
            ...objects.map((object) =>
                bar(CLASSES[object.class] ?? "", object.fromMm, object.toMm, AT.row + row / 4, row / 2),
            ),
            ...shown.worked.near(fromMm, toMm).map(({ startMm, endMm }) => bar("worked", startMm, endMm, AT.track, 10)),
            draw("path", {
                fill: "none",
                stroke: "var(--ink)",
                "stroke-width": 1.5,
                d: speedLine(shown.speeds.near(fromMm - BESIDE_MM, toMm + BESIDE_MM), shown.fastestMmS, x),
            }),
            draw("line", { stroke: "var(--rule)", x1: middle, x2: middle, y1: 0, y2: AT.speedEnd }),
            ...shown.alarms
                .filter(({ mm }) => mm >= fromMm && mm <= toMm)
                .map(({ mm, isWarning }) => {
                    const colour = isWarning ? "var(--hold)" : "var(--alarm)";
                    const d = `M${x(mm)} ${AT.alarm}l14 9l-14 9V${AT.speedEnd}`;
                    return draw("path", { class: "flag", fill: colour, stroke: colour, d });
                }),
            ...marks(fromMm, toMm, x),
        );
        const { timeMs, mmS } = shown.speeds.nearest(this.#middleMm);
        at.textContent = say("atPlace", {
            distance: metres(this.#middleMm),
            time: duration(timeMs),
            speed: quantity(mmS * 0.0036, "kilometer-per-hour", 1),
        });
    }
}

function speedLine(speeds: readonly Speed[], fastestMmS: number, x: (mm: number) => number): string {
    const y = (mmS: number) => AT.speedEnd - (Math.abs(mmS) / fastestMmS) * (AT.speedEnd - AT.speed);
    const points = speeds.map(({ mm, mmS }) => `${x(mm).toFixed(1)} ${y(mmS).toFixed(1)}`);
    return points.length > 0 ? `M${points.join("L")}` : "";
}

function marks(fromMm: number, toMm: number, x: (mm: number) => number): SVGElement[] {
    const apart = MARKS_MM.find((apart) => (toMm - fromMm) / apart <= MARKS) ?? (toMm - fromMm) / MARKS;
    const marks: SVGElement[] = [];
    for (let mm = Math.ceil(Math.max(fromMm, 0) / apart) * apart; mm <= toMm; mm += apart) {
        const text = quantity(mm / 1000, "meter", apart < 1000 ? 1 : 0);
        marks.push(
            draw("text", { class: "note", x: x(mm), y: AT.note, "font-size": 12, "text-anchor": "middle" }, text),
        );
    }
    return marks;
}

function inWords(file: File, { lengthMm, timeMs, objects, swings, alarms, unknownMs }: Picture): string {
    const has = say("logHas", {
        file: file.name,
        distance: metres(lengthMm),
        time: duration(timeMs),
        objects: objects.length,
        swings,
        count: alarms.length,
    });
    return [has, ...unknownMs.map((ms) => say("logUnknown", { time: duration(ms) }))].join(" ");
}

function agreement({ objects, alarms, swings, difference, notes }: Replayed): string {
    return [
        say("replaySame", { objects, alarms, swings }),
        difference === null ? say("replayWhole") : say("replayDiffers", { difference }),
        ...notes.map(sentence),
    ].join(" ");
}

const metres = (mm: number) => quantity(mm / 1000, "meter", mm < 100_000 ? 1 : 0);

function duration(ms: number): string {
    const seconds = ms / 1000;
    if (seconds < MINUTE_S) return quantity(seconds, "second", 1);
    return seconds < HOUR_S ? quantity(seconds / 60, "minute", 1) : quantity(seconds / 3600, "hour", 1);
}
