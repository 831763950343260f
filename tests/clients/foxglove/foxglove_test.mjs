// node foxglove_test.mjs KILOTWIN VIEW SOURCES NPM: a live run, seen by the client of Foxglove's own WebSocket protocol; a viewer that
// comes late, one that breaks the rules, and another run. Status 77: the npm packages are not there.
import assert from "node:assert/strict";
import { spawn } from "node:child_process";
import dgram from "node:dgram";
import fs from "node:fs";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";

const [kilotwin, view, sources, npm] = process.argv.slice(2);
const require = createRequire(path.resolve(npm, "package.json"));
let FoxgloveClient, WebSocket, protobuf, descriptor;
try {
  ({ FoxgloveClient } = require("@foxglove/ws-protocol"));
  WebSocket = require("ws");
  protobuf = require("protobufjs");
  descriptor = require("protobufjs/ext/descriptor");
} catch {
  console.log("skipped: build/npm lacks @foxglove/ws-protocol, ws or protobufjs; scripts/setup installs them");
  process.exit(77);
}

const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-foxglove-"));
const started = [];
/** A DDS domain that no test beside this one takes: its first port stays bound, as by a participant. */
async function ownDomain() {
  for (let domain = 60 + (process.pid % 50); ; domain = 1 + (domain % 110)) {
    const socket = dgram.createSocket("udp4");
    const free = await new Promise((done) => {
      socket.once("error", () => done(false));
      socket.bind({ port: 7410 + 250 * domain, exclusive: true }, () => done(true));
    });
    if (free) return String(domain);
  }
}
const domain = await ownDomain();
const failed = setTimeout(() => {
  console.error("nothing happened for 240 s");
  end(1);
}, 240000);
function end(status) {
  for (const child of started) child.kill("SIGINT");
  fs.rmSync(scratch, { recursive: true, force: true });
  process.exit(status);
}

/** Starts a program; `says(text)` waits until its stderr holds it, and gives the text so far. */
function start(words) {
  const child = spawn(words[0], words.slice(1), { stdio: ["ignore", "ignore", "pipe"] });
  started.push(child);
  let said = "";
  child.stderr.on("data", (data) => (said += data));
  child.says = async (wanted) => {
    while (!wanted.test(said)) {
      assert.equal(child.exitCode, null, said);
      await new Promise((later) => setTimeout(later, 50));
    }
    return said.match(wanted);
  };
  child.ended = new Promise((done) => child.on("exit", done));
  return child;
}

const run = (name, robots) =>
  start([kilotwin, "run", path.join(sources, "experiments/disperse.txtpb"), "--robots", String(robots), "--duration", "600",
    "--pace", "1", "--quiet", "--domain", domain, "--out", path.join(scratch, name)]);

const served = start([view, "view", "--domain", domain, "--foxglove", "--port", "0", "--origin", "https://viewer.example"]);
const url = (await served.says(/ws:\/\/127\.0\.0\.1:\d+/))[0];

/** Octets that the server has sent to a viewer and that its socket has no room for. */
function octetsWaiting(socket) {
  const hex = (port) => port.toString(16).toUpperCase().padStart(4, "0");
  const { localPort, remotePort } = socket._socket;
  for (const line of fs.readFileSync("/proc/net/tcp", "utf8").split("\n")) {
    const [, local, remote, , queues] = line.trim().split(/\s+/);
    if (local?.endsWith(`:${hex(remotePort)}`) && remote?.endsWith(`:${hex(localPort)}`)) return parseInt(queues, 16);
  }
  throw new Error("the viewer is disconnected");
}

/** A viewer that subscribes to all channels and collects what comes. */
function viewer() {
  const client = new FoxgloveClient({ ws: new WebSocket(url, [FoxgloveClient.SUPPORTED_SUBPROTOCOL]) });
  const seen = { infos: [], times: [], messages: {}, channels: new Map(), topics: new Map(), types: new Map(), client };
  client.on("serverInfo", (info) => seen.infos.push(info));
  client.on("time", ({ timestamp }) => seen.times.push(timestamp));
  client.on("advertise", (channels) => {
    for (const channel of channels) {
      const set = descriptor.FileDescriptorSet.decode(Buffer.from(channel.schema, "base64"));
      seen.types.set(channel.topic, protobuf.Root.fromDescriptor(set).lookupType(channel.schemaName));
      seen.channels.set(channel.topic, channel.id);
      seen.topics.set(client.subscribe(channel.id), channel.topic);
    }
  });
  client.on("message", ({ subscriptionId, timestamp, data }) => {
    const topic = seen.topics.get(subscriptionId);
    assert.ok(topic, "data of no subscription");
    const decoded = seen.types.get(topic).decode(new Uint8Array(data.buffer, data.byteOffset, data.byteLength));
    (seen.messages[topic] ??= []).push({ timestamp, decoded });
  });
  seen.until = async (what, holds) => {
    for (let waited = 0; !holds(); waited += 50) {
      assert.ok(waited < 30000, `waited for ${what}`);
      await new Promise((later) => setTimeout(later, 50));
    }
  };
  return seen;
}

try {
  const first = viewer(); // before there is a run
  const running = run("one", 60);
  await first.until("states", () => (first.messages["/poses"] ?? []).length >= 10);
  assert.equal(first.infos.length, 1);
  assert.deepEqual(first.infos[0].capabilities, ["time"]);
  assert.deepEqual([...first.types.keys()].sort(), ["/counters", "/log", "/poses", "/robots", "/scene"]);
  for (const { decoded } of first.messages["/poses"]) {
    assert.equal(decoded.poses.length, 60);
    for (const { position, orientation } of decoded.poses) {
      assert.ok(Math.hypot(position.x, position.y) < 1.5, "metres");
      assert.ok(Math.abs(Math.hypot(orientation.z, orientation.w) - 1) < 1e-9);
    }
  }
  assert.equal(first.messages["/robots"][0].decoded.data.length, 60 * 16);
  // Stamps are simulated time and go forward.
  const stamps = first.messages["/poses"].map(({ timestamp }) => timestamp);
  for (let i = 1; i < stamps.length; i += 1) assert.ok(stamps[i] > stamps[i - 1]);
  assert.ok(stamps.at(-1) < 100n * 1000000000n);
  assert.ok(first.times.length >= 5);

  // A viewer that comes late sees the arena too.
  const late = viewer();
  await late.until("the arena", () => (late.messages["/scene"] ?? []).length >= 1 && (late.messages["/robots"] ?? []).length >= 2);
  assert.equal(late.messages["/scene"][0].decoded.entities[0].id, "arena");

  // A viewer that breaks the rules is disconnected, and no other one.
  for (const text of ["no json", "[]", '{"op": 1}', '{"op": "subscribe"}', `{"op": "x", "y": "${"z".repeat(100000)}"}`]) {
    const bad = new WebSocket(url, ["foxglove.sdk.v1"]);
    await new Promise((open) => bad.on("open", open));
    bad.on("error", () => {});
    const closed = new Promise((done) => bad.on("close", done));
    bad.send(text);
    await closed;
  }
  // A viewer that sends without end is disconnected; one that never reads delays nobody.
  const flood = new WebSocket(url, ["foxglove.sdk.v1"]);
  await new Promise((open) => flood.on("open", open));
  flood.on("error", () => {});
  const code = new Promise((done) => flood.on("close", done));
  for (let i = 0; i < 20000; i += 1) flood.send('{"op": "unsubscribe", "subscriptionIds": []}');
  assert.ok([1006, 1008].includes(await code), "with a reason, or at once where more was on its way");
  const deaf = new WebSocket(url, ["foxglove.sdk.v1"]);
  await new Promise((open) => deaf.on("open", open));
  deaf.on("error", () => {});
  // Many subscriptions of one channel: some megabytes in a second, more than the sockets of both sides hold.
  const poses = late.channels.get("/poses");
  deaf.send(JSON.stringify({ op: "subscribe", subscriptions: [...Array(100).keys()].map((id) => ({ id, channelId: poses })) }));
  deaf.pause();
  // Its sockets are full when what waits is the same over ten states, which others see.
  let waiting = 0, seenBefore = 0;
  await late.until("states beside a viewer whose sockets are full", () => {
    const now = octetsWaiting(deaf), seen = late.messages["/robots"].length;
    if (now !== waiting) [waiting, seenBefore] = [now, seen];
    return waiting > 0 && seen >= seenBefore + 10;
  });
  console.log(`${waiting} octets wait for the viewer that never reads`);
  deaf.terminate();

  // Host names of other machines are refused, and pages that are not of a viewer, of this machine, or of --origin.
  const admitted = (headers) =>
    new Promise((done) => {
      const socket = new WebSocket(url, ["foxglove.websocket.v1"], { headers });
      socket.on("error", () => done(false));
      socket.on("open", () => done(socket.close() ?? true));
    });
  assert.equal(await admitted({ Host: "example.org" }), false);
  for (const origin of ["https://app.foxglove.dev", "https://lichtblick-suite.github.io", "http://localhost:8080", "file://",
    "https://viewer.example"])
    assert.equal(await admitted({ Origin: origin }), true, origin);
  for (const origin of ["https://example.org", "null", "http://localhost.example.org", "https://app.foxglove.dev.example.org",
    "https://viewer.example:444", `https://${"x".repeat(300)}`])
    assert.equal(await admitted({ Origin: origin }), false, origin);
  const known = first.messages["/poses"].length;
  await first.until("more states", () => first.messages["/poses"].length > known + 3);

  // Another run is another session, with other numbers of channels.
  running.kill("SIGINT");
  await running.ended;
  await first.until("the end", () => (first.messages["/log"] ?? []).some(({ decoded }) => decoded.message.includes("ended")));
  const channels = new Set(first.topics.keys());
  first.messages = {};
  run("two", 7);
  await first.until("the second run", () => first.infos.length === 2 && (first.messages["/poses"] ?? []).length >= 3);
  assert.notEqual(first.infos[0].sessionId, first.infos[1].sessionId);
  assert.equal(first.messages["/poses"].at(-1).decoded.poses.length, 7);
  assert.ok([...first.topics.keys()].some((id) => !channels.has(id)));
  clearTimeout(failed);
  console.log("Foxglove's client sees what it should");
  end(0);
} catch (error) {
  console.error(error);
  end(1);
}
