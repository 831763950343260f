// Shared parts of the tests of the page in Chromium. A test gives the words of its command line:
//   KILOTWIN VIEW SAMPLES NPM SOURCES [PICTURES]
// With PICTURES, screenshots go to that directory. Status 77: there is no Chromium or playwright-core.
import assert from "node:assert/strict";
import fs from "node:fs";
import os from "node:os";
import path from "node:path";
import { Served, eventually, launchBrowser } from "./browser.mjs";

export const [kilotwin, viewProgram, samples, npm, sources, pictures] = process.argv.slice(2);
const { browser, reason } = await launchBrowser(npm);
if (reason) {
  console.log(`skipped: ${reason}`);
  process.exit(77);
}
export const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-page-"));
export const HALF_MM = 1000; // of the arena
const started = [];

export async function serve(words) {
  const served = await Served.start(words, scratch);
  started.push(served);
  return served;
}

/** A run, once it has printed its DDS domain, which is `found`. */
export async function start(words) {
  const run = await Served.start(words, scratch, /runs on DDS domain (\d+)/);
  started.push(run);
  return run;
}

/** A page that fails the test on any error, and on any request to another address. */
export async function open(address, context = browser) {
  const page = await context.newPage({ viewport: { width: 1280, height: 720 } });
  page.faults = [];
  page.on("pageerror", (error) => page.faults.push(error.message));
  page.on("console", (message) => {
    // The browser reports every refused connection; the page tries again.
    if (message.type() === "error" && !message.text().includes("ERR_CONNECTION_REFUSED")) page.faults.push(message.text());
  });
  page.on("request", (request) => {
    if (new URL(request.url()).host !== new URL(address).host && !request.url().startsWith("blob:")) page.faults.push(request.url());
  });
  await page.addInitScript(() => {
    const Socket = window.WebSocket;
    window.WebSocket = class extends Socket {
      constructor(...words) {
        super(...words);
        window.lastSocket = this;
      }
    };
  });
  await page.goto(address);
  await connected(page);
  return page;
}
/** The page takes a message as if the gateway had sent it. */
export const tell = (page, message) => page.evaluate((data) => window.lastSocket.onmessage({ data }), JSON.stringify(message));
export const newContext = () => browser.newContext();
export const text = (page, id) => page.locator(`#${id}`).textContent();
export const connected = (page) => eventually("connected", async () => (await page.locator("body").getAttribute("data-connection")) === "open");
export const counter = (page, name) => page.evaluate((key) => window.kilotwin[key], name);
export const received = (page) => counter(page, "received");
export const drawn = (page) => counter(page, "drawn");
export const clock = async (page) => Number.parseFloat(await text(page, "clock"));
export const press = (page, name) => page.getByRole("button", { name, exact: true }).click();
export const picture = async (page, name) => pictures && page.screenshot({ path: path.join(pictures, `${name}.png`) });
export const phase = (page, wanted) => eventually(`phase ${wanted}`, async () => (await text(page, "phase")) === wanted);

/** Waits until an element shows a text, or one that a regular expression matches. */
export async function says(page, id, wanted) {
  let last = "";
  const look = async () => {
    last = await text(page, id);
    return wanted instanceof RegExp ? wanted.test(last) : last === wanted;
  };
  await eventually(`"${id}" shows ${wanted}`, look).catch((error) => {
    throw new Error(`${error.message}; it shows ${JSON.stringify(last)}`);
  });
}

/** Where a place of the arena is while the whole arena is shown. */
export async function onScreen(page, x, y) {
  const box = await page.locator("#picture").boundingBox();
  const pxPerMm = Math.min(box.width, box.height) / (2 * 1.06 * HALF_MM);
  return [box.x + box.width / 2 + x * pxPerMm, box.y + box.height / 2 - y * pxPerMm];
}

/** The content of a file that the page saves. */
export async function saved(page, button) {
  const download = page.waitForEvent("download");
  await press(page, button);
  return fs.readFileSync(await (await download).path());
}

/** What the panel of the selected robot says: x, y in mm and the heading in degrees. */
export async function poseOfSelected(page) {
  const found = /x, y(-?[\d.]+), (-?[\d.]+) mmheading(-?\d+)/.exec(await text(page, "robot-facts"));
  assert.ok(found, "a robot is selected");
  return found.slice(1).map(Number);
}

export async function select(page, robot) {
  await page.locator("#find-id").fill(String(robot));
  await press(page, "Select");
  await eventually(`robot ${robot}`, async () => (await text(page, "robot-title")) === `Robot ${robot}`);
}

/** Runs tests one after another, and ends what they have started. */
export async function run(...tests) {
  try {
    for (const test of tests) await test();
    console.log("the page does what it should");
  } finally {
    await browser.close();
    for (const served of started) await served.stop();
    fs.rmSync(scratch, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
  }
}
