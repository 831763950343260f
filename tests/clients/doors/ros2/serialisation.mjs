// Proves that the door speaks as ROS 2 does, against packages that know nothing of Cyclone DDS:
//   - definitions of ROS's own messages come from @foxglove/rosmsg-msgs-common, serialisation from @foxglove/rosmsg2-serialization;
//   - a message serialised by the package is read by Cyclone, and Cyclone's serialisation of it has the same octets;
//   - what the door reads of it is what the message holds;
//   - hashes of types (RIHS01) are computed again from the definitions.
// Usage: node serialisation.mjs ROS2_CDR NPM_DIRECTORY TYPES_HPP. Exit status 77: the packages are missing.
import { spawnSync } from "node:child_process";
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import assert from "node:assert/strict";
import path from "node:path";

const [program, npm, typesHpp] = process.argv.slice(2);
let parse, MessageReader, MessageWriter, common;
try {
  const require = createRequire(path.resolve(npm, "package.json"));
  ({ parse } = require("@foxglove/rosmsg"));
  ({ MessageReader, MessageWriter } = require("@foxglove/rosmsg2-serialization"));
  common = require("@foxglove/rosmsg-msgs-common").ros2jazzy;
} catch (error) {
  console.log(`skipped: ${error.message.split("\n")[0]}; scripts/setup installs the packages`);
  process.exit(77);
}

// Packages outside common_interfaces, as their field lists have them.
const own = {
  "motion_capture_tracking_interfaces/NamedPose": "string name\ngeometry_msgs/Pose pose",
  "motion_capture_tracking_interfaces/NamedPoseArray": "std_msgs/Header header\nNamedPose[] poses",
  "mocap4r2_msgs/Marker":
    "int8 USE_NAME=0\nint8 id_type\nint32 marker_index\nstring marker_name\ngeometry_msgs/Point translation",
  "mocap4r2_msgs/RigidBody": "string rigid_body_name\nmocap4r2_msgs/Marker[] markers\ngeometry_msgs/Pose pose",
  "mocap4r2_msgs/RigidBodies": "std_msgs/Header header\nuint32 frame_number\nmocap4r2_msgs/RigidBody[] rigidbodies",
};
const shortName = (name) => name.replace("/msg/", "/");
const definitions = new Map();
for (const [name, definition] of Object.entries(common)) {
  definitions.set(shortName(name), { name: shortName(name), definitions: definition.definitions });
}
for (const [name, text] of Object.entries(own)) {
  const [parsed] = parse(text, { ros2: true, skipTypeFixup: true });
  for (const field of parsed.definitions) {
    if (field.isComplex && !field.type.includes("/")) field.type = `${name.split("/")[0]}/${field.type}`;
  }
  definitions.set(name, { name, definitions: parsed.definitions });
}
const isTime = (type) => type === "time" || type === "duration";
function closure(name, found = new Map()) {
  const message = definitions.get(name);
  assert.ok(message, `no definition of ${name}`);
  if (found.has(name)) return found;
  found.set(name, message);
  for (const field of message.definitions) {
    if (field.isComplex && !isTime(field.type)) closure(shortName(field.type), found);
  }
  return found;
}
const listOf = (name) => [...closure(name).values()];

// --- octets ---------------------------------------------------------------------------------------------------------------
// xorshift, so that every run tests the same messages.
let seed = 88172645463325252n;
function random() {
  seed ^= (seed << 13n) & 0xffffffffffffffffn;
  seed ^= seed >> 7n;
  seed ^= (seed << 17n) & 0xffffffffffffffffn;
  return Number(seed >> 11n) / 2 ** 53;
}
const below = (n) => Math.floor(random() * n);
const number = () => (random() - 0.5) * 10 ** (below(7) - 3);
// ASCII: the package counts UTF-16 units where octets are due.
const text = () => "kilobot_0-wand".slice(0, below(15));
const many = (make) => Array.from({ length: below(6) }, make);
const stamp = () => ({ sec: below(2 ** 31), nanosec: below(1e9) });
const header = () => ({ stamp: stamp(), frame_id: text() });
const point = () => ({ x: number(), y: number(), z: number() });
const pose = () => ({ position: point(), orientation: { ...point(), w: number() } });
const marker = () => ({ id_type: below(3), marker_index: below(100) - 50, marker_name: text(), translation: point() });

const line = (h, frame = "-") => `header ${BigInt(h.stamp.sec) * 1000000000n + BigInt(h.stamp.nanosec)} ${h.frame_id} ${frame}`;
const shown = (name, position, q, covariance = []) =>
  ["pose", name, ...[position.x, position.y, position.z, q.x, q.y, q.z, q.w, ...covariance]];
const posed = (name, p, covariance) => shown(name, p.position, p.orientation, covariance);

const types = {
  S: {
    name: "geometry_msgs/PoseStamped",
    make: () => ({ header: header(), pose: pose() }),
    read: (m) => [line(m.header), posed("topic", m.pose)],
  },
  V: {
    name: "geometry_msgs/PoseWithCovarianceStamped",
    make: () => ({ header: header(), pose: { pose: pose(), covariance: Float64Array.from({ length: 36 }, number) } }),
    read: (m) => [line(m.header), posed("topic", m.pose.pose, [0, 1, 2, 7, 14, 28, 35].map((i) => m.pose.covariance[i]))],
  },
  A: {
    name: "geometry_msgs/PoseArray",
    make: () => ({ header: header(), poses: many(pose) }),
    read: (m) => [line(m.header), ...m.poses.map((p, i) => posed(String(i), p))],
  },
  T: {
    name: "tf2_msgs/TFMessage",
    make: () => ({
      transforms: many(() => ({
        header: header(),
        child_frame_id: text(),
        transform: { translation: point(), rotation: { ...point(), w: number() } },
      })),
    }),
    // Transforms of one header that follow each other are one message.
    read: (m) => m.transforms.flatMap((t, i) => [
      ...(i > 0 && line(m.transforms[i - 1].header) === line(t.header) ? [] : [line(t.header)]),
      shown(t.child_frame_id, t.transform.translation, t.transform.rotation),
    ]),
  },
  N: {
    name: "motion_capture_tracking_interfaces/NamedPoseArray",
    make: () => ({ header: header(), poses: many(() => ({ name: text(), pose: pose() })) }),
    read: (m) => [line(m.header), ...m.poses.map((p) => posed(p.name, p.pose))],
  },
  R: {
    name: "mocap4r2_msgs/RigidBodies",
    make: () => ({
      header: header(),
      frame_number: below(2 ** 32),
      rigidbodies: many(() => ({ rigid_body_name: text(), markers: many(marker), pose: pose() })),
    }),
    read: (m) => [line(m.header, m.frame_number), ...m.rigidbodies.map((b) => posed(b.rigid_body_name, b.pose))],
  },
  C: {
    name: "rosgraph_msgs/Clock",
    make: () => ({ clock: stamp() }),
    read: (m) => [`${m.clock.sec} ${m.clock.nanosec}`],
  },
};

// Sizes that other implementations measured, with frame_id "map" and names "kilobot_0", "kilobot_1".
const map = () => ({ stamp: { sec: 1, nanosec: 2 }, frame_id: "map" });
const fixed = [
  ["S", { header: map(), pose: pose() }, 76],
  ["A", { header: map(), poses: [pose(), pose()] }, 140],
  ["T", { transforms: [0, 1].map((i) => ({ header: map(), child_frame_id: `kilobot_${i}`,
      transform: { translation: point(), rotation: { ...point(), w: 1 } } })) }, 188],
  ["N", { header: map(), poses: [0, 1].map((i) => ({ name: `kilobot_${i}`, pose: pose() })) }, 172],
  ["C", { clock: { sec: 1, nanosec: 2 } }, 12],
];
const kPerType = 200;
const requests = [];
for (const [type, message, size] of fixed) requests.push({ type, message, size });
for (const type of Object.keys(types)) {
  for (let i = 0; i < kPerType; ++i) requests.push({ type, message: types[type].make() });
}
const block = (octets) => {
  const head = Buffer.alloc(4);
  head.writeUInt32LE(octets.length);
  return Buffer.concat([head, octets]);
};
const input = [];
for (const request of requests) {
  request.octets = Buffer.from(new MessageWriter(listOf(types[request.type].name)).writeMessage(request.message));
  input.push(block(Buffer.concat([Buffer.from(request.type), request.octets])));
}
input.push(block(Buffer.from("P")));
const ran = spawnSync(program, { input: Buffer.concat(input), maxBuffer: 2 ** 28 });
assert.equal(ran.status, 0, `ros2_cdr: ${ran.stderr}`);
let at = 0;
const answer = () => {
  const length = ran.stdout.readUInt32LE(at);
  at += 4 + length;
  return ran.stdout.subarray(at - length, at);
};
for (const { type, message, size, octets } of requests) {
  const name = types[type].name;
  const cyclone = answer();
  if (size) assert.equal(octets.length, size, `${name}: size`);
  assert.deepEqual(cyclone, octets, `${name}: Cyclone and the package serialise differently`);
  assert.deepEqual([...cyclone.subarray(0, 4)], [0, 1, 0, 0], `${name}: plain CDR, least octet first`);
  assert.deepEqual(new MessageReader(listOf(name)).readMessage(cyclone), message, name);
  const lines = answer().toString().split("\n").slice(0, -1);
  const expected = types[type].read(message);
  assert.equal(lines.length, expected.length, name);
  const poses = expected.filter(Array.isArray);
  const others = expected.filter((l) => !Array.isArray(l));
  assert.deepEqual(lines.filter((l) => !l.startsWith("pose")), others, `${name}: headers`);
  lines.filter((l) => l.startsWith("pose")).forEach((l, i) => {
    const numbers = poses[i].slice(2);
    const words = l.split(" ");
    assert.equal(words.slice(1, -numbers.length).join(" "), poses[i][1], `${name}: name`);
    assert.deepEqual(words.slice(-numbers.length).map(Number), numbers, `${name}: numbers`);
  });
}
const published = new MessageReader(listOf("geometry_msgs/PoseArray")).readMessage(answer());
assert.deepEqual(published, {
  header: { stamp: { sec: 12, nanosec: 34 }, frame_id: "map" },
  poses: [
    { position: { x: 1, y: 2, z: 3 }, orientation: { x: 4, y: 5, z: 6, w: 7 } },
    { position: { x: -0.5, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } },
  ],
});
assert.equal(at, ran.stdout.length);
console.log(`${requests.length} messages of ${Object.keys(types).length} types: the same octets, the same values`);

// --- hashes of types --------------------------------------------------------------------------------------------------------
// ROS enhancement proposal 2016: SHA-256 of a type's description as JSON.
const typeId = { int8: 2, uint8: 3, int16: 4, uint16: 5, int32: 6, uint32: 7, int64: 8, uint64: 9, float32: 10, float64: 11,
  bool: 15, byte: 16, string: 17 };
const kArray = 48, kSequence = 144;
const fullName = (name) => name.replace("/", "/msg/");
const time = { name: "builtin_interfaces/Time", definitions: [{ name: "sec", type: "int32" }, { name: "nanosec", type: "uint32" }] };
const duration = { ...time, name: "builtin_interfaces/Duration" };
function described(message) {
  const fields = message.definitions.filter((f) => !f.isConstant).map((f) => {
    const nested = isTime(f.type) ? fullName(f.type === "time" ? time.name : duration.name) : f.isComplex ? fullName(shortName(f.type)) : "";
    const base = nested === "" ? typeId[f.type] : 1;
    assert.ok(base, f.type);
    const id = base + (f.arrayLength ? kArray : f.isArray ? kSequence : 0);
    return { name: f.name, type: { type_id: id, capacity: f.arrayLength ?? 0, string_capacity: 0, nested_type_name: nested } };
  });
  return { type_name: fullName(message.name), fields };
}
// JSON with a space behind each colon and comma.
const json = (v) => Array.isArray(v) ? `[${v.map(json).join(", ")}]`
  : v !== null && typeof v === "object" ? `{${Object.entries(v).map(([k, x]) => `${JSON.stringify(k)}: ${json(x)}`).join(", ")}}`
  : JSON.stringify(v);
function hash(name) {
  const all = closure(name);
  const uses = (kind) => [...all.values()].some((m) => m.definitions.some((f) => f.type === kind));
  const others = [...all.values()].filter((m) => m.name !== name);
  if (uses("time")) others.push(time);
  if (uses("duration")) others.push(duration);
  const referenced = others.map(described).sort((a, b) => (a.type_name < b.type_name ? -1 : 1));
  const description = json({ type_description: described(all.get(name)), referenced_type_descriptions: referenced });
  return "RIHS01_" + createHash("sha256").update(description).digest("hex");
}
const stated = new Map();
for (const [, type, value] of readFileSync(typesHpp, "utf8").matchAll(/type_hash<(\w+)>\(\) \{\s*return "(\w+)"/g)) {
  stated.set(type, value);
}
assert.equal(stated.size, Object.keys(types).length);
for (const { name } of Object.values(types)) {
  assert.equal(stated.get(name.split("/")[1]), hash(name), `${name}: hash`);
}
console.log(`${stated.size} hashes of types: as the definitions have them`);
