// node types_test.mjs NPM PAGE: the page's sources have no type errors. Status 77: the npm packages are not there.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";

const [npm, page] = process.argv.slice(2);
const compiler = path.resolve(npm, "node_modules/typescript/bin/tsc");
if (!fs.existsSync(compiler)) {
  console.log("skipped: build/npm has no typescript; scripts/setup installs it");
  process.exit(77);
}
try {
  execFileSync(process.execPath, [compiler, "--project", page], { stdio: "inherit" });
} catch {
  process.exit(1);
}
