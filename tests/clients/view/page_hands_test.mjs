// node page_hands_test.mjs KILOTWIN VIEW SAMPLES NPM SOURCES [PICTURES]: hands in a live run, in headless Chromium. Robots and
// objects are moved and turned; partitions hand robots over; messages fly; federates tell what they wait for; a tracker's log plays
// real robots, one of which leaves the model.
import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { eventually } from "./browser.mjs";
import {
  clock, counter, drawn, kilotwin, newContext, onScreen, open, phase, picture, poseOfSelected, press, run, saved, says, scratch, select, serve, tell, text,
} from "./page_tools.mjs";

const TICK_S = 0.032768;
const tickOf = async (page) => Math.round((await clock(page)) / TICK_S);
/** The tick at which a paused run stands; it repeats its state every half second. */
async function standingTick(page) {
  let tick = -1;
  await eventually("time stands still", async () => {
    const now = await tickOf(page);
    const same = now === tick;
    tick = now;
    await page.waitForTimeout(600);
    return same;
  });
  return tick;
}
const held = (page) => counter(page, "held");

function write(name, content) {
  fs.writeFileSync(path.join(scratch, name), content);
  return path.join(scratch, name);
}

/** Robots stand and send; a box and a disc lie between them. */
function standingExperiment() {
  write("stand.c", `
    #include <kilolib.h>
    static message_t message;
    static message_t *message_tx(void) { return &message; }
    static void message_rx(message_t *m, distance_measurement_t *d) { (void)m; (void)d; }
    static void setup(void) { message.type = 1; message.crc = message_crc(&message); }
    static void loop(void) {}
    int main(void) {
      kilo_init();
      kilo_message_tx = message_tx;
      kilo_message_rx = message_rx;
      kilo_start(setup, loop);
      return 0;
    }`);
  return write("stand.txtpb", `duration_s: 900 seed: 3 arena { width_mm: 2000 height_mm: 2000 }
    robots { count: 20 behaviour: "stand.c" layout { x_mm: -500 grid { pitch_mm: 90 heading: HEADING_FIXED } } }
    movable { box { width_mm: 120 length_mm: 200 } mass_g: 400 x_mm: -300 y_mm: 500 }
    recording { every_s: 0.5 }`);
}

async function drag(page, from, to, withShift = false) {
  if (withShift) await page.keyboard.down("Shift");
  await page.mouse.move(...from);
  await page.mouse.down();
  await page.mouse.move((from[0] + to[0]) / 2, (from[1] + to[1]) / 2, { steps: 3 });
  await page.mouse.move(...to, { steps: 3 });
  await page.mouse.up();
  if (withShift) await page.keyboard.up("Shift");
}

const near = (value, wanted, most, what) => assert.ok(Math.abs(value - wanted) <= most, `${what}: ${value}, expected ${wanted}`);

async function movesAndHandOvers() {
  const directory = path.join(scratch, "moved");
  const served = await serve([kilotwin, "run", standingExperiment(), "--pace", "1", "--partitions", "2x1", "--out", directory, "--view"]);
  const page = await open(served.address);
  await phase(page, "live: running");
  await eventually("facts of the run", async () => /partitions2 × 1margin of ghosts[1-9]\d* mm/.test(await text(page, "run-facts")));

  // Messages, counters and variables are recorded for the page. Messages come with the metrics of the radio. The federates say what they do.
  await eventually("messages", async () => (await counter(page, "flights")) > 0);
  await eventually("federates", async () => (await page.locator("#federates li").count()) >= 5);
  await says(page, "federates", /physics 0,0computes \d+, exchanges \d+, waits \d+ %/);
  await eventually("nobody holds up a run at its pace", async () => (await text(page, "work-verdict")).startsWith("Nobody holds up"));
  await select(page, 7);
  await eventually("its messages", async () => /messages sent[1-9]\d*…?received[1-9]\d*…?heard most\d+ \(/.test(await text(page, "robot-facts")));
  await eventually("its counters", async () => /radio_sent[1-9]\d*/.test(await text(page, "robot-variables")));
  await eventually("lines from robots that it heard", async () => (await saved(page, "Save the picture as SVG")).toString().includes('stroke-opacity="0.4"'));
  await picture(page, "messages");

  // A viewer without the token moves nothing.
  const stranger = await open(served.address.replace(/#.*/, ""), await newContext());
  await phase(stranger, "live: running");
  await eventually("a picture", async () => (await drawn(stranger)) > 1);
  assert.ok(await stranger.locator("#move").isDisabled());
  const before = await poseOfSelected(page);
  await drag(stranger, await onScreen(stranger, before[0], before[1]), await onScreen(stranger, 300, 300), true);
  await eventually("the reason", async () => (await text(stranger, "notice")).includes("the whole address"));
  await stranger.context().close();

  // Paused, the outline waits for the next step.
  await press(page, "Pause");
  await phase(page, "live: paused");
  const tick = await standingTick(page);
  await press(page, "Move robots and objects");
  await drag(page, await onScreen(page, before[0], before[1]), await onScreen(page, 400, -300));
  await eventually("sent", async () => (await held(page)) === "robot 7 waits");
  await eventually("the reason", async () => (await text(page, "notice")).includes("Robot 7 stands there after the next step"));
  assert.deepEqual(await poseOfSelected(page), before);
  await picture(page, "moving");
  // A notice of something else does not take the move back.
  await tell(page, { type: "notice", text: "something else", refuses: "" });
  assert.equal(await text(page, "notice"), "something else");
  await tell(page, { type: "marks", whole: true, marks: [] }); // the page draws after each message
  assert.equal(await held(page), "robot 7 waits");
  await page.keyboard.press(".");
  await eventually("the step", async () => (await tickOf(page)) === tick + 1);
  await eventually("the outline has arrived", async () => (await held(page)) === "robot 7");
  const isAt = async (x, y) => {
    const [atX, atY] = await poseOfSelected(page);
    return Math.hypot(atX - x, atY - y) < 8; // a mouse moves by pixels
  };
  await eventually("the robot is there", () => isAt(400, -300));
  const there = await poseOfSelected(page);
  // It went from the left partition to the right one.
  await eventually("the hand-over", async () => (await counter(page, "handOvers")) === 1);
  await eventually("its partition", async () => (await text(page, "robot-facts")).includes("partition1, 0"));

  // Its handle turns it; so do keys.
  const [x, y] = await onScreen(page, there[0], there[1]);
  const radius = 17 * ((await onScreen(page, 1, 0))[0] - (await onScreen(page, 0, 0))[0]);
  await drag(page, [x + radius + 24, y], [x, y - radius - 24]);
  await eventually("sent", async () => (await held(page)) === "robot 7 waits");
  await page.keyboard.press(".");
  await eventually("turned", async () => (await held(page)) === "robot 7" && Math.abs((await poseOfSelected(page))[2] - 90) <= 2);
  await page.keyboard.press("[");
  await page.keyboard.press("[");
  await page.keyboard.press("ArrowRight");
  await eventually("sent", async () => (await held(page)) === "robot 7 waits");
  await page.keyboard.press(".");
  await eventually("turned by keys", async () => (await held(page)) === "robot 7" && Math.abs((await poseOfSelected(page))[2] - 120) <= 2);
  await eventually("moved by a key", async () => Math.abs((await poseOfSelected(page))[0] - there[0] - 5) < 1);

  // Where it cannot stand, the page says why.
  await drag(page, [x, y], [x + 30, (await onScreen(page, 0, -990))[1]]);
  await eventually("the reason", async () => (await text(page, "notice")).includes("Robot 7 stays where it is"));
  await eventually("let go", async () => (await held(page)) === "");

  // While the run goes on, an object goes elsewhere at once; Esc lets go.
  await press(page, "Continue");
  await phase(page, "live: running");
  await drag(page, await onScreen(page, -300, 500), await onScreen(page, 200, 600));
  await eventually("the object has arrived", async () => (await held(page)) === "object 0");
  await picture(page, "moved");
  await page.keyboard.press("Escape");
  assert.equal(await page.locator("#move").getAttribute("aria-pressed"), "false");
  // Without the tool a drag moves the picture; with shift it moves a robot.
  await drag(page, await onScreen(page, there[0] + 5, there[1]), await onScreen(page, 500, 200), true);
  await eventually("moved with shift", async () => (await held(page)) === "robot 7" && Math.abs((await poseOfSelected(page))[1] - 200) < 8);
  // Its trail goes on from there: no line leads across the arena. Robots stand, so each part is one place.
  const trail = async () => (await saved(page, "Save the picture as SVG")).toString().match(/stroke-width="2" d="(M[^"Z]*)"/)?.[1];
  const standing = await tickOf(page);
  await eventually("a trail", async () => (await tickOf(page)) > standing + 100 && (await trail()) !== undefined);
  for (const part of (await trail()).split("M").filter(Boolean)) {
    const places = part.split("L").map((place) => place.split(" ").map(Number));
    near(Math.max(...places.map(([a]) => a)), Math.min(...places.map(([a]) => a)), 5, "width of a part of the trail");
  }
  assert.deepEqual(page.faults, []);

  // The recording has a mark for each, and replays them to the same hash.
  page.once("dialog", (dialog) => dialog.accept());
  await press(page, "Stop the run for good");
  await phase(page, "recorded");
  await eventually("marks", async () => (await page.locator("#marks button").count()) === 5);
  const titles = await page.locator("#marks button").evaluateAll((marks) => marks.map((mark) => mark.title));
  assert.match(titles.join("\n"), /object 0 placed at 20\d, 60\d mm/);
  await eventually("the whole run's times", async () => (await text(page, "work-span")) === "whole run");
  assert.deepEqual(page.faults, []);
  await page.close();
  // The page knows of the end before the launcher has written the summary.
  await eventually("the launcher's end", () => served.text.includes("the page now shows the recording"));
  assert.equal(await served.stop(), 0);
  execFileSync(kilotwin, ["replay", directory, "--verify"], { stdio: "pipe" });
}

/** Four real robots that drive to the right, as a log of ARK; robot 2 stands still from the 30th second on. */
function trackerLog() {
  let random = 12345;
  const noise = () => {
    let sum = 0;
    for (let i = 0; i < 12; ++i) {
      random = (random * 1103515245 + 12345) % 2147483648;
      sum += random / 2147483648 - 0.5;
    }
    return sum;
  };
  const rows = [];
  for (let n = 0; n <= 20 * 100; ++n) {
    const time = n / 20;
    const robots = [0, 1, 2, 3].map((robot) => {
      const driven = 10 * (robot === 2 ? Math.min(time, 30) : time);
      const x = -600 + (robot % 2 === 0 ? -100 : 100) + driven + 0.5 * noise();
      const y = (robot < 2 ? -100 : 100) + 0.5 * noise();
      return [robot, 0, (x + 1000).toFixed(2), (1000 - y).toFixed(2), noise().toFixed(2)].join("\t");
    });
    rows.push([time.toFixed(3), ...robots].join("\t"));
  }
  return write("tracked.log", `${rows.join("\n")}\n`);
}

async function hybridRun() {
  write("ahead.c", `
    #include <kilolib.h>
    static void setup(void) {}
    static void loop(void) { set_motors(kilo_straight_left, kilo_straight_right); }
    int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }`);
  const experiment = write("hybrid.txtpb", `duration_s: 400 seed: 4 arena { width_mm: 2000 height_mm: 2000 }
    motion { bias_sd_mm_s: 0.05 factor_variance_s: 0.0005 spin_up_s: 0 }
    robots { count: 4 behaviour: "ahead.c" body: TRACKED says { shadow: true } layout { x_mm: -600 grid { pitch_mm: 200 heading: HEADING_FIXED } } }
    tracking { bridge_s: 2 }
    door { name: "ceiling" log { format: ARK } position_sd_mm: 3 heading_sd_deg: 3 }`);
  const log = trackerLog();
  const served = await serve([kilotwin, "run", experiment, "--pace", "4", "--monitor", "--warm-up", "5",
    "--out", path.join(scratch, "hybrid"), "--view"]);
  const page = await open(served.address);
  await phase(page, "live: running");
  await eventually("its domain", async () => /runs on DDS domain \d+/.test(served.text));
  const [, domain] = /runs on DDS domain (\d+)/.exec(served.text);
  const player = spawn(kilotwin, ["play", experiment, log, "--speed", "4", "--domain", domain], { cwd: scratch, stdio: ["ignore", "ignore", "pipe"] });
  try {
    // An ellipse around each of them, live: as wide as the tracker's standard deviation says, where the tracker sees the robot.
    const ellipses = async () => {
      const svg = (await saved(page, "Save the picture as SVG")).toString();
      const rims = svg.match(/<path [^>]*stroke-width="1.5" d="([^"]*)"/)?.[1] ?? "";
      return rims.split("Z").filter(Boolean).map((rim) => [...rim.matchAll(/[ML](-?[\d.]+) (-?[\d.]+)/g)].map(([, x, y]) => [Number(x), Number(y)]));
    };
    let rims = [];
    await eventually("four ellipses", async () => (rims = await ellipses()).length === 4);
    const pxPerMm = (await onScreen(page, 1, 0))[0] - (await onScreen(page, 0, 0))[0];
    for (const rim of rims) {
      const xs = rim.map(([x]) => x);
      near(Math.max(...xs) - Math.min(...xs), 2 * 2.4477 * 3 * pxPerMm, 0.5, "width of the ellipse");
    }
    await select(page, 1);
    await says(page, "robot-facts", /kindtracked/);
    // Real robots stay where they are.
    await eventually("the reason", async () => {
      await page.keyboard.press("0"); // a drag beside the robot, which drives on, moves the picture
      const [x, y] = await poseOfSelected(page);
      await drag(page, await onScreen(page, x, y), await onScreen(page, x, y + 300), true);
      return (await text(page, "notice")).includes("Robot 1 is tracked");
    });
    assert.equal(await held(page), "");

    // The monitor's alarm reaches the page while the run lasts.
    await eventually("the alarm", async () => (await text(page, "alarm-lines")).includes("robot 2 leaves the model"), 90);
    assert.equal(await text(page, "phase"), "live: running");
    assert.ok(await page.locator("#alarms").isVisible());
    await picture(page, "hybrid");
  } finally {
    player.kill("SIGTERM");
  }
  // Without its tracker, every robot is lost: a dashed ring with a question mark at its last place.
  const lost = async () => [...(await saved(page, "Save the picture as SVG")).toString().matchAll(/<text x="(-?[\d.]+)" y="(-?[\d.]+)"[^>]*>\?</g)];
  await eventually("four question marks", async () => (await lost()).length === 4);
  await eventually("its state", async () => (await text(page, "robot-facts")).includes("statenot there, last seen here"));
  await page.keyboard.press("0");
  const view = await page.locator("#picture").boundingBox();
  const [lastX, lastY] = await onScreen(page, ...(await poseOfSelected(page)));
  await eventually("robot 1 is marked where it was", async () =>
    (await lost()).some(([, x, y]) => Math.hypot(Number(x) + view.x - lastX, Number(y) - 4 + view.y - lastY) < 2));
  // A click selects it.
  await page.keyboard.press("Escape");
  await eventually("robot 1", async () => {
    await page.mouse.click(lastX, lastY);
    return (await text(page, "robot-title")) === "Robot 1";
  });
  await picture(page, "lost");
  assert.deepEqual(page.faults, []);
  page.once("dialog", (dialog) => dialog.accept());
  await press(page, "Stop the run for good");
  await phase(page, "recorded");
  await page.close();
  // The page knows of the end before the launcher has written the summary.
  await eventually("the launcher's end", () => served.text.includes("the page now shows the recording"));
  assert.equal(await served.stop(), 0);
}

await run(movesAndHandOvers, hybridRun);
