// The page: one run, live or recorded, from above. It draws when something has changed.
import { Camera } from "./camera.ts";
import { Connection } from "./connection.ts";
import { Flights, FLOATS } from "./flights.ts";
import { furthest, type Point } from "./geometry.ts";
import { Labels } from "./labels.ts";
import { showMarks } from "./marks.ts";
import { Mover } from "./mover.ts";
import { element, notice, setText, showConnection, showFrame, showProgram, showRobot, showRun, showScale } from "./panels.ts";
import { HandOvers } from "./partitions.ts";
import { Playback } from "./playback.ts";
import { ellipsesOf, messageOf, showAlarms, showPackets } from "./outside.ts";
import { Plots } from "./plots.ts";
import { listenToPointer } from "./pointer.ts";
import { kindsOf, type Frame, type MarksText, type Message, type OutsideText, type RobotCounts, type Run, type Status, type TrailText, type WorkText } from "./protocol.ts";
import { Renderer, type Marks } from "./renderer.ts";
import { svgOf } from "./svg.ts";
import { Theme } from "./theme.ts";
import { showWork } from "./work.ts";

const PANEL_EVERY_MS = 200;
/** How often the selected robot's variables and log are asked for while time passes. */
const PROGRAM_EVERY_MS = 400;
const COUNTS_EVERY_MS = 400;
const OUTSIDE_EVERY_MS = 250;
const FLOORS_EVERY_MS = 500;
const LIGHT_EVERY_MS = 200;
const WORK_EVERY_MS = 1000;
/** Marks are asked for again while not all have come, and while the recording grows. */
const MARKS_EVERY_MS = 1000;
const TRAIL_EVERY_S = 1;
const TRAIL_SEGMENTS = 30;
const MOST_TRAIL_POINTS = 2000;
/** Swarms larger than this begin without trails. */
const MOST_TRAILS = 5000;
/** Robots further than this from a click are not selected. */
const CLICK_REACH_PX = 14;
const SEEK_S = 5;
/** The overhead controller's command to send a message once. */
const ONCE = 6;

class Page {
  #stale = true;
  readonly #picture = element<HTMLCanvasElement>("picture");
  readonly #line = element<HTMLInputElement>("line");
  readonly #camera = new Camera();
  #renderer = new Renderer(this.#picture);
  readonly #labels = new Labels(element<HTMLCanvasElement>("labels"));
  readonly #plots: Plots = new Plots({
    send: (request) => this.#connection.send(request),
    seek: (time) => this.#run && this.#seek(time / this.#run.tickSeconds),
  });
  readonly #theme = new Theme(() => this.#recolour());
  readonly #playback = new Playback((request) => this.#connection.send(request));
  readonly #flights = new Flights((request) => this.#connection.send(request));
  readonly #handOvers = new HandOvers();
  readonly #mover: Mover = new Mover({
    send: (request) => this.#connection.send(request),
    notice,
    placeOf: (robot) => this.#placeOf(robot),
    mayMove: () => this.#maySend,
    paused: () => this.#paused,
  }, this.#camera);
  readonly #connection: Connection;

  #run: Run | undefined;
  #status: Status | undefined;
  #counts: RobotCounts | undefined;
  #selected: number | undefined;
  #trail: Point[][] = []; // of the selected robot, in parts
  #program: { tick: number; askedAt: number } | undefined; // what was asked for last
  #countsAsked: { tick: number; at: number } | undefined;
  #floorsAsked = -Infinity;
  #lightAsked: { tick: number; at: number } | undefined;
  #outside: OutsideText | undefined;
  #ellipses: [number, number][][] = [];
  #outsideAsked: { tick: number; at: number } | undefined;
  #work: WorkText | undefined;
  #workAsked = -Infinity;
  #timeMarks: MarksText["marks"] = [];
  #marksDue = true;
  #marksAsked = -Infinity;
  #mayTrail = 0; // when the trail of the selected robot may be asked for again
  #trailTick = -1; // up to which it was asked for
  #trails = true;
  #trailFrom: Frame | undefined;
  #maySteer = false;
  #fitted = true;
  #shown: Frame | undefined;
  #drawnAt = 0;
  #panelsAt = 0;
  #bytes: { at: number; bytes: number }[] = [];
  #pace: { at: number; tick: number }[] = [];
  /** What tests measure. */
  readonly counters = { drawn: 0, received: 0, bytes: 0, drawMs: 0, flights: 0, handOvers: 0, held: "", moved: false };
  #firstDrawn: Frame | undefined;

  constructor() {
    this.#listen();
    this.#connection = new Connection({
      connected: () => this.#connected(),
      lost: () => this.#lost(),
      message: (message) => this.#message(message),
      frame: (frame) => this.#frame(frame),
    });
    requestAnimationFrame((now) => this.#tick(now));
  }

  #recolour(): void {
    this.#stale = true;
    this.#plots.recolour();
  }

  // The connection.

  #connected(): void {
    showConnection("open");
    this.#showToken();
  }

  /** The token leaves the address, which others may see; this tab remembers it, also when it is loaded again. */
  #showToken(): void {
    const given = new URLSearchParams(location.hash.slice(1)).get("token");
    if (given) {
      sessionStorage.setItem("token", given);
      history.replaceState(null, "", location.pathname + location.search);
    }
    const token = sessionStorage.getItem("token");
    if (token) this.#connection.send({ do: "hello", token });
  }

  #lost(): void {
    showConnection("lost");
    this.#playback.lost();
    this.#plots.lost();
    this.#program = this.#outsideAsked = this.#countsAsked = this.#lightAsked = undefined;
    this.#flights.forget();
    this.#mover.refused();
  }

  #message(message: Message): void {
    this.#stale = true;
    switch (message.type) {
      case "run": return this.#begin(message);
      case "status":
        this.#status = message;
        this.#plots.status(message);
        return this.#buttons();
      case "outside":
        this.#outside = message;
        this.#ellipses = ellipsesOf(message);
        showAlarms(message.alarms);
        return showPackets(message, this.#maySend);
      case "flights": return this.#flights.take(message);
      case "work":
        this.#work = message;
        return showWork(message);
      case "marks":
        this.#timeMarks = message.marks;
        this.#marksDue = !message.whole;
        if (this.#run) showMarks(this.#timeMarks, this.#run, (tick) => this.#seek(tick));
        return;
      case "plots": return this.#plots.list(message.plots);
      case "plot": return this.#plots.take(message);
      case "program":
        if (message.robot === this.#selected) showProgram(message);
        return;
      case "extent":
        this.#plots.grown();
        if (this.#run) {
          this.#run.lastTick = message.lastTick;
          this.#run.states = message.states;
          this.#line.max = String(message.lastTick);
          showMarks(this.#timeMarks, this.#run, (tick) => this.#seek(tick));
        }
        this.#marksDue = true;
        this.#countsAsked = undefined;
        return;
      case "light": return this.#renderer.setLight(message);
      case "floors": return this.#renderer.setFloors(message.floors);
      case "trail":
        if (message.robot === this.#selected) this.#takeTrail(message);
        return;
      case "robot":
        this.#counts = message;
        return;
      case "grant":
        this.#maySteer = message.steer;
        return this.#buttons();
      case "notice":
        if (message.refuses === "place") this.#mover.refused();
        return notice(message.text);
    }
  }

  #begin(run: Run): void {
    const another = this.#run?.run !== run.run;
    this.#run = run;
    this.#status = this.#counts = this.#shown = this.#trailFrom = undefined;
    this.#pace = [];
    if (another || (this.#selected ?? 0) >= run.robots) this.#select(undefined);
    this.#renderer.begin(run, kindsOf(run));
    if (another) {
      this.#fitted = true;
      this.#showTrails(run.robots <= MOST_TRAILS);
      this.#showMessages((run.receivedRecorded || run.sentRecorded) && run.robots <= MOST_TRAILS);
    }
    this.#flights.begin(run);
    this.#handOvers.begin(run);
    this.#mover.begin(run);
    this.#useMover(false);
    this.#work = undefined;
    this.#workAsked = this.#marksAsked = -Infinity;
    this.#timeMarks = [];
    this.#marksDue = true;
    showWork(undefined);
    showMarks([], run, () => undefined);
    this.#line.min = String(run.firstTick);
    this.#line.max = String(run.lastTick);
    this.#playback.begin(run);
    this.#plots.begin(run);
    this.#program = this.#outsideAsked = this.#outside = this.#lightAsked = undefined;
    this.#ellipses = [];
    showAlarms([]);
    this.#line.disabled = this.#playback.live;
    element("speed").parentElement!.hidden = this.#playback.live;
    element("back").hidden = this.#playback.live;
    this.#picture.setAttribute("aria-label", `The arena of ${run.name} from above, ${run.robots} robots`);
    this.#countsAsked = undefined;
    this.#buttons();
  }

  #frame(frame: Frame): void {
    if (!this.#run || frame.robots !== this.#run.robots) return;
    this.counters.received += 1;
    this.counters.bytes += frame.bytes;
    this.#bytes.push({ at: performance.now(), bytes: frame.bytes });
    this.#playback.take(frame);
    this.#plots.frame(frame, performance.now());
    this.#flights.frame(frame);
    this.#stale = true;
  }

  // Drawing.

  /** Nothing that the graphics memory held is there any more, except trails all of it is made again. */
  #restorePicture(): void {
    const { floors, light } = this.#renderer;
    this.#renderer = new Renderer(this.#picture);
    if (this.#run) this.#renderer.begin(this.#run, kindsOf(this.#run));
    this.#renderer.setFloors(floors);
    this.#renderer.setLight(light);
    this.#shown = undefined;
    this.#stale = true;
  }

  #tick(now: number): void {
    requestAnimationFrame((next) => this.#tick(next));
    const seconds = Math.min(0.25, (now - this.#drawnAt) / 1000);
    this.#drawnAt = now;
    if (this.#playback.advance(seconds)) this.#stale = true;
    const main = this.#picture.parentElement!;
    if (main.clientWidth !== this.#camera.width || main.clientHeight !== this.#camera.height) {
      this.#camera.resize(main.clientWidth, main.clientHeight);
      this.#stale = true;
    }
    if (this.#mover.update(now) || this.#handOvers.active) this.#stale = true;
    this.#flights.update(this.#playback, now);
    if (this.#stale) this.#draw();
    if (now - this.#panelsAt > PANEL_EVERY_MS) {
      this.#panelsAt = now;
      this.#panels(now);
    }
  }

  #draw(): void {
    const began = performance.now();
    this.#stale = false;
    const run = this.#run;
    if (run && this.#fitted) this.#camera.fit(run.arena.halfWidth, run.arena.halfHeight);
    const { current: frame, next, part } = this.#playback;
    if (frame && (frame !== this.#shown || part > 0 || this.#playback.playing)) this.#renderer.setFrame(frame, next, part);
    if (frame && frame !== this.#shown) {
      this.#follow(frame);
      this.#handOvers.take(frame, began);
      this.#shown = frame;
      this.#mover.frame(frame);
    }
    const selected = frame && this.#selected !== undefined ? this.#placeOf(this.#selected) : undefined;
    if (selected && element<HTMLInputElement>("follow").checked) {
      this.#fitted = false;
      [this.#camera.x, this.#camera.y] = selected;
    }
    this.#renderer.draw(this.#camera, this.#theme.palette, frame, frame?.movables ?? new Float32Array(), this.#marks(selected));
    showScale(this.#camera.pxPerMm);
    if (run && frame) this.#labels.draw(run, frame, this.#camera, this.#selected, (robot) => this.#placeOf(robot));
    this.counters.drawn += 1;
    this.counters.drawMs += performance.now() - began;
    if (this.counters.moved || !frame) return;
    const first = (this.#firstDrawn ??= frame);
    this.counters.moved = first.robots === frame.robots && frame.x.some((x, robot) => x !== first.x[robot]);
  }

  #marks(selected: [number, number] | undefined): Marks {
    const trail = selected && this.#trail.length > 0 ? [...this.#trail.slice(0, -1), ...this.#goOn(this.#trail.at(-1)!, selected)] : [];
    const range = element<HTMLInputElement>("range").checked ? (this.#run?.radioRange ?? 0) : 0;
    const place = (robot: number): [number, number] => this.#placeOf(robot);
    const flying = this.#playback.current ? this.#flights.fill(this.#playback, place, this.#selected) : 0;
    const flights = this.#flights.data.subarray(0, FLOATS * flying);
    const flashes = this.#playback.current ? this.#handOvers.flashes(performance.now(), place) : [];
    this.counters.flights += flying;
    this.counters.handOvers = this.#handOvers.count;
    this.counters.held = this.#mover.held ? `${this.#mover.held.movable ? "object" : "robot"} ${this.#mover.held.body}${this.#mover.waiting ? " waits" : ""}` : "";
    const heard = this.#flights.shown && this.#counts?.robot === this.#selected ? (this.#counts?.lately ?? []).map(place) : [];
    return { selected, trail, range, heard, ellipses: this.#ellipses, flights, flashes, held: this.#mover.lines() };
  }

  /** Where a robot is drawn, mm. */
  #placeOf(robot: number): [number, number] {
    const { current, next, part } = this.#playback;
    const run = this.#run!;
    let x = current!.x[robot]!;
    let y = current!.y[robot]!;
    if (next && part > 0) {
      x += (next.x[robot]! - x) * part;
      y += (next.y[robot]! - y) * part;
    }
    return [run.gridLowest + run.gridStep * x, run.gridLowest + run.gridStep * y];
  }

  /** Trails go on with a new state; a jump in time cuts them. */
  #follow(frame: Frame): void {
    const run = this.#run!;
    const from = this.#trailFrom;
    const passed = from ? (frame.tick - from.tick) * run.tickSeconds : Infinity;
    const longest = 20 * Math.max(TRAIL_EVERY_S, (frame.nextTick - frame.tick) * run.tickSeconds) * Math.max(1, this.#playback.speed);
    if (passed < 0 || passed > longest) {
      this.#renderer.forgetTrails();
      this.#trailFrom = frame;
    } else if (from && passed >= TRAIL_EVERY_S) {
      if (this.#trails) this.#renderer.addTrailSegment(from, frame, TRAIL_SEGMENTS, furthest(passed));
      if (this.#playback.live && this.#selected !== undefined) this.#lengthenTrail(this.#placeOf(this.#selected));
      this.#trailFrom = frame;
    }
    if (!this.#playback.live) this.#askTrail();
  }

  /** The last part of a trail and a further place: two parts where the robot was placed elsewhere in between. */
  #goOn(part: Point[], place: Point): Point[][] {
    const [x, y] = part.at(-1)!;
    const from = this.#trailFrom;
    const passed = from && this.#shown ? Math.abs(this.#shown.tick - from.tick) * this.#run!.tickSeconds : 0;
    const near = !this.#playback.live || Math.hypot(place[0] - x, place[1] - y) <= furthest(Math.max(TRAIL_EVERY_S, passed));
    return near ? [[...part, place]] : [part, [place]];
  }

  #lengthenTrail(place: Point): void {
    const last = this.#trail.pop();
    this.#trail.push(...(last ? this.#goOn(last, place) : [[place]]));
    if (this.#trail.reduce((sum, part) => sum + part.length, 0) <= MOST_TRAIL_POINTS) return;
    // Every second point, and the ends of parts; of the parts, the newest.
    this.#trail = this.#trail.slice(-MOST_TRAIL_POINTS / 4).map((part) => part.filter((_, i) => i % 2 === 0 || i === part.length - 1));
  }

  #takeTrail({ xy, whole }: TrailText): void {
    this.#trail = [];
    for (let i = 0; i + 1 < xy.length; i += 2) {
      const [x, y] = [xy[i], xy[i + 1]];
      if (x == null || y == null) this.#trail.push([]);
      else if (this.#trail.length === 0) this.#trail.push([[x, y]]);
      else this.#trail.at(-1)!.push([x, y]);
    }
    this.#trail = this.#trail.filter(({ length }) => length > 0);
    if (!whole) setTimeout(() => this.#askTrail(), Math.max(0, this.#mayTrail - performance.now()));
  }

  #askTrail(): void {
    if (this.#selected === undefined || performance.now() < this.#mayTrail) return;
    this.#mayTrail = performance.now() + 500;
    this.#trailTick = Math.floor(this.#playback.time);
    this.#connection.send({ do: "trail", robot: this.#selected, tick: this.#trailTick });
  }

  #askProgram(robot: number, tick: number, now: number): void {
    const last = this.#program;
    if (last && (last.tick === tick || now - last.askedAt < PROGRAM_EVERY_MS)) return;
    this.#program = { tick, askedAt: now };
    this.#connection.send({ do: "program", robot, tick });
  }

  #askCounts(robot: number, tick: number, now: number): void {
    const last = this.#countsAsked;
    const settled = last?.tick === tick && this.#counts?.tick === tick && this.#counts.whole;
    if (last && (settled || now - last.at < COUNTS_EVERY_MS)) return;
    this.#countsAsked = { tick, at: now };
    this.#connection.send({ do: "robot", robot, tick });
  }

  /** Floors of recordings come with their states. */
  #askFloors(tick: number, now: number): void {
    if (!this.#playback.live || now - this.#floorsAsked < FLOORS_EVERY_MS) return;
    this.#floorsAsked = now;
    this.#connection.send({ do: "floors", tick });
  }

  #askLight(tick: number, now: number): void {
    if (!this.#run?.light || this.#lightAsked?.tick === tick) return;
    if (this.#lightAsked && now - this.#lightAsked.at < LIGHT_EVERY_MS) return;
    this.#lightAsked = { tick, at: now };
    this.#connection.send({ do: "light", tick });
  }

  #askOutside(tick: number, now: number): void {
    const last = this.#outsideAsked;
    if (last && (last.tick === tick || now - last.at < OUTSIDE_EVERY_MS)) return;
    this.#outsideAsked = { tick, at: now };
    this.#connection.send({ do: "outside", tick });
  }

  #askWork(now: number): void {
    const settled = !this.#playback.live && this.#work !== undefined && (this.#work.federates.length > 0 || this.#work.cost.length > 0);
    if (settled || now - this.#workAsked < WORK_EVERY_MS) return;
    this.#workAsked = now;
    this.#connection.send({ do: "work" });
  }

  #askMarks(now: number): void {
    if (this.#playback.live || !this.#marksDue || now - this.#marksAsked < MARKS_EVERY_MS) return;
    this.#marksAsked = now;
    this.#connection.send({ do: "marks" });
  }

  #panels(now: number): void {
    const run = this.#run;
    const frame = this.#playback.current;
    if (!run) return;
    this.#bytes = this.#bytes.filter((entry) => now - entry.at < 2000);
    showRun(run, this.#status, this.#work, this.#bytes.reduce((sum, entry) => sum + entry.bytes, 0) / 2, this.#handOvers.count);
    if (!frame) return;
    const time = this.#playback.playing ? this.#playback.time : frame.tick;
    this.#pace.push({ at: now, tick: time });
    this.#pace = this.#pace.filter((entry) => now - entry.at < 2000);
    const first = this.#pace[0]!;
    const moving = this.#pace.length > 2 && now > first.at;
    const speed = moving ? ((time - first.tick) * run.tickSeconds * 1000) / (now - first.at) : undefined;
    showFrame(run, frame, time, speed === undefined || speed < 0 ? undefined : speed);
    setText("clock", `${(time * run.tickSeconds).toFixed(2)} / ${(run.lastTick * run.tickSeconds).toFixed(1)} s`);
    if (document.activeElement !== this.#line || this.#playback.playing || this.#playback.live) this.#line.value = String(time);
    this.#line.setAttribute("aria-valuetext", `${(time * run.tickSeconds).toFixed(1)} seconds`);
    if (this.#selected !== undefined) {
      showRobot(run, frame, this.#selected, this.#counts);
      this.#askProgram(this.#selected, Math.floor(time), now);
      this.#askCounts(this.#selected, Math.floor(time), now);
      if (!this.#playback.live && this.#trailTick !== Math.floor(time)) this.#askTrail();
    }
    this.#askOutside(Math.floor(time), now);
    this.#askFloors(Math.floor(time), now);
    this.#askLight(Math.floor(time), now);
    this.#askWork(now);
    this.#askMarks(now);
    this.#plots.update(now, time * run.tickSeconds);
    this.#buttons();
  }

  // Actions of the viewer.

  get #paused(): boolean {
    return this.#playback.live ? this.#status?.phase === "paused" : !this.#playback.playing;
  }

  get #maySend(): boolean {
    const phase = this.#status?.phase;
    return this.#playback.live && this.#maySteer && (phase === "running" || phase === "paused");
  }

  #sendOverhead(): void {
    const data = element<HTMLInputElement>("overhead-data").value;
    const message = messageOf(element<HTMLInputElement>("overhead-type").valueAsNumber, data);
    if (message === undefined) notice("A message has a type from 0 to 255 and up to 9 octets of data, two hexadecimal digits each.");
    else this.#connection.send({ do: "overhead", command: ONCE, message });
  }

  #buttons(): void {
    const live = this.#playback.live;
    const phase = this.#status?.phase;
    const steers = !live || (this.#maySteer && (phase === "running" || phase === "paused"));
    const play = element<HTMLButtonElement>("play");
    const label = this.#paused ? (live ? "Continue" : "Play") : "Pause";
    if (play.getAttribute("aria-label") !== label) {
      play.setAttribute("aria-label", label);
      play.classList.toggle("paused", this.#paused);
    }
    play.disabled = !steers;
    element<HTMLButtonElement>("forward").disabled = !steers || (live && phase !== "paused");
    element("stop").hidden = !live || !steers;
    element("move").hidden = !live;
    element<HTMLButtonElement>("move").disabled = !this.#maySend;
    if (this.#mover.on && !this.#maySend) this.#useMover(false);
    if (element("overhead-form").hidden === this.#maySend) showPackets(this.#outside, this.#maySend);
    const badge = element("phase");
    badge.hidden = !this.#run;
    setText("phase", live ? `live: ${phase ?? "waiting"}` : "recorded");
  }

  #playOrPause(): void {
    if (this.#playback.live) this.#connection.send({ do: this.#paused ? "continue" : "pause" });
    else this.#playback.toggle();
    this.#stale = true;
    this.#buttons();
  }

  #seek(tick: number): void {
    this.#playback.seek(tick);
    this.#pace = [];
    this.#stale = true;
  }

  #step(direction: 1 | -1): void {
    this.#pace = [];
    if (!this.#playback.live) this.#playback.step(direction);
    else if (direction > 0 && this.#paused) this.#connection.send({ do: "step", steps: 1 });
    this.#stale = true;
  }

  #select(robot: number | undefined): void {
    this.#selected = robot;
    this.#trail = [];
    this.#mayTrail = 0;
    this.#program = this.#countsAsked = this.#counts = undefined;
    this.#stale = true;
    this.#plots.select(robot);
    showProgram(undefined);
    if (robot === undefined) {
      element("robot").hidden = true;
      return;
    }
    if (!this.#playback.live) this.#askTrail();
    if (this.#run && this.#playback.current) showRobot(this.#run, this.#playback.current, robot, this.#counts);
  }

  #clicked(px: number, py: number): void {
    const frame = this.#playback.current;
    if (!this.#run || !frame) return;
    const [x, y] = this.#camera.toArena(px, py);
    let nearest: number | undefined;
    let least = Math.max(this.#run.robotRadius, CLICK_REACH_PX / this.#camera.pxPerMm);
    for (let robot = 0; robot < frame.robots; ++robot) {
      const [a, b] = this.#placeOf(robot);
      const distance = Math.hypot(a - x, b - y);
      if (distance < least) [nearest, least] = [robot, distance];
    }
    this.#select(nearest);
  }

  #find(): void {
    const robot = element<HTMLInputElement>("find-id").valueAsNumber;
    if (!this.#run || !(robot >= 0 && robot < this.#run.robots)) {
      notice(`There is no such robot; robots are numbered from 0 to ${(this.#run?.robots ?? 1) - 1}.`);
      return;
    }
    this.#select(robot);
  }

  #zoom(factor: number): void {
    this.#fitted = false;
    this.#camera.zoomAt(this.#camera.width / 2, this.#camera.height / 2, factor);
    this.#stale = true;
  }

  #fit(): void {
    this.#fitted = true;
    element<HTMLInputElement>("follow").checked = false;
    this.#stale = true;
  }

  #showTrails(show: boolean): void {
    this.#trails = show;
    element("trails").setAttribute("aria-pressed", String(show));
    if (!show) this.#renderer.forgetTrails();
    this.#stale = true;
  }

  #showMessages(show: boolean): void {
    this.#flights.shown = show;
    element("messages").setAttribute("aria-pressed", String(show));
    this.#stale = true;
  }

  #toggleMessages(): void {
    if (!this.#flights.recorded) {
      notice("No messages are recorded. The experiment's recording { event: RECEIVED } records them.");
      return;
    }
    this.#showMessages(!this.#flights.shown);
  }

  /** Chooses or leaves the tool that moves robots and objects. */
  #useMover(use: boolean): void {
    if (use && !this.#maySend) {
      notice("Moving needs a run that goes on, and the whole address that `kilotwin view` has printed.");
      use = false;
    }
    this.#mover.on = use;
    if (!use) this.#mover.release();
    element("move").setAttribute("aria-pressed", String(use));
    this.#picture.classList.toggle("moves", use);
    if (use && this.#selected !== undefined && this.#playback.current) this.#mover.takeRobot(this.#selected, this.#playback.current);
    this.#stale = true;
  }

  /** Moves or turns the selected robot, or the object in hand. False: there is none. */
  #nudge(right: number, up: number, turns: number): boolean {
    const frame = this.#playback.current;
    if (!this.#mover.on || !frame) return false;
    if (!this.#mover.held && (this.#selected === undefined || !this.#mover.takeRobot(this.#selected, frame))) return false;
    this.#mover.nudge(right, up, turns);
    return true;
  }

  #toggleHelp(show?: boolean): void {
    const panel = element("help-panel");
    panel.hidden = show === undefined ? !panel.hidden : !show;
    element("help").setAttribute("aria-expanded", String(!panel.hidden));
  }

  /** Saves picture and labels as one PNG. */
  #save(): void {
    this.#draw(); // the picture's memory lasts until the browser shows it
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [this.#picture.width, this.#picture.height];
    const context = copy.getContext("2d")!;
    context.drawImage(this.#picture, 0, 0);
    const labels = element<HTMLCanvasElement>("labels");
    if (labels.width > 0 && labels.height > 0) context.drawImage(labels, 0, 0, copy.width, copy.height);
    copy.toBlob((blob) => blob && this.#download(blob, "png"));
  }

  /** Saves the same section as lines and areas, without the trails of all robots. */
  #saveSvg(): void {
    const run = this.#run;
    const frame = this.#playback.current;
    if (!run || !frame) return;
    const selected = this.#selected === undefined ? undefined : this.#placeOf(this.#selected);
    const svg = svgOf(
      { run, frame, kinds: kindsOf(run), floors: this.#renderer.floors, light: this.#renderer.light, movables: frame.movables, marks: this.#marks(selected),
        selected: this.#selected, placeOf: (robot) => this.#placeOf(robot) },
      this.#camera, this.#theme.palette,
    );
    this.#download(new Blob([svg], { type: "image/svg+xml" }), "svg");
  }

  #download(blob: Blob, ending: string): void {
    const link = document.createElement("a");
    link.href = URL.createObjectURL(blob);
    link.download = `${this.#run?.name ?? "kilotwin"}-${Math.floor(this.#playback.time)}.${ending}`;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10000);
  }

  #listen(): void {
    const on = (id: string, act: () => void): void => element(id).addEventListener("click", act);
    on("play", () => this.#playOrPause());
    on("back", () => this.#step(-1));
    on("forward", () => this.#step(1));
    on("stop", () => {
      if (confirm("Stop the run for good? What was recorded stays.")) this.#connection.send({ do: "stop" });
    });
    on("zoom-in", () => this.#zoom(1.4));
    on("zoom-out", () => this.#zoom(1 / 1.4));
    on("fit", () => this.#fit());
    on("trails", () => this.#showTrails(!this.#trails));
    on("messages", () => this.#toggleMessages());
    on("move", () => this.#useMover(!this.#mover.on));
    on("plots-button", () => this.#plots.toggle());
    on("save", () => this.#save());
    on("save-svg", () => this.#saveSvg());
    on("theme", () => this.#theme.toggle());
    on("help", () => this.#toggleHelp());
    for (const id of ["follow", "range"]) element(id).addEventListener("change", () => (this.#stale = true));
    element("find").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#find();
    });
    element("overhead-form").addEventListener("submit", (event) => {
      event.preventDefault();
      this.#sendOverhead();
    });
    element<HTMLSelectElement>("speed").addEventListener("change", (event) => {
      this.#playback.speed = Number((event.target as HTMLSelectElement).value);
    });
    this.#line.addEventListener("input", () => {
      this.#seek(Number(this.#line.value));
    });
    listenToPointer(this.#picture, this.#camera, {
      moved: () => {
        this.#fitted = false;
        this.#stale = true;
      },
      dragged: () => (element<HTMLInputElement>("follow").checked = false),
      clicked: (px, py) => this.#clicked(px, py),
      takes: (px, py, withShift) => {
        const frame = this.#playback.current;
        this.#stale = true;
        return (this.#mover.on || withShift) && frame !== undefined && this.#mover.take(px, py, frame);
      },
      carried: (px, py) => {
        this.#mover.drag(px, py);
        this.#stale = true;
      },
      dropped: (moved) => {
        this.#mover.drop(moved);
        this.#stale = true;
      },
    });
    window.addEventListener("keydown", (event) => this.#key(event));
    // A new address of the same page brings a new token.
    window.addEventListener("hashchange", () => this.#showToken());
    this.#picture.addEventListener("webglcontextlost", (event) => {
      event.preventDefault(); // else the browser does not give it back
      notice("The browser has taken the graphics memory away. The picture comes back by itself.");
    });
    this.#picture.addEventListener("webglcontextrestored", () => this.#restorePicture());
  }

  #key(event: KeyboardEvent): void {
    const typing = event.target instanceof HTMLInputElement && ["number", "text"].includes(event.target.type);
    const onControl = event.target instanceof HTMLButtonElement || event.target instanceof HTMLSelectElement || event.target === this.#line;
    if (typing || event.ctrlKey || event.metaKey || event.altKey) return;
    const run = this.#run;
    const jump = run ? SEEK_S / run.tickSeconds : 0;
    const keys: Record<string, () => unknown> = {
      ".": () => this.#step(1),
      ",": () => this.#step(-1),
      "+": () => this.#zoom(1.4),
      "=": () => this.#zoom(1.4),
      "-": () => this.#zoom(1 / 1.4),
      "0": () => this.#fit(),
      p: () => this.#plots.toggle(),
      t: () => this.#showTrails(!this.#trails),
      m: () => this.#toggleMessages(),
      g: () => this.#useMover(!this.#mover.on),
      "[": () => this.#nudge(0, 0, 1),
      "]": () => this.#nudge(0, 0, -1),
      d: () => this.#theme.toggle(),
      s: () => this.#save(),
      v: () => this.#saveSvg(),
      f: () => element("follow").click(),
      "?": () => this.#toggleHelp(),
      Escape: () => {
        this.#toggleHelp(false);
        if (this.#mover.held || this.#mover.on) this.#useMover(false);
        else this.#select(undefined);
      },
    };
    // These belong to the control that has the focus.
    if (!onControl || event.target === this.#line) keys[" "] = () => this.#playOrPause();
    if (!onControl) {
      keys["ArrowLeft"] = () => this.#nudge(-1, 0, 0) || this.#seek(this.#playback.time - jump);
      keys["ArrowRight"] = () => this.#nudge(1, 0, 0) || this.#seek(this.#playback.time + jump);
      keys["ArrowUp"] = () => this.#nudge(0, 1, 0);
      keys["ArrowDown"] = () => this.#nudge(0, -1, 0);
    }
    const act = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!act) return;
    event.preventDefault();
    act();
    this.#stale = true;
  }
}

declare global {
  interface Window {
    /** For tests: what the page has drawn and received. */
    kilotwin?: Page["counters"];
  }
}

try {
  window.kilotwin = new Page().counters;
} catch (error) {
  notice(`The page cannot start: ${error instanceof Error ? error.message : String(error)}.`);
}
