// node types_test.mjs NPM PAGE: the page's sources have no type errors. Status 77: the npm packages are not there.
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";

const [npm, page] = process.argv.slice(2);
const compiler = path.resolve(npm, "node_modules/typescript/bin/tsc");
if (!fs.existsSync(compiler)) {
  console.log("skipped: build/npm has no typescript; scripts/setup installs it");
  process.exit(77);
}
// Packages are found in node_modules beside the sources: as clients/view/page/build.cmake does.
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-types-"));
try {
  fs.cpSync(page, scratch, { recursive: true });
  fs.symlinkSync(path.resolve(npm, "node_modules"), path.join(scratch, "node_modules"));
  execFileSync(process.execPath, [compiler, "--project", scratch], { stdio: "inherit" });
} catch (error) {
  if (error.status === undefined) throw error;
  process.exitCode = 1;
} finally {
  fs.rmSync(scratch, { recursive: true, force: true });
}
