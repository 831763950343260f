// Text of the page: head line, facts, the selected robot. All text from a run enters as text, never as HTML.
import { GRID_PX, roundStep } from "./geometry.ts";
import { cellOf, isGhost } from "./partitions.ts";
import {
  groupOf, headingOf, ledOf, leftMotorOn, lifeName, lifeOf, rightMotorOn, LIFE_FAILED,
  type Frame, type ProgramText, type RobotCounts, type Run, type Status, type WorkText,
} from "./protocol.ts";

export function element<Kind extends HTMLElement>(id: string): Kind {
  const found = document.getElementById(id);
  if (!found) throw new Error(`the page has no element "${id}"`);
  return found as Kind;
}

export function setText(id: string, text: string): void {
  const at = element(id);
  if (at.textContent !== text) at.textContent = text;
}

type Fact = [name: string, value: string];

/** Shows facts as a definition list; changes only what has changed. */
function setFacts(list: HTMLElement, facts: Fact[]): void {
  while (list.children.length > facts.length) list.lastElementChild!.remove();
  facts.forEach(([name, value], i) => {
    let row = list.children[i];
    if (!row) {
      row = document.createElement("div");
      row.append(document.createElement("dt"), document.createElement("dd"));
      list.append(row);
    }
    const [dt, dd] = [row.children[0]!, row.children[1]!];
    if (dt.textContent !== name) dt.textContent = name;
    if (dd.textContent !== value) dd.textContent = value;
  });
}

const seconds = (s: number): string => `${s.toFixed(s < 100 ? 2 : 1)} s`;
const fileName = (path: string): string => path.split("/").pop() ?? "";
const list = (entries: { robot: number; count: number }[]): string =>
  entries.length === 0 ? "none" : entries.map((entry) => `${entry.robot} (${entry.count})`).join(", ");

export function showRun(run: Run, status: Status | undefined, work: WorkText | undefined, bytesPerSecond: number, handOvers: number): void {
  setText("name", run.name);
  setText("speed-what", run.source === "recorded" ? "playback" : "speed");
  document.title = `${run.name} – Kilotwin`;
  const { radius, corners, halfWidth, halfHeight } = run.arena;
  const size = `${(2 * halfWidth).toFixed(0)} × ${(2 * halfHeight).toFixed(0)} mm`;
  const facts: Fact[] = [
    ["seen", run.source],
    ["seed", run.seed],
    ["arena", radius !== undefined ? `circle, radius ${radius.toFixed(0)} mm` : corners ? `polygon, ${size}` : size],
    ["tick", `${(1000 * run.tickSeconds).toFixed(3)} ms`],
    ["radio range", `${run.radioRange.toFixed(0)} mm`],
  ];
  if (run.partitions[0] * run.partitions[1] > 1) 
    facts.push(["partitions", run.partitions.join(" × ")], ["margin of ghosts", `${run.ghostMargin.toFixed(0)} mm`], ["hand-overs seen", String(handOvers)]);
  if (run.source === "recorded") facts.push(["states", String(run.states)]);
  if (status) {
    facts.push(["messages sent", String(status.sent)], ["received", String(status.received)]);
    if (status.wallSeconds > 0) facts.push(["mean speed", `${(status.simulatedSeconds / status.wallSeconds).toFixed(2)}×`]);
    if (status.note) facts.push(["note", status.note]);
  } else if (work?.sent !== undefined) {
    facts.push(["messages sent", String(work.sent)], ["received", String(work.received)]);
    if (work.meanSpeed) facts.push(["mean speed", `${work.meanSpeed.toFixed(2)}×`]);
  }
  facts.push(["data", `${(bytesPerSecond / 1000).toFixed(0)} kB/s`]);
  for (const group of run.groups) {
    const what = `${group.kind}${group.immobile ? ", immobile" : ""}`;
    facts.push([`robots ${group.first} to ${group.first + group.count - 1}`, [what, fileName(group.program)].filter(Boolean).join(": ")]);
  }
  setFacts(element("run-facts"), facts);
}

export function showFrame(run: Run, frame: Frame, tick: number, speed: number | undefined): void {
  let failed = 0;
  for (const state of frame.state) if (lifeOf(state) === LIFE_FAILED) ++failed;
  setText("time", seconds(tick * run.tickSeconds));
  setText("count", String(frame.robots));
  setText("speed-now", speed === undefined ? "–" : `${speed.toFixed(speed < 10 ? 2 : 0)}×`);
  setText("faults", String(failed));
  element("faults-figure").hidden = failed === 0;
}

/** Column and row of the partition in which a robot stands; undefined where there is one partition. */
function partitionOf(run: Run, frame: Frame, robot: number): string | undefined {
  if (run.partitions[0] * run.partitions[1] <= 1) return undefined;
  const [x, y] = [run.gridLowest + run.gridStep * frame.x[robot]!, run.gridLowest + run.gridStep * frame.y[robot]!];
  return `${cellOf(run, x, y).join(", ")}${isGhost(run, x, y) ? ", known to its neighbour" : ""}`;
}

/** Counts up to the time of the picture where events are recorded, else of the whole run. */
function messageFacts(run: Run, counts: RobotCounts): Fact[] {
  const facts: Fact[] = [];
  const whole = counts.run;
  const add = (name: string, now: string | undefined, ofRun: string | undefined): void => {
    if (now !== undefined) facts.push([name, counts.whole ? now : `${now}…`]);
    else if (ofRun !== undefined) facts.push([`${name}, whole run`, ofRun]);
  };
  const count = (value: number | undefined): string | undefined => (value === undefined ? undefined : String(value));
  const partners = (value: { robot: number; count: number }[] | undefined): string | undefined => (value ? list(value) : undefined);
  add("messages sent", run.sentRecorded ? count(counts.sent) : undefined, count(whole?.sent));
  add("received", run.receivedRecorded ? count(counts.received) : undefined, count(whole?.received));
  add("heard most", run.receivedRecorded ? partners(counts.heard) : undefined, partners(whole?.heard));
  add("heard by", undefined, partners(whole?.heardBy));
  add("lost to collisions", undefined, count(whole?.collided));
  add("backed off", undefined, count(whole?.backedOff));
  if (counts.since !== undefined && (run.sentRecorded || run.receivedRecorded)) facts.push(["messages since", seconds(counts.since * run.tickSeconds)]);
  return facts;
}

export function showRobot(run: Run, frame: Frame, robot: number, counts: RobotCounts | undefined): void {
  const section = element("robot");
  section.hidden = false;
  setText("robot-title", `Robot ${robot}`);
  const value = frame.headingLed[robot]!;
  const state = frame.state[robot]!;
  const group = groupOf(run, robot);
  const facts: Fact[] = [
    ["x, y", `${(run.gridLowest + run.gridStep * frame.x[robot]!).toFixed(1)}, ${(run.gridLowest + run.gridStep * frame.y[robot]!).toFixed(1)} mm`],
    ["heading", `${Math.round((headingOf(value) * 180) / Math.PI) % 360}°`],
    ["LED (r g b)", ledOf(value).join(" ")],
    ["state", lifeName(lifeOf(state))],
  ];
  if (run.source === "live") {
    const motors = [leftMotorOn(state) ? "left" : "", rightMotorOn(state) ? "right" : ""].filter(Boolean).join(" and ");
    facts.push(["motors on", motors || "none"]);
  }
  const partition = partitionOf(run, frame, robot);
  if (partition) facts.push(["partition", partition]);
  if (group) facts.push(["kind", group.kind], ["program", fileName(group.program) || "none"]);
  if (counts?.robot === robot) facts.push(...messageFacts(run, counts));
  setFacts(element("robot-facts"), facts);
}

const valueText = (value: number | null): string =>
  value === null ? "–" : Number.isInteger(value) ? String(value) : String(Number(value.toPrecision(6)));

/** Variables and log of the selected robot's program. Their text comes from programs. */
export function showProgram(program: ProgramText | undefined): void {
  element("robot-program").hidden = !program;
  if (!program) return;
  setFacts(element("robot-variables"), program.variables.map(({ name, value }): Fact => [name, valueText(value)]));
  const unknown = "The recording is not known here: kilotwin view RUN --domain N.";
  const hint = (id: string, absent: boolean, text: string): void => {
    element(id).hidden = !absent;
    setText(id, program.known ? text : unknown);
  };
  hint("no-variables", program.variables.length === 0, "None is recorded; recording { variable { name: \"NAME\" } } in the experiment records one.");
  const log = element("robot-log");
  const atEnd = log.scrollTop + log.clientHeight >= log.scrollHeight - 4;
  const changed = log.textContent !== program.log;
  if (changed) log.textContent = program.log;
  log.hidden = program.log === "";
  hint("no-log", program.log === "", "Nothing so far.");
  if (changed && atEnd) log.scrollTop = log.scrollHeight;
}

/** A bar of a round length, as far apart as the lines of the grid. */
export function showScale(pxPerMm: number): void {
  const step = roundStep(GRID_PX / pxPerMm);
  const text = step >= 1000 ? `${step / 1000} m` : `${Number(step.toPrecision(1))} mm`;
  element("scale").style.width = `${(step * pxPerMm).toFixed(1)}px`;
  setText("scale", text);
}

let noticeTimer: ReturnType<typeof setTimeout> | undefined;

/** One line above the picture, for some seconds. */
export function notice(text: string): void {
  const at = element("notice");
  at.textContent = text;
  at.hidden = false;
  clearTimeout(noticeTimer);
  noticeTimer = setTimeout(() => (at.hidden = true), 6000);
}

export function showConnection(state: "connecting" | "open" | "lost"): void {
  document.body.dataset["connection"] = state;
  setText("connection", state === "open" ? "connected" : state === "lost" ? "connection lost; tries again" : "connecting");
}
