// node pogosim_test.mjs FEATHER CSV NPM: Arrow's own reader finds in a table of `kilotwin export --pogosim` the columns that pogosim
// writes, with their types, and the values of the same table as CSV. Status 77: the reader is not there.
import assert from "node:assert/strict";
import fs from "node:fs";
import { createRequire } from "node:module";
import path from "node:path";

const [feather, csv, npm] = process.argv.slice(2);
let arrow;
try {
  arrow = createRequire(path.resolve(npm, "package.json"))("apache-arrow");
} catch {
  process.exit(77);
}

const table = arrow.tableFromIPC(fs.readFileSync(feather));
assert.deepEqual(table.schema.fields.map((field) => `${field.name}:${field.type}`), [
  "time:Float64", "robot_category:Utf8", "robot_id:Int64", "x:Float64", "y:Float64", "angle:Float64",
  "pogobot_ticks:Int64",
]);
const [header, ...rows] = fs.readFileSync(csv, "utf8").trim().split("\n").map((line) => line.trim().split(","));
assert.equal(table.numRows, rows.length);
assert.ok(rows.length > 2);
header.forEach((name, column) => {
  const values = table.getChild(name);
  rows.forEach((row, i) => {
    if (name === "robot_category") assert.equal(values.get(i), row[column]);
    else assert.ok(Math.abs(Number(values.get(i)) - Number(row[column])) < 1e-4, `${name} ${i}`);
  });
});
