// Draws one picture of the run with WebGL 2. It keeps one buffer for all robots and never an object per robot.
import type { Camera } from "./camera.ts";
import { GRID_PX, Triangles, circle, outline, roundStep, type Colour, type Point } from "./geometry.ts";
import { FLOATS } from "./flights.ts";
import { bordersOf } from "./partitions.ts";
import { spotsOf, type Floor, type Frame, type LightText, type Run } from "./protocol.ts";
import * as shaders from "./shaders.ts";

const BYTES_PER_VERTEX = 8;
const LEAST_RADIUS_PX = 1.7;
/** Vertices of a message: the strip along its arc. */
const FLIGHT_VERTICES = 34;
const GHOST_ALPHA = 30;
const HEARD_ALPHA = 110;

/** Colours of a theme, 0 to 255. */
export interface Palette {
  background: Colour;
  floor: Colour;
  grid: Colour;
  wall: Colour;
  obstacle: Colour;
  movable: Colour;
  movableRim: Colour;
  lamp: Colour;
  ink: Colour;
  body: Colour;
  fault: Colour;
  tracked: Colour;
  accent: Colour;
  message: Colour;
  ghost: Colour;
}

/** What lies above the arena besides robots. */
export interface Marks {
  selected: Point | undefined;
  /** Where the selected robot was; parts, because it may have been placed elsewhere in between. */
  trail: Point[][];
  range: number;
  /** Robots that the selected one has heard lately. */
  heard: Point[];
  /** Where tracked robots are with a probability of 95 %: rims. */
  ellipses: Point[][];
  /** Messages: FLOATS of flights.ts each. */
  flights: Float32Array;
  /** Robots that have changed their partition, each with how much of its flash has passed, 0 to 1. */
  flashes: { at: Point; part: number }[];
  /** A body that is being placed elsewhere. */
  held: { rim: Point[]; arm: [Point, Point]; handle: Point[] } | undefined;
}

class Program {
  readonly gl: WebGL2RenderingContext;
  readonly program: WebGLProgram;
  readonly #uniforms = new Map<string, WebGLUniformLocation | null>();

  constructor(gl: WebGL2RenderingContext, vertex: string, fragment: string, attributes: string[]) {
    this.gl = gl;
    this.program = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]] as const) {
      const shader = gl.createShader(kind)!;
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(this.program, shader);
    }
    attributes.forEach((name, i) => gl.bindAttribLocation(this.program, i, name));
    gl.linkProgram(this.program);
    if (!gl.getProgramParameter(this.program, gl.LINK_STATUS) && !gl.isContextLost())
      throw new Error(`shader: ${gl.getProgramInfoLog(this.program)}`);
  }

  at(name: string): WebGLUniformLocation | null {
    if (!this.#uniforms.has(name)) this.#uniforms.set(name, this.gl.getUniformLocation(this.program, name));
    return this.#uniforms.get(name)!;
  }
}

const unit = (colour: Colour): [number, number, number] => [colour[0] / 255, colour[1] / 255, colour[2] / 255];

function bytesOf(base64: string): Uint8Array<ArrayBuffer> {
  const text = atob(base64);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  return bytes;
}

export class Renderer {
  readonly #gl: WebGL2RenderingContext;
  readonly #flat: Program;
  readonly #robots: Program;
  readonly #trails: Program;
  readonly #floor: Program;
  readonly #flights: Program;
  readonly #flightBuffer: WebGLBuffer;
  readonly #flatBuffer: WebGLBuffer;
  readonly #robotBuffer: WebGLBuffer;
  readonly #indexBuffer: WebGLBuffer;
  readonly #squareBuffer: WebGLBuffer;
  readonly #below = new Triangles();
  readonly #above = new Triangles();
  #run: Run | undefined;
  #kinds: Uint8Array = new Uint8Array();
  #vertices = new Uint32Array();
  #robotCount = 0;
  #indexed = 0;
  #textures: WebGLTexture[] = [];
  #floors: Floor[] = [];
  #light: LightText | undefined;
  /** Segments of the trails of all robots, oldest first: a buffer of two ends per robot each. */
  #segments: { buffer: WebGLBuffer; vertices: number }[] = [];

  constructor(canvas: HTMLCanvasElement) {
    const gl = canvas.getContext("webgl2", { antialias: false, alpha: false, preserveDrawingBuffer: false });
    if (!gl) throw new Error("this browser has no WebGL 2");
    this.#gl = gl;
    this.#flat = new Program(gl, shaders.FLAT_VERTEX, shaders.FLAT_FRAGMENT, ["a_position", "a_colour"]);
    this.#robots = new Program(gl, shaders.ROBOT_VERTEX, shaders.ROBOT_FRAGMENT, ["a_place", "a_headingLed", "a_stateKind"]);
    this.#trails = new Program(gl, shaders.TRAIL_VERTEX, shaders.TRAIL_FRAGMENT, ["a_place"]);
    this.#floor = new Program(gl, shaders.FLOOR_VERTEX, shaders.FLOOR_FRAGMENT, ["a_position"]);
    this.#flights = new Program(gl, shaders.FLIGHT_VERTEX, shaders.FLIGHT_FRAGMENT, ["a_ends", "a_age"]);
    this.#flightBuffer = gl.createBuffer();
    this.#flatBuffer = gl.createBuffer();
    this.#robotBuffer = gl.createBuffer();
    this.#indexBuffer = gl.createBuffer();
    this.#squareBuffer = gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#squareBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), gl.STATIC_DRAW);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
  }

  begin(run: Run, kinds: Uint8Array): void {
    this.#run = run;
    this.#kinds = kinds;
    this.#robotCount = 0;
    this.forgetTrails();
    this.#light = undefined;
    this.setFloors([]);
  }

  setFloors(floors: Floor[]): void {
    this.#floors = floors;
    this.#paintFloors();
  }

  setLight(light: LightText | undefined): void {
    this.#light = light;
    this.#paintFloors();
  }

  get light(): LightText | undefined {
    return this.#light;
  }

  /** Light lies below what is painted. */
  #paintFloors(): void {
    const gl = this.#gl;
    for (const texture of this.#textures) gl.deleteTexture(texture);
    const pictures = this.#light ? [this.#light.floor, ...this.#floors] : this.#floors;
    this.#textures = pictures.map((floor) => {
      const texture = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, Math.max(1, floor.columns), Math.max(1, floor.rows), 0, gl.RGBA, gl.UNSIGNED_BYTE,
                    floor.columns * floor.rows > 0 ? bytesOf(floor.rgba) : new Uint8Array(4));
      const smooth = floor === this.#light?.floor ? gl.LINEAR : gl.NEAREST;
      for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, smooth);
      for (const wrap of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, wrap, gl.CLAMP_TO_EDGE);
      return texture;
    });
  }

  get floors(): Floor[] {
    return this.#floors;
  }

  /** Takes a state. Between two states, `part` of the way from `frame` to `next`. */
  setFrame(frame: Frame, next: Frame | undefined, part: number): void {
    const n = frame.robots;
    if (this.#vertices.length < 8 * n) this.#vertices = new Uint32Array(8 * n);
    const vertices = this.#vertices;
    const kinds = this.#kinds;
    const between = next !== undefined && next.robots === n && part > 0;
    for (let i = 0; i < n; ++i) {
      let x = frame.x[i]!;
      let y = frame.y[i]!;
      let turn = frame.headingLed[i]! >> 6;
      if (between) {
        x += (next.x[i]! - x) * part;
        y += (next.y[i]! - y) * part;
        // The shorter way round.
        turn = (turn + ((((next.headingLed[i]! >> 6) - turn + 1536) & 1023) - 512) * part) & 1023;
      }
      const place = Math.round(x) | (Math.round(y) << 16);
      const rest = (turn << 6) | (frame.headingLed[i]! & 63) | (frame.state[i]! << 16) | (kinds[i]! << 24);
      for (let at = 8 * i; at < 8 * i + 8; at += 2) {
        vertices[at] = place;
        vertices[at + 1] = rest;
      }
    }
    const gl = this.#gl;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#robotBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, vertices.subarray(0, 8 * n), gl.STREAM_DRAW);
    this.#robotCount = n;
    if (this.#indexed < n) this.#index(n);
  }

  #index(robots: number): void {
    const indices = new Uint32Array(6 * robots);
    for (let i = 0; i < robots; ++i) indices.set([4 * i, 4 * i + 1, 4 * i + 2, 4 * i + 2, 4 * i + 1, 4 * i + 3], 6 * i);
    this.#gl.bindBuffer(this.#gl.ELEMENT_ARRAY_BUFFER, this.#indexBuffer);
    this.#gl.bufferData(this.#gl.ELEMENT_ARRAY_BUFFER, indices, this.#gl.STATIC_DRAW);
    this.#indexed = robots;
  }

  /** Adds a segment to every robot's trail, and keeps the newest `keep`. Robots that moved further than `most`, mm, get none. */
  addTrailSegment(from: Frame, to: Frame, keep: number, most: number): void {
    const n = Math.min(from.robots, to.robots);
    const ends = new Uint16Array(4 * n);
    const longest = most / (this.#run?.gridStep ?? 1);
    for (let i = 0; i < n; ++i) {
      const near = Math.hypot(to.x[i]! - from.x[i]!, to.y[i]! - from.y[i]!) <= longest;
      ends[4 * i] = near ? from.x[i]! : to.x[i]!;
      ends[4 * i + 1] = near ? from.y[i]! : to.y[i]!;
      ends[4 * i + 2] = to.x[i]!;
      ends[4 * i + 3] = to.y[i]!;
    }
    const gl = this.#gl;
    // The oldest buffer is used again.
    const oldest = this.#segments.length >= keep ? this.#segments.shift() : undefined;
    const buffer = oldest?.buffer ?? gl.createBuffer();
    gl.bindBuffer(gl.ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ARRAY_BUFFER, ends, gl.STATIC_DRAW);
    this.#segments.push({ buffer, vertices: 2 * n });
  }

  forgetTrails(): void {
    for (const segment of this.#segments) this.#gl.deleteBuffer(segment.buffer);
    this.#segments = [];
  }

  draw(camera: Camera, palette: Palette, frame: Frame | undefined, movables: Float32Array, marks: Marks): void {
    const gl = this.#gl;
    const ratio = window.devicePixelRatio || 1;
    const canvas = gl.canvas as HTMLCanvasElement;
    const width = Math.round(camera.width * ratio);
    const height = Math.round(camera.height * ratio);
    if (canvas.width !== width || canvas.height !== height) {
      canvas.width = width;
      canvas.height = height;
    }
    gl.viewport(0, 0, width, height);
    gl.clearColor(...unit(palette.background), 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    const run = this.#run;
    if (!run) return;
    const view: [number, number, number, number] = [
      (2 * camera.pxPerMm) / camera.width,
      (2 * camera.pxPerMm) / camera.height,
      (-2 * camera.x * camera.pxPerMm) / camera.width,
      (-2 * camera.y * camera.pxPerMm) / camera.height,
    ];
    const radius = Math.max(run.robotRadius, LEAST_RADIUS_PX / camera.pxPerMm);
    this.#below.clear();
    this.#below.convex(this.#edge(run), palette.floor);
    this.#drawTriangles(this.#below, view);
    this.#drawFloors(run, view);
    this.#below.clear();
    this.#gridAndWalls(run, camera, palette);
    this.#bodies(run, camera, palette, movables);
    this.#drawTriangles(this.#below, view);
    this.#drawTrails(run, palette, view);
    if (frame) this.#drawRobots(run, camera, palette, view, radius);
    this.#drawFlights(marks.flights, camera, palette, view, radius);
    this.#above.clear();
    this.#marks(camera, palette, marks, radius);
    this.#drawTriangles(this.#above, view);
  }

  #gridAndWalls(run: Run, camera: Camera, palette: Palette): void {
    const { halfWidth, halfHeight } = run.arena;
    const px = 1 / camera.pxPerMm;
    const step = roundStep(GRID_PX * px);
    const [left, top] = camera.toArena(0, 0);
    const [right, bottom] = camera.toArena(camera.width, camera.height);
    if (run.arena.radius === undefined && run.arena.corners === undefined) {
      const [low, high] = [Math.max(-halfWidth, left), Math.min(halfWidth, right)];
      const [under, over] = [Math.max(-halfHeight, bottom), Math.min(halfHeight, top)];
      for (let x = Math.ceil(low / step) * step; x <= high; x += step) this.#below.line([x, under], [x, over], px, palette.grid);
      for (let y = Math.ceil(under / step) * step; y <= over; y += step) this.#below.line([low, y], [high, y], px, palette.grid);
    }
    this.#partitions(run, px, palette);
    this.#below.path(this.#edge(run), 3 * px, palette.wall, true);
  }

  /** Borders of partitions, dashed, and the margin of ghosts on both sides. */
  #partitions(run: Run, px: number, palette: Palette): void {
    const { halfWidth: w, halfHeight: h } = run.arena;
    const dash = 7 * px;
    const dashed = (from: Point, to: Point): void => {
      const length = Math.hypot(to[0] - from[0], to[1] - from[1]);
      const dashes = Math.min(400, Math.ceil(length / (2 * dash)));
      const at = (part: number): Point => [from[0] + (to[0] - from[0]) * part, from[1] + (to[1] - from[1]) * part];
      for (let i = 0; i < dashes; ++i) this.#below.line(at(i / dashes), at((i + 0.5) / dashes), 1.5 * px, palette.obstacle);
    };
    const [columns, rows] = bordersOf(run);
    const g = run.ghostMargin;
    const band: Colour = [palette.ghost[0], palette.ghost[1], palette.ghost[2], GHOST_ALPHA];
    if (g > 0) {
      for (const x of columns) this.#below.convex([[x - g, -h], [x + g, -h], [x + g, h], [x - g, h]], band);
      for (const y of rows) this.#below.convex([[-w, y - g], [w, y - g], [w, y + g], [-w, y + g]], band);
    }
    for (const x of columns) dashed([x, -h], [x, h]);
    for (const y of rows) dashed([-w, y], [w, y]);
  }

  #edge(run: Run): Point[] {
    const { halfWidth: w, halfHeight: h, radius, corners } = run.arena;
    if (radius !== undefined) return circle(0, 0, radius, 128);
    return corners ?? [[-w, -h], [w, -h], [w, h], [-w, h]];
  }

  #bodies(run: Run, camera: Camera, palette: Palette, movables: Float32Array): void {
    const px = 1 / camera.pxPerMm;
    for (const spot of spotsOf(run, this.#floors)) {
      const rim = circle(spot.x, spot.y, spot.radius);
      for (let i = 0; i < rim.length; i += 2) this.#below.line(rim[i]!, rim[i + 1]!, 2 * px, palette.accent);
    }
    for (const lamp of this.#light?.lamps ?? []) {
      this.#below.path(circle(lamp.x, lamp.y, 9 * px, 24), 2 * px, palette.lamp, true);
      if (!lamp.on) continue;
      this.#below.convex(circle(lamp.x, lamp.y, 9 * px, 24), palette.lamp);
      for (let i = 0; i < 8; ++i) {
        const [c, s] = [Math.cos((i * Math.PI) / 4), Math.sin((i * Math.PI) / 4)];
        this.#below.line([lamp.x + 12 * px * c, lamp.y + 12 * px * s], [lamp.x + 18 * px * c, lamp.y + 18 * px * s], 2 * px, palette.lamp);
      }
    }
    for (const body of run.obstacles) this.#below.convex(outline(body, ...body.pose), palette.obstacle);
    const m = run.movables.length;
    if (movables.length !== 3 * m) return;
    run.movables.forEach((body, i) => {
      const rim = outline(body, movables[i]!, movables[m + i]!, movables[2 * m + i]!);
      this.#below.convex(rim, palette.movable);
      this.#below.path(rim, 2 * px, palette.movableRim, true);
    });
  }

  #marks(camera: Camera, palette: Palette, marks: Marks, radius: number): void {
    const px = 1 / camera.pxPerMm;
    for (const rim of marks.ellipses) this.#above.path(rim, 1.5 * px, palette.tracked, true);
    for (const { at, part } of marks.flashes) {
      const rim = circle(...at, radius * (1.3 + 1.6 * part), 32);
      this.#above.path(rim, 3 * px, [palette.ghost[0], palette.ghost[1], palette.ghost[2], Math.round(255 * (1 - part))], true);
    }
    if (marks.held) {
      const { rim, arm, handle } = marks.held;
      const dashed = rim.length > 16 ? rim : rim.flatMap((corner, i) => Array.from({ length: 12 }, (_, k): Point => {
        const next = rim[(i + 1) % rim.length]!;
        return [corner[0] + ((next[0] - corner[0]) * k) / 12, corner[1] + ((next[1] - corner[1]) * k) / 12];
      }));
      for (let i = 0; i < dashed.length; i += 2) this.#above.line(dashed[i]!, dashed[(i + 1) % dashed.length]!, 2 * px, palette.accent);
      this.#above.line(...arm, 1.5 * px, palette.accent);
      this.#above.convex(handle, palette.accent);
    }
    const faint: Colour = [palette.message[0], palette.message[1], palette.message[2], HEARD_ALPHA];
    if (marks.selected) for (const from of marks.heard) this.#above.line(from, marks.selected, 1.5 * px, faint);
    for (const part of marks.trail) this.#above.path(part, 2 * px, palette.accent);
    if (!marks.selected) return;
    this.#above.path(circle(...marks.selected, radius + 4 * px, 48), 2.5 * px, palette.accent, true);
    if (marks.range <= 0) return;
    const range = circle(...marks.selected, marks.range, 96);
    for (let i = 0; i < range.length; i += 2) this.#above.line(range[i]!, range[i + 1]!, 1.2 * px, palette.accent);
  }

  #drawTriangles(triangles: Triangles, view: [number, number, number, number]): void {
    if (triangles.count === 0) return;
    const gl = this.#gl;
    gl.useProgram(this.#flat.program);
    gl.uniform4f(this.#flat.at("u_view"), ...view);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#flatBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, triangles.bytes, gl.STREAM_DRAW);
    this.#attributes(2);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 12, 0);
    gl.vertexAttribPointer(1, 4, gl.UNSIGNED_BYTE, true, 12, 8);
    gl.drawArrays(gl.TRIANGLES, 0, triangles.count);
  }

  #drawFloors(run: Run, view: [number, number, number, number]): void {
    const gl = this.#gl;
    if (this.#textures.length === 0) return;
    gl.useProgram(this.#floor.program);
    gl.uniform4f(this.#floor.at("u_view"), ...view);
    gl.uniform2f(this.#floor.at("u_half"), run.arena.halfWidth, run.arena.halfHeight);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#squareBuffer);
    this.#attributes(1);
    gl.vertexAttribPointer(0, 2, gl.FLOAT, false, 8, 0);
    for (const texture of this.#textures) {
      gl.bindTexture(gl.TEXTURE_2D, texture);
      gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);
    }
  }

  #drawTrails(run: Run, palette: Palette, view: [number, number, number, number]): void {
    const gl = this.#gl;
    if (this.#segments.length === 0) return;
    gl.useProgram(this.#trails.program);
    gl.uniform4f(this.#trails.at("u_view"), ...view);
    gl.uniform2f(this.#trails.at("u_grid"), run.gridLowest, run.gridStep);
    this.#attributes(1);
    this.#segments.forEach((segment, i) => {
      const age = (i + 1) / this.#segments.length;
      gl.uniform4f(this.#trails.at("u_colour"), ...unit(palette.ink), 0.45 * age);
      gl.bindBuffer(gl.ARRAY_BUFFER, segment.buffer);
      gl.vertexAttribPointer(0, 2, gl.UNSIGNED_SHORT, false, 4, 0);
      gl.drawArrays(gl.LINES, 0, segment.vertices);
    });
  }

  #drawRobots(run: Run, camera: Camera, palette: Palette, view: [number, number, number, number], radius: number): void {
    const gl = this.#gl;
    gl.useProgram(this.#robots.program);
    gl.uniform4f(this.#robots.at("u_view"), ...view);
    gl.uniform2f(this.#robots.at("u_grid"), run.gridLowest, run.gridStep);
    gl.uniform1f(this.#robots.at("u_radius"), radius);
    gl.uniform1f(this.#robots.at("u_pxPerRadius"), radius * camera.pxPerMm * (window.devicePixelRatio || 1));
    gl.uniform3f(this.#robots.at("u_ink"), ...unit(palette.ink));
    gl.uniform3f(this.#robots.at("u_body"), ...unit(palette.body));
    gl.uniform3f(this.#robots.at("u_fault"), ...unit(palette.fault));
    gl.uniform3f(this.#robots.at("u_tracked"), ...unit(palette.tracked));
    gl.uniform3f(this.#robots.at("u_ghost"), ...unit(palette.ghost));
    gl.uniform2f(this.#robots.at("u_cells"), ...run.partitions);
    gl.uniform2f(this.#robots.at("u_half"), run.arena.halfWidth, run.arena.halfHeight);
    gl.uniform1f(this.#robots.at("u_margin"), run.ghostMargin);
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#robotBuffer);
    this.#attributes(3);
    gl.vertexAttribPointer(0, 2, gl.UNSIGNED_SHORT, false, BYTES_PER_VERTEX, 0);
    gl.vertexAttribPointer(1, 1, gl.UNSIGNED_SHORT, false, BYTES_PER_VERTEX, 4);
    gl.vertexAttribPointer(2, 2, gl.UNSIGNED_BYTE, false, BYTES_PER_VERTEX, 6);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, this.#indexBuffer);
    gl.drawElements(gl.TRIANGLES, 6 * this.#robotCount, gl.UNSIGNED_INT, 0);
  }

  /** All messages by one call, an instance each. */
  #drawFlights(flights: Float32Array, camera: Camera, palette: Palette, view: [number, number, number, number], radius: number): void {
    const gl = this.#gl;
    if (flights.length === 0) return;
    gl.useProgram(this.#flights.program);
    gl.uniform4f(this.#flights.at("u_view"), ...view);
    gl.uniform1f(this.#flights.at("u_pxPerMm"), camera.pxPerMm);
    gl.uniform1f(this.#flights.at("u_radius"), radius);
    gl.uniform3f(this.#flights.at("u_colour"), ...unit(palette.message));
    gl.bindBuffer(gl.ARRAY_BUFFER, this.#flightBuffer);
    gl.bufferData(gl.ARRAY_BUFFER, flights, gl.STREAM_DRAW);
    this.#attributes(2);
    gl.vertexAttribPointer(0, 4, gl.FLOAT, false, 4 * FLOATS, 0);
    gl.vertexAttribPointer(1, 2, gl.FLOAT, false, 4 * FLOATS, 16);
    for (const i of [0, 1]) gl.vertexAttribDivisor(i, 1);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, FLIGHT_VERTICES, flights.length / FLOATS);
    for (const i of [0, 1]) gl.vertexAttribDivisor(i, 0);
  }

  #attributes(count: number): void {
    for (let i = 0; i < 3; ++i) {
      if (i < count) this.#gl.enableVertexAttribArray(i);
      else this.#gl.disableVertexAttribArray(i);
    }
  }
}
