// Where a viewer is in time. A recording is played from states that the page asks for, one request at a time; a live run shows
// its newest state.
import type { Frame, Run } from "./protocol.ts";

/** States further apart than this are not interpolated: between them robots may have done anything. */
const LONGEST_BETWEEN_S = 2.5;

export type Ask = (request: { do: "at"; tick: number; request: number } | { do: "next" }) => void;

export class Playback {
  run: Run | undefined;
  /** The state that is shown; between it and `next` while playing. */
  current: Frame | undefined;
  next: Frame | undefined;
  playing = false;
  /** Simulated seconds per second. */
  speed = 1;
  /** In ticks, not whole while playing. */
  time = 0;
  #ask: Ask;
  #request = 0;
  #waiting: number | undefined;
  #wanted: number | undefined;

  constructor(ask: Ask) {
    this.#ask = ask;
  }

  get live(): boolean {
    return this.run?.source === "live";
  }

  begin(run: Run): void {
    const same = this.run?.run === run.run && this.run.source === run.source;
    this.run = run;
    this.current = this.next = undefined;
    this.#waiting = this.#wanted = undefined;
    if (this.live) {
      this.#ask({ do: "next" });
      return;
    }
    // After a lost connection, on from the same place.
    if (!same) {
      this.time = run.firstTick;
      this.playing = true;
    }
    this.#want(Math.floor(this.time));
  }

  /** The connection is gone: nothing that was asked for will come. */
  lost(): void {
    this.#waiting = undefined;
  }

  take(frame: Frame): void {
    if (this.live) {
      this.current = frame;
      this.time = frame.tick;
      this.#ask({ do: "next" });
      return;
    }
    if (frame.request !== this.#waiting) return;
    this.#waiting = undefined;
    const wanted = this.#wanted;
    this.#wanted = undefined;
    if (this.current && frame.tick === this.current.nextTick && this.playing) this.next = frame;
    else {
      this.current = frame;
      this.next = undefined;
      if (!this.playing) this.time = frame.tick;
    }
    if (wanted !== undefined) this.#want(wanted);
  }

  /** Time goes on by so many seconds of the viewer. Returns whether the picture changes. */
  advance(seconds: number): boolean {
    const run = this.run;
    if (!run || this.live || !this.playing || !this.current) return false;
    this.time = Math.min(run.lastTick, this.time + (seconds * this.speed) / run.tickSeconds);
    if (this.next && this.time >= this.next.tick) {
      this.current = this.next;
      this.next = undefined;
    }
    const { tick, nextTick } = this.current;
    if (this.time < tick || (this.time >= nextTick && nextTick > tick)) this.#want(Math.floor(this.time));
    else if (!this.next && nextTick > tick && this.#interpolates()) this.#want(nextTick);
    if (this.time >= run.lastTick) this.playing = false;
    return true;
  }

  /** How far between `current` and `next`, 0 to 1. */
  get part(): number {
    if (!this.playing || !this.current || !this.next || !this.#interpolates()) return 0;
    const part = (this.time - this.current.tick) / (this.next.tick - this.current.tick);
    return Math.min(1, Math.max(0, part));
  }

  seek(tick: number): void {
    const run = this.run;
    if (!run || this.live) return;
    this.time = Math.min(run.lastTick, Math.max(run.firstTick, Math.round(tick)));
    this.#want(this.time);
  }

  step(direction: 1 | -1): void {
    if (!this.current || this.live) return;
    this.playing = false;
    this.seek(direction > 0 ? this.current.nextTick : this.current.tick - 1);
  }

  toggle(): void {
    const run = this.run;
    if (!run || this.live) return;
    this.playing = !this.playing;
    if (this.playing && this.time >= run.lastTick) this.seek(run.firstTick);
    // A picture that stands still is a recorded state.
    if (!this.playing) this.seek(this.time);
  }

  #interpolates(): boolean {
    const run = this.run!;
    return (this.current!.nextTick - this.current!.tick) * run.tickSeconds <= LONGEST_BETWEEN_S;
  }

  #want(tick: number): void {
    if (this.#waiting !== undefined) {
      this.#wanted = tick;
      return;
    }
    this.#waiting = ++this.#request;
    this.#ask({ do: "at", tick, request: this.#waiting });
  }
}
