// The programs of the renderer. `u_view` maps mm to clip coordinates: xy scales, zw shifts.

export const FLAT_VERTEX = `#version 300 es
in vec2 a_position;
in vec4 a_colour;
uniform vec4 u_view;
out vec4 v_colour;
void main() {
  gl_Position = vec4(a_position * u_view.xy + u_view.zw, 0.0, 1.0);
  v_colour = a_colour;
}`;

export const FLAT_FRAGMENT = `#version 300 es
precision highp float;
in vec4 v_colour;
out vec4 colour;
void main() { colour = vec4(v_colour.rgb * v_colour.a, v_colour.a); }`;

// Four vertices per robot, the corners of a square around its disc. Squares are drawn as plain triangles: a software renderer
// draws instances five times slower.
export const ROBOT_VERTEX = `#version 300 es
in vec2 a_place;        // grid coordinates
in float a_headingLed;
in vec2 a_stateKind;
uniform vec4 u_view;
uniform vec2 u_grid;    // lowest, step, mm
uniform float u_radius; // mm
uniform vec2 u_cells, u_half; // columns and rows of partitions; half of the rectangle around the arena, mm
uniform float u_margin; // mm
flat out float v_ghost; // 1: within the margin of a border between partitions
out vec2 v_at;          // in the robot's frame, in radii
flat out vec3 v_led;
flat out vec2 v_lifeKind;
void main() {
  const float reach = 1.45;
  int corner = gl_VertexID & 3;
  vec2 offset = reach * vec2((corner & 1) == 0 ? -1.0 : 1.0, corner < 2 ? -1.0 : 1.0);
  vec2 centre = u_grid.x + u_grid.y * a_place;
  gl_Position = vec4((centre + u_radius * offset) * u_view.xy + u_view.zw, 0.0, 1.0);
  int value = int(a_headingLed);
  float heading = float(value >> 6) * (6.2831853 / 1024.0);
  vec2 ahead = vec2(cos(heading), sin(heading));
  v_at = vec2(dot(offset, ahead), dot(offset, vec2(-ahead.y, ahead.x)));
  v_led = vec3(float(value & 3), float((value >> 2) & 3), float((value >> 4) & 3)) / 3.0;
  vec2 cell = (centre + u_half) / (2.0 * u_half) * u_cells;
  vec2 border = clamp(floor(cell + 0.5), vec2(1.0), max(u_cells - 1.0, vec2(1.0)));
  vec2 away = abs(cell - border) * (2.0 * u_half) / u_cells;
  v_ghost = (u_cells.x > 1.5 && away.x <= u_margin) || (u_cells.y > 1.5 && away.y <= u_margin) ? 1.0 : 0.0;
  int life = int(a_stateKind.x) & 15;
  v_lifeKind = vec2(float(life), a_stateKind.y);
}`;

// Disc in the LED's colour with a rim, a bar towards the heading, and a mark by state and kind: a cross for failed robots, a
// minus for flat batteries, a square around tracked ones, a square inside firmware ones, a dotted ring around those that several
// partitions know. Of tracked robots that are not there, a dashed ring at their last place.
export const ROBOT_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_at;
flat in vec3 v_led;
flat in vec2 v_lifeKind;
flat in float v_ghost;
uniform float u_pxPerRadius;
uniform vec3 u_ink, u_body, u_fault, u_tracked, u_ghost;
out vec4 colour;
float inside(float distance) { return clamp(0.5 - distance * u_pxPerRadius, 0.0, 1.0); }
void main() {
  float life = v_lifeKind.x, kind = v_lifeKind.y;
  float r = length(v_at);
  if (life > 12.5 && life < 13.5) {
    float dashes = step(0.4, fract(atan(v_at.y, v_at.x) * 1.2732395));  // eight of them
    float lost = inside(abs(r - 1.1) - 0.13) * dashes;
    if (lost <= 0.0) discard;
    colour = vec4(u_tracked * lost, lost);
    return;
  }
  float disc = inside(r - 1.0);
  bool lit = v_led.r + v_led.g + v_led.b > 0.0;
  vec3 paint = lit ? 0.25 + 0.75 * v_led : u_body;
  float alpha = disc;
  vec3 mixed = mix(paint, u_ink, disc - inside(r - 0.84));
  float bar = inside(max(abs(v_at.y) - 0.11, max(-v_at.x, v_at.x - 0.9)));
  vec3 mark = lit && dot(v_led, vec3(0.3, 0.5, 0.2)) < 0.35 ? vec3(1.0) : vec3(0.06);
  mixed = mix(mixed, lit ? mark : u_ink, bar);
  if (kind > 0.5 && kind < 1.5) {
    float square = abs(max(abs(v_at.x), abs(v_at.y)) - 0.42) - 0.08;
    mixed = mix(mixed, lit ? mark : u_ink, inside(square));
  }
  if (v_ghost > 0.5) {
    float dots = step(0.5, fract(atan(v_at.y, v_at.x) * 1.2732395));  // eight of them
    float ring = inside(abs(r - 1.22) - 0.1) * dots;
    mixed = mix(mixed, u_ghost, ring * (1.0 - disc));
    alpha = max(alpha, ring);
  }
  if (kind > 1.5) {
    float frame = inside(abs(max(abs(v_at.x), abs(v_at.y)) - 1.28) - 0.09);
    mixed = mix(mixed, u_tracked, frame * (1.0 - disc));
    alpha = max(alpha, frame);
  }
  if (life > 14.5) {
    vec2 turned = abs(vec2(v_at.x + v_at.y, v_at.x - v_at.y)) * 0.7071;
    float cross = inside(max(min(turned.x, turned.y) - 0.15, max(turned.x, turned.y) - 1.3));
    mixed = mix(mixed, u_fault, cross);
    alpha = max(alpha, cross);
  } else if (life > 13.5) {
    float minus = inside(max(abs(v_at.y) - 0.16, abs(v_at.x) - 1.2));
    mixed = mix(mixed, u_fault, minus);
    alpha = max(alpha, minus);
  } else if (life < 0.5 && !lit) {
    alpha *= 0.55;
  }
  if (alpha <= 0.0) discard;
  colour = vec4(mixed * alpha, alpha);
}`;

// One instance per message: an arc from the sender to the receiver, or a ring around a robot that has sent. It fades with its age;
// its front runs ahead in the first half.
export const FLIGHT_VERTEX = `#version 300 es
in vec4 a_ends;      // mm
in vec2 a_age;       // 0 to 1, emphasis
uniform vec4 u_view;
uniform float u_pxPerMm, u_radius;
out float v_along;
flat out vec2 v_age;
void main() {
  const float segments = 16.0, turn = 6.2831853;
  float along = float(gl_VertexID >> 1) / segments;
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  vec2 way = a_ends.zw - a_ends.xy;
  float distance = length(way);
  vec2 at, normal;
  if (distance < 0.001) {
    normal = vec2(cos(turn * along), sin(turn * along));
    at = a_ends.xy + u_radius * (1.15 + 1.2 * a_age.x) * normal;
  } else {
    vec2 across = vec2(-way.y, way.x) / distance;
    float bulge = 0.12 * distance;
    at = a_ends.xy + way * along + across * bulge * 4.0 * along * (1.0 - along);
    vec2 tangent = way + across * bulge * 4.0 * (1.0 - 2.0 * along);
    normal = vec2(-tangent.y, tangent.x) / length(tangent);
  }
  float width = (a_age.y > 0.75 ? 2.2 : 1.5) / u_pxPerMm;
  gl_Position = vec4((at + 0.5 * width * side * normal) * u_view.xy + u_view.zw, 0.0, 1.0);
  v_along = distance < 0.001 ? 0.0 : along;
  v_age = a_age;
}`;

export const FLIGHT_FRAGMENT = `#version 300 es
precision highp float;
in float v_along;
flat in vec2 v_age;
uniform vec3 u_colour;
out vec4 colour;
void main() {
  float front = min(1.0, 2.0 * v_age.x);
  if (v_along > front) discard;
  float near = 1.0 - clamp((front - v_along) * 4.0, 0.0, 1.0);
  float alpha = (1.0 - v_age.x) * mix(0.2, 1.0, v_age.y) * mix(0.55, 1.0, near);
  colour = vec4(u_colour * alpha, alpha);
}`;

export const TRAIL_VERTEX = `#version 300 es
in vec2 a_place;
uniform vec4 u_view;
uniform vec2 u_grid;
void main() { gl_Position = vec4((u_grid.x + u_grid.y * a_place) * u_view.xy + u_view.zw, 0.0, 1.0); }`;

export const TRAIL_FRAGMENT = `#version 300 es
precision highp float;
uniform vec4 u_colour;
out vec4 colour;
void main() { colour = vec4(u_colour.rgb * u_colour.a, u_colour.a); }`;

export const FLOOR_VERTEX = `#version 300 es
in vec2 a_position;
uniform vec4 u_view;
uniform vec2 u_half;
out vec2 v_at;
void main() {
  gl_Position = vec4(a_position * u_half * u_view.xy + u_view.zw, 0.0, 1.0);
  v_at = vec2(0.5 + 0.5 * a_position.x, 0.5 - 0.5 * a_position.y);
}`;

export const FLOOR_FRAGMENT = `#version 300 es
precision highp float;
in vec2 v_at;
uniform sampler2D u_floor;
out vec4 colour;
void main() {
  vec4 cell = texture(u_floor, v_at);
  colour = vec4(cell.rgb * cell.a, cell.a);
}`;
