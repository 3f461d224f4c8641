// Makes an SBOM independent of run and folder: `node sbom.mjs FROM TO [PACKAGE...]`. It removes number, time and the folder's name.
//
// Each PACKAGE, as `NAME|VERSION|LICENCE`, is linked C code. The package managers of Rust and Node.js do not know it, so it is
// added here.

import { readFileSync, writeFileSync } from "node:fs";

const [from, to, ...packages] = process.argv.slice(2);
const here = process.cwd();
const sbom = JSON.parse(readFileSync(from, "utf8").replaceAll(encodeURI(here), "/weeder").replaceAll(here, "/weeder"));
delete sbom.serialNumber;
delete sbom.metadata.timestamp;
if (sbom.bomFormat !== "CycloneDX" || !sbom.components?.length) {
    throw new Error(`${from} is no SBOM with components`);
}
for (const text of packages) {
    const [name, version, expression] = text.split("|");
    if (!name || !version || !expression) throw new Error(`\`${text}\` is not NAME|VERSION|LICENCE`);
    sbom.components.push({ type: "library", name, version, licenses: [{ expression }] });
}
writeFileSync(to, `${JSON.stringify(sbom, null, 2)}\n`);
