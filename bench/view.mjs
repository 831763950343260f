#!/usr/bin/env node
// Measures the web page of a run: frames per second, bytes per viewer, viewers beside a run, recordings.
// Usage: bench/view.mjs [-w] [-n ROUNDS] [-k BUILD]     default: 5 rounds, build/release
//   -w  write the tables to docs/results/view.md
// Needs a build with tests, Chromium, and the npm packages of scripts/setup --develop. Rounds alternate between the conditions
// that are compared; tables give medians.
import { execFileSync, spawn } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { fileURLToPath } from "node:url";
import { Served, eventually, launchBrowser } from "../tests/clients/view/browser.mjs";

const root = path.resolve(path.dirname(fileURLToPath(import.meta.url)), "..");
const words = process.argv.slice(2);
const option = (name, otherwise) => (words.includes(name) ? words[words.indexOf(name) + 1] : otherwise);
const rounds = Number(option("-n", "5"));
const build = path.resolve(root, option("-k", "build/release"));
const [kilotwin, view, samples] = ["kilotwin", "kilotwin-view", "tests/clients/view/view_samples"].map((name) => path.join(build, name));
const npm = path.join(root, "build/npm");
const WebSocket = createRequire(path.join(npm, "package.json"))("ws");
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-bench-view-"));
const header = execFileSync(path.join(root, "bench/results.py"), ["head", "The web page of a run", `bench/view.mjs ${words.join(" ")}`.trim()]).toString();
const load = () => os.loadavg()[0].toFixed(1);

const median = (values) => [...values].sort((a, b) => a - b)[values.length >> 1];
const pause = (seconds) => new Promise((resolve) => setTimeout(resolve, 1000 * seconds));
const seconds = async (act) => {
  const began = performance.now();
  await act();
  return (performance.now() - began) / 1000;
};
const text = [];
const say = (line = "") => {
  text.push(line);
  console.log(line);
};

/** CPU time of all processes of Chromium that this program has started, s. */
function browserCpu() {
  const processes = new Map();
  for (const pid of fs.readdirSync("/proc").filter((name) => /^\d+$/.test(name))) {
    try {
      const [, name, rest] = /^\d+ \((.*)\) (.*)$/s.exec(fs.readFileSync(`/proc/${pid}/stat`, "utf8"));
      const fields = rest.split(" ");
      processes.set(Number(pid), { name, parent: Number(fields[1]), cpu: (Number(fields[11]) + Number(fields[12])) / 100 });
    } catch {
      // It has ended meanwhile.
    }
  }
  const isOurs = (pid) => pid === process.pid || (processes.has(pid) && isOurs(processes.get(pid).parent));
  return [...processes].reduce((sum, [pid, one]) => sum + (one.name.startsWith("chrom") && isOurs(pid) ? one.cpu : 0), 0);
}

function recordingOf(robots, states, every) {
  const file = path.join(scratch, `${robots}-${states}-${every}.ktrec`);
  if (!fs.existsSync(file)) execFileSync(samples, ["recording", file, String(robots), String(states), String(every)]);
  return file;
}

/** A viewer without a page: it asks for the next state as soon as it has one. */
class Viewer {
  constructor(port) {
    this.frames = this.bytes = 0;
    this.lines = [];
    this.waiting = new Map();
    this.socket = new WebSocket(`ws://127.0.0.1:${port}/`, "kilotwin-view.1");
    this.socket.binaryType = "nodebuffer";
    this.ready = new Promise((resolve, reject) => {
      this.socket.on("error", reject);
      this.socket.on("message", (data, binary) => {
        this.bytes += data.length;
        if (binary) {
          ++this.frames;
          this.waiting.get("frame")?.(data);
          if (this.live) this.send({ do: "next" });
          return;
        }
        const message = JSON.parse(data);
        this.waiting.get(message.type)?.(message);
        if (message.type !== "run") return;
        this.run = message;
        this.live = message.source === "live";
        if (this.live) this.send({ do: "next" });
        resolve(message);
      });
    });
  }
  send(request) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(request));
  }
  /** Sends a request and waits for the answer of this type. */
  async ask(request, type) {
    const answer = new Promise((resolve) => this.waiting.set(type, resolve));
    this.send(request);
    return answer;
  }
  /** Reads no more; the system's buffers fill up. */
  stall() {
    this.socket._socket.pause();
  }
  close() {
    this.socket.terminate();
  }
}

async function drawing() {
  say("\n## Frames per second of drawing\n");
  say("A recording with a state every 0.1 s plays at real time. Chromium without a window draws 1280 x 720 by software (SwiftShader).");
  say("No GPU was in the machine, so the rates are those of a software renderer. The browser asks for at most 60 frames per second. The");
  say("CPU time is that of all its processes; it tells how many frames a machine draws that does nothing else. The script time is what the");
  say("page's own program takes for a frame, without the renderer: a machine with a GPU needs that.\n");
  say("| robots | trails | messages in a picture | frames drawn per second | CPU time of a frame | script time of a frame | bytes of a frame | bytes per second to the viewer | load |\n|---|---|---|---|---|---|---|---|---|");
  const { browser, reason } = await launchBrowser(npm);
  if (reason) throw new Error(reason);
  try {
    for (const [robots, states, trails, messages] of [[1000, 200, true, true], [1000, 200, true, false], [1000, 200, false, false], [10000, 120, false, true], [10000, 120, false, false], [100000, 60, false, false]]) {
      const served = await Served.start([view, "view", recordingOf(robots, states, 0.1)], scratch);
      const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
      await page.goto(served.address);
      await eventually("a picture", () => page.evaluate(() => window.kilotwin.drawn > 3));
      if (!trails && robots <= 5000) await page.keyboard.press("t"); // larger swarms begin without
      if (messages !== robots <= 5000) await page.keyboard.press("m");
      await pause(2);
      const counters = () => page.evaluate(() => ({ ...window.kilotwin, now: performance.now() }));
      const before = await counters();
      const cpu = browserCpu();
      await pause(states / 10 > 6 ? 5 : 3);
      const after = await counters();
      const cpuOfFrame = (browserCpu() - cpu) / Math.max(1, after.drawn - before.drawn);
      const passed = (after.now - before.now) / 1000;
      const frames = after.received - before.received;
      const perSecond = (name) => (after[name] - before[name]) / passed;
      say(`| ${robots} | ${trails ? "yes" : "no"} | ${((after.flights - before.flights) / Math.max(1, after.drawn - before.drawn)).toFixed(0)} | ${perSecond("drawn").toFixed(1)} | ${(1000 * cpuOfFrame).toFixed(0)} ms | ${((after.drawMs - before.drawMs) / Math.max(1, after.drawn - before.drawn)).toFixed(2)} ms | ${Math.round((after.bytes - before.bytes) / Math.max(1, frames))} | ${(perSecond("bytes") / 1000).toFixed(0)} kB/s | ${load()} |`);
      await page.close();
      await served.stop();
    }
  } finally {
    await browser.close();
  }
}

/** Moves the time line and waits until the page has drawn the state there. */
async function scrubbing() {
  const [robots, states, moves] = [100000, 60, 40];
  say("\n## Scrubbing in the browser\n");
  say(`A recording of ${robots} robots with a state per second. The time line is set to ${moves} times, one after the other; each is measured`);
  say("from the input to the end of the page's drawing of the state there.\n");
  say("| median | worst | load |\n|---|---|---|");
  const { browser, reason } = await launchBrowser(npm);
  if (reason) throw new Error(reason);
  const served = await Served.start([view, "view", recordingOf(robots, states, 1)], scratch);
  try {
    const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
    await page.goto(served.address);
    await eventually("a picture", () => page.evaluate(() => window.kilotwin.drawn > 3));
    await page.getByRole("button", { name: "Pause", exact: true }).click();
    await pause(2);
    const times = await page.evaluate(async (count) => {
      const line = document.getElementById("line");
      const nextFrame = () => new Promise(requestAnimationFrame);
      const all = [];
      for (let i = 0; i < count; ++i) {
        const { received, drawn } = window.kilotwin;
        const began = performance.now();
        line.value = String((Number(line.max) * ((7 * i + 3) % count)) / count);
        line.dispatchEvent(new Event("input"));
        while (window.kilotwin.received === received) await new Promise((resolve) => setTimeout(resolve, 0));
        const drawnThen = Math.max(drawn, window.kilotwin.drawn);
        while (window.kilotwin.drawn === drawnThen) await nextFrame();
        all.push(performance.now() - began);
      }
      return all;
    }, moves);
    say(`| ${median(times).toFixed(0)} ms | ${Math.max(...times).toFixed(0)} ms | ${load()} |`);
    await page.close();
  } finally {
    await served.stop();
    await browser.close();
  }
}

/** From the command line to the first picture in which robots have moved. */
async function startOfAWatchedRun() {
  const experiment = path.join(root, "experiments/disperse.txtpb");
  say("\n## From the command to the first movement\n");
  say("`kilotwin run experiments/disperse.txtpb --pace 1 --view`, the address opened at once in a browser that runs already. Seconds from the");
  say(`command, medians of ${rounds} rounds.\n`);
  say("| address printed | first picture | first movement drawn | load |\n|---|---|---|---|");
  const { browser, reason } = await launchBrowser(npm);
  if (reason) throw new Error(reason);
  const times = [];
  try {
    for (let round = 0; round < rounds; ++round) {
      const began = performance.now();
      const passed = () => (performance.now() - began) / 1000;
      const served = await Served.start([kilotwin, "run", experiment, "--pace", "1", "--duration", "600", "--view", "--out", path.join(scratch, `watched-${round}`)], scratch);
      const printed = passed();
      const page = await browser.newPage({ viewport: { width: 1280, height: 720 } });
      await page.goto(served.address);
      await page.waitForFunction(() => window.kilotwin?.received > 0, undefined, { polling: "raf" });
      const pictured = passed();
      await page.waitForFunction(() => window.kilotwin.moved, undefined, { polling: "raf" });
      times.push([printed, pictured, passed()]);
      await page.close();
      await served.stop();
    }
  } finally {
    await browser.close();
  }
  const column = (i) => `${median(times.map((one) => one[i])).toFixed(2)} s`;
  say(`| ${column(0)} | ${column(1)} | ${column(2)} | ${load()} |`);
}

async function recordings() {
  say("\n## Recordings: opening and seeking\n");
  say("Opening: from the start of `kilotwin view` to the first state at a viewer. Seeking: from the request for a random time to its");
  say("state, over 200 requests. Plot: the first curve of the mean square displacement, which comes in several answers.\n");
  say("| recording | size | opens in | seeks in, median | seeks in, worst | plot | its longest answer | load |\n|---|---|---|---|---|---|---|---|");
  for (const [name, robots, states] of [["1 h x 1000 robots, a state per second", 1000, 3600], ["2 min x 100,000 robots, a state per second", 100000, 120]]) {
    const file = recordingOf(robots, states, 1);
    let served;
    let viewer;
    const opened = await seconds(async () => {
      served = await Served.start([view, "view", file], scratch);
      viewer = new Viewer(served.port);
      const run = await viewer.ready;
      await viewer.ask({ do: "at", tick: run.lastTick, request: 1 }, "frame");
    });
    const times = [];
    let random = 12345;
    for (let i = 0; i < 200; ++i) {
      random = (random * 1103515245 + 12345) % 2147483648;
      const tick = Math.floor((random / 2147483648) * viewer.run.lastTick);
      times.push(await seconds(() => viewer.ask({ do: "at", tick, request: i + 2 }, "frame")));
    }
    const plots = await viewer.ask({ do: "plots" }, "plots");
    const plot = plots.plots.findIndex((one) => one.name === "msd");
    let longest = 0;
    const plotted = await seconds(async () => {
      for (let whole = false; !whole; ) longest = Math.max(longest, await seconds(async () => ({ whole } = await viewer.ask({ do: "plot", plot }, "plot"))));
    });
    const ms = (value) => `${(1000 * value).toFixed(1)} ms`;
    say(`| ${name} | ${(fs.statSync(file).size / 1e6).toFixed(0)} MB | ${opened.toFixed(2)} s | ${ms(median(times))} | ${ms(Math.max(...times))} | ${plotted.toFixed(2)} s | ${ms(longest)} | ${load()} |`);
    viewer.close();
    await served.stop();
    fs.rmSync(file);
  }
}

/** A federated run with viewers beside it, as fast as it goes or at a pace. */
async function watchedRun(name, viewers, stalled, more) {
  const out = path.join(scratch, name);
  const domain = 150 + Math.floor(Math.random() * 60);
  let served;
  let watching = [];
  if (viewers > 0) {
    served = await Served.start([view, "view", "--domain", String(domain)], scratch);
    watching = Array.from({ length: viewers }, () => new Viewer(served.port));
  }
  const run = spawn(kilotwin, ["run", path.join(root, "experiments/disperse.txtpb"), "--robots", "1000", "--partitions", "1x1", ...more, "--quiet", "--domain", String(domain), "--out", out], { stdio: ["ignore", "ignore", "inherit"] });
  const status = await new Promise((resolve) => {
    run.on("exit", resolve);
    if (stalled) Promise.all(watching.map((viewer) => viewer.ready)).then(() => watching.forEach((viewer) => viewer.stall()));
  });
  if (status !== 0) throw new Error(`the run ended with status ${status}`);
  const summary = JSON.parse(fs.readFileSync(path.join(out, "summary.json"), "utf8"));
  let gatewayCpu = 0;
  if (served) {
    const fields = fs.readFileSync(`/proc/${served.process.pid}/stat`, "utf8").split(") ")[1].split(" ");
    gatewayCpu = (Number(fields[11]) + Number(fields[12])) / 100;
    await served.stop();
  }
  const frames = watching.reduce((sum, viewer) => sum + viewer.frames, 0);
  const bytes = watching.reduce((sum, viewer) => sum + viewer.bytes, 0);
  watching.forEach((viewer) => viewer.close());
  fs.rmSync(out, { recursive: true });
  return { hash: summary.state_hash, wall: summary.wall_s, cpu: summary.cpu_s, gatewayCpu, frames, bytes, late: summary.late_ticks };
}

async function viewersBesideARun(title, more, how) {
  const conditions = [["none", 0, false], ["one", 1, false], ["20 that read", 20, false], ["20 that never read", 20, true]];
  const results = new Map(conditions.map(([name]) => [name, []]));
  for (let round = 0; round < rounds; ++round)
    for (const [name, viewers, stalled] of conditions) results.get(name).push(await watchedRun(`run-${round}-${viewers}-${stalled}`, viewers, stalled, more));
  say(`\n## ${title}\n`);
  say(`\`experiments/disperse.txtpb\` with 1000 robots, federated in one partition, ${how}: ${rounds} rounds. Gateway and`);
  say("viewers share the machine with the run. CPU time of the run counts the run's processes alone; ratios are to no viewer.\n");
  say("| viewers | state hash | wall time of the run | ratio | CPU time of the run | ratio | CPU time of the gateway | frames per viewer | bytes per second and viewer | late ticks |\n|---|---|---|---|---|---|---|---|---|---|");
  const of = (name, field) => median(results.get(name).map((one) => one[field]));
  for (const [name, viewers] of conditions) {
    const hashes = [...new Set(results.get(name).map((one) => one.hash))].join(", ");
    const ratio = (field) => (of(name, field) / of("none", field)).toFixed(2);
    const each = (field, scale = 1) => (viewers === 0 ? "" : (of(name, field) / viewers / scale).toFixed(0));
    const rate = viewers === 0 ? "" : `${(of(name, "bytes") / viewers / of(name, "wall") / 1000).toFixed(0)} kB/s`;
    say(`| ${name} | \`${hashes}\` | ${of(name, "wall").toFixed(2)} s | ${ratio("wall")} | ${of(name, "cpu").toFixed(2)} s | ${ratio("cpu")} | ${viewers === 0 ? "" : `${of(name, "gatewayCpu").toFixed(2)} s`} | ${each("frames")} | ${rate} | ${of(name, "late") ?? "no pace"} |`);
  }
  const spread = results.get("none").map((one) => one.wall);
  say(`\nWall times without a viewer lay between ${Math.min(...spread).toFixed(2)} s and ${Math.max(...spread).toFixed(2)} s; the load at the end was ${load()}.`);
}

function recordingCost() {
  const [robots, duration] = [1000, 120];
  const out = path.join(scratch, "recorded");
  execFileSync(kilotwin, ["run", path.join(root, "experiments/disperse.txtpb"), "--robots", String(robots), "--duration", String(duration), "--mode", "local", "--quiet", "--out", out]);
  const summary = JSON.parse(fs.readFileSync(path.join(out, "summary.json"), "utf8"));
  const minutes = duration / 60;
  const bytes = fs.statSync(path.join(out, "recording.ktrec")).size / robots / minutes;
  const ns = (summary.cost_ns_per_robot_tick.recording * summary.ticks) / minutes;
  const all = Object.values(summary.cost_ns_per_robot_tick).reduce((sum, cost) => sum + cost, 0);
  say("\n## Cost of recording\n");
  say(`${robots} robots, ${duration} s, a state per second, in one process. Per robot and simulated minute:\n`);
  say("| bytes | CPU time | share of the run's CPU time | load |\n|---|---|---|---|");
  say(`| ${bytes.toFixed(0)} | ${(ns / 1000).toFixed(1)} us | ${((100 * summary.cost_ns_per_robot_tick.recording) / all).toFixed(2)} % | ${load()} |`);
}

try {
  await drawing();
  await scrubbing();
  await startOfAWatchedRun();
  await recordings();
  recordingCost();
  // 30 s of the robots take half a second of two cores, so 1500 s take more than 20 s.
  await viewersBesideARun("Viewers beside a run without a pace", ["--duration", "1500"], "1500 s as fast as it goes");
  await viewersBesideARun("Viewers beside a run at real time", ["--duration", "20", "--pace", "1"], "20 s at real time");
  if (words.includes("-w")) fs.writeFileSync(path.join(root, "docs/results/view.md"), `${header}${text.join("\n")}\n`);
} finally {
  fs.rmSync(scratch, { recursive: true, force: true });
}
