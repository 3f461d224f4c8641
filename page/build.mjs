// Builds the page: `node build.mjs page` makes dist/, and `node build.mjs tests` makes build/tests/. Both make
// build/lockstep.mjs, the page's virtual Uno for another program.
//
// The page has three files that a browser opens from any source, also from the disk. Three more files make it
// installable from a server. The firmware, the project's Rust and the translations are inside the page, because a page
// opened from the disk may read no file. They are compressed, as they would be more than half of the page. The firmware
// comes from `cargo firmware`, which must run first. The command `weeder` proves its bounds: the one that WEEDER names,
// else this repository's. The Rust is built here.

import { execFileSync } from "node:child_process";
import { createHash } from "node:crypto";
import { existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { basename, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { deflateAsync } from "@gfx/zopfli";
import { build, transform } from "esbuild";

const here = fileURLToPath(new URL(".", import.meta.url));
process.chdir(here);

const metadata = execFileSync("cargo", ["metadata", "--no-deps", "--format-version", "1"], { encoding: "utf8" });
/** Cargo's folder, as variables and the user's configuration of cargo name it. */
const target = JSON.parse(metadata).target_directory;
mkdirSync("build", { recursive: true });

/** The firmware as a HEX file. `weeder hex` refuses a firmware with unproved bounds. */
function firmware() {
    const elf = join(target, "avr-none/firmware/weeder-firmware.elf");
    if (!existsSync(elf)) {
        console.error(`${elf} is not there: run \`cargo firmware\` first`);
        process.exit(1);
    }
    const [command, ...words] = process.env.WEEDER
        ? [process.env.WEEDER]
        : ["cargo", "run", "--quiet", "--package", "weeder-cli", "--"];
    const hex = "build/weeder.hex";
    execFileSync(command, [...words, "hex", hex, "--force", "--elf", elf], { stdio: ["ignore", "ignore", "inherit"] });
    return hex;
}

/** The firmware's commit, which only a release names. */
const { WEEDER_COMMIT: commit = "", ...environment } = process.env;

/** The project's Rust as WebAssembly. It does not see the commit, so a new one compiles nothing. */
function rust() {
    execFileSync("cargo", ["page", "--quiet"], { stdio: "inherit", env: environment });
    return join(target, "wasm32-unknown-unknown/page/page.wasm");
}

/** Writes a file for esbuild, and returns its path. */
function built(/** @type {string} */ name, /** @type {string | Buffer} */ content) {
    const path = resolve("build", name);
    writeFileSync(path, content);
    return path;
}

/** Compresses a file into a file; src/core.ts decompresses it. Zopfli packs it smaller than zlib. */
const packed = async (/** @type {string} */ path) =>
    built(`${basename(path)}.deflated`, Buffer.from(await deflateAsync(readFileSync(path), {})));

/** The translations: each table by its language. */
const languages = Object.fromEntries(
    readdirSync("src/words")
        .filter((name) => name.endsWith(".json"))
        .map((name) => [basename(name, ".json"), JSON.parse(readFileSync(`src/words/${name}`, "utf8"))]),
);

/**
 * The worker that reads logs, as a file. A page opened from the disk can only start a worker whose code is inside the
 * page.
 */
async function logWorker() {
    const outfile = resolve("build/log-worker.txt");
    await build({ entryPoints: ["src/record/worker.ts"], bundle: true, minify: true, target: "es2022", outfile });
    return outfile;
}

/** The manual's table of alarms and warnings, as a file. */
function faults() {
    const manual = readFileSync("../docs/faults.md", "utf8");
    const rows = manual.matchAll(/^\| `((?:\d-\d )?(\w+))`[^|]*\| ([^|]*) \|$/gm);
    return built("faults.json", JSON.stringify([...rows].map(([, title, name, advice]) => ({ name, title, advice }))));
}

/** The page's HTML without its indentation, with the English texts instead of their names behind `$`. */
async function html() {
    const { code } = await transform(readFileSync("src/words/en.ts"), { loader: "ts" });
    const { words } = await import(`data:text/javascript,${encodeURIComponent(code)}`);
    // Shown in every language, because no code has chosen one.
    words.notStarted = [{ words }, ...Object.values(languages)].map(({ words }) => words.notStarted).join(" / ");
    const source = readFileSync("src/index.html", "utf8").replaceAll(/\n +/g, "\n");
    return source.replaceAll(/\$(\w+)/g, (_, name) => {
        if (words[name] === undefined) throw new Error(`src/words/en.ts lacks the text ${name} of src/index.html`);
        return words[name];
    });
}

/** The SHA-256 of a text. */
const hashOf = (/** @type {string} */ text) => createHash("sha256").update(text).digest("hex");

/** The files that an installed page has, and their media types. */
const MEDIA = {
    "index.html": "text/html; charset=utf-8",
    "page.css": "text/css; charset=utf-8",
    "page.js": "text/javascript; charset=utf-8",
    "manifest.webmanifest": "application/manifest+json",
    "icon.svg": "image/svg+xml",
};

/** The tests that take longest. The first in this list start first. */
const LONGEST = ["flasher", "work", "words", "page", "update", "access", "record", "screen", "board", "session"];

/** @type {import("esbuild").BuildOptions} */
const common = {
    bundle: true,
    charset: "utf8",
    target: "es2022",
    // avr8js as modules, also for node. Its other form resolves each function again at every call, and takes twice the
    // time.
    mainFields: ["module", "main"],
    alias: {
        "firmware.deflated": await packed(firmware()),
        "rust.deflated": await packed(rust()),
        "languages.deflated": await packed(built("languages.json", JSON.stringify(languages))),
        "log-worker.js": await logWorker(),
        "faults.json": faults(),
    },
    define: { COMMIT: JSON.stringify(commit && ` (${commit})`) },
    loader: { ".txt": "text", ".deflated": "binary" },
};

/** @type {import("esbuild").BuildOptions} */
const forNode = { ...common, platform: "node", format: "esm" };

await build({ ...forNode, entryPoints: ["src/uno/lockstep.ts"], outfile: "build/lockstep.mjs" });

const what = process.argv[2];
if (what === "page") {
    rmSync("dist", { recursive: true, force: true });
    mkdirSync("dist");
    /** @type {import("esbuild").BuildOptions} */
    const page = { ...common, outdir: "dist", entryNames: "[name]", format: "iife", minify: true };
    const { outputFiles = [] } = await build({
        ...page,
        entryPoints: ["src/start.ts", "src/page.css"].map((path) => ({ in: path, out: "page" })),
        define: { ...common.define, BUILD: '"{BUILD}"' },
        write: false,
    });
    const parts = Object.fromEntries(outputFiles.map(({ path, text }) => [basename(path), text]));
    for (const name of ["manifest.webmanifest", "icon.svg"]) parts[name] = readFileSync(join("src/app", name), "utf8");
    parts["index.html"] = await html();
    // The build's name is the hash of the files without it.
    const name = hashOf(Object.entries(parts).sort().join()).slice(0, 16);
    // What the worker stores: by its address, the hash of its content, and its media type.
    const files = Object.entries(MEDIA).map(([file, media]) => {
        const content = (parts[file] ?? "").replaceAll("{BUILD}", name);
        writeFileSync(join("dist", file), content);
        const address = file === "index.html" ? "./" : file.startsWith("page.") ? `${file}?${name}` : file;
        return [address, { hash: hashOf(content), media }];
    });
    const define = { BUILD: JSON.stringify(name), FILES: JSON.stringify(Object.fromEntries(files)) };
    await build({ ...page, entryPoints: ["src/app/worker.ts"], define });
    console.log("The page is in page/dist: open index.html.");
} else if (what === "tests") {
    rmSync("build/tests", { recursive: true, force: true });
    const entryPoints = readdirSync("tests").filter((name) => name.endsWith(".test.ts"));
    // Node starts the files in the order of their names. A long one at the end would run alone, beside an idle core.
    const named = (/** @type {string} */ name) => {
        const place = LONGEST.indexOf(basename(name, ".test.ts"));
        return `${place < 0 ? "" : `${String(place).padStart(2, "0")}-`}${basename(name, ".ts")}`;
    };
    await build({
        ...forNode,
        entryPoints: entryPoints.map((name) => ({ in: join("tests", name), out: named(name) })),
        outdir: "build/tests",
        outExtension: { ".js": ".mjs" },
        inject: ["tests/ready.ts"],
        external: ["playwright"],
        sourcemap: "inline",
    });
} else {
    console.error("usage: node build.mjs page|tests");
    process.exit(1);
}
