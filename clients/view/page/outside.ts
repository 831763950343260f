// External input of the run: where trackers saw robots, and packets for the overhead controller.
import type { Point } from "./geometry.ts";
import { element, setText } from "./panels.ts";
import type { OutsideText } from "./protocol.ts";

/** Half axes of the ellipse that holds the robot with a probability of 95 %, in standard deviations. */
const SIGMAS = Math.sqrt(-2 * Math.log(0.05));
const CORNERS = 36;
const PLACE_NUMBERS = 5;

const COMMANDS = ["stop", "LED", "repeat", "raw", "boot page", "GPS frame", "once"];

/** The rim of each tracked robot's ellipse. */
export function ellipsesOf(outside: OutsideText): Point[][] {
  return outside.robots.map((_, i): Point[] => {
    const [x, y, xx, xy, yy] = outside.places.slice(PLACE_NUMBERS * i, PLACE_NUMBERS * (i + 1)) as [number, number, number, number, number];
    // The factor of Cholesky maps the unit circle to the ellipse.
    const a = Math.sqrt(xx);
    const b = xy / a;
    const c = Math.sqrt(Math.max(0, yy - b * b));
    return Array.from({ length: CORNERS }, (_, k): Point => {
      const [cosine, sine] = [Math.cos((2 * Math.PI * k) / CORNERS), Math.sin((2 * Math.PI * k) / CORNERS)];
      return [x + SIGMAS * a * cosine, y + SIGMAS * (b * cosine + c * sine)];
    });
  });
}

/** The newest packets, one a line, and whether the viewer may send one. */
export function showPackets(outside: OutsideText | undefined, maySend: boolean): void {
  const packets = outside?.packets ?? [];
  element("overhead").hidden = packets.length === 0 && !maySend;
  element("overhead-form").hidden = !maySend;
  element("packets").hidden = packets.length === 0;
  const lines = packets.map(({ time, command, message }) => {
    const data = message.slice(0, 18).replace(/(?:00)+$/, "") || "0";
    return `${time.toFixed(2).padStart(7)} s  ${COMMANDS[command] ?? command}  type ${Number.parseInt(message.slice(18), 16)}  ${data}`;
  });
  setText("packets", lines.reverse().join("\n"));
}

/** The alarms of the residual monitor, newest first. */
export function showAlarms(alarms: string[]): void {
  element("alarms").hidden = alarms.length === 0;
  setText("alarm-lines", [...alarms].reverse().join("\n"));
}

/** The ten octets of a message, data first, as hexadecimal digits; undefined where the text is none. */
export function messageOf(type: number, data: string): string | undefined {
  const digits = data.replace(/\s+/g, "");
  if (!/^(?:[0-9a-fA-F]{2}){0,9}$/.test(digits) || !(Number.isInteger(type) && type >= 0 && type <= 255)) return undefined;
  return digits.padEnd(18, "0") + type.toString(16).padStart(2, "0");
}
