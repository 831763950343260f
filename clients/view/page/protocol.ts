// Messages of the gateway: JSON messages and binary frames. clients/view/frame_code.hpp and run_text.cpp write them.

export interface Group {
  first: number;
  count: number;
  kind: "native" | "firmware" | "tracked";
  immobile: boolean;
  program: string;
}

/** A convex shape about its centre, mm: a disc or a polygon. */
export interface Shape {
  radius?: number;
  corners?: [number, number][];
}

export interface Circle {
  x: number;
  y: number;
  radius: number;
  name: string;
}

/** What stays the same during a run. Lengths in mm. */
export interface Run {
  type: "run";
  source: "live" | "recorded";
  name: string;
  run: string;
  seed: string;
  tickSeconds: number;
  firstTick: number;
  lastTick: number;
  robots: number;
  states: number;
  gridLowest: number;
  gridStep: number;
  robotRadius: number;
  radioRange: number;
  arena: { halfWidth: number; halfHeight: number; radius?: number; corners?: [number, number][] };
  obstacles: (Shape & { pose: [number, number, number] })[];
  movables: Shape[];
  /** It has light, which is asked for by time. */
  light: boolean;
  circles: Circle[];
  /** Columns and rows of the partitions over the rectangle around the arena. */
  partitions: [number, number];
  /** Robots within this distance of a partition are known to it, mm. */
  ghostMargin: number;
  /** The events SENT and RECEIVED are recorded. */
  sentRecorded: boolean;
  receivedRecorded: boolean;
  groups: Group[];
}

export interface Status {
  type: "status";
  phase: "starting" | "running" | "paused" | "ended" | "broken";
  tick: number;
  lastTick: number;
  simulatedSeconds: number;
  wallSeconds: number;
  failed: number;
  sent: number;
  received: number;
  note: string;
}

/** `rgba` is base64: the raster row by row from the top, and the colour of each circle. */
export interface Floor {
  columns: number;
  rows: number;
  rgba: string;
  circles: (Circle & { rgba: string })[];
}

/** Circles that are drawn: those on floors, and those of the experiment that no floor draws around the same centre. */
export function spotsOf(run: Run, floors: Floor[]): Circle[] {
  const painted = floors.flatMap((floor) => floor.circles);
  return [...run.circles.filter((spot) => !painted.some(({ x, y }) => Math.hypot(x - spot.x, y - spot.y) < 1)), ...painted];
}

export interface RobotCounts {
  type: "robot";
  robot: number;
  tick: number;
  /** false: not all was read; more, if it is asked for again. */
  whole: boolean;
  /** Of recorded events up to the tick; absent: they are not recorded. Counted from the tick `since`, if it is there. */
  sent?: number;
  received?: number;
  heard?: { robot: number; count: number }[];
  since?: number;
  /** Robots that it has heard within the last seconds. */
  lately?: number[];
  /** Of the whole run. */
  run?: {
    sent?: number;
    received?: number;
    collided?: number;
    backedOff?: number;
    heard?: { robot: number; count: number }[];
    heardBy?: { robot: number; count: number }[];
  };
}

/** What can be plotted over time, of the swarm and of single robots. */
export interface PlotInfo {
  name: string;
  title: string;
  unit: string;
  swarm: boolean;
  robot: boolean;
  variable: boolean;
  /** Why it has no curve; empty: it has one. */
  absent: string;
}

/** One plot of the list: columns of `values` have an entry per entry of `time`, s. */
export interface PlotData {
  type: "plot";
  plot: number;
  robot: number | null;
  /** false: there is more, if it is asked for again. */
  whole: boolean;
  names: string[];
  time: number[];
  values: (number | null)[][];
}

/** What a robot's program knows and has printed up to a tick. */
export interface ProgramText {
  type: "program";
  robot: number;
  tick: number;
  /** false: the run's directory is not known. */
  known: boolean;
  variables: { name: string; value: number | null }[];
  log: string;
}

/** What trackers saw up to a tick, and the newest packets for the overhead controller, oldest first. */
export interface OutsideText {
  type: "outside";
  tick: number;
  robots: number[];
  /** Per robot x, y in mm and the covariance xx, xy, yy in mm². */
  places: number[];
  /** `message`: ten octets as hexadecimal digits, data and type. */
  packets: { time: number; command: number; message: string }[];
  /** Lines of the residual monitor, oldest first. */
  alarms: string[];
}

/** Messages that ended after tick `from`, up to tick `until`; a sender that is its own receiver has sent. */
export interface FlightsText {
  type: "flights";
  from: number;
  until: number;
  /** Messages are known up to this tick. */
  newest: number;
  /** false: there were more. */
  whole: boolean;
  sender: number[];
  receiver: number[];
  tick: number[];
}

/** Wall time by what a federate did, s. */
export interface FederateWork {
  name: string;
  step: number;
  exchange: number;
  wait: number;
}

export interface WorkText {
  type: "work";
  /** Of the last seconds; else of the whole run. */
  live: boolean;
  federates: FederateWork[];
  /** Of a run that has ended: CPU time by subject, ns per robot and tick. */
  cost: { name: string; ns: number }[];
  /** Of a run that has ended: messages of all robots, and simulated time over wall time. */
  sent?: number;
  received?: number;
  meanSpeed?: number;
}

export interface MarksText {
  type: "marks";
  /** false: there are more, if they are asked for again. */
  whole: boolean;
  marks: { tick: number; text: string }[];
}

/** Light on the floor at a tick, and the lamps: one that is off shines no light. */
export interface LightText {
  type: "light";
  tick: number;
  lamps: { x: number; y: number; on: boolean }[];
  floor: Floor;
}

/** Where a robot was, oldest first, x and y in turn, mm; null: it was placed elsewhere in between. */
export interface TrailText {
  type: "trail";
  robot: number;
  /** false: there is more, if it is asked for again. */
  whole: boolean;
  xy: (number | null)[];
}

export type Message =
  | FlightsText
  | WorkText
  | MarksText
  | OutsideText
  | PlotData
  | ProgramText
  | { type: "plots"; plots: PlotInfo[] }
  | Run
  | Status
  | RobotCounts
  | { type: "extent"; lastTick: number; states: number }
  | { type: "floors"; floors: Floor[] }
  | LightText
  | TrailText
  | { type: "grant"; steer: boolean }
  /** `refuses`: the request that the run refuses; empty: it refuses none. */
  | { type: "notice"; text: string; refuses: "place" | "" };

/** The state of all robots at one tick: views into the message's own memory. */
export interface Frame {
  request: number;
  tick: number;
  nextTick: number;
  robots: number;
  /** x, y and heading of movable bodies, column after column. */
  movables: Float32Array;
  x: Uint16Array;
  y: Uint16Array;
  headingLed: Uint16Array;
  state: Uint8Array;
  bytes: number;
}

const MAGIC = 0x3156544b;
const HEADER_BYTES = 32;
const MOVABLE_BYTES = 12;
const ROBOT_BYTES = 7;

/** Undefined where the message is no frame. */
export function decodeFrame(data: ArrayBuffer): Frame | undefined {
  if (data.byteLength < HEADER_BYTES) return undefined;
  const header = new DataView(data);
  const robots = header.getUint32(24, true);
  const movables = header.getUint32(28, true);
  if (header.getUint32(0, true) !== MAGIC) return undefined;
  if (data.byteLength !== HEADER_BYTES + movables * MOVABLE_BYTES + robots * ROBOT_BYTES) return undefined;
  const columns = HEADER_BYTES + movables * MOVABLE_BYTES;
  return {
    request: header.getUint32(4, true),
    tick: header.getFloat64(8, true),
    nextTick: header.getFloat64(16, true),
    robots,
    movables: new Float32Array(data, HEADER_BYTES, 3 * movables),
    x: new Uint16Array(data, columns, robots),
    y: new Uint16Array(data, columns + 2 * robots, robots),
    headingLed: new Uint16Array(data, columns + 4 * robots, robots),
    state: new Uint8Array(data, columns + 6 * robots, robots),
    bytes: data.byteLength,
  };
}

export const headingOf = (headingLed: number): number => ((headingLed >> 6) / 1024) * 2 * Math.PI;
/** Red, green and blue, 0 to 3 each. */
export const ledOf = (headingLed: number): [number, number, number] => [
  headingLed & 3,
  (headingLed >> 2) & 3,
  (headingLed >> 4) & 3,
];

export const LIFE_RUNNING = 4;
/** A tracked robot that is lost, has left, or has not come yet. Its place is the last known one. */
export const LIFE_ABSENT = 13;
export const LIFE_FLAT = 14;
export const LIFE_FAILED = 15;
export const lifeOf = (state: number): number => state & 15;
export const leftMotorOn = (state: number): boolean => (state & 16) !== 0;
export const rightMotorOn = (state: number): boolean => (state & 32) !== 0;

const LIFE_NAMES: Record<number, string> = {
  0: "sleeping",
  1: "idle",
  2: "shows its battery",
  3: "setup",
  4: "running",
  5: "charging",
  6: "moving",
  [LIFE_ABSENT]: "not there, last seen here",
  [LIFE_FLAT]: "battery flat",
  [LIFE_FAILED]: "failed",
};
export const lifeName = (life: number): string => LIFE_NAMES[life] ?? `life cycle ${life}`;

export const KINDS = { native: 0, firmware: 1, tracked: 2 } as const;

/** The kind of each robot, as a number of KINDS. */
export function kindsOf(run: Run): Uint8Array {
  const kinds = new Uint8Array(run.robots);
  for (const group of run.groups) kinds.fill(KINDS[group.kind], group.first, group.first + group.count);
  return kinds;
}

export function groupOf(run: Run, robot: number): Group | undefined {
  return run.groups.find((group) => robot >= group.first && robot < group.first + group.count);
}
