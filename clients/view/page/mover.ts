// Moves a robot or an object of a live run: an outline is dragged, turned, and sent; it stays until the run shows the body there.
import type { Camera } from "./camera.ts";
import { circle, outline, type Point } from "./geometry.ts";
import { groupOf, headingOf, LIFE_ABSENT, lifeOf, type Frame, type Run } from "./protocol.ts";

const REACH_PX = 14;
/** Of the handle that turns the body, from its rim. */
const HANDLE_PX = 24;
const HANDLE_RADIUS_PX = 6;
const KEY_MM = 5;
const KEY_RAD = Math.PI / 12;
/** Keys that follow each other within this time are one request. */
const KEY_PAUSE_MS = 350;
/** A running run that does not show the body there after so long has not placed it. */
const PATIENCE_MS = 4000;

export interface MoverListener {
  send(request: object): void;
  notice(text: string): void;
  /** Where a robot is drawn, mm. */
  placeOf(robot: number): Point;
  mayMove(): boolean;
  paused(): boolean;
}

type Pose = { x: number; y: number; heading: number };

interface Held {
  movable: boolean;
  body: number;
  pose: Pose;
  /** Where the run had it when it was taken. */
  from: Pose;
  grip: "none" | "body" | "handle";
  /** From the pointer to the centre, mm. */
  offset: Point;
  /** Sent, and not shown by the run so far. */
  sentAt: number | undefined;
  changedAt: number | undefined;
}

export class Mover {
  /** The tool is chosen: bodies are taken without a further key. */
  on = false;
  #held: Held | undefined;
  #run: Run | undefined;
  readonly #listener: MoverListener;
  readonly #camera: Camera;

  constructor(listener: MoverListener, camera: Camera) {
    this.#listener = listener;
    this.#camera = camera;
  }

  begin(run: Run): void {
    this.#run = run;
    this.#held = undefined;
  }

  get held(): Held | undefined {
    return this.#held;
  }

  /** Waits for the run to show what was asked of it. */
  get waiting(): boolean {
    return this.#held?.sentAt !== undefined;
  }

  release(): void {
    this.#held = undefined;
  }

  /** Takes what lies under the pointer. False: nothing does. */
  take(px: number, py: number, frame: Frame): boolean {
    const run = this.#run;
    if (!run) return false;
    const at = this.#camera.toArena(px, py);
    const handle = this.#handle();
    if (this.#held && handle && Math.hypot(handle[0] - at[0], handle[1] - at[1]) * this.#camera.pxPerMm <= HANDLE_RADIUS_PX + 4) {
      this.#held.grip = "handle";
      return true;
    }
    const [movable, body] = this.#under(at, frame, run) ?? [false, undefined];
    if (body === undefined) return false;
    if (!this.#listener.mayMove()) {
      this.#listener.notice(run.source === "recorded" ? "A recorded run cannot be changed." : "Moving needs a run that goes on, and the whole address that `kilotwin view` has printed.");
      return true;
    }
    if (!movable && groupOf(run, body)?.kind === "tracked") {
      this.#listener.notice(`Robot ${body} is tracked: a real robot, which only a hand can move.`);
      return true;
    }
    const pose = this.#poseOf(movable, body, frame);
    this.#held = { movable, body, pose, from: { ...pose }, grip: "body", offset: [pose.x - at[0], pose.y - at[1]], sentAt: undefined, changedAt: undefined };
    return true;
  }

  /** Takes a robot by keys. */
  takeRobot(robot: number, frame: Frame): boolean {
    if (this.#held && !this.#held.movable && this.#held.body === robot) return true;
    if (!this.#run || !this.#listener.mayMove() || groupOf(this.#run, robot)?.kind === "tracked") return false;
    const pose = this.#poseOf(false, robot, frame);
    this.#held = { movable: false, body: robot, pose, from: { ...pose }, grip: "none", offset: [0, 0], sentAt: undefined, changedAt: undefined };
    return true;
  }

  drag(px: number, py: number): void {
    const held = this.#held;
    if (!held || held.grip === "none") return;
    const [x, y] = this.#camera.toArena(px, py);
    if (held.grip === "handle") held.pose = { ...held.pose, heading: Math.atan2(y - held.pose.y, x - held.pose.x) };
    else held.pose = { ...held.pose, x: x + held.offset[0], y: y + held.offset[1] };
  }

  drop(moved: boolean): void {
    const held = this.#held;
    if (!held || held.grip === "none") return;
    held.grip = "none";
    if (moved) this.#send();
  }

  /** Moves or turns what is held by a key. */
  nudge(right: number, up: number, turns: number): void {
    const held = this.#held;
    if (!held) return;
    const { x, y, heading } = held.pose;
    held.pose = { x: x + KEY_MM * right, y: y + KEY_MM * up, heading: heading + KEY_RAD * turns };
    held.changedAt = performance.now();
  }

  /** Sends what keys have changed, and gives up what the run does not show. Returns whether the picture changes. */
  update(now: number): boolean {
    const held = this.#held;
    if (!held) return false;
    if (held.changedAt !== undefined && now - held.changedAt > KEY_PAUSE_MS) {
      held.changedAt = undefined;
      this.#send();
      return true;
    }
    if (held.sentAt === undefined || this.#listener.paused()) {
      if (held.sentAt !== undefined) held.sentAt = now;
      return false;
    }
    if (now - held.sentAt < PATIENCE_MS) return false;
    this.#listener.notice(`${this.#name(held)} did not come to stand there; what lies in its way may have pushed it.`);
    this.#held = undefined;
    return true;
  }

  /** The run refuses the request. */
  refused(): void {
    if (this.waiting) this.#held = undefined;
  }

  /** A new state: the outline goes where the run shows the body there, and follows a body that was not moved so far. */
  frame(frame: Frame): void {
    const held = this.#held;
    if (!held || held.grip !== "none" || held.changedAt !== undefined) return;
    const now = this.#poseOf(held.movable, held.body, frame);
    if (held.sentAt !== undefined && !this.#isThere(held, now)) return;
    held.sentAt = undefined;
    held.pose = now;
    held.from = { ...now };
  }

  /** Nearer to where it was sent than to where it was: it may have moved on since. */
  #isThere(held: Held, now: Pose): boolean {
    const turn = (a: number, b: number): number => Math.abs(Math.atan2(Math.sin(a - b), Math.cos(a - b)));
    const apart = (a: Pose, b: Pose): number => Math.hypot(a.x - b.x, a.y - b.y);
    const moved = apart(held.pose, held.from);
    if (moved > 2) return apart(now, held.pose) < moved / 2;
    return turn(now.heading, held.pose.heading) <= turn(held.from.heading, held.pose.heading) / 2;
  }

  #send(): void {
    const { movable, body, pose } = this.#held!;
    const round = (value: number): number => Number(value.toFixed(3));
    const place = { x: round(pose.x), y: round(pose.y), heading: round(Math.atan2(Math.sin(pose.heading), Math.cos(pose.heading))) };
    this.#held!.sentAt = performance.now();
    this.#listener.send({ do: "place", ...(movable ? { movable: body } : { robot: body }), ...place });
    if (this.#listener.paused()) this.#listener.notice(`${this.#name(this.#held!)} stands there after the next step of the run.`);
  }

  #name(held: Held): string {
    return `${held.movable ? "Object" : "Robot"} ${held.body}`;
  }

  #under(at: Point, frame: Frame, run: Run): [boolean, number] | undefined {
    let nearest: number | undefined;
    let least = Math.max(run.robotRadius, REACH_PX / this.#camera.pxPerMm);
    for (let robot = 0; robot < frame.robots; ++robot) {
      if (lifeOf(frame.state[robot]!) === LIFE_ABSENT) continue;
      const [x, y] = this.#listener.placeOf(robot);
      const distance = Math.hypot(x - at[0], y - at[1]);
      if (distance < least) [nearest, least] = [robot, distance];
    }
    if (nearest !== undefined) return [false, nearest];
    const object = run.movables.findIndex((_, i) => {
      const pose = this.#poseOf(true, i, frame);
      const shape = run.movables[i]!;
      if (shape.radius !== undefined) return Math.hypot(pose.x - at[0], pose.y - at[1]) <= shape.radius;
      const rim = outline(shape, pose.x, pose.y, pose.heading);
      return rim.every(([x, y], k) => {
        const [nextX, nextY] = rim[(k + 1) % rim.length]!;
        return (nextX - x) * (at[1] - y) - (nextY - y) * (at[0] - x) >= 0; // corners go anticlockwise
      });
    });
    return object >= 0 ? [true, object] : undefined;
  }

  #poseOf(movable: boolean, body: number, frame: Frame): Pose {
    const m = this.#run!.movables.length;
    if (movable) return { x: frame.movables[body]!, y: frame.movables[m + body]!, heading: frame.movables[2 * m + body]! };
    const [x, y] = this.#listener.placeOf(body);
    return { x, y, heading: headingOf(frame.headingLed[body]!) };
  }

  #radius(held: Held): number {
    const shape = held.movable ? this.#run!.movables[held.body]! : { radius: this.#run!.robotRadius };
    return shape.radius ?? Math.max(...shape.corners!.map(([x, y]) => Math.hypot(x, y)));
  }

  /** Where the handle lies, mm. */
  #handle(): Point | undefined {
    const held = this.#held;
    if (!held) return undefined;
    const { x, y, heading } = held.pose;
    const far = this.#radius(held) + HANDLE_PX / this.#camera.pxPerMm;
    return [x + far * Math.cos(heading), y + far * Math.sin(heading)];
  }

  /** What is drawn: the outline at the new place, a line to the handle, and the handle. */
  lines(): { rim: Point[]; arm: [Point, Point]; handle: Point[] } | undefined {
    const held = this.#held;
    const handle = this.#handle();
    if (!held || !handle) return undefined;
    const { x, y, heading } = held.pose;
    const shape = held.movable ? this.#run!.movables[held.body]! : { radius: Math.max(this.#run!.robotRadius, 3 / this.#camera.pxPerMm) };
    return { rim: outline(shape, x, y, heading), arm: [[x, y], handle], handle: circle(...handle, HANDLE_RADIUS_PX / this.#camera.pxPerMm, 20) };
  }
}
