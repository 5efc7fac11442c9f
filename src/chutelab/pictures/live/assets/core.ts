// The core in memory, what core/module.py is in Python: `Memory`; and its contact engine, what
// engines/contact.py is: `Core`. A machine goes in, knots and events come out.

type Struct = { size: number, fields: Record<string, [number, string, number]> };
export type Layout = { structs: Record<string, Struct>, enums: Record<string, Record<string,
  number>>, constants: Record<string, number> };
/** Of a run that goes on after a change: spins, rad/s, and who is under way already */
export type Machine = import("./machine.ts").Machine & { spins?: number[], goesOn?: boolean[] };
export type Event = { t: number, x: number, y: number, before: number[], after: number[],
  normal: number, tangent: number, disk: number, other: number, kind: number,
  surface: number };

const PAGE = 65536;

// Friction without a bound, as a number that can be multiplied by zero.
const GREATEST = 1e300;

/** Doubles of a knot: t, x, y, vx, vy, spin, three entries of the ledger; and its disk. */
const KNOT_ROW = 10;

/** Arrays that may become full, and the structs of their rows. */
const GROWING = {
  knot: [["knots", "Knot"]],
  event: [["events", "Event"]],
  contact: [["contacts", "Contact"], ["earlier", "Contact"], ["links", "int2"]],
  near: [["near", "int2"]],
};

const SIZES: Record<string, number> = { double: 8, int: 4, int2: 8 };

/** Compile what a page carries: the core, compressed by zlib. */
async function compiled(wasm: ArrayBuffer) {
  const plain = new Blob([wasm]).stream().pipeThrough(new DecompressionStream("deflate"));
  return WebAssembly.compile(await new Response(plain).arrayBuffer());
}

async function startCore(module: WebAssembly.Module, layout: Layout) {
  return new Core(await WebAssembly.instantiate(module, {}), layout);
}

/** Structs of which the core has one each, and arrays that their fields point to. */
class Memory {
  exports: any;
  base;
  /** Where the structs of the core's subjects are, by their names. */
  subjects: Record<string, number>;
  end;
  bytes = new Uint8Array();
  doubles = new Float64Array();
  ints = new Int32Array();

  constructor(instance: WebAssembly.Instance, readonly layout: Layout) {
    this.exports = instance.exports;
    this.exports._initialize();
    this.base = this.exports.__heap_base.value;
    const { world, plan, drawing, laws } = this.exports;
    this.subjects = { World: world(), Plan: plan(), Drawing: drawing(), Laws: laws() };
    this.end = this.base;
    this.look();
  }

  /** Free all arrays, and reset all structs. */
  forget() {
    this.end = this.base;
    Object.keys(this.subjects).forEach((name) => this.reset(name));
  }

  /** Set all fields of a struct to 0. */
  reset(of: string) {
    this.bytes.fill(0, this.subjects[of], this.subjects[of] + this.layout.structs[of].size);
  }

  /** Look at the memory anew; it moves when it grows. */
  look() {
    const { buffer } = this.exports.memory;
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

  /** Make room for an array of zeros, to which a field points from now on. */
  place(name: string, kind: string, count: number, of = "World") {
    const size = SIZES[kind] ?? this.layout.structs[kind].size;
    const begin = Math.ceil(this.end / 16) * 16;
    this.end = begin + size * Math.max(1, count);
    if (this.end > this.bytes.length) {
      this.exports.memory.grow(Math.ceil((this.end - this.bytes.length) / PAGE));
      this.look();
    }
    this.bytes.fill(0, begin, this.end);
    this.set(name, begin, of);
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

/** One run at a time: `begin` lays a machine out, `proceed` runs on, `take` hands over. */
class Core extends Memory {
  machine: Machine | null = null;

  makeRoom(what: keyof typeof GROWING, room: number) {
    for (const [name, kind] of GROWING[what]) this.place(name, kind, room);
    this.set(`${what}_room`, room);
  }

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

  /** Lay out a machine: the run is at its beginning then. */
  begin(machine: Machine) {
    this.machine = machine;
    this.forget();
    const { interact, releases, rolling } = machine;
    const n = releases.length;
    const rows = surfaceRows(machine, this.layout.enums.Shape);
    const kinds = rolling.length;
    const room = rows.length + machine.arcs.length;
    const gates = rows.filter(({ opens, closes }) => isFinite(opens) || isFinite(closes)).length;
    const buckets = interact ? 1 << (32 - Math.clz32(4 * n + 16)) : 1;
    const cells = interact ? 12 * n + 64 : 1;
    this.place("disks", "Disk", n);
    this.place("tracks", "Track", n);
    this.place("surfaces", "Surface", room);
    this.place("pairs", "Pair", kinds * (kinds + rows.length));
    this.place("books", "double", 3 * (machine.surfaces.length + 1));
    this.place("cells", "Cell", cells);
    this.place("heads", "int", buckets);
    this.place("heap", "int", n);
    this.place("queue", "int", n + 1);
    this.place("moved", "int", n);
    this.place("found", "int", 2 * n);
    this.place("nearby", "int", this.layout.constants.MAX_NEARBY * n);
    this.place("everything", "int", room);
    this.place("ends", "int", 2 * room);
    this.place("spared", "int", 2 * n * gates);
    this.makeRoom("knot", (releases.some(({ carried }) => carried) ? 100 : 30) * n + 200);
    this.makeRoom("event", 40 * n + 1200);
    this.makeRoom("contact", 8 * n + 16);
    this.makeRoom("near", interact ? 16 * n + 16 : 1);
    const numbers = {
      disk_count: n, surface_count: rows.length, kind_count: kinds, material_count: rows.length,
      owner_count: machine.surfaces.length, bucket_count: buckets, cell_room: cells,
      interact: Number(interact),
      until: this.layout.enums.Until[`UNTIL_${machine.until.toUpperCase()}`],
      landing: machine.landing, ride_owner: 0,
      pulley: machine.pulley ? machine.segments.length : -1,
      ride_incline: machine.pulley ? machine.pulley.incline : 0,
      g: machine.gravity, dt: machine.dt, end_time: machine.endTime,
    };
    for (const [name, value] of Object.entries(numbers)) this.set(name, value);
    rows.forEach(({ restitution, friction, ...row }, k) => {
      this.fill("surfaces", "Surface", k, row);
      for (let kind = 0; kind < kinds; kind += 1) {
        this.pair(kind, kinds + k, restitution[kind], friction[kind], rolling[kind]);
      }
    });
    for (let a = 0; a < kinds; a += 1) {
      for (let b = 0; b < kinds; b += 1) {
        const [e, mu] = [machine.pairRestitution[a][b], machine.pairFriction[a][b]];
        this.pair(a, b, e, mu, Math.max(rolling[a], rolling[b]));
      }
    }
    releases.forEach((one, i) => {
      const [left, right, bottom, top] = machine.exitBoxes[i];
      this.fill("disks", "Disk", i, {
        x: one.x, y: one.y, vx: one.vx, vy: one.vy, spin: machine.spins?.[i] ?? 0, release: one.t,
        radius: machine.radius[i], mass: machine.mass[i], inertia: machine.inertia[i],
        kind: one.kind, rides: Number(one.carried), goes_on: Number(machine.goesOn?.[i] ?? false),
        exit_box: [left, bottom, right, top],
      });
    });
    this.exports.prepare();
  }

  pair(kind: number, column: number, restitution: number, friction: number, rolling: number) {
    const columns = this.get("kind_count") + this.get("material_count");
    const row = { restitution, friction: Math.min(friction, GREATEST), rolling };
    this.fill("pairs", "Pair", kind * columns + column, row);
  }

  /** Run on for at most so many steps, make room where it is full. What has been written is in
   * `take`; it has to be taken before the next call. */
  proceed(steps: number): "running" | "done" | "stalled" {
    const { Status } = this.layout.enums;
    const status = this.exports.run(steps);
    // Growing inside the core would move the memory too.
    this.look();
    if (status === Status.DONE) return "done";
    if (status === Status.STALLED) return "stalled";
    if (status === Status.FULL_NEAR) this.makeRoom("near", 2 * this.get("near_room"));
    if (status === Status.FULL_CONTACTS) {
      // Of what was there, only contacts of the step before are needed.
      const size = this.get("earlier_count") * this.layout.structs.Contact.size;
      const earlier = this.bytes.slice(this.get("earlier"), this.get("earlier") + size);
      this.makeRoom("contact", 2 * this.get("contact_room"));
      this.bytes.set(earlier, this.get("earlier"));
    }
    for (const what of ["knot", "event"] as const) {
      const full = status === Status[`FULL_${what.toUpperCase()}S`];
      const room = this.get(`${what}_room`);
      // Taking many of them has made room.
      if (full && this.get(`${what}_count`) <= room / 2) this.grow = { what, room: 2 * room };
    }
    return "running";
  }

  /** Take the knots, `KNOT_ROW` doubles each, and the events that have been written. */
  take(): { knots: Float64Array, events: Event[] } {
    const count = this.get("knot_count");
    const first = this.get("knots") >> 3;
    const knots = this.doubles.slice(first, first + count * KNOT_ROW);
    const { disk } = this.layout.structs.Knot.fields;
    for (let i = 0; i < count; i += 1) {
      knots[i * KNOT_ROW + 9] = this.ints[(this.get("knots") + i * 8 * KNOT_ROW + disk[0]) >> 2];
    }
    const events: Event[] = this.rows("events", "Event", this.get("event_count"));
    this.set("knot_count", 0);
    this.set("event_count", 0);
    if (this.grow) this.makeRoom(this.grow.what as "knot", this.grow.room);
    this.grow = null;
    return { knots, events };
  }

  /** How far those under way have come, as rows of knots; only between steps of a run whose
   * particles meet. Of what lasts in contact it is the latest state with a balance that closes. A
   * knot after a blow, which the core holds back while another may follow, comes before it. */
  tips() {
    const { Disk, Track } = this.layout.structs, { Mode } = this.layout.enums;
    const rows: number[] = [];
    const incline = this.get("ride_incline"), now = this.get("t");
    for (let i = 0; i < this.get("disk_count"); i += 1) {
      const disk = this.get("disks") + i * Disk.size, track = this.get("tracks") + i * Track.size;
      const at = (name: string) => this.doubles[(disk + Disk.fields[name][0]) >> 3];
      const some = (begin: number, many: number) =>
        this.doubles.subarray(begin >> 3, (begin >> 3) + many);
      const mode = this.ints[(disk + Disk.fields.mode[0]) >> 2];
      if (mode === Mode.WAITING || mode === Mode.GONE) continue;
      if (this.ints[(track + Track.fields.held_back[0]) >> 2]) {
        rows.push(...some(track + Track.fields.knot[0], 6),
          ...some(track + Track.fields.blow_entries[0], 3), i);
      }
      if (mode === Mode.FREE && this.ints[(track + Track.fields.lasted[0]) >> 2]) {
        rows.push(...some(track + Track.fields.held[0], 6),
          ...some(track + Track.fields.held_entries[0], 3), i);
        continue;
      }
      let state = ["t", "x", "y", "vx", "vy"].map(at);
      if (mode === Mode.RIDING) {
        const rho = at("ride_rho"), v = at("ride_speed");
        const along = at("ride_x") + v * (now - at("ride_from"));
        const turn = Math.max(along, 0) / rho - incline, [s, c] = [Math.sin(turn), Math.cos(turn)];
        const straight = Math.min(along, 0);
        state = [now, rho * s + straight * c, rho * c - straight * s, v * c, -v * s];
      }
      rows.push(...state, at("spin"), ...some(disk + Disk.fields.entries[0], 3), i);
    }
    return new Float64Array(rows);
  }

  grow: { what: string, room: number } | null = null;

  /** Why each track ended, see enum Reason; only once the run is done. */
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
  const gate = ({ appears, vanishes }: { appears: number, vanishes: number }) => ({
    opens: appears, closes: vanishes,
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

export { Core, KNOT_ROW, Memory, compiled, startCore };
