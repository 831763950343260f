// Curves over time below the picture: of the swarm and of the selected robot. Recorded ones come from the gateway; of a live run
// without its recording they are what the page has seen.
import uPlot from "uplot";
import "uplot/dist/uPlot.min.css";
import { LiveCurves } from "./live_curves.ts";
import { element } from "./panels.ts";
import type { Frame, PlotData, PlotInfo, Run, Status } from "./protocol.ts";

const SLOTS = 3;
/** How often a curve is asked for again while its run goes on, and while not all of it has been read. */
const AGAIN_MS = 2000;
const MORE_MS = 50;
const LEGEND_PX = 22;
const KEY = "kilotwin-plots";
/** What the slots show at first, where it is there: V is the first recorded variable. */
const FIRST_CHOICE = ["msd", "V", "nearest", "sent", "received", "running", "failed"];

export interface PlotsListener {
  send(request: object): void;
  /** A viewer clicked at this time, s. */
  seek(time: number): void;
}

interface Slot {
  box: HTMLElement;
  choice: HTMLSelectElement;
  chart: HTMLElement;
  words: HTMLElement;
  /** "s3": plot 3 of the swarm; "r3": of the selected robot; "l3": seen by the page itself. */
  key: string;
  /** The viewer has chosen it. */
  chosen: boolean;
  plot: uPlot | undefined;
  shape: string;
  asked: number;
  waiting: boolean;
  growing: boolean;
}

type Lines = { names: string[]; time: number[]; values: (number | null)[][] };

export class Plots {
  readonly #listener: PlotsListener;
  readonly #section = element("plots");
  readonly #slots: Slot[] = [];
  readonly #live = new LiveCurves();
  #run: Run | undefined;
  #recorded: PlotInfo[] = [];
  #robot: number | undefined;
  #now = 0;
  #listAsked = 0;
  #grownAt = -Infinity;

  constructor(listener: PlotsListener) {
    this.#listener = listener;
    for (let i = 0; i < SLOTS; ++i) this.#slots.push(this.#makeSlot(i));
    if (localStorage.getItem(KEY) === "open") this.toggle(true);
    new ResizeObserver(() => this.#resize()).observe(this.#section);
  }

  get shown(): boolean {
    return !this.#section.hidden;
  }

  toggle(show = !this.shown): void {
    this.#section.hidden = !show;
    element("plots-button").setAttribute("aria-pressed", String(show));
    localStorage.setItem(KEY, show ? "open" : "closed");
    if (show) for (const slot of this.#slots) slot.asked = -Infinity;
  }

  begin(run: Run): void {
    const another = this.#run?.run !== run.run || this.#run?.source !== run.source;
    this.#run = run;
    if (another) {
      this.#recorded = [];
      this.#live.begin(run);
      for (const slot of this.#slots) this.#choose(slot, "");
    }
    this.#listAsked = -Infinity;
    for (const slot of this.#slots) [slot.asked, slot.waiting] = [-Infinity, false];
    this.#offer();
  }

  /** The connection is gone: nothing that was asked for will come. */
  lost(): void {
    for (const slot of this.#slots) slot.waiting = false;
  }

  /** What the gateway can give. */
  list(plots: PlotInfo[]): void {
    if (JSON.stringify(plots) === JSON.stringify(this.#recorded)) return;
    this.#recorded = plots;
    this.#offer();
  }

  /** The recording has more states than before. */
  grown(): void {
    this.#grownAt = performance.now();
  }

  select(robot: number | undefined): void {
    if (robot === this.#robot) return;
    this.#robot = robot;
    this.#offer();
    for (const slot of this.#slots) if (slot.key.startsWith("r")) [slot.asked, slot.waiting] = [-Infinity, false];
  }

  status(status: Status): void {
    this.#live.status(status);
  }

  frame(frame: Frame, now: number): void {
    if (this.#run?.source === "live") this.#live.frame(frame, now);
  }

  take(data: PlotData): void {
    for (const slot of this.#slots) {
      const robot = slot.key.startsWith("r") ? this.#robot : null;
      if (Number(slot.key.slice(1)) !== data.plot || slot.key.startsWith("l") || data.robot !== robot) continue;
      slot.waiting = false;
      slot.growing = !data.whole;
      this.#show(slot, data);
    }
  }

  /** Asks for what is missing and moves the mark of the present time, s. */
  update(now: number, time: number): void {
    const run = this.#run;
    if (!run || !this.shown) return;
    const goesOn = run.source === "live" || now - this.#grownAt < 2 * AGAIN_MS;
    if (this.#recorded.length === 0 && now - this.#listAsked > AGAIN_MS) {
      this.#listAsked = now;
      this.#listener.send({ do: "plots" });
    }
    for (const slot of this.#slots) {
      if (slot.key.startsWith("l")) this.#showLive(slot);
      else if (slot.key !== "" && this.#absent(slot) === "" && this.#isDue(slot, now, goesOn)) this.#ask(slot, now);
    }
    const moved = time !== this.#now;
    this.#now = time;
    for (const slot of this.#slots) {
      if (moved) slot.plot?.redraw(false, false);
      this.#tellNow(slot);
    }
  }

  /** While no pointer is above the plot, its legend tells the values at the present time. */
  #tellNow(slot: Slot): void {
    const plot = slot.plot;
    if (!plot || plot.cursor.idx != null) return;
    const times = plot.data[0];
    let [low, high] = [0, times.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle]! <= this.#now + 1e-6) low = middle;
      else high = middle - 1;
    }
    plot.setLegend({ idx: low });
  }

  /** Colours have changed. */
  recolour(): void {
    for (const slot of this.#slots) {
      const data = slot.plot?.data;
      slot.shape = "";
      if (!data || !slot.plot) continue;
      const names = slot.plot.series.slice(1).map((series) => String(series.label));
      this.#show(slot, { names, time: [...data[0]], values: data.slice(1).map((column) => [...(column as (number | null)[])]) });
    }
  }

  #makeSlot(i: number): Slot {
    const box = document.createElement("div");
    const choice = document.createElement("select");
    const chart = document.createElement("div");
    const words = document.createElement("p");
    box.className = "plot";
    chart.className = "chart";
    choice.setAttribute("aria-label", `Plot ${i + 1}`);
    box.append(choice, chart, words);
    this.#section.append(box);
    const slot: Slot = { box, choice, chart, words, key: "", chosen: false, plot: undefined, shape: "", asked: -Infinity, waiting: false, growing: false };
    choice.addEventListener("change", () => {
      slot.chosen = true;
      this.#choose(slot, choice.value);
    });
    return slot;
  }

  #choose(slot: Slot, key: string): void {
    slot.key = key;
    [slot.asked, slot.waiting, slot.growing, slot.shape] = [-Infinity, false, false, ""];
    slot.plot?.destroy();
    slot.plot = undefined;
    this.#explain(slot, key === "" ? "nothing to plot yet" : this.#absent(slot));
  }

  /** Why what is chosen has no curve; empty: it has one. */
  #absent(slot: Slot): string {
    return slot.key.startsWith("l") ? "" : (this.#recorded[Number(slot.key.slice(1))]?.absent ?? "");
  }

  #explain(slot: Slot, words: string): void {
    slot.words.textContent = words;
    slot.words.hidden = words === "";
  }

  /** Fills the choices of all slots, and keeps what is chosen where it is still there. */
  #offer(): void {
    const seen = this.#run?.source === "live" ? this.#live.sources : [];
    const option = (key: string, plot: PlotInfo, whose = ""): HTMLOptionElement =>
      new Option(`${plot.variable ? plot.name : plot.title}${plot.unit ? `, ${plot.unit}` : ""}${whose}`, key);
    const group = (label: string, options: HTMLOptionElement[]): HTMLOptGroupElement[] => {
      if (options.length === 0) return [];
      const at = document.createElement("optgroup");
      at.label = label;
      at.append(...options);
      return [at];
    };
    this.#slots.forEach((slot, i) => {
      const of = (letter: string, wanted: (plot: PlotInfo) => boolean, whose = ""): HTMLOptionElement[] =>
        this.#recorded.flatMap((plot, number) => (wanted(plot) ? [option(`${letter}${number}`, plot, whose)] : []));
      slot.choice.replaceChildren(
        ...group("Swarm", of("s", (plot) => plot.swarm)),
        ...(this.#robot === undefined ? [] : group(`Robot ${this.#robot}`, of("r", (plot) => plot.robot, ` of robot ${this.#robot}`))),
        ...group(this.#recorded.length > 0 ? "As it happens" : "Swarm", seen.map((source, number) => option(`l${number}`, source))),
      );
      const keys = [...slot.choice.options].map((at) => at.value);
      slot.choice.disabled = keys.length === 0;
      slot.chosen &&= keys.includes(slot.key);
      const key = slot.chosen ? slot.key : this.#firstChoice(i, keys);
      if (key !== "") slot.choice.value = key;
      if (key !== slot.key) this.#choose(slot, key);
    });
  }

  #firstChoice(slot: number, keys: string[]): string {
    // Without its recording, a live run has the experiment's observables alone from the gateway.
    const isRecorded = this.#recorded.some((plot) => plot.name === "msd");
    const plots = isRecorded ? this.#recorded : this.#live.sources;
    const letter = isRecorded ? "s" : "l";
    const found = FIRST_CHOICE.flatMap((name) => {
      const number = plots.findIndex((plot) => (name === "V" ? plot.variable : plot.name === name && !plot.variable));
      return number >= 0 && keys.includes(`${letter}${number}`) ? [`${letter}${number}`] : [];
    });
    return found[slot] ?? keys[0] ?? "";
  }

  #isDue(slot: Slot, now: number, goesOn: boolean): boolean {
    if (slot.asked === -Infinity) return true;
    if (slot.waiting) return now - slot.asked > 5 * AGAIN_MS;
    return slot.growing ? now - slot.asked > MORE_MS : goesOn && now - slot.asked > AGAIN_MS;
  }

  #ask(slot: Slot, now: number): void {
    const plot = Number(slot.key.slice(1));
    slot.asked = now;
    slot.waiting = true;
    this.#listener.send(slot.key.startsWith("r") ? { do: "plot", plot, robot: this.#robot } : { do: "plot", plot });
  }

  #showLive(slot: Slot): void {
    const number = Number(slot.key.slice(1));
    const length = this.#live.time.length;
    if (length < 2 || slot.plot?.data[0].at(-1) === this.#live.time.at(-1)) return;
    this.#show(slot, { names: ["value"], time: [...this.#live.time], values: [[...this.#live.values[number]!]] });
  }

  #show(slot: Slot, lines: Lines): void {
    const data = [lines.time, ...lines.values] as uPlot.AlignedData;
    const known = lines.values[0]?.some((value) => value !== null) ?? false;
    this.#explain(slot, known ? "" : "no value yet");
    slot.chart.hidden = !known;
    if (!known) return;
    const shape = lines.names.join("\n");
    if (slot.plot && slot.shape === shape) slot.plot.setData(data);
    else {
      slot.plot?.destroy();
      slot.shape = shape;
      slot.plot = new uPlot(this.#options(slot, lines.names), data, slot.chart);
    }
  }

  #size(slot: Slot): { width: number; height: number } {
    const head = slot.choice.offsetHeight;
    return { width: Math.max(100, slot.box.clientWidth), height: Math.max(60, slot.box.clientHeight - head - LEGEND_PX - 6) };
  }

  #resize(): void {
    for (const slot of this.#slots) slot.plot?.setSize(this.#size(slot));
  }

  #options(slot: Slot, names: string[]): uPlot.Options {
    const style = getComputedStyle(document.documentElement);
    const colour = (name: string): string => style.getPropertyValue(`--${name}`).trim();
    const font = "11px system-ui, 'DejaVu Sans', sans-serif";
    const axis = { stroke: colour("faint"), grid: { stroke: colour("grid"), width: 1 }, ticks: { show: false }, font };
    const series = names.map((label, i): uPlot.Series => ({
      label,
      stroke: colour(i === 0 ? "accent" : "faint"),
      width: i === 0 ? 1.8 : 1,
      ...(i === 0 ? {} : { dash: [4, 3] }),
      points: { show: false },
      spanGaps: true,
      value: (_: uPlot, value: number | null) => (value === null || value === undefined ? "–" : String(Number(value.toPrecision(5)))),
    }));
    return {
      ...this.#size(slot),
      padding: [8, 12, 0, 0],
      scales: { x: { time: false }, y: { range: (_, least, largest) => rangeOf(least, largest) } },
      series: [{ label: "time", value: (_, value) => (value === null ? "–" : `${value.toFixed(2)} s`) }, ...series],
      axes: [{ ...axis, size: 22, gap: 2, space: 60, values: (_, ticks) => ticks.map((tick) => `${tick} s`) }, { ...axis, size: 52, gap: 4, space: 30 }],
      cursor: { sync: { key: "time" }, points: { size: 6 }, drag: { x: true, y: false } },
      legend: { show: true },
      hooks: {
        ready: [(plot) => this.#listen(plot)],
        draw: [(plot) => this.#mark(plot, colour("text"))],
      },
    };
  }

  /** A click moves to that time; a drag shows a part, a double click all. */
  #listen(plot: uPlot): void {
    let from = 0;
    plot.over.addEventListener("mousedown", (event) => (from = event.clientX));
    plot.over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - from) < 3) this.#listener.seek(plot.posToVal(event.clientX - plot.over.getBoundingClientRect().left, "x"));
    });
  }

  #mark(plot: uPlot, colour: string): void {
    const { left, top, width, height } = plot.bbox;
    const x = plot.valToPos(this.#now, "x", true);
    if (!(x >= left && x <= left + width)) return;
    plot.ctx.save();
    plot.ctx.strokeStyle = colour;
    plot.ctx.lineWidth = window.devicePixelRatio || 1;
    plot.ctx.setLineDash([]);
    plot.ctx.beginPath();
    plot.ctx.moveTo(x, top);
    plot.ctx.lineTo(x, top + height);
    plot.ctx.stroke();
    plot.ctx.restore();
  }
}

/** A range with room above and below; 0 at its edge where no value is negative and it lies near. */
function rangeOf(least: number | null, largest: number | null): [number, number] {
  if (least === null || largest === null) return [0, 1];
  const room = 0.06 * (largest - least) || Math.max(1, Math.abs(largest)) * 0.1;
  const low = least >= 0 && least - room < 0.35 * largest ? 0 : least - room;
  return [low, largest + room];
}
