// node arrow_test.mjs FOLDER NPM: reads FOLDER/t.arrow and FOLDER/long.feather of table_test.cpp by Arrow's own reader. Status 77:
// it is not there.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [folder, npm] = process.argv.slice(2);
let arrow;
try {
  arrow = createRequire(path.resolve(npm, "package.json"))("apache-arrow");
} catch {
  process.exit(77);
}

const table = arrow.tableFromIPC(fs.readFileSync(path.join(folder, "t.arrow")));
assert.deepEqual(table.schema.fields.map((f) => `${f.name}:${f.type}`), [
  "time_s:Float64", "robot:Int64", "hops:Int64", "x_mm:Float64", "state:Utf8",
]);
assert.equal(table.schema.metadata.get("seed"), "7");
assert.equal(table.schema.metadata.get("version"), '1, "two"');
assert.equal(table.schema.fields[3].metadata.get("unit"), "mm");
assert.equal(table.schema.fields[1].metadata.size, 0);
const column = (name) => [...table.getChild(name)];
assert.deepEqual(column("time_s"), [0, 0.032768, 0.065536]);
assert.deepEqual(column("robot"), [0n, 1n, 2n]);
assert.deepEqual(column("hops"), [0n, null, 20n]);
assert.deepEqual(column("x_mm"), [0, -1.25, null].map((x) => (x === 0 ? -0 : x)));
assert.deepEqual(column("state"), ["running", 'a "b", Käfer 🐞', ""]);

// Several batches; the reader of files finds them by the footer.
const long = arrow.tableFromIPC(fs.readFileSync(path.join(folder, "long.feather")));
assert.equal(long.numRows, 150000);
assert.equal(long.batches.length, 3);
const numbers = long.getChild("n");
const words = long.getChild("word");
for (let i = 0; i < 150000; i += 1) {
  assert.equal(numbers.get(i), i % 7 === 0 ? null : BigInt(-i));
  assert.equal(words.get(i), i % 11 === 0 ? null : `${i}\uFFFD`);
}
