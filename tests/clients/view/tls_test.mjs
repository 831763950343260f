// node tls_test.mjs KILOTWIN VIEW NPM SOURCES: the page beyond this machine, with a certificate that the test makes. A connection without
// encryption is refused before anything is served. Status 77: the npm package ws or the program openssl is not there.
import assert from "node:assert/strict";
import { execFileSync, spawnSync } from "node:child_process";
import fs from "node:fs";
import http from "node:http";
import https from "node:https";
import { createRequire } from "node:module";
import os from "node:os";
import path from "node:path";
import { Served, eventually, launchBrowser } from "./browser.mjs";

const [kilotwin, view, npm, sources] = process.argv.slice(2);
const scratch = fs.mkdtempSync(path.join(os.tmpdir(), "kilotwin-tls-"));
process.on("exit", () => fs.rmSync(scratch, { recursive: true, force: true }));
const file = (name) => path.join(scratch, name);
let WebSocket;
try {
  WebSocket = createRequire(path.resolve(npm, "package.json"))("ws");
  execFileSync("openssl", ["version"]);
} catch {
  console.log("skipped: build/npm lacks ws, or there is no openssl; scripts/setup installs both");
  process.exit(77);
}

// An address that other machines reach, where this one has any.
const addresses = Object.values(os.networkInterfaces()).flat();
const host = addresses.find(({ family, internal }) => family === "IPv4" && !internal)?.address ?? "127.0.0.1";
const makeCertificate = (name) =>
  execFileSync("openssl", ["req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes", "-days", "2", "-subj",
    "/CN=kilotwin-test", "-addext", `subjectAltName=IP:${host}`, "-keyout", file(`${name}.key`), "-out", file(`${name}.pem`)],
    { stdio: "ignore" });
makeCertificate("own");
makeCertificate("other");
/** Trusts the test's certificate, also under a false name in the header Host: the server must refuse that. */
const trusting = { ca: fs.readFileSync(file("own.pem")), checkServerIdentity: () => undefined };
const run = file("run");
execFileSync(kilotwin, ["run", path.join(sources, "experiments/disperse.txtpb"), "--robots", "4", "--duration", "2", "--mode", "local",
  "--quiet", "--out", run]);

/** What is refused with status 2, and what its line says. */
function refused(words, expected) {
  const { status, stderr } = spawnSync(view, ["view", run, ...words], { encoding: "utf8", timeout: 30000 });
  assert.equal(status, 2, `${words}: ${stderr}`);
  assert.match(stderr, expected);
  assert.doesNotMatch(stderr, /kilotwin: open/);
}
const tls = (certificate, key) => ["--certificate", file(certificate), "--key", file(key)];
refused(["--listen", "192.0.2.1"], /served with TLS only; give --certificate FILE and --key FILE/);
refused(["--listen", host, "--certificate", file("own.pem")], /--certificate and --key belong together/);
refused(["--listen", "0.0.0.0", ...tls("own.pem", "own.key")], /give the IPv4 address or the name/);
refused(["--listen", host, ...tls("own.key", "own.pem")], /is no PEM file with a CERTIFICATE/);
refused(["--listen", host, ...tls("own.pem", "none.key")], /none\.key: cannot be read/);
refused(["--listen", host, ...tls("own.pem", "other.key")], /the key must be that of the certificate/);

const served = await Served.start([view, "view", run, "--listen", host, ...tls("own.pem", "own.key")], scratch);
process.on("exit", () => served.process.kill("SIGKILL"));
const { origin, hash } = new URL(served.address);
assert.equal(origin, `https://${host}:${served.port}`);
const token = hash.slice("#token=".length);

const get = (client, url, options = {}) =>
  new Promise((done) => client.get(url, options, (answer) => done(answer.resume().statusCode)).on("error", (error) => done(error.code)));
assert.equal(await get(https, `${origin}/`, trusting), 200);
assert.equal(await get(https, `${origin}/`, { ...trusting, headers: { Host: "example.org" } }), 403);
assert.notEqual(await get(http, `http://${host}:${served.port}/`), 200);

/** The answer to "hello", or the error of the handshake. */
const hello = (headers) =>
  new Promise((done) => {
    const socket = new WebSocket(origin.replace("https", "wss"), ["kilotwin-view.1"], { ...trusting, headers });
    socket.on("error", (error) => done(error.message));
    socket.on("open", () => socket.send(JSON.stringify({ do: "hello", token })));
    socket.on("message", (data, binary) => {
      if (binary || JSON.parse(data).type !== "grant") return;
      socket.close();
      done(JSON.parse(data));
    });
  });
assert.deepEqual(await hello({ Origin: origin }), { type: "grant", steer: true });
for (const headers of [{ Origin: "https://example.org" }, { Origin: origin.replace("https", "http") }, { Host: "example.org" }])
  assert.equal(typeof (await hello(headers)), "string", JSON.stringify(headers));

// The page itself, where there is a browser.
const { browser, reason } = await launchBrowser(npm);
if (reason) console.log(`without a browser: ${reason}`);
if (browser) {
  const page = await (await browser.newContext({ ignoreHTTPSErrors: true })).newPage();
  await page.goto(served.address);
  await eventually("connected", async () => (await page.locator("body").getAttribute("data-connection")) === "open");
  await browser.close();
}
assert.equal(await served.stop(), 0);
console.log("other machines are served with TLS, and only so");
process.exit(0);
