// node page_test.mjs KILOTWIN VIEW SAMPLES NPM SOURCES [PICTURES]: the page in headless Chromium, as people use it.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import path from "node:path";
import { eventually } from "./browser.mjs";
import {
  clock, connected, counter, drawn, HALF_MM, kilotwin, newContext, onScreen, open, phase, picture, pictures, press, received, run, samples,
  saved, says, scratch, serve, sources, start, text, viewProgram,
} from "./page_tools.mjs";

/** Where robot `i` of the sample is: tests/clients/view/recordings.hpp. */
function circling(i, time) {
  const radius = 0.95 * HALF_MM * Math.sqrt((i + 0.5) / 1000);
  const angle = 2.399963 * i + 0.02 * time;
  return [radius * Math.cos(angle), radius * Math.sin(angle)];
}

async function recordedRun() {
  const recording = path.join(scratch, "recording.ktrec");
  execFileSync(samples, ["recording", recording, "1000", "200", "0.5"]);
  const words = [viewProgram, "view", recording];
  let served = await serve(words);
  const page = await open(served.address);
  await eventually("a picture", async () => (await received(page)) > 1 && (await drawn(page)) > 1);
  await says(page, "name", "circling");
  await says(page, "count", "1000");
  await says(page, "phase", "recorded");

  // It plays by itself; pause stands still at a recorded state.
  const before = await clock(page);
  await eventually("time goes on", async () => (await clock(page)) > before + 0.2);
  await press(page, "Pause");
  await eventually("paused", async () => (await page.locator("#play").getAttribute("aria-label")) === "Play");
  await page.locator("#line").fill("610"); // tick
  await eventually("sought", async () => Math.abs((await clock(page)) - 610 * 0.032768) < 0.5);
  const at = await clock(page);

  // One state forward and back: half a second, to the tick.
  await press(page, "One step forward");
  await eventually("a step forward", async () => Math.abs((await clock(page)) - at - 0.5) < 0.034);
  await page.keyboard.press(",");
  await eventually("a step back", async () => Math.abs((await clock(page)) - at) < 0.001);

  // A click selects the robot that is drawn there; a click beside robots selects none.
  await page.locator("#picture").click({ position: { x: 5, y: 5 } });
  assert.ok(await page.locator("#robot").isHidden());
  // The page looks for the robot in the picture that it has drawn last, which may be older than the last key.
  const click = async (robot, dx = 0, dy = 0) => {
    const [x, y] = await onScreen(page, ...circling(robot, await clock(page)));
    await eventually(`robot ${robot}`, async () => {
      await page.mouse.click(x + dx, y + dy);
      return (await text(page, "robot-title")) === `Robot ${robot}`;
    });
  };
  await click(700);
  // Counts up to now where events are recorded, else of the whole run. A line leads from the robot that it has heard.
  const statesSoFar = Math.floor((at + 0.001) / 0.5);
  await eventually("its counters", async () => (await text(page, "robot-facts")).includes(`messages sent, whole run703received${statesSoFar}heard most701 (${statesSoFar})`));
  const heard = /stroke-opacity="0.4" d="M(-?[\d.]+) (-?[\d.]+)L(-?[\d.]+) (-?[\d.]+)"/.exec((await saved(page, "Save the picture as SVG")).toString());
  const [heardX, heardY] = await onScreen(page, ...circling(701, at));
  const arena = await page.locator("#picture").boundingBox();
  assert.ok(Math.hypot(Number(heard[1]) + arena.x - heardX, Number(heard[2]) + arena.y - heardY) < 1);
  await picture(page, "recorded");

  // Messages fly between robots of the recording, a bounded number in a picture; the button hides them.
  const messagesDrawn = async () => {
    const before = await counter(page, "flights");
    const drawnBefore = await drawn(page);
    await page.keyboard.press("t");
    await page.keyboard.press("t");
    await eventually("another picture", async () => (await drawn(page)) > drawnBefore);
    return (await counter(page, "flights")) - before;
  };
  await eventually("messages", async () => (await messagesDrawn()) > 0);
  await press(page, "Messages");
  assert.equal(await messagesDrawn(), 0);
  await press(page, "Messages");
  await eventually("messages again", async () => (await messagesDrawn()) > 0);

  // A mark of the time line leads to the tick at which a robot was placed.
  const mark = page.getByRole("button", { name: /Go to .* robot 4 placed at 120, -80 mm, heading 90/ });
  await eventually("a mark", async () => (await mark.count()) === 1);
  const stood = await clock(page);
  await mark.focus();
  await page.keyboard.press("Enter");
  await eventually("the mark's time", async () => Math.abs((await clock(page)) - 50) < 0.6);
  await page.locator("#line").fill(String(Math.round(stood / 0.032768)));
  await eventually("back", async () => Math.abs((await clock(page)) - stood) < 0.001);
  // Nothing moves in a recording, and the page says so.
  await page.keyboard.press("g");
  await eventually("the reason", async () => (await text(page, "notice")).includes("Moving needs a run that goes on"));

  // The browser may take the graphics memory away; the same picture comes back.
  const looks = () => saved(page, "Save the picture as PNG");
  let pictured = Buffer.alloc(0);
  await eventually("a picture that stays", async () => {
    const before = pictured;
    await page.waitForTimeout(600); // longer than the page waits before it asks again
    return (pictured = await looks()).equals(before);
  });
  const lose = (restore) => page.evaluate((back) => {
    window.lost ??= document.getElementById("picture").getContext("webgl2").getExtension("WEBGL_lose_context");
    if (back) window.lost.restoreContext();
    else window.lost.loseContext();
  }, restore);
  await lose(false);
  await eventually("the reason", async () => (await text(page, "notice")).includes("graphics memory"));
  await lose(true);
  await eventually("the same picture", async () => (await looks()).equals(pictured));

  // Dragging moves the picture with the pointer: the robot is now 120 px further right and 40 px lower.
  const box = await page.locator("#picture").boundingBox();
  await page.mouse.move(box.x + 90, box.y + 300);
  await page.mouse.down();
  await page.mouse.move(box.x + 150, box.y + 320, { steps: 4 });
  await page.mouse.move(box.x + 210, box.y + 340, { steps: 4 });
  await page.mouse.up();
  await page.keyboard.press("Escape");
  await click(701, 120, 40);

  // Zoom, the other theme, and back to the whole arena.
  const [x, y] = await onScreen(page, ...circling(701, await clock(page)));
  await page.mouse.move(x + 120, y + 40);
  for (let i = 0; i < 6; ++i) await page.mouse.wheel(0, -240);
  const theme = () => page.locator("html").getAttribute("data-theme");
  const was = await theme();
  await page.keyboard.press("d");
  assert.notEqual(await theme(), was);
  await picture(page, "zoomed");
  await page.keyboard.press("d");
  await page.keyboard.press("0");
  await click(3);
  await page.locator("#find-id").fill("5000");
  await press(page, "Select");
  await eventually("no such robot", async () => (await text(page, "notice")).includes("0 to 999"));
  assert.equal((await saved(page, "Save the picture as PNG")).subarray(1, 4).toString(), "PNG");

  // The SVG has the same robots at the same places: a disc per robot, the ellipses of 9 tracked ones, some dozen elements.
  const svg = (await saved(page, "Save the picture as SVG")).toString();
  const elements = await page.evaluate((source) => {
    const parsed = new DOMParser().parseFromString(source, "image/svg+xml");
    return parsed.querySelector("parsererror") ? undefined : [...parsed.querySelectorAll("path")].map((one) => one.outerHTML);
  }, svg);
  assert.ok(elements && elements.length < 200);
  const [sx, sy] = await onScreen(page, ...circling(3, await clock(page)));
  const view = await page.locator("#picture").boundingBox();
  const discs = elements.filter((one) => one.includes('fill="rgb')).flatMap((one) => [...one.matchAll(/M(-?[\d.]+) (-?[\d.]+)a([\d.]+)/g)]);
  assert.equal(discs.length, 1000);
  assert.ok(discs.some(([, x, y, r]) => Math.hypot(Number(x) + Number(r) - (sx - view.x), Number(y) - (sy - view.y)) < 1));
  const outlines = elements.filter((one) => /stroke-width="1.5"/.test(one)).join("");
  assert.equal(outlines.split("Z").length - 1, 9);
  await eventually("packets", async () => (await text(page, "packets")).includes("once  type 7"));
  if (pictures) fs.writeFileSync(path.join(pictures, "picture.svg"), svg);

  // The gateway ends and comes back: the page goes on where it was, without a reload.
  const sought = await clock(page);
  await served.stop();
  await eventually("lost", async () => (await page.locator("body").getAttribute("data-connection")) === "lost");
  const known = await received(page);
  served = await serve([...words, "--port", String(served.port)]);
  await connected(page);
  await eventually("frames again", async () => (await received(page)) > known);
  await eventually("the time of before", async () => (await clock(page)) === sought);
  await says(page, "robot-title", "Robot 3");
  assert.deepEqual(page.faults, []);
  await page.close();
  assert.equal(await served.stop(), 0);
}

/** An experiment whose program prints and has variables; what it prints would be harmful as HTML. */
function talkingExperiment() {
  fs.writeFileSync(path.join(scratch, "talk.c"), `
    #include <kilolib.h>
    #include <stdio.h>
    volatile uint32_t rounds;
    static void loop(void) {
      if (kilo_ticks / 32 != rounds) {
        rounds = kilo_ticks / 32;
        printf("round %lu <img src=x onerror=alert(1)>\\n", (unsigned long)rounds);
      }
      set_motors(kilo_straight_left, kilo_straight_right);
    }
    static void setup(void) {}
    int main(void) { kilo_init(); kilo_start(setup, loop); return 0; }`);
  const experiment = path.join(scratch, "talk.txtpb");
  fs.writeFileSync(experiment, `duration_s: 600 seed: 5 arena { width_mm: 2000 height_mm: 2000 }
    robots { count: 100 behaviour: "talk.c" layout { grid { pitch_mm: 60 } } }
    recording { every_s: 0.5 variable { name: "rounds" every_s: 0.5 } }
    observable { name: "mean_rounds" value: "mean(rounds)" }
    observable { name: "awake" value: "share(state == running)" }`);
  return experiment;
}

/** What the legend of a plot says, and the value of one of its lines; undefined where there is none. */
const legend = async (page, plot) => (await page.locator(`#plots .plot:nth-child(${plot}) .u-legend`).allTextContents())[0] ?? "";
async function line(page, plot, name) {
  const found = new RegExp(`${name}:? ?([-0-9.e]+)`).exec(await legend(page, plot));
  return found ? Number(found[1]) : undefined;
}

async function plotsAndPrograms() {
  const talked = path.join(scratch, "talked");
  execFileSync(kilotwin, ["run", talkingExperiment(), "--duration", "30", "--mode", "local", "--quiet", "--out", talked]);
  fs.writeFileSync(path.join(talked, "alarms.txt"), "monitor: 12.0 s: robot 2 <b>leaves</b> the model\nmonitor: 25.0 s: robot 4 leaves the model\n");
  const residuals = Array.from({ length: 29 }, (_, i) => `${i + 1},42,30,30,30,${i + 1},-0.5,0.25,${2 * i + 2}\n`);
  fs.writeFileSync(path.join(talked, "residuals.csv"), `time_s,robot,samples,headings,tested,along,across,heading,mean_square\n${residuals.join("")}`);
  const served = await serve([viewProgram, "view", talked]);
  const page = await open(served.address);
  await eventually("a picture", async () => (await drawn(page)) > 1);
  await press(page, "Pause");
  await page.locator("#line").fill("610"); // 20.0 s
  await eventually("sought", async () => Math.abs((await clock(page)) - 610 * 0.032768) < 0.6);

  // The selected robot's variables and log, up to this time.
  await page.locator("#find-id").fill("42");
  await press(page, "Select");
  const rounds = async () => Number(/rounds(\d+)/.exec(await text(page, "robot-variables"))?.[1]);
  await eventually("its variable", async () => Math.abs((await rounds()) - (await clock(page)) * 31.25 / 32) < 2);
  await eventually("its log", async () => (await text(page, "robot-log")).endsWith(`round ${await rounds()} <img src=x onerror=alert(1)>\n`));
  assert.equal(await page.locator("#robot-log img").count(), 0);

  // Where the time went: a run in one process has its cost by subject.
  await eventually("the cost", async () => (await text(page, "federates")).includes("behaviours"));
  await says(page, "work-verdict", "All engines share one process.");
  await says(page, "run-facts", /messages sent\d+.*received\d+.*mean speed\d/s);
  await says(page, "speed-what", "playback");

  // Alarms of the residual monitor, up to this time.
  await says(page, "alarm-lines", "12.0 s: robot 2 <b>leaves</b> the model");

  // Plots: of the swarm, then of the robot; a click goes to its time.
  await press(page, "Plots");
  await eventually("the mean square displacement", async () => (await line(page, 1, "value")) > 0);
  await eventually("the choice of the variable", () => page.evaluate(() => document.querySelectorAll("#plots select")[1].selectedOptions[0]?.text === "rounds"));
  await eventually("the variable's mean", async () => (await line(page, 2, "mean")) === (await rounds()));
  await page.locator("#plots select").nth(2).selectOption({ label: "rounds of robot 42" });
  await eventually("the robot's variable", async () => (await line(page, 3, "value")) === (await rounds()));
  await picture(page, "plots");
  await page.locator("#plots select").nth(1).selectOption({ label: "mean_rounds (observable)" });
  await eventually("the experiment's own observable", async () => (await line(page, 2, "value")) === (await rounds()));
  await page.locator("#plots select").nth(0).selectOption({ label: "residuals of the monitor, whitened of robot 42" });
  await eventually("the robot's residuals", async () => (await line(page, 1, "across")) === -0.5 && (await line(page, 1, "along")) === Math.floor(await clock(page)));
  await page.locator("#plots select").nth(0).selectOption({ label: "residuals of the monitor, whitened" });
  await eventually("the swarm's", async () => (await line(page, 1, "mean square of all")) === 2 * Math.floor(await clock(page)));
  const plot = await page.locator("#plots .plot:nth-child(3) .u-over").boundingBox();
  await page.mouse.click(plot.x + plot.width / 2, plot.y + plot.height / 2);
  await eventually("half of the time", async () => Math.abs((await clock(page)) - 15) < 1);
  await page.mouse.move(5, 5);
  await eventually("its value then", async () => Math.abs((await line(page, 3, "value")) - 15 * 31.25 / 32) < 2);
  await page.keyboard.press("d");
  await picture(page, "plots-dark");
  await page.keyboard.press("p");
  assert.ok(await page.locator("#plots").isHidden());
  assert.deepEqual(page.faults, []);
  await page.close();
  assert.equal(await served.stop(), 0);
}

/** Lamps are drawn where they are at the time of the picture, over their light. */
async function lightOnTheFloor() {
  const lit = path.join(scratch, "lit");
  execFileSync(kilotwin, ["run", path.join(sources, "experiments/phototaxis.txtpb"), "--robots", "5", "--duration", "90", "--mode", "local", "--quiet", "--out", lit]);
  const served = await serve([viewProgram, "view", lit]);
  const page = await open(served.address);
  await eventually("a picture", async () => (await drawn(page)) > 1);
  await press(page, "Pause");
  /** Numbers of lamps on and off, and the picture of the light. */
  const look = async () => {
    const svg = (await saved(page, "Save the picture as SVG")).toString();
    const lamps = { on: 0, off: 0, image: /<image [^>]*href="([^"]*)"/.exec(svg)?.[1] };
    for (const [, attributes, data] of svg.matchAll(/<path ([^>]*) d="([^"]*a9 9 [^"]*)"/g))
      lamps[attributes.includes('fill="none"') ? "off" : "on"] += data.split("M").length - 1;
    return lamps;
  };
  await page.locator("#line").fill(String(Math.round(30 / 0.032768)));
  let before;
  await eventually("both lamps", async () => (before = await look()).on === 2 && before.off === 0 && before.image !== undefined);
  await page.locator("#line").fill(String(Math.round(80 / 0.032768)));
  await eventually("one lamp is off", async () => {
    const now = await look();
    return now.on === 1 && now.off === 1 && now.image !== before.image;
  });
  await picture(page, "light");
  assert.deepEqual(page.faults, []);
  await page.close();
  assert.equal(await served.stop(), 0);
}

async function liveRun() {
  const served = await serve([kilotwin, "run", talkingExperiment(), "--pace", "1",
    "--partitions", "2x1", "--out", path.join(scratch, "run"), "--view"]);
  const page = await open(served.address);
  await phase(page, "live: running");
  await eventually("states", async () => (await received(page)) > 5);
  await says(page, "count", "100");

  // The token leaves the address. The tab remembers it when it is loaded again.
  assert.ok(!page.url().includes("token"), page.url());
  await page.reload();
  await connected(page);
  await phase(page, "live: running");
  await eventually("it may steer", () => page.locator("#play").isEnabled());

  // Without the token nothing steers.
  const stranger = await (await newContext()).newPage();
  await stranger.goto(served.address.replace(/#.*/, ""));
  await eventually("the stranger watches", async () => (await received(stranger)) > 1);
  assert.ok(await stranger.locator("#play").isDisabled());
  assert.ok(await stranger.locator("#stop").isHidden());
  assert.ok(await stranger.locator("#overhead-form").isHidden());
  await stranger.context().close();

  await press(page, "Pause");
  await phase(page, "live: paused");
  const tickOf = async () => Math.round((await clock(page)) / 0.032768);
  let tick = -1;
  await eventually("time stands still", async () => {
    const now = await tickOf();
    const same = now === tick;
    tick = now;
    await page.waitForTimeout(600); // a paused run repeats its state every half second
    return same;
  });
  await page.keyboard.press(".");
  await eventually("one tick", async () => (await tickOf()) === tick + 1);
  await page.locator("#find-id").fill("7");
  await press(page, "Select");
  await eventually("the robot", async () => (await text(page, "robot-facts")).includes("motors on"));
  await eventually("its partition", async () => {
    const facts = await text(page, "robot-facts");
    return facts.includes(`partition${Number.parseFloat(/x, y(-?[\d.]+)/.exec(facts)[1]) < 0 ? 0 : 1}, 0`);
  });
  // Variables, log and curves come from the recording while it grows.
  await eventually("its variable", async () => (await text(page, "robot-variables")).includes("rounds"));
  await press(page, "Plots");
  await press(page, "Continue");
  await eventually("its log", async () => (await text(page, "robot-log")).includes("round 1 <img"));
  await eventually("a curve", async () => (await line(page, 1, "value")) > 0);
  await page.locator("#plots select").nth(2).selectOption({ label: "rounds of robot 7" });
  await eventually("its curve", async () => (await line(page, 3, "value")) >= 1);
  await page.locator("#plots select").nth(1).selectOption({ label: "simulated over real time" });
  await page.locator("#plots select").nth(0).selectOption({ label: "mean_rounds (observable)" });
  await eventually("the experiment's own observable", async () => (await line(page, 1, "value")) >= 0);
  await eventually("the speed", async () => (await line(page, 2, "value")) > 0);
  // A message for the overhead controller; what is no message is not sent.
  await page.locator("#overhead-type").fill("3");
  await page.locator("#overhead-data").fill("0a1");
  await press(page, "Send");
  await eventually("the reason", async () => (await text(page, "notice")).includes("two hexadecimal digits"));
  await page.locator("#overhead-data").fill("0a 1b");
  await press(page, "Send");
  await eventually("the packet", async () => (await text(page, "packets")).includes("once  type 3  0a1b"));
  await press(page, "Pause");
  await phase(page, "live: paused");
  tick = await tickOf();
  await picture(page, "live");
  await page.keyboard.press("p");
  await page.keyboard.press("Escape");
  await press(page, "Continue");
  await phase(page, "live: running");
  await eventually("it goes on", async () => (await tickOf()) > tick + 20);

  // Stopped, the run becomes a recording in the same page.
  page.once("dialog", (dialog) => dialog.accept());
  await press(page, "Stop the run for good");
  await phase(page, "recorded");
  await eventually("where the time went", async () => (await text(page, "work-span")) === "whole run" && (await text(page, "federates")).includes("physics 1,0computes"));
  await eventually("its recording", async () => (await text(page, "run-facts")).includes("states"));
  await eventually("the packet in the recording", async () => (await text(page, "packets")).includes("once  type 3  0a1b"));
  await eventually("the launcher's end", () => served.text.includes("the page now shows the recording"));
  assert.deepEqual(page.faults, []);
  await page.close();
  assert.equal(await served.stop(), 0);
}

/** Without the run's directory, observables of poses, LEDs and life cycles have curves, and the others say why not. */
async function liveRunElsewhere() {
  const run = await start([kilotwin, "run", talkingExperiment(), "--pace", "1", "--out", path.join(scratch, "elsewhere")]);
  const served = await serve([viewProgram, "view", "--domain", run.found]);
  const page = await open(served.address);
  await phase(page, "live: running");
  await press(page, "Plots");
  await eventually("the choice", async () => (await page.locator("#plots select").nth(0).locator("option").allTextContents()).includes("awake (observable)"));
  await page.locator("#plots select").nth(0).selectOption({ label: "awake (observable)" });
  await eventually("the observable", async () => (await line(page, 1, "value")) === 1);
  await page.locator("#plots select").nth(1).selectOption({ label: "mean_rounds (observable)" });
  await eventually("the reason", async () => /mean_rounds uses rounds, which is in the run's recording only/.test(await page.locator("#plots .plot:nth-child(2) p").textContent()));
  await run.stop();
  assert.deepEqual(page.faults, []);
  await page.close();
  assert.equal(await served.stop(), 0);
}

await run(recordedRun, plotsAndPrograms, lightOnTheFloor, liveRun, liveRunElsewhere);
