// Runs the core's contact engine in node: `node contact_in_node.mjs core.wasm layout.json MEMORY OUT`.
//
// MEMORY is what the module's memory holds before the run, OUT what is drained in the same slices,
// knots and events, and at the end the ledger.
import { readFileSync, writeFileSync } from "node:fs";

const [wasm, layout, memory, out] = process.argv.slice(2);
const { enums, structs } = JSON.parse(readFileSync(layout, "utf8"));
const { instance } = await WebAssembly.instantiate(readFileSync(wasm), {});
const core = instance.exports;
core._initialize();
const start = readFileSync(memory);
const pages = Math.ceil(start.length / 65536) - core.memory.buffer.byteLength / 65536;
if (pages > 0) core.memory.grow(pages);
new Uint8Array(core.memory.buffer).set(start);

const world = core.world();
const field = (name) => world + structs.World.fields[name][0];
const view = () => new DataView(core.memory.buffer);
const get = (name) => view().getInt32(field(name), true);
const set = (name, value) => view().setInt32(field(name), value, true);
const bytes = (name, size) => {
  const begin = view().getUint32(field(name), true);
  return Buffer.from(core.memory.buffer.slice(begin, begin + size));
};

const knots = [], events = [];
for (;;) {
  const status = core.run(64);
  knots.push(bytes("knots", get("knot_count") * structs.Knot.size));
  events.push(bytes("events", get("event_count") * structs.Event.size));
  set("knot_count", 0);
  set("event_count", 0);
  if ("drained" in structs.World.fields) set("drained", get("drained") + 1);
  if (status === enums.Status.DONE) break;
  const { PAUSED, FULL } = enums.Status;
  if (status !== PAUSED && status !== FULL) throw new Error(`status ${status}`);
}
const books = bytes("books", 8 * 3 * (get("owner_count") + 1));
writeFileSync(out, Buffer.concat([...knots, ...events, books]));
