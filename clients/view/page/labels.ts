// Numbers beside robots, on a canvas above the picture, where there is room for them.
import type { Camera } from "./camera.ts";
import { LIFE_ABSENT, lifeOf, type Frame, type Run } from "./protocol.ts";

const LEAST_RADIUS_PX = 9;
const MOST_LABELS = 600;
const HALF_LETTER_PX = 4;

export class Labels {
  readonly #canvas: HTMLCanvasElement;
  readonly #context: CanvasRenderingContext2D;
  #empty = true;

  constructor(canvas: HTMLCanvasElement) {
    this.#canvas = canvas;
    this.#context = canvas.getContext("2d")!;
  }

  /** `placeOf` gives a robot's place as it is drawn, mm. */
  draw(run: Run, frame: Frame, camera: Camera, selected: number | undefined, placeOf: (robot: number) => [number, number]): void {
    const radius = run.robotRadius * camera.pxPerMm;
    const all = radius >= LEAST_RADIUS_PX;
    const tracked = run.groups.some((group) => group.kind === "tracked");
    if (!all && selected === undefined && run.circles.length === 0 && !tracked) {
      if (!this.#empty) this.#clear();
      return;
    }
    this.#clear();
    this.#empty = false;
    const style = getComputedStyle(document.documentElement);
    const context = this.#context;
    context.font = "11px system-ui, 'DejaVu Sans', sans-serif";
    context.textAlign = "center";
    context.lineWidth = 3;
    context.lineJoin = "round";
    context.strokeStyle = style.getPropertyValue("--floor");
    context.fillStyle = style.getPropertyValue("--text");
    for (const circle of run.circles) this.#put(circle.name, ...camera.toScreen(circle.x, circle.y + circle.radius), 0);
    let drawn = 0;
    for (let robot = 0; (all || tracked) && robot < frame.robots && drawn < MOST_LABELS; ++robot) {
      const lost = lifeOf(frame.state[robot]!) === LIFE_ABSENT;
      if (!lost && (!all || robot === selected)) continue;
      const [x, y] = camera.toScreen(...placeOf(robot));
      if (x < 0 || y < 0 || x > camera.width || y > camera.height) continue;
      if (lost) this.#put("?", x, y + HALF_LETTER_PX, -4);
      if (all && robot !== selected) this.#put(String(robot), x, y, radius);
      ++drawn;
    }
    if (selected === undefined) return;
    context.font = "bold 12px system-ui, 'DejaVu Sans', sans-serif";
    context.fillStyle = style.getPropertyValue("--accent");
    this.#put(String(selected), ...camera.toScreen(...placeOf(selected)), Math.max(radius, 3) + 5);
  }

  #put(text: string, x: number, y: number, above: number): void {
    this.#context.strokeText(text, x, y - above - 4);
    this.#context.fillText(text, x, y - above - 4);
  }

  #clear(): void {
    const ratio = window.devicePixelRatio || 1;
    const { clientWidth, clientHeight } = this.#canvas;
    // Setting the size clears.
    this.#canvas.width = Math.round(clientWidth * ratio);
    this.#canvas.height = Math.round(clientHeight * ratio);
    this.#context.scale(ratio, ratio);
    this.#empty = true;
  }
}
