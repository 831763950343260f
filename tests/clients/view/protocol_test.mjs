// node protocol_test.mjs view_samples NPM PAGE: the page's own decoder against frames that the gateway's encoder wrote.
// Status 77: the npm packages are not there.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { pathToFileURL } from "node:url";

const [samples, npm, pageSources] = process.argv.slice(2);
const require = createRequire(path.resolve(npm, "package.json"));
let esbuild;
try {
  esbuild = require("esbuild");
} catch {
  console.log("skipped: build/npm has no esbuild, which comes with vite; scripts/setup installs it");
  process.exit(77);
}
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-protocol-"));
try {
  const decoder = path.join(scratch, "protocol.mjs");
  const source = fs.readFileSync(path.join(pageSources, "protocol.ts"), "utf8");
  fs.writeFileSync(decoder, esbuild.transformSync(source, { loader: "ts", format: "esm" }).code);
  const protocol = await import(pathToFileURL(decoder));
  const [binary, json] = [path.join(scratch, "frame.bin"), path.join(scratch, "frame.json")];
  execFileSync(samples, ["frame", binary, json]);
  const bytes = fs.readFileSync(binary);
  const data = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
  const expected = JSON.parse(fs.readFileSync(json, "utf8"));

  const frame = protocol.decodeFrame(data);
  assert.equal(frame.request, expected.request);
  assert.equal(frame.tick, expected.tick);
  assert.equal(frame.nextTick, expected.nextTick);
  assert.equal(frame.robots, expected.robots.length);
  assert.equal(frame.bytes, 32 + 3 * 12 + 7 * frame.robots);
  assert.deepEqual([...frame.movables], expected.movables);
  expected.robots.forEach((robot, i) => {
    const place = (column) => expected.gridLowest + expected.gridStep * column[i];
    assert.ok(Math.abs(place(frame.x) - robot.x) <= 0.5001 * expected.gridStep, `x of ${i}`);
    assert.ok(Math.abs(place(frame.y) - robot.y) <= 0.5001 * expected.gridStep, `y of ${i}`);
    const turn = protocol.headingOf(frame.headingLed[i]) - robot.heading;
    assert.ok(Math.abs(Math.atan2(Math.sin(turn), Math.cos(turn))) <= Math.PI / 1024 + 1e-9, `heading of ${i}`);
    const [r, g, b] = protocol.ledOf(frame.headingLed[i]);
    assert.equal(r | (g << 2) | (b << 4), robot.led);
    assert.equal(protocol.lifeOf(frame.state[i]), robot.life);
    assert.equal(protocol.leftMotorOn(frame.state[i]), robot.left);
    assert.equal(protocol.rightMotorOn(frame.state[i]), robot.right);
  });

  // Data that are no frame are refused, whatever their length.
  for (let length = 0; length < data.byteLength; ++length) assert.equal(protocol.decodeFrame(data.slice(0, length)), undefined);
  const foreign = data.slice(0);
  new Uint8Array(foreign)[0] ^= 1;
  assert.equal(protocol.decodeFrame(foreign), undefined);
  console.log(`${frame.robots} robots decoded as they were encoded`);
} finally {
  fs.rmSync(scratch, { recursive: true });
}
