// The core in memory, like Python's `chutelab.core`: `Memory`; and its contact engine, like
// engines/contact.py: `Core`. A machine goes in, knots and events come out.

type Struct = { size: number, fields: Record<string, [number, string, number]> };
export type Layout = { structs: Record<string, Struct>, enums: Record<string, Record<string,
  number>>, constants: Record<string, number> };
/** For a run that continues after a change: spins, rad/s, angles of particles, rad, and which are
 * already under way */
export type Machine = import("./machine.ts").Machine & { spins?: number[], angles?: number[],
  goesOn?: boolean[] };
export type Event = { t: number, x: number, y: number, before: number[], after: number[],
  normal: number, tangent: number, disk: number, other: number, kind: number,
  surface: number };

// Stands for unbounded friction; finite, so that it can be multiplied by zero.
const GREATEST = 1e300;

/** Doubles of a knot: t, x, y, vx, vy, spin, three entries of the ledger; its disk; and its
 * angle, of what has corners. */
const KNOT_ROW = 11;

/** Doubles of the totals of all particles at a step: t, kinetic, potential, three entries of the
 * ledger, overlap; energy at the releases; for all springs energy when tied, present energy, loss
 * in dampers and work. */
const TOTAL_ROW = 12;

/** Numbers of a bin of a surface: normal and tangential impulse, the whole in x and y, its moment
 * (N s, N m s), and places times normal impulses (N s m). */
const LOAD_ROW = 7;

/** Compressed bytes from text: 13 bits per two letters, 6 for a single last one, see `_packed` in
 * `live/__init__.py`. Other text gives no valid core, which the engine reports. */
function bytesOf(text: string) {
  const values = Array.from({ length: 128 }, (_, code) =>
    code - 33 - Number(code > 34) - Number(code > 60) - Number(code > 92));
  const letter = (n: number) => values[text.charCodeAt(n) & 127];
  const bytes = new Uint8Array((13 * (text.length >> 1) + 6 * (text.length & 1)) >> 3);
  let held = 0, bits = 0, at = 0;
  for (let n = 0; n < text.length; n += 2) {
    const wide = n + 1 < text.length ? 13 : 6;
    held = (held << wide) | (wide > 6 ? LETTERS * letter(n) + letter(n + 1) : letter(n));
    for (bits += wide; bits >= 8; at += 1) bytes[at] = held >> (bits -= 8);
    held &= (1 << bits) - 1;
  }
  return bytes;
}

/** Letters of packed text. */
const LETTERS = 91;

/** Decompress data of zlib. */
const unpacked = (packed: ArrayBuffer) =>
  new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate")));

/** Compile the core of a page, compressed by zlib. */
async function compiled(wasm: ArrayBuffer) {
  return WebAssembly.compile(await unpacked(wasm).arrayBuffer());
}

async function startCore(module: WebAssembly.Module, layout: Layout) {
  return new Core(await WebAssembly.instantiate(module, {}), layout);
}

/** Structs of which the core has exactly one, and the arrays that their fields point to. */
class Memory {
  exports: any;
  /** Addresses of the structs of the core's parts, by name. */
  subjects: Record<string, number>;
  bytes = new Uint8Array();
  doubles = new Float64Array();
  ints = new Int32Array();

  constructor(instance: WebAssembly.Instance, readonly layout: Layout) {
    this.exports = instance.exports;
    this.exports._initialize();
    const { room, world, plan, drawing, laws, loads } = this.exports;
    this.subjects = {
      Room: room(), World: world(), Plan: plan(), Drawing: drawing(), Laws: laws(),
      Loads: loads(),
    };
    this.look();
  }

  /** Free all arrays, and reset all structs. */
  forget() {
    Object.keys(this.subjects).forEach((name) => this.reset(name));
  }

  /** Call a function that may allocate memory; the views of it are made again. */
  work(name: string, ...numbers: number[]): number {
    const found = this.exports[name](...numbers);
    this.look();
    if (!found) throw new RangeError("The core gets no more memory.");
    return found;
  }

  /** Set all fields of a struct to 0. */
  reset(of: string) {
    this.bytes.fill(0, this.subjects[of], this.subjects[of] + this.layout.structs[of].size);
  }

  /** Get the memory again; it moves when it grows. */
  look() {
    const { buffer } = this.exports.memory;
    if (buffer === this.bytes.buffer) return;
    this.bytes = new Uint8Array(buffer);
    this.doubles = new Float64Array(buffer);
    this.ints = new Int32Array(buffer);
  }

  get(name: string, of = "World") {
    const [offset, type] = this.layout.structs[of].fields[name];
    const at = this.subjects[of] + offset;
    return type === "double" ? this.doubles[at >> 3] : this.ints[at >> 2];
  }

  set(name: string, value: number, of = "World") {
    const [offset, type] = this.layout.structs[of].fields[name];
    const at = this.subjects[of] + offset;
    if (type === "double") this.doubles[at >> 3] = value;
    else this.ints[at >> 2] = value;
  }

  /** Set several fields of a struct. */
  setAll(of: string, values: Record<string, number>) {
    for (const [name, value] of Object.entries(values)) this.set(name, value, of);
  }

  /** The rows of an array, field by field. */
  rows(name: string, struct: string, count: number, of = "World"): any[] {
    const { size, fields } = this.layout.structs[struct];
    return Array.from({ length: count }, (_, row) => {
      const begin = this.get(name, of) + row * size;
      const values = Object.entries(fields).map(([field, [offset, type, many]]) => {
        const array = type === "double" ? this.doubles : this.ints;
        const at = (begin + offset) >> (type === "double" ? 3 : 2);
        return [field, many > 1 ? [...array.subarray(at, at + many)] : array[at]];
      });
      return Object.fromEntries(values);
    });
  }
}

/** One run at a time: `begin` sets up a machine, `proceed` runs on, `take` returns results. */
class Core extends Memory {
  machine: Machine | null = null;
  /** Number of states of hinges taken. */
  swung = 0;
  /** Number of bins of loads taken. */
  borne = 0;

  /** Fill in fields of one row of an array. */
  fill(name: string, struct: string, row: number, values: Record<string, number | number[]>,
    of = "World") {
    const { size, fields } = this.layout.structs[struct];
    const begin = this.get(name, of) + row * size;
    for (const [key, value] of Object.entries(values)) {
      const [offset, type] = fields[key];
      if (typeof value !== "number") this.doubles.set(value, (begin + offset) >> 3);
      else if (type === "double") this.doubles[(begin + offset) >> 3] = value;
      else this.ints[(begin + offset) >> 2] = value;
    }
  }

  /** Set up a machine, at the beginning of its run. */
  begin(machine: Machine) {
    this.machine = machine;
    this.swung = this.borne = 0;
    this.forget();
    const { releases, rolling, falls, pulley, outlines } = machine, kinds = rolling.length;
    const firsts = outlines.map((_, n) => outlines.slice(0, n).flat().length);
    const rows = surfaceRows(machine, this.layout.enums.Shape);
    this.setAll("World", {
      disk_count: releases.length, surface_count: rows.length, kind_count: kinds,
      owner_count: machine.surfaces.length, interact: Number(machine.interact),
      mover_count: machine.movers.length, trigger_count: machine.triggers.length,
      joint_count: machine.joints.length, outline_count: outlines.flat().length,
      until: this.layout.enums.Until[`UNTIL_${machine.until.toUpperCase()}`],
      landing: machine.landing, ride_owner: 0, pulley: pulley ? machine.segments.length : -1,
      ride_incline: pulley ? pulley.incline : 0, g: machine.gravity,
      tilt: machine.tilt, air: machine.air,
      dt: machine.dt, chosen: machine.chosen, end_time: machine.endTime,
    });
    this.work("lay_out_world");
    this.doubles.set(outlines.flat(2), this.get("outlines") >> 3);
    machine.movers.forEach((mover, k) => this.fill("movers", "Mover", k, mover));
    machine.joints.forEach(({ kind, from, ...joint }, k) => this.fill("joints", "Joint", k,
      { ...joint, kind: this.layout.enums.Tie[kind.toUpperCase()], from: from ?? [NaN, NaN] }));
    const { GOES, COMES, STARTS } = this.layout.enums.Doing;
    machine.triggers.forEach(({ surface, doing, by }, k) => this.fill("triggers", "Trigger", k,
      { surface, doing: { opens: GOES, closes: COMES, starts: STARTS }[doing], by }));
    rows.forEach(({ restitution, friction, ...row }, k) => {
      this.fill("surfaces", "Surface", k, row);
      for (let kind = 0; kind < kinds; kind += 1) {
        this.pair(
          kind, kinds + k, restitution[kind], friction[kind], rolling[kind], falls[kind],
          machine.cohesion[kind][kinds + row.owner],
        );
      }
    });
    for (let a = 0; a < kinds; a += 1) {
      for (let b = 0; b < kinds; b += 1) {
        const [e, mu] = [machine.pairRestitution[a][b], machine.pairFriction[a][b]];
        this.pair(
          a, b, e, mu, Math.max(rolling[a], rolling[b]), Math.max(falls[a], falls[b]),
          machine.cohesion[a][b],
        );
      }
    }
    releases.forEach((one, i) => {
      this.fill("disks", "Disk", i, {
        x: one.x, y: one.y, vx: one.vx, vy: one.vy,
        spin: machine.spins?.[i] ?? one.omega, release: one.t,
        radius: machine.radius[i], mass: machine.mass[i], inertia: machine.inertia[i],
        kind: one.kind, rides: Number(one.carried), goes_on: Number(machine.goesOn?.[i] ?? false),
        exit_box: one.exitBox, turned: machine.angles?.[i] ?? one.angle,
        corners: outlines[one.kind].length, outline: firsts[one.kind],
      });
    });
    this.work("prepare");
    this.set("every", machine.loads, "Loads");
    if (machine.loads) this.work("lay_out_bins", machine.surfaces.length);
  }

  pair(
    kind: number, column: number, restitution: number, friction: number, rolling: number,
    falls: number, cohesion: number,
  ) {
    const columns = this.get("kind_count") + this.get("material_count");
    const row = { restitution, friction: Math.min(friction, GREATEST), rolling, falls, cohesion };
    this.fill("pairs", "Pair", kind * columns + column, row);
  }

  /** Run on for at most so many steps. The results have to be taken by `take` before the next call.
   */
  proceed(steps: number): "running" | "done" | "stalled" {
    const { Status } = this.layout.enums, status = this.exports.run(steps);
    this.look();
    if (status === Status.LACKING) throw new RangeError("The core gets no more memory.");
    return status === Status.DONE ? "done" : status === Status.STALLED ? "stalled" : "running";
  }

  /** Take the knots, `KNOT_ROW` doubles each, and the events that have been written. */
  take(): { knots: Float64Array, events: Event[], swings: number[], totals: Float64Array } {
    const count = this.get("knot_count");
    const first = this.get("knots") >> 3;
    const knots = this.doubles.slice(first, first + count * KNOT_ROW);
    const { disk } = this.layout.structs.Knot.fields;
    for (let i = 0; i < count; i += 1) {
      knots[i * KNOT_ROW + 9] = this.ints[(this.get("knots") + i * 8 * KNOT_ROW + disk[0]) >> 2];
    }
    const events: Event[] = this.rows("events", "Event", this.get("event_count"));
    const sums = this.machine?.interact ? this.get("total_count") * TOTAL_ROW : 0;
    const begin = this.get("totals") >> 3, totals = this.doubles.slice(begin, begin + sums);
    this.set("knot_count", 0);
    this.set("event_count", 0);
    this.set("total_count", 0);
    return { knots, events, swings: this.takeSwings(), totals };
  }

  /** States of hinges not taken so far, `SWING_ROW` numbers each; the core keeps all. */
  takeSwings(): number[] {
    const count = this.get("swing_count"), begin = this.get("swings"), rows: number[] = [];
    const { size, fields } = this.layout.structs.Swing;
    for (; this.swung < count; this.swung += 1) {
      const at = begin + this.swung * size, work = (this.get("swing_work") >> 3) + 3 * this.swung;
      rows.push(...this.doubles.subarray(at >> 3, (at >> 3) + 3),
        ...this.doubles.subarray(work, work + 3), this.ints[(at + fields.surface[0]) >> 2]);
    }
    return rows;
  }

  /** Times at which triggers acted, s; Infinity for those that did not. */
  triggered(): number[] {
    return this.rows("triggers", "Trigger", this.get("trigger_count")).map(({ t }) => t);
  }

  /** Loads of surfaces, `LOAD_ROW` numbers each, from a bin on: the latest, or at the end all,
   * since loads of sleeping particles are added when they wake. */
  takeLoads(over: boolean): { from: number, rows: Float64Array } {
    const used = this.get("used", "Loads"), wide = this.get("owner_count", "Loads") * LOAD_ROW;
    const { interact, dt, loads } = this.machine as Machine;
    const late = loads ? Math.ceil((4 * dt) / loads) + 2 : 0;
    const from = over || !interact ? 0 : Math.max(0, this.borne - late);
    const begin = this.get("bins", "Loads") >> 3;
    this.borne = used;
    return { from, rows: this.doubles.slice(begin + from * wide, begin + used * wide) };
  }

  /** The present states of particles under way, as rows of knots; only between steps of a run whose
   * particles meet. In lasting contact it is the latest state with a closed balance. It is preceded
   * by the latest state that may become a knot, and for an impact also by the state before it. */
  tips() {
    const { Disk, Track } = this.layout.structs, { Mode } = this.layout.enums;
    const { WAITS } = this.layout.constants;
    const rows: number[] = [];
    const incline = this.get("ride_incline"), now = this.get("t");
    for (let i = 0; i < this.get("disk_count"); i += 1) {
      const disk = this.get("disks") + i * Disk.size, track = this.get("tracks") + i * Track.size;
      const at = (name: string) => this.doubles[(disk + Disk.fields[name][0]) >> 3];
      const some = (begin: number, many: number) =>
        this.doubles.subarray(begin >> 3, (begin >> 3) + many);
      const mode = this.ints[(disk + Disk.fields.mode[0]) >> 2];
      if (mode === Mode.WAITING || mode === Mode.GONE) continue;
      const waits = this.ints[(track + Track.fields.waits[0]) >> 2];
      const wait = (n: number) => this.get("waits") + (i * WAITS + n) * 8 * KNOT_ROW;
      for (let n = Math.max(0, waits - 2); n < waits; n += 1) {
        const isLatest = this.doubles[wait(n) >> 3] === this.doubles[wait(waits - 1) >> 3];
        if (isLatest) rows.push(...some(wait(n), 9), i, this.doubles[(wait(n) >> 3) + 10]);
      }
      if (mode === Mode.FREE && this.ints[(track + Track.fields.lasted[0]) >> 2]) continue;
      let state = ["t", "x", "y", "vx", "vy"].map(at);
      if (mode === Mode.RIDING) {
        const rho = at("ride_rho"), v = at("ride_speed");
        const along = at("ride_x") + v * (now - at("ride_from"));
        const turn = Math.max(along, 0) / rho - incline, [s, c] = [Math.sin(turn), Math.cos(turn)];
        const straight = Math.min(along, 0);
        state = [now, rho * s + straight * c, rho * c - straight * s, v * c, -v * s];
      }
      rows.push(...state, at("spin"), ...some(disk + Disk.fields.entries[0], 3), i,
        at("turned"));
    }
    return new Float64Array(rows);
  }

  /** The reason of each track's end, see enum Reason; only after the run. */
  reasons() {
    const { size, fields } = this.layout.structs.Disk;
    return Array.from({ length: this.get("disk_count") }, (_, i) =>
      this.ints[(this.get("disks") + i * size + fields.reason[0]) >> 2]);
  }

  /** Belt work, restitution and friction loss by surface, J; the last row is the disks' own. */
  books() {
    const first = this.get("books") >> 3;
    return Array.from({ length: this.get("owner_count") + 1 }, (_, row) =>
      [...this.doubles.subarray(first + 3 * row, first + 3 * row + 3)]);
  }
}

/** All surfaces as rows of the core: segments, the pulley, arcs. */
function surfaceRows({ segments, arcs, pulley }: Machine, shapes: Record<string, number>) {
  const gate = (piece: { appears: number, vanishes: number, one_sided: number }) => ({
    opens: piece.appears, closes: piece.vanishes, one_sided: piece.one_sided,
  });
  const flat = segments.map((s) => ({
    shape: shapes.SEGMENT, x: s.x, y: s.y, tx: s.tx, ty: s.ty, length: s.length, speed: s.speed,
    owner: s.surface, ...gate(s), restitution: s.restitution, friction: s.friction,
  }));
  const wheels = (pulley ? [pulley] : []).map((wheel) => ({
    shape: shapes.CIRCLE, x: 0, y: 0, radius: wheel.radius, speed: wheel.speed,
    owner: wheel.surface, opens: -Infinity, closes: Infinity, restitution: wheel.restitution,
    friction: wheel.friction,
  }));
  const bent = arcs.map((arc) => ({
    shape: shapes.ARC, x: arc.x, y: arc.y, radius: arc.radius, begin: arc.begin,
    extent: arc.extent, speed: arc.speed, owner: arc.surface, ...gate(arc),
    restitution: arc.restitution, friction: arc.friction,
  }));
  return [...flat, ...wheels, ...bent];
}

export { Core, KNOT_ROW, LOAD_ROW, Memory, TOTAL_ROW, bytesOf, compiled, startCore, unpacked };
