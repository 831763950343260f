// Messages as they fly: asks for those around the present time and keeps them for as long as they are drawn.
import type { Playback } from "./playback.ts";
import type { FlightsText, Frame, Run } from "./protocol.ts";

/** How long a message is drawn, s of simulated time at real time or slower. */
const LIFE_S = 0.35;
const ASK_EVERY_MS = 120;
/** An answer that has not come after so long is given up. */
const PATIENCE_MS = 2000;
/** The federates report messages every 32 ticks, so a live run shows them at least so many ticks later. */
const LEAST_DELAY_TICKS = 36;
const MOST_DELAY_TICKS = 400;
const MOST_KEPT = 12000;
/** Messages of one picture at most. */
export const MOST_DRAWN = 1500;
/** Floats per message: from x, y, to x, y in mm, age 0 to 1, emphasis. */
export const FLOATS = 6;

export class Flights {
  shown = false;
  /** Drawn in the last picture. */
  drawn = 0;
  readonly data = new Float32Array(FLOATS * MOST_DRAWN);
  readonly #send: (request: object) => void;
  #run: Run | undefined;
  #known: { tick: number; sender: number; receiver: number }[] = [];
  #from = 0; // what is known: after this tick
  #until = -1; // up to this one
  #askedAt: number | undefined;
  #waiting = false;
  #liveStep = 0; // ticks between two states
  #liveTick = 0;
  #delay = LEAST_DELAY_TICKS;

  constructor(send: (request: object) => void) {
    this.#send = send;
  }

  begin(run: Run): void {
    this.#run = run;
    this.#liveStep = this.#liveTick = 0;
    this.#delay = LEAST_DELAY_TICKS;
    this.forget();
  }

  get recorded(): boolean {
    return this.#run !== undefined && (this.#run.receivedRecorded || this.#run.sentRecorded);
  }

  forget(): void {
    this.#known = [];
    this.#from = 0;
    this.#until = -1;
    this.#waiting = false;
    this.#askedAt = undefined;
  }

  frame(frame: Frame): void {
    if (frame.tick > this.#liveTick) this.#liveStep = Math.min(256, frame.tick - this.#liveTick);
    this.#liveTick = frame.tick;
  }

  take(answer: FlightsText): void {
    const run = this.#run;
    if (!run) return;
    this.#waiting = false;
    // As late as reports have come lately; a shorter delay is tried again slowly.
    const late = this.#liveTick - answer.newest + 2;
    if (answer.newest > 0) this.#delay = Math.min(MOST_DELAY_TICKS, Math.max(LEAST_DELAY_TICKS, late, this.#delay - 0.5));
    const fresh = answer.tick.map((tick, i) => ({ tick, sender: answer.sender[i]!, receiver: answer.receiver[i]! }))
      .filter(({ sender, receiver }) => sender < run.robots && receiver < run.robots);
    if (run.source === "live" || answer.from !== this.#until) this.#known = fresh;
    else this.#known = [...this.#known, ...fresh].slice(-MOST_KEPT);
    if (run.source === "live" || answer.from !== this.#until) this.#from = answer.from;
    this.#until = answer.until;
  }

  /** The time whose messages are drawn, in ticks, and how long each is drawn. */
  #present(playback: Playback): { now: number; life: number } {
    const run = this.#run!;
    const life = LIFE_S / run.tickSeconds;
    if (playback.live) return { now: (playback.current?.tick ?? 0) - this.#delay, life: Math.max(life, 1.5 * this.#liveStep) };
    const now = playback.playing ? playback.time : (playback.current?.tick ?? 0);
    return { now, life: life * Math.max(1, playback.playing ? playback.speed : 1) };
  }

  /** Asks for what is missing. */
  update(playback: Playback, at: number): void {
    if (!this.shown || !this.recorded || !playback.current) return;
    if (this.#waiting && at - this.#askedAt! < PATIENCE_MS) return;
    if (this.#askedAt !== undefined && at - this.#askedAt < ASK_EVERY_MS) return;
    const { now, life } = this.#present(playback);
    const first = Math.max(-1, Math.floor(now - life));
    if (playback.live) return this.#ask(first, Math.max(0, Math.ceil(now) + 8), at);
    // Of a recording, what comes next is asked for ahead of time.
    const ahead = Math.ceil(now + (playback.playing ? life : 0));
    if (first < this.#from || first > this.#until) this.#ask(first, ahead, at);
    else if (ahead > this.#until) this.#ask(this.#until, ahead, at);
    else this.#known = this.#known.filter(({ tick }) => tick > first - 2);
  }

  #ask(from: number, tick: number, at: number): void {
    this.#askedAt = at;
    this.#waiting = true;
    this.#send({ do: "flights", from, tick });
  }

  /** Fills `data` for one picture. Those of the selected robot come last, so that they lie above the others. */
  fill(playback: Playback, placeOf: (robot: number) => [number, number], selected: number | undefined): number {
    this.drawn = 0;
    if (!this.shown || !this.#run || !playback.current) return 0;
    const { now, life } = this.#present(playback);
    const flying = this.#known.filter(({ tick }) => tick <= now && tick > now - life);
    const own = flying.filter(({ sender, receiver }) => sender === selected || receiver === selected);
    const others = flying.filter(({ sender, receiver }) => sender !== selected && receiver !== selected);
    const chosen = [...others.slice(0, MOST_DRAWN - Math.min(own.length, MOST_DRAWN)), ...own.slice(0, MOST_DRAWN)];
    for (const { tick, sender, receiver } of chosen) {
      const emphasis = selected === undefined ? 0.5 : sender === selected || receiver === selected ? 1 : 0.15;
      this.data.set([...placeOf(sender), ...placeOf(receiver), (now - tick) / life, emphasis], FLOATS * this.drawn++);
    }
    return this.drawn;
  }
}
