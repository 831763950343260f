// Shared parts of the tests and measurements of the page: Chromium, and processes of Kilotwin that print an address.
import { spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

/** Chromium through playwright-core, or the reason why it is not there. */
export async function launchBrowser(npm) {
  let playwright;
  try {
    playwright = createRequire(path.resolve(npm, "package.json"))("playwright-core");
  } catch {
    return { reason: "build/npm has no playwright-core; scripts/setup installs it" };
  }
  const executablePath = ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((file) => fs.existsSync(file));
  if (!executablePath) return { reason: "no Chromium; scripts/setup --develop installs it" };
  const browser = await playwright.chromium.launch({
    executablePath,
    // Root needs --no-sandbox; the pages come from this machine alone.
    args: ["--no-sandbox", "--enable-unsafe-swiftshader", "--disable-background-networking"],
  });
  return { browser };
}

/** A process that prints "kilotwin: open ADDRESS" on stderr. */
export class Served {
  /** Returns once the program has printed what `said` finds: by default the address of a page. */
  static async start(words, cwd, said = /kilotwin: open (https?:\S+)/) {
    const served = new Served();
    served.process = spawn(words[0], words.slice(1), { cwd, stdio: ["ignore", "pipe", "pipe"] });
    served.ended = new Promise((resolve) => served.process.on("exit", (status, signal) => resolve(status ?? signal)));
    served.text = "";
    served.process.stdout.on("data", (data) => (served.text += data));
    served.found = await new Promise((resolve, reject) => {
      served.process.stderr.on("data", (data) => {
        served.text += data;
        const found = said.exec(served.text);
        if (found) resolve(found[1]);
      });
      served.process.on("exit", () => reject(new Error(`ended before it printed ${said}: ${served.text}`)));
      served.process.on("error", reject);
    });
    if (served.found.startsWith("http")) {
      served.address = served.found;
      served.port = Number(new URL(served.address).port);
    }
    return served;
  }
  async stop() {
    this.process.kill("SIGTERM");
    return this.ended;
  }
}

/** Polls until `condition` holds; throws after a bound against hanging. */
export async function eventually(what, condition, seconds = 60) {
  const until = Date.now() + 1000 * seconds;
  for (;;) {
    if (await condition()) return;
    if (Date.now() > until) throw new Error(`never happened: ${what}`);
    await new Promise((resolve) => setTimeout(resolve, 25));
  }
}
