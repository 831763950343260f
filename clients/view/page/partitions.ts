// Partitions over the arena: who owns a robot, where robots are known to several partitions, and hand-overs from one to another.
import type { Point } from "./geometry.ts";
import type { Frame, Run } from "./protocol.ts";

/** Column and row of the partition that owns a place: as PartitionGrid divides the rectangle around the arena. */
export function cellOf(run: Run, x: number, y: number): [number, number] {
  const [columns, rows] = run.partitions;
  const { halfWidth, halfHeight } = run.arena;
  const cell = (value: number, half: number, count: number): number =>
    Math.min(count - 1, Math.max(0, Math.floor(((value + half) / (2 * half)) * count)));
  return [cell(x, halfWidth, columns), cell(y, halfHeight, rows)];
}

/** Places of the borders between columns, and between rows, mm. */
export function bordersOf(run: Run): [number[], number[]] {
  const between = (half: number, count: number): number[] =>
    Array.from({ length: count - 1 }, (_, i) => -half + (2 * half * (i + 1)) / count);
  return [between(run.arena.halfWidth, run.partitions[0]), between(run.arena.halfHeight, run.partitions[1])];
}

/** Whether robots at this place are known to more than one partition. */
export function isGhost(run: Run, x: number, y: number): boolean {
  const [columns, rows] = bordersOf(run);
  return columns.some((at) => Math.abs(x - at) <= run.ghostMargin) || rows.some((at) => Math.abs(y - at) <= run.ghostMargin);
}

const FLASH_MS = 900;
const MOST_FLASHES = 200;
/** Between states further apart, robots may have changed their partitions several times. */
const LONGEST_BETWEEN_S = 2.5;

/** Notices which robots have changed their partition from state to state. */
export class HandOvers {
  /** Since the run was opened. */
  count = 0;
  #run: Run | undefined;
  #owner = new Uint16Array();
  #tick: number | undefined;
  #flashes: { robot: number; began: number }[] = [];

  begin(run: Run): void {
    this.#run = run.partitions[0] * run.partitions[1] > 1 ? run : undefined;
    this.#owner = new Uint16Array(run.robots);
    this.#tick = undefined;
    this.#flashes = [];
    this.count = 0;
  }

  /** Takes a state; states come in the order of time, or after a jump. */
  take(frame: Frame, now: number): void {
    const run = this.#run;
    if (!run || frame.tick === this.#tick) return;
    const passed = this.#tick === undefined ? Infinity : (frame.tick - this.#tick) * run.tickSeconds;
    const follows = passed > 0 && passed <= LONGEST_BETWEEN_S;
    this.#tick = frame.tick;
    for (let robot = 0; robot < frame.robots; ++robot) {
      const [column, row] = cellOf(run, run.gridLowest + run.gridStep * frame.x[robot]!, run.gridLowest + run.gridStep * frame.y[robot]!);
      const owner = row * run.partitions[0] + column;
      if (follows && owner !== this.#owner[robot]) {
        ++this.count;
        if (this.#flashes.length < MOST_FLASHES) this.#flashes.push({ robot, began: now });
      }
      this.#owner[robot] = owner;
    }
  }

  /** Flashes at this time, each with how much of it has passed, 0 to 1. */
  flashes(now: number, placeOf: (robot: number) => Point): { at: Point; part: number }[] {
    this.#flashes = this.#flashes.filter((flash) => now - flash.began < FLASH_MS);
    return this.#flashes.map(({ robot, began }) => ({ at: placeOf(robot), part: (now - began) / FLASH_MS }));
  }

  get active(): boolean {
    return this.#flashes.length > 0;
  }
}
