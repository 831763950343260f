// Triangles of what is not a robot: floor, walls, grid lines, bodies, rings. Vertices are x, y in mm and a colour.
import type { Shape } from "./protocol.ts";

export type Colour = [number, number, number, number];
export type Point = [number, number];

const FLOATS_PER_VERTEX = 3;

/** A growing list of triangles. */
export class Triangles {
  #data = new ArrayBuffer(1 << 14);
  #floats = new Float32Array(this.#data);
  #colours = new Uint8Array(this.#data);
  count = 0;

  clear(): void {
    this.count = 0;
  }

  /** x, y as floats and the colour as four octets, per vertex. */
  get bytes(): Uint8Array<ArrayBuffer> {
    return new Uint8Array(this.#data, 0, this.count * FLOATS_PER_VERTEX * 4);
  }

  vertex(x: number, y: number, colour: Colour): void {
    const at = this.count * FLOATS_PER_VERTEX;
    if (at + FLOATS_PER_VERTEX > this.#floats.length) this.#grow();
    this.#floats[at] = x;
    this.#floats[at + 1] = y;
    this.#colours.set(colour, 4 * (at + 2));
    ++this.count;
  }

  convex(corners: Point[], colour: Colour): void {
    for (let i = 2; i < corners.length; ++i) {
      for (const corner of [corners[0]!, corners[i - 1]!, corners[i]!]) this.vertex(...corner, colour);
    }
  }

  line(a: Point, b: Point, width: number, colour: Colour): void {
    const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
    if (length === 0) return;
    const nx = (-(b[1] - a[1]) / length) * (width / 2);
    const ny = ((b[0] - a[0]) / length) * (width / 2);
    this.convex(
      [
        [a[0] + nx, a[1] + ny],
        [b[0] + nx, b[1] + ny],
        [b[0] - nx, b[1] - ny],
        [a[0] - nx, a[1] - ny],
      ],
      colour,
    );
  }

  path(points: Point[], width: number, colour: Colour, closed = false): void {
    for (let i = 1; i < points.length; ++i) this.line(points[i - 1]!, points[i]!, width, colour);
    if (closed && points.length > 2) this.line(points[points.length - 1]!, points[0]!, width, colour);
  }

  #grow(): void {
    const data = new ArrayBuffer(2 * this.#data.byteLength);
    new Uint8Array(data).set(this.#colours);
    this.#data = data;
    this.#floats = new Float32Array(data);
    this.#colours = new Uint8Array(data);
  }
}

/** Further than this a robot does not drive in so many seconds, mm: it was placed elsewhere. clients/view/recorded_curves.cpp. */
export const furthest = (seconds: number): number => 20 + 60 * seconds;

export function circle(x: number, y: number, radius: number, corners = 64): Point[] {
  return Array.from({ length: corners }, (_, i): Point => {
    const angle = (2 * Math.PI * i) / corners;
    return [x + radius * Math.cos(angle), y + radius * Math.sin(angle)];
  });
}

/** The outline of a body at a pose. */
export function outline(shape: Shape, x: number, y: number, heading: number): Point[] {
  if (shape.radius !== undefined) return circle(x, y, shape.radius);
  const cosine = Math.cos(heading);
  const sine = Math.sin(heading);
  return (shape.corners ?? []).map(([a, b]): Point => [x + cosine * a - sine * b, y + sine * a + cosine * b]);
}

/** Lines of the grid are at least so far apart on the screen. */
export const GRID_PX = 56;

/** A round distance of grid lines that lie at least `least` apart. */
export function roundStep(least: number): number {
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((factor) => factor * power).find((step) => step >= least)!;
}
