// Curves of a live run without its recording: what the page has seen itself, from states and from the run's status.
import { LIFE_FAILED, LIFE_RUNNING, lifeOf, type Frame, type PlotInfo, type Run, type Status } from "./protocol.ts";

const FIRST_INTERVAL_MS = 250;
const MOST_POINTS = 2000;

interface Source extends PlotInfo {
  value(): number | null;
}

export class LiveCurves {
  readonly sources: Source[];
  readonly time: number[] = [];
  readonly values: (number | null)[][];
  #intervalMs = FIRST_INTERVAL_MS;
  #taken = -Infinity;
  #run: Run | undefined;
  #frame: Frame | undefined;
  #first: Frame | undefined;
  #status: Status | undefined;
  #before: Status | undefined;

  constructor() {
    const source = (name: string, title: string, unit: string, value: () => number | null): Source =>
      ({ name, title, unit, swarm: true, robot: false, variable: false, absent: "", value });
    this.sources = [
      source("msd", "mean square displacement since opening", "mm²", () => this.#displacement()),
      source("running", "robots whose program runs", "", () => this.#count((state) => lifeOf(state) === LIFE_RUNNING)),
      source("failed", "failed robots", "", () => this.#count((state) => lifeOf(state) === LIFE_FAILED)),
      source("sent", "messages sent per second", "1/s", () => this.#rate((status) => status.sent)),
      source("received", "messages received per second", "1/s", () => this.#rate((status) => status.received)),
      source("speed", "simulated over real time", "", () => this.#speed()),
    ];
    this.values = this.sources.map(() => []);
  }

  begin(run: Run): void {
    this.#run = run;
    this.#first = this.#frame = this.#status = this.#before = undefined;
    this.#intervalMs = FIRST_INTERVAL_MS;
    this.#taken = -Infinity;
    for (const column of [this.time, ...this.values]) column.length = 0;
  }

  status(status: Status): void {
    this.#before = this.#status;
    this.#status = status;
  }

  /** Takes a point where the last one lies long enough in the past, and time has passed. */
  frame(frame: Frame, now: number): void {
    const run = this.#run;
    if (!run || now - this.#taken < this.#intervalMs) return;
    const time = frame.tick * run.tickSeconds;
    if (this.time.length > 0 && time <= this.time.at(-1)!) return;
    this.#taken = now;
    this.#frame = frame;
    this.#first ??= frame;
    this.time.push(time);
    this.sources.forEach((source, i) => this.values[i]!.push(source.value()));
    if (this.time.length > MOST_POINTS) this.#halve();
  }

  #halve(): void {
    this.#intervalMs *= 2;
    for (const column of [this.time, ...this.values] as (number | null)[][]) {
      const kept = column.filter((_, i) => i % 2 === 0);
      column.splice(0, column.length, ...kept);
    }
  }

  #displacement(): number {
    const [from, to] = [this.#first!, this.#frame!];
    let sum = 0;
    for (let i = 0; i < to.robots; ++i) sum += (to.x[i]! - from.x[i]!) ** 2 + (to.y[i]! - from.y[i]!) ** 2;
    return (sum / to.robots) * this.#run!.gridStep ** 2;
  }

  #count(holds: (state: number) => boolean): number {
    let count = 0;
    for (const state of this.#frame!.state) if (holds(state)) ++count;
    return count;
  }

  #rate(of: (status: Status) => number): number | null {
    const [before, after] = [this.#before, this.#status];
    if (!before || !after || after.simulatedSeconds <= before.simulatedSeconds) return null;
    return (of(after) - of(before)) / (after.simulatedSeconds - before.simulatedSeconds);
  }

  #speed(): number | null {
    const [before, after] = [this.#before, this.#status];
    if (!before || !after || after.wallSeconds <= before.wallSeconds) return null;
    return (after.simulatedSeconds - before.simulatedSeconds) / (after.wallSeconds - before.wallSeconds);
  }
}
