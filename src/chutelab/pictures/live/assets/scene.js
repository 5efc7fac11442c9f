// A scene as its file has it, and with all defaults: `resolve`. The same rules as in Python's
// `chutelab.scene`, of which a page needs those about what can be edited. `keys.js` changes keys.
import { conflictsOf, listOf, misfitsOf, straysOf } from "./checks.js";

/** @typedef {[number, number]} Point */
/** @typedef {Record<string, any>} Given keys as a scene file has them */

/**
 * @typedef {object} Rule what a key may hold
 * @property {any} [default] absent where a key has none
 * @property {boolean} [required]
 * @property {string} [unit]
 * @property {number} [low]
 * @property {number} [high]
 * @property {import("./forms.js").Form} form
 */

/**
 * @typedef {object} Lab what Python writes into the page, see `describe.py`
 * @property {Record<string, Record<string, Rule>>} tables rules by table and key
 * @property {Record<string, Record<string, number>>} presets materials by name
 */

/**
 * @typedef {object} Particle
 * @property {string} [name]
 * @property {"disk" | "sphere"} shape
 * @property {number} radius the mean one where they differ
 * @property {Point} [span] the least and the largest radius where they differ
 * @property {number} mass
 * @property {number} [density]
 * @property {string} [material]
 * @property {boolean} spin
 * @property {number} rolling_friction
 * @property {Given} given the keys that were written
 */

/**
 * @typedef {object} Stream
 * @property {string} name
 * @property {string} [particle]
 * @property {number} count
 * @property {number} rate particles per second
 * @property {number} [width]
 * @property {number} start
 * @property {number} bed_height
 * @property {number} speed_spread
 * @property {number | string} seed
 * @property {Point} [at]
 * @property {Point} [to]
 * @property {[Point, Point]} [fill]
 * @property {Point} [velocity]
 * @property {boolean} interact
 * @property {number} restitution
 * @property {number} friction
 * @property {Given} given
 */

/**
 * @typedef {object} Plate
 * @property {string} [name]
 * @property {Point} [pivot]
 * @property {number} distance
 * @property {number} angle_deg
 * @property {number} pivot_height
 * @property {number} above
 * @property {number} [below]
 * @property {number} restitution
 * @property {number} friction
 * @property {Given} given
 */

/**
 * @typedef {object} Surface
 * @property {string} name
 * @property {Point[]} [points] of a straight one
 * @property {Point} [center] of an arc
 * @property {number} radius
 * @property {number} from_deg
 * @property {number} to_deg
 * @property {number} restitution
 * @property {number} friction
 * @property {"steel" | "rubber"} material
 * @property {number} speed
 * @property {number} [opens_at]
 * @property {number} [closes_at]
 * @property {[number, number, number][]} repeat
 * @property {Given} given
 */

/**
 * @typedef {object} Conveyor
 * @property {string} name
 * @property {Point} from
 * @property {Point} to
 * @property {number} pulley_radius
 * @property {number} speed
 * @property {number} restitution
 * @property {number} friction
 * @property {Given} given
 */

/**
 * @typedef {object} Incoming
 * @property {number} speed
 * @property {number} pulley_radius
 * @property {number} length
 * @property {number} incline_deg
 * @property {"adhesion" | number} friction
 * @property {number} restitution
 * @property {Given} given
 */

/**
 * @typedef {object} Outgoing
 * @property {number} speed
 * @property {number} drop
 * @property {"impact" | "top"} drop_from
 * @property {number} start
 * @property {number} length
 * @property {number} restitution
 * @property {number} friction
 * @property {Given} given
 */

/**
 * @typedef {object} Scene all defaults filled in; names as in the file, but for three lists
 * @property {string} title
 * @property {number} gravity
 * @property {Particle[]} particles
 * @property {Map<string, Record<string, number>>} materials numbers by name, presets too
 * @property {{between: [string, string], restitution?: number, friction?: number}[]} pair
 * @property {Incoming | null} incoming
 * @property {Plate[]} plates
 * @property {Outgoing | null} outgoing
 * @property {Conveyor[]} conveyor
 * @property {Surface[]} surface
 * @property {Stream[]} streams
 * @property {{until: "landed" | "settled" | number, max_time: number, dt: number}} run
 * @property {number[]} kinds which of the particles each stream consists of
 * @property {boolean} crowded whether particles meet
 * @property {number} most how many particles a page has room for
 * @property {{from: Point, to: Point} | null} view corners of what is shown
 */

/** What is wrong with a scene. */
export class Fault extends Error {
  /**
   * @param {string} key full path, such as `plate.angle_deg` or `surface[1].radius`
   * @param {unknown} value what was found there; undefined if the key is missing
   * @param {string} text id of a text in the catalogue
   * @param {Record<string, number | string>} words numbers and names for that text
   */
  constructor(key, value, text, words = {}) {
    super(`${key}: ${text} ${JSON.stringify(words)}`);
    this.key = key;
    this.value = value;
    this.text = text;
    this.words = words;
  }
}

/**
 * Fills in all defaults.
 * @param {Given} given
 * @param {Lab} lab
 * @returns {Scene}
 * @throws {Fault} if a value is out of its range, or keys contradict each other
 */
export function resolve(given, lab) {
  for (const wrong of misfitsOf(given, lab)) throw new Fault(...wrong);
  const filled = (/** @type {string} */ table, /** @type {Given} */ row) => {
    /** @type {Given} */
    const values = {};
    for (const [key, rule] of Object.entries(lab.tables[table])) {
      if (rule.default !== undefined) values[key] = rule.default;
    }
    return /** @type {any} */ ({ ...values, ...row, given: row });
  };
  const rows = (/** @type {string} */ table) => {
    return listOf(given[table]).map((row) => filled(table, row));
  };
  // A map, for a name may be one that every object has.
  const materials = new Map(Object.entries(lab.presets));
  for (const { name, ...own } of listOf(given.material)) {
    for (const key of ["restitution", "friction"]) {
      own[`${key}_steel`] ??= own[key];
      own[`${key}_rubber`] ??= own[key];
    }
    materials.set(name, /** @type {Record<string, number>} */ (own));
  }
  const particles = given.particle === undefined ? [filled("particle", {})] : rows("particle");
  const streams = given.stream === undefined ? [filled("stream", {})] : rows("stream");
  const names = particles.map((kind) => kind.name);
  /** @type {number[]} */
  const kinds = streams.map((stream) => {
    return particles.length === 1 || stream.particle === undefined
      ? 0 : names.indexOf(stream.particle);
  });
  for (const wrong of straysOf(given, names, [...materials.keys()])) throw new Fault(...wrong);
  particles.forEach((kind) => fillMass(kind, materials));
  streams.forEach((stream, n) => fillRate(stream, n, particles[kinds[n]]));
  const incoming = given.incoming === undefined ? null : filled("incoming", given.incoming);
  const outgoing = given.outgoing === undefined ? null : filled("outgoing", given.outgoing);
  if (outgoing !== null && incoming !== null) outgoing.speed ??= incoming.speed;
  const plates = rows("plate");
  for (const plate of plates) {
    if (plate.pivot === undefined && incoming !== null) {
      plate.pivot_height ??= incoming.pulley_radius;
    }
  }
  const surface = rows("surface");
  for (const one of surface) {
    if (one.from !== undefined) one.points = [one.from, one.to];
  }
  const run = filled("run", given.run ?? {});
  run.until ??= outgoing === null ? "settled" : "landed";
  const count = streams.reduce((sum, stream) => sum + stream.count, 0);
  /** @type {Scene} */
  const scene = {
    title: given.title ?? lab.tables.scene.title.default,
    gravity: given.gravity ?? lab.tables.scene.gravity.default,
    particles, materials, pair: given.pair ?? [], incoming, plates, outgoing,
    conveyor: rows("conveyor"), surface, streams, run, kinds, view: given.view ?? null,
    crowded: count > 1 && streams.some((stream) => stream.interact),
    most: lab.tables.stream.count.high ?? Infinity,
  };
  for (const wrong of conflictsOf(scene, given)) throw new Fault(...wrong);
  return scene;
}

/**
 * Fills in the mean radius of particles, and the mass that goes with that.
 * @param {any} kind
 * @param {Map<string, Record<string, number>>} materials
 */
function fillMass(kind, materials) {
  let density = kind.density;
  if (density === undefined && kind.material !== undefined && !("mass" in kind.given)) {
    density = materials.get(kind.material)?.density;
  }
  if (Array.isArray(kind.radius)) {
    kind.span = kind.radius;
    kind.radius = 0.5 * (kind.span[0] + kind.span[1]);
  }
  if (density !== undefined) {
    const size = kind.radius;
    kind.mass = density * (4.0 / 3.0 * Math.PI) * (size * size * size);
  }
}

/**
 * Fills in a stream's name, and its rate in particles per second.
 * @param {any} stream
 * @param {number} number
 * @param {Particle} kind
 */
function fillRate(stream, number, kind) {
  stream.name ??= number ? `stream${number + 1}` : "stream";
  if (typeof stream.rate !== "string") return;
  const found = /^ *(\d+\.?\d*(?:[eE][+-]?\d+)?) *t\/h *$/.exec(stream.rate);
  let mass = kind.mass;
  if (kind.span !== undefined) {
    const [low, high] = kind.span;
    const cube = kind.radius * kind.radius * kind.radius;
    mass = kind.mass * 0.25 * (low + high) * (low * low + high * high) / cube;
  }
  stream.rate = Number(found?.[1]) / 3.6 / mass / slices(stream, kind);
}

/**
 * Returns how many slices, each one particle thick, the material of a stream is wide.
 * @param {Stream} stream
 * @param {Particle} kind
 */
export function slices({ width }, kind) {
  return width === undefined ? 1.0 : width / (2.0 * kind.radius);
}

/**
 * Returns restitution and friction of a kind of particles and another kind, or a surface.
 *
 * What a pair says counts first, then what the surface (or a stream of the kind) says, then the
 * material, then the default. Of two kinds that nothing is said of it is the geometric mean of
 * what each has with itself.
 * @param {Scene} scene
 * @param {number} kind
 * @param {number | string} other a kind, or the name of a surface
 * @returns {[number, number]} friction is Infinity with adhesion
 */
export function met(scene, kind, other) {
  const particle = scene.particles[kind];
  /** @type {string | undefined} */
  let partner;
  /** @type {[number, any]} */
  let values;
  if (typeof other === "string") {
    partner = other;
    const { steel, home, belt } = surfaceTable(scene, other);
    values = ownValues(scene, particle, [home], steel ? "_steel" : "_rubber", belt);
  } else if (other === kind) {
    partner = particle.name;
    const own = scene.streams.filter((_, n) => scene.kinds[n] === kind);
    const homes = own.length ? own : [{ restitution: 0.5, friction: 0.3, given: {} }];
    values = ownValues(scene, particle, homes, "", false);
  } else {
    partner = scene.particles[other].name;
    const [a, b] = [met(scene, kind, kind), met(scene, other, other)];
    values = [Math.sqrt(a[0] * b[0]), Math.sqrt(a[1] * b[1])];
  }
  let [restitution, friction] = values;
  for (const pair of scene.pair.slice().reverse()) {
    const [a, b] = pair.between;
    const { name } = particle;
    if ((a === name && b === partner) || (b === name && a === partner)) {
      restitution = pair.restitution ?? restitution;
      friction = pair.friction ?? friction;
    }
  }
  return [restitution, friction === "adhesion" ? Infinity : friction];
}

/**
 * @param {Scene} scene
 * @param {Particle} particle
 * @param {{restitution: number, friction: any, given: Given}[]} homes tables that may say them
 * @param {string} column of the material
 * @param {boolean} grips whether friction is the belt's own matter
 * @returns {[number, any]}
 */
function ownValues(scene, particle, homes, column, grips) {
  const material = particle.material === undefined ? null
    : scene.materials.get(particle.material) ?? null;
  const value = (/** @type {"restitution" | "friction"} */ key) => {
    const said = homes.find((home) => key in home.given);
    const own = said === undefined && !(grips && key === "friction");
    return own && material !== null ? material[key + column] : (said ?? homes[0])[key];
  };
  return [value("restitution"), value("friction")];
}

/**
 * Returns the table that a surface is from, by its name, and what it is made of.
 * @param {Scene} scene
 * @param {string} name
 * @returns {{home: any, steel: boolean, belt: boolean}}
 */
export function surfaceTable(scene, name) {
  if (name === "incoming") return { home: scene.incoming, steel: false, belt: true };
  if (name === "outgoing") return { home: scene.outgoing, steel: false, belt: false };
  const plate = scene.plates.find((one) => (one.pivot ? one.name : "plate") === name);
  if (plate !== undefined) return { home: plate, steel: true, belt: false };
  const conveyor = scene.conveyor.find((one) => one.name === name);
  if (conveyor !== undefined) return { home: conveyor, steel: false, belt: false };
  const surface = scene.surface.find((one) => one.name === name);
  return { home: surface, steel: surface?.material === "steel", belt: false };
}
