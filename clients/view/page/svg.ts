// The picture as SVG: what is seen, in the same section of the arena. Robots of one look share one path, so that a file of a
// thousand robots has some dozen elements.
import type { Camera } from "./camera.ts";
import { FLOATS } from "./flights.ts";
import { circle, outline, type Colour, type Point } from "./geometry.ts";
import { bordersOf, isGhost } from "./partitions.ts";
import {
  headingOf, KINDS, ledOf, LIFE_ABSENT, LIFE_FAILED, LIFE_FLAT, lifeOf, spotsOf, type Floor, type Frame, type LightText, type Run,
} from "./protocol.ts";
import type { Marks, Palette } from "./renderer.ts";

export interface Scene {
  run: Run;
  frame: Frame;
  kinds: Uint8Array;
  floors: Floor[];
  light: LightText | undefined;
  movables: Float32Array;
  marks: Marks;
  selected: number | undefined;
  placeOf: (robot: number) => Point;
}

const escaped = (text: string): string => text.replace(/[&<>"']/g, (c) => `&#${c.charCodeAt(0)};`);
const css = ([r, g, b]: Colour): string => `rgb(${r},${g},${b})`;
const n = (value: number): string => String(Math.round(10 * value) / 10);
const path = (points: Point[], closed: boolean): string =>
  points.map(([x, y], i) => `${i === 0 ? "M" : "L"}${n(x)} ${n(y)}`).join("") + (closed ? "Z" : "");
const disc = ([x, y]: Point, r: number): string => `M${n(x - r)} ${n(y)}a${n(r)} ${n(r)} 0 1 0 ${n(2 * r)} 0a${n(r)} ${n(r)} 0 1 0 ${n(-2 * r)} 0`;

/** The colour of a robot's disc, as the shader mixes it. */
function paint(headingLed: number, palette: Palette): string {
  const led = ledOf(headingLed);
  if (led.every((value) => value === 0)) return css(palette.body);
  return css([...led.map((value) => Math.round(255 * (0.25 + (0.75 * value) / 3))), 255] as Colour);
}

function raster(floor: Floor): string | undefined {
  if (floor.columns * floor.rows === 0) return undefined;
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [floor.columns, floor.rows];
  const octets = Uint8ClampedArray.from(atob(floor.rgba), (c) => c.charCodeAt(0));
  canvas.getContext("2d")!.putImageData(new ImageData(octets, floor.columns, floor.rows), 0, 0);
  return canvas.toDataURL();
}

/** Looks of robots, each a path that grows. */
class Paths {
  readonly #paths = new Map<string, string[]>();
  add(attributes: string, data: string): void {
    const known = this.#paths.get(attributes);
    if (known) known.push(data);
    else this.#paths.set(attributes, [data]);
  }
  toString(): string {
    return [...this.#paths].map(([attributes, data]) => `<path ${attributes} d="${data.join("")}"/>`).join("\n");
  }
}

export function svgOf(scene: Scene, camera: Camera, palette: Palette): string {
  const { run, frame } = scene;
  const at = ([x, y]: Point): Point => camera.toScreen(x, y);
  const scale = camera.pxPerMm;
  const { halfWidth: w, halfHeight: h, radius, corners } = run.arena;
  const edge = radius !== undefined ? circle(0, 0, radius, 128) : (corners ?? ([[-w, -h], [w, -h], [w, h], [-w, h]] as Point[]));
  const below = new Paths();
  const above = new Paths();
  const line = (colour: Colour, width: number, more = ""): string => `fill="none" stroke="${css(colour)}" stroke-width="${width}"${more}`;
  const fill = (colour: Colour): string => `fill="${css(colour)}"`;
  const [left, top] = at([-w, h]);
  const pictures = scene.light ? [scene.light.floor, ...scene.floors] : scene.floors;
  const images = pictures.flatMap((floor) => {
    const data = raster(floor);
    return data ? [`<image x="${n(left)}" y="${n(top)}" width="${n(2 * w * scale)}" height="${n(2 * h * scale)}" preserveAspectRatio="none" image-rendering="pixelated" href="${data}"/>`] : [];
  });
  below.add(line(palette.wall, 3), path(edge.map(at), true));
  for (const spot of spotsOf(run, scene.floors)) below.add(line(palette.accent, 2, ' stroke-dasharray="6 6"'), disc(at([spot.x, spot.y]), spot.radius * scale));
  for (const lamp of scene.light?.lamps ?? []) below.add(lamp.on ? fill(palette.lamp) : line(palette.lamp, 2), disc(at([lamp.x, lamp.y]), 9));
  for (const body of run.obstacles) below.add(fill(palette.obstacle), path(outline(body, ...body.pose).map(at), true));
  const [columns, rows] = bordersOf(run);
  const borders: [Point, Point][] = [...columns.map((x): [Point, Point] => [[x, -h], [x, h]]), ...rows.map((y): [Point, Point] => [[-w, y], [w, y]])];
  for (const [from, to] of borders) {
    if (run.ghostMargin > 0) below.add(`${line(palette.ghost, 2 * run.ghostMargin * scale)} stroke-opacity="0.12"`, path([at(from), at(to)], false));
    below.add(line(palette.obstacle, 1.5, ' stroke-dasharray="7 7"'), path([at(from), at(to)], false));
  }
  const m = run.movables.length;
  if (scene.movables.length === 3 * m) {
    run.movables.forEach((body, i) => {
      const rim = outline(body, scene.movables[i]!, scene.movables[m + i]!, scene.movables[2 * m + i]!).map(at);
      below.add(`${fill(palette.movable)} stroke="${css(palette.movableRim)}" stroke-width="2"`, path(rim, true));
    });
  }
  const words: string[] = [];
  const word = (text: string, [x, y]: Point, colour: Colour): void => {
    words.push(`<text x="${n(x)}" y="${n(y)}" ${fill(colour)}>${escaped(text)}</text>`);
  };
  const robots = new Paths();
  const r = Math.max(run.robotRadius * scale, 1.7);
  const rim = `stroke="${css(palette.ink)}" stroke-width="${n(Math.max(0.5, 0.14 * r))}"`;
  for (let robot = 0; robot < frame.robots; ++robot) {
    const life = lifeOf(frame.state[robot]!);
    const place = at(scene.placeOf(robot));
    const [x, y] = place;
    if (x < -r || y < -r || x > camera.width + r || y > camera.height + r) continue;
    if (life === LIFE_ABSENT) {
      above.add(line(palette.tracked, 0.26 * r, ` stroke-dasharray="${n(0.52 * r)} ${n(0.35 * r)}"`), disc(place, 1.1 * r));
      word("?", [x, y + 4], palette.ink);
      continue;
    }
    robots.add(`fill="${paint(frame.headingLed[robot]!, palette)}" ${rim}`, disc(place, 0.93 * r));
    const heading = headingOf(frame.headingLed[robot]!);
    above.add(line(palette.ink, 0.22 * r), path([place, [x + 0.9 * r * Math.cos(heading), y - 0.9 * r * Math.sin(heading)]], false));
    const square = (half: number): string => path([[x - half, y - half], [x + half, y - half], [x + half, y + half], [x - half, y + half]], true);
    if (scene.kinds[robot] === KINDS.firmware) above.add(line(palette.ink, 0.16 * r), square(0.42 * r));
    if (scene.kinds[robot] === KINDS.tracked) above.add(line(palette.tracked, 0.18 * r), square(1.28 * r));
    if (isGhost(run, ...scene.placeOf(robot))) above.add(line(palette.ghost, 0.2 * r, ` stroke-dasharray="${n(0.48 * r)}"`), disc(place, 1.22 * r));
    if (life === LIFE_FAILED) {
      above.add(line(palette.fault, 0.3 * r), path([[x - 0.9 * r, y - 0.9 * r], [x + 0.9 * r, y + 0.9 * r]], false) + path([[x - 0.9 * r, y + 0.9 * r], [x + 0.9 * r, y - 0.9 * r]], false));
    }
    if (life === LIFE_FLAT) above.add(line(palette.fault, 0.32 * r), path([[x - 1.2 * r, y], [x + 1.2 * r, y]], false));
  }
  const { marks } = scene;
  for (let i = 0; i < marks.flights.length; i += FLOATS) {
    const [fromX, fromY, toX, toY, age] = marks.flights.subarray(i, i + FLOATS) as unknown as [number, number, number, number, number];
    const [a, b] = [at([fromX, fromY]), at([toX, toY])];
    const colour = line(palette.message, 1.5, ` stroke-opacity="${(Math.ceil(4 * (1 - age)) / 4).toFixed(2)}"`);
    // The control point of the arc lies to the left of the way.
    const bend: Point = [(a[0] + b[0]) / 2 + 0.24 * (b[1] - a[1]), (a[1] + b[1]) / 2 - 0.24 * (b[0] - a[0])];
    if (fromX === toX && fromY === toY) above.add(colour, disc(a, r * (1.15 + 1.2 * age)));
    else above.add(colour, `M${n(a[0])} ${n(a[1])}Q${n(bend[0])} ${n(bend[1])} ${n(b[0])} ${n(b[1])}`);
  }
  if (marks.selected) for (const from of marks.heard) above.add(`${line(palette.message, 1.5)} stroke-opacity="0.4"`, path([at(from), at(marks.selected)], false));
  for (const rimOf of marks.ellipses) above.add(line(palette.tracked, 1.5), path(rimOf.map(at), true));
  for (const part of marks.trail.filter(({ length }) => length > 1)) above.add(line(palette.accent, 2), path(part.map(at), false));
  for (const spot of run.circles) word(spot.name, at([spot.x, spot.y + spot.radius]), palette.ink);
  if (marks.selected) {
    const place = at(marks.selected);
    above.add(line(palette.accent, 2.5), disc(place, r + 4));
    if (marks.range > 0) above.add(line(palette.accent, 1.2, ' stroke-dasharray="5 5"'), disc(place, marks.range * scale));
    word(String(scene.selected), [place[0], place[1] - r - 9], palette.accent);
  }
  return `<?xml version="1.0" encoding="UTF-8"?>
<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 ${n(camera.width)} ${n(camera.height)}" width="${n(camera.width)}" height="${n(camera.height)}">
<title>${escaped(run.name)}, ${(frame.tick * run.tickSeconds).toFixed(2)} s</title>
<rect width="100%" height="100%" ${fill(palette.background)}/>
<path ${fill(palette.floor)} d="${path(edge.map(at), true)}"/>
${images.join("\n")}
${below}
${robots}
${above}
<g font-family="system-ui, 'DejaVu Sans', sans-serif" font-size="12" font-weight="bold" text-anchor="middle">${words.join("")}</g>
</svg>
`;
}
