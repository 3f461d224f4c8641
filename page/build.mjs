// Makes what runs out of what is written: `node build.mjs page` makes dist/, `node build.mjs tests` makes build/tests/.
//
// The page is three files that a browser opens from anywhere, the disk included: the firmware is inside, and so is the project's
// own Rust, as a browser gives no page a file of the disk. The firmware's HEX comes from `cargo firmware`, which has to be run
// first; WEEDER_HEX names another HEX file. The Rust is built here.

import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { fileURLToPath } from "node:url";
import { build } from "esbuild";

const here = fileURLToPath(new URL(".", import.meta.url));
process.chdir(here);

const target = process.env.CARGO_TARGET_DIR ?? "../target";

/** The firmware as a HEX file. */
function firmware() {
    if (process.env.WEEDER_HEX) return process.env.WEEDER_HEX;
    const elf = join(target, "avr-none/firmware/weeder-firmware.elf");
    if (!existsSync(elf)) {
        console.error(`${elf} is not there: run \`cargo firmware\` first, or name a HEX file in WEEDER_HEX`);
        process.exit(1);
    }
    mkdirSync("build", { recursive: true });
    execFileSync("avr-objcopy", ["-O", "ihex", "-j", ".text", "-j", ".data", elf, "build/weeder.hex"]);
    return "build/weeder.hex";
}

/** The project's Rust as WebAssembly. */
function rust() {
    execFileSync("cargo", ["page", "--quiet"], { stdio: "inherit" });
    return join(target, "wasm32-unknown-unknown/page/page.wasm");
}

/** What the manual's table says of alarms and warnings, as a file. */
function faults() {
    const rows = readFileSync("../docs/faults.md", "utf8").matchAll(
        /^\| (?:(\d-\d) )?\| `(\w+)`[^|]*\| ([^|]*) \| [^|]* \| ([^|]*) \|$/gm,
    );
    const faults = [...rows].map(([, code = "", name, cause, advice]) => ({ code, name, cause, advice }));
    mkdirSync("build", { recursive: true });
    writeFileSync("build/faults.json", JSON.stringify(faults));
    return "build/faults.json";
}

/** @type {import("esbuild").BuildOptions} */
const common = {
    bundle: true,
    target: "es2022",
    // avr8js as modules also for node: its other form looks each function up anew at every call, and takes twice the time.
    mainFields: ["module", "main"],
    alias: { "weeder.hex": resolve(firmware()), "page.wasm": resolve(rust()), "faults.json": resolve(faults()) },
    loader: { ".hex": "text", ".wasm": "binary" },
};

const what = process.argv[2];
if (what === "page") {
    rmSync("dist", { recursive: true, force: true });
    await build({
        ...common,
        entryPoints: ["src/page.ts", "src/page.css", "src/index.html"],
        outdir: "dist",
        format: "iife",
        loader: { ...common.loader, ".html": "copy" },
        minify: true,
    });
    console.log("The page is in page/dist: open index.html.");
} else if (what === "tests") {
    rmSync("build/tests", { recursive: true, force: true });
    const entryPoints = readdirSync("tests").filter((name) => name.endsWith(".test.ts"));
    await build({
        ...common,
        entryPoints: entryPoints.map((name) => join("tests", name)),
        outdir: "build/tests",
        outExtension: { ".js": ".mjs" },
        platform: "node",
        external: ["playwright-core"],
        format: "esm",
        sourcemap: "inline",
    });
} else {
    console.error("usage: node build.mjs page|tests");
    process.exit(1);
}
