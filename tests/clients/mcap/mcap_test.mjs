// node mcap_test.mjs KILOTWIN SAMPLES NPM: exported files, read by the reader of MCAP's own project, with the schemas that the
// files carry. Status 77: the npm packages are not there.
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import fs from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";

const [kilotwin, samples, npm] = process.argv.slice(2);
const require = createRequire(path.resolve(npm, "package.json"));
let mcap, protobuf, descriptor;
try {
  mcap = require("@mcap/core");
  protobuf = require("protobufjs");
  descriptor = require("protobufjs/ext/descriptor");
} catch {
  console.log("skipped: build/npm has no @mcap/core and protobufjs; scripts/setup installs them");
  process.exit(77);
}

const ROBOTS = 40;
const STATES = 30;
const EVERY_S = 0.5;
const TICK_S = 0.032768;
const nanoseconds = (stamp) => BigInt(stamp.seconds?.toString() ?? 0) * 1000000000n + BigInt(stamp.nanos ?? 0);

/** Tick of the recorded state `number`, and where the sample's robot `i` is then: tests/clients/view/recordings.hpp. */
const tickOf = (number) => Math.ceil((number * EVERY_S) / TICK_S - 1e-6);
function circling(i, time) {
  const radius = 0.95 * 1000 * Math.sqrt((i + 0.5) / ROBOTS);
  const angle = 2.399963 * i + 0.02 * time;
  return { x: (radius * Math.cos(angle)) / 1000, y: (radius * Math.sin(angle)) / 1000, heading: angle + Math.PI / 2 };
}

class Bytes {
  constructor(bytes) {
    this.bytes = bytes;
  }
  async size() {
    return BigInt(this.bytes.length);
  }
  async read(offset, length) {
    return new Uint8Array(this.bytes.subarray(Number(offset), Number(offset + length)));
  }
}

function decoderOf(schema) {
  assert.equal(schema.encoding, "protobuf");
  const root = protobuf.Root.fromDescriptor(descriptor.FileDescriptorSet.decode(schema.data));
  return root.lookupType(schema.name);
}

const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-mcap-"));
try {
  const recording = path.join(scratch, "recording.ktrec");
  const file = path.join(scratch, "run.mcap");
  execFileSync(samples, ["recording", recording, String(ROBOTS), String(STATES), String(EVERY_S)]);
  execFileSync(kilotwin, ["export", recording, "--mcap", file, "--every", String(EVERY_S)]);
  const bytes = fs.readFileSync(file);

  // By the index; the reader checks all checksums.
  const reader = await mcap.McapIndexedReader.Initialize({ readable: new Bytes(bytes) });
  assert.equal(reader.statistics.channelCount, 5);
  assert.equal(reader.statistics.chunkCount, reader.chunkIndexes.length);
  assert.ok(reader.chunkIndexes.length >= (STATES * EVERY_S) / 2, "chunks end regularly");
  const types = new Map([...reader.schemasById.values()].map((schema) => [schema.id, decoderOf(schema)]));
  const counts = {};
  let number = 0;
  for await (const message of reader.readMessages()) {
    const channel = reader.channelsById.get(message.channelId);
    counts[channel.topic] = (counts[channel.topic] ?? 0) + 1;
    const value = types.get(channel.schemaId).decode(message.data);
    if (value.timestamp) assert.equal(nanoseconds(value.timestamp), message.logTime);
    if (channel.topic === "/robots") {
      const time = tickOf(number) * TICK_S;
      assert.equal(message.logTime, BigInt(Math.round(time * 1e9)));
      assert.equal(value.data.length, ROBOTS * value.point_stride);
      const at = new DataView(value.data.buffer, value.data.byteOffset, value.data.byteLength);
      for (let i = 0; i < ROBOTS; ++i) {
        const place = circling(i, time);
        assert.ok(Math.abs(at.getFloat32(i * value.point_stride, true) - place.x) < 1e-6);
        assert.ok(Math.abs(at.getFloat32(i * value.point_stride + 4, true) - place.y) < 1e-6);
        const led = (i + Math.floor(number / 8)) % 64;
        if (led !== 0) assert.equal(at.getUint8(i * value.point_stride + 12), 85 * (led & 3));
      }
      ++number;
    } else if (channel.topic === "/poses") {
      assert.equal(value.poses.length, ROBOTS);
      const { position, orientation } = value.poses[7];
      const place = circling(7, Number(message.logTime) / 1e9);
      assert.ok(Math.abs(position.x - place.x) < 1e-9 && Math.abs(position.y - place.y) < 1e-9);
      const turn = 2 * Math.atan2(orientation.z, orientation.w) - place.heading;
      assert.ok(Math.abs(Math.sin(turn / 2)) < 1e-9);
    } else if (channel.topic === "/scene") {
      assert.deepEqual(value.entities.map((entity) => entity.id), ["arena", "obstacles"]);
      assert.deepEqual(value.entities[0].lines[0].points.map((point) => point.x), [-1, 1, 1, -1]);
    } else if (channel.topic === "/counters") {
      assert.equal(value.robots_running, ROBOTS);
    }
  }
  // Every tenth state a packet comes from outside; the last line says that the run has ended.
  const lines = STATES / 10 + 1;
  assert.deepEqual(counts, { "/scene": 1, "/robots": STATES, "/poses": STATES, "/counters": STATES, "/log": lines });
  assert.equal(reader.statistics.messageCount, BigInt(3 * STATES + 1 + lines));

  // A part of the time, by the index alone.
  let part = 0;
  for await (const message of reader.readMessages({ topics: ["/poses"], startTime: 5000000000n, endTime: 7000000000n })) {
    assert.ok(message.logTime >= 5000000000n && message.logTime <= 7000000000n);
    ++part;
  }
  assert.ok(part >= 3 && part <= 5, `${part} states in two seconds`);

  // A file that was cut off: a reader that streams gets every whole chunk.
  const stream = new mcap.McapStreamReader();
  stream.append(new Uint8Array(bytes.subarray(0, Math.floor(bytes.length / 2))));
  let messages = 0;
  for (let record = stream.nextRecord(); record; record = stream.nextRecord()) if (record.type === "Message") ++messages;
  assert.ok(messages > STATES, `${messages} messages of half a file`);

  // A run's variables, and the lines that its robots print.
  const program = path.join(scratch, "counting.c");
  fs.writeFileSync(program, `#include "kilolib.h"
#define DEBUG
#include "debug.h"
volatile int turns;
void setup() {}
void loop() { if (kilo_ticks >= 31 * (turns + 1)) { turns++; printf("turn %d of robot %d\\n", turns, kilo_uid); } }
int main() { kilo_init(); debug_init(); kilo_start(setup, loop); return 0; }
`);
  const experiment = path.join(scratch, "counting.txtpb");
  fs.writeFileSync(experiment, `duration_s: 5 seed: 1 arena { width_mm: 500 height_mm: 500 }
robots { count: 3 behaviour: "counting.c" layout { grid { pitch_mm: 60 } } }
recording { variable { name: "turns" every_s: 0.5 } variable { name: "radio_sent" every_s: 1 } }
`);
  const ran = path.join(scratch, "ran");
  execFileSync(kilotwin, ["run", experiment, "--mode", "local", "--quiet", "--out", ran]);
  execFileSync(kilotwin, ["export", ran, "--mcap", file]);
  const counted = await mcap.McapIndexedReader.Initialize({ readable: new Bytes(fs.readFileSync(file)) });
  const typesOf = new Map([...counted.schemasById.values()].map((schema) => [schema.id, decoderOf(schema)]));
  const [said, turns] = [[], []];
  let before = 0n;
  for await (const message of counted.readMessages()) {
    assert.ok(message.logTime >= before, "times ascend");
    before = message.logTime;
    const { topic, schemaId } = counted.channelsById.get(message.channelId);
    const value = typesOf.get(schemaId).decode(message.data);
    if (topic === "/log" && value.name.startsWith("robot ")) said.push([value.name, value.message, Number(message.logTime) / 1e9]);
    if (topic === "/variables/turns") turns.push(value);
    if (topic === "/variables/radio_sent") assert.equal(value.robot.length, 3);
  }
  assert.equal(said.length, 12, JSON.stringify(said)); // of 3 robots, once per 31 kilo_ticks
  for (const [name, text, time] of said) {
    const [turn, robot] = text.match(/^turn (\d+) of robot (\d+)$/).slice(1).map(Number);
    assert.equal(name, `robot ${robot}`);
    assert.ok(Math.abs(time - turn) < 0.1, `${text} at ${time}`);
  }
  assert.deepEqual(turns[0].robot, [0, 1, 2]);
  assert.equal(turns.at(-1).mean, 4);
  assert.deepEqual(turns.at(-1).value, [4, 4, 4]);
  console.log(`${bytes.length} bytes, ${reader.statistics.messageCount} messages, ${reader.chunkIndexes.length} chunks`);
} finally {
  fs.rmSync(scratch, { recursive: true });
}
