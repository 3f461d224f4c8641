// Checks the links of a folder's HTML and Markdown files: `node .ci/links.mjs FOLDER`. Each link to a file must lead to
// one inside of the folder, and each mark behind # must be in that file. Prints the dead links, and fails if there is one.

import { existsSync, readdirSync, readFileSync, statSync } from "node:fs";
import { dirname, join, relative, resolve } from "node:path";

const folder = resolve(process.argv[2] ?? ".");
const textOf = (path) => readFileSync(path, "utf8");

/** Text without the code in it, where brackets are no links. */
const bare = (path) => {
    const text = textOf(path);
    return path.endsWith(".md")
        ? text.replaceAll(/^(```|~~~)[^]*?^\1/gm, "").replaceAll(/`[^`\n]*`/g, "")
        : text.replaceAll(/<(script|template)\b[^]*?<\/\1>/g, (script) => script.slice(0, script.indexOf(">") + 1));
};

function marks(path) {
    const text = textOf(path);
    if (!path.endsWith(".md")) return [...text.matchAll(/\b(?:id|name)="([^"]*)"/g)].map(([, mark]) => mark);
    const heads = [...text.matchAll(/^#+ (.*)$/gm)].map(([, head]) =>
        head.toLowerCase().replaceAll(/\]\([^)]*\)/g, "").replaceAll(/[^\p{L}\p{N} _-]/gu, "").replaceAll(" ", "-"),
    );
    return [...heads, ...[...text.matchAll(/<a (?:id|name)="([^"]*)"/g)].map(([, mark]) => mark)];
}

const dead = [];
const files = readdirSync(folder, { recursive: true }).filter((path) => /\.(html|md)$/.test(path));
for (const file of files.map((path) => join(folder, path))) {
    const pattern = file.endsWith(".md") ? /\]\(<?([^)>\s]+)/g : /\b(?:href|src)="([^"]*)"/g;
    for (const [, link] of bare(file).matchAll(pattern)) {
        if (/^(\w+:|\/\/)/.test(link)) continue;
        const [path = "", mark] = link.replaceAll("&amp;", "&").split("#");
        let to = path === "" ? file : join(dirname(file), decodeURIComponent(path.replace(/\?.*/, "")));
        if (existsSync(to) && statSync(to).isDirectory() && existsSync(join(to, "index.html"))) to = join(to, "index.html");
        const isThere = existsSync(to) && !relative(folder, to).startsWith("..");
        // The page's marks are its views.
        const isMarked = !mark || !isThere || !/\.(html|md)$/.test(to) || marks(to).some((has) => has === mark || has === `view-${mark}`);
        if (!isThere || !isMarked) dead.push(`${relative(folder, file)}: ${link}`);
    }
}
if (files.length === 0) dead.push(`${folder} has no page`);
for (const link of dead) console.error(`dead link in ${link}`);
process.exit(dead.length > 0 ? 1 : 0);
