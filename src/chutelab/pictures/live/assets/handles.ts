// Handles: their place, the keys of the scene that they change, and their range.

import { particlesAt } from "./edit.ts";
import type { Machine } from "./machine.ts";
import { namesOfJoints } from "./joints.ts";
import { ruleOf, type Joint, type Moves, type Point, type Scene } from "./scene.ts";

/** A number of the scene; `part` is its index in a point */
type Axis = { key: string, part?: number, value: number, unit: string, step: number,
  low: number, high: number };
/** `what` is a word of the catalogue; `drag` gives the axes' values for a place in the world, from
 * which `values` computes those of the scene if the axes are not its keys. A tool's handle takes
 * them by `change`, and may show more than its values. A handle of a `whole` body has the axes of
 * all its places. `fixed` is the point from which its angle is measured. */
export type Handle = { id: string, surface: string, what: string,
  shape: "point" | "end" | "turn" | "arrow",
  x: number, y: number, from?: [number, number], axes: Axis[],
  drag: (x: number, y: number) => number[], change?: (numbers: number[]) => void,
  values?: (numbers: number[]) => Record<string, unknown>,
  says?: string, whole?: boolean, fixed?: [number, number], places?: [number, number][] };

/** Length of an arrow per speed, m per m/s. */
const ARROW = 0.08;

/** Place of the outgoing belt's handle, m beyond the plate. */
const AHEAD_OF_PLATE = 0.1;

const DEGREE = Math.PI / 180;

/** Share of the distance of a turning handle: a particle this close is meant. */
const NEAR = 0.5;

/** Steps of arrow keys by unit. */
const STEPS: Record<string, number> = { m: 0.01, degrees: 1, "m/s": 0.1 };

class Handles {
  list: Handle[] = [];

  /** @param lab the page's data
   * @param away distance of a turning handle beyond its end, m
   * @param hasRoom whether the picture has room for a handle at a place, m */
  constructor(
    readonly scene: Scene, readonly machine: Machine, readonly lab: any, readonly away = 0,
    readonly hasRoom = (_x: number, _y: number) => true,
  ) {
    this.belts();
    this.plates();
    scene.conveyor.forEach((_, n) => this.conveyor(n));
    scene.surface.forEach((_, n) => this.surface(n));
    scene.streams.forEach((_, n) => this.stream(n));
    scene.sensor.forEach((_, n) => this.sensor(n));
    const names = namesOfJoints(machine);
    scene.joints.forEach((joint, n) => this.joint(joint, names[n]));
  }

  axis(key: string, value: number, unit: string, part?: number) {
    const plain = key.replace(/\[\d+\]/, "");
    const rule = ruleOf(this.lab.tables, plain);
    const [low, high] = this.lab.live?.ranges?.[key] ?? this.lab.live?.ranges?.[plain]
      ?? [rule?.low ?? -Infinity, rule?.high ?? Infinity];
    return { key, part, value, unit, step: STEPS[unit], low, high };
  }

  /** A point of the scene. */
  place(key: string, [x, y]: [number, number]) {
    return [this.axis(key, x, "m", 0), this.axis(key, y, "m", 1)];
  }

  add(
    id: string, surface: string, what: string, shape: Handle["shape"], at: [number, number],
    axes: Axis[], drag: Handle["drag"], from?: [number, number], fixed?: [number, number],
  ) {
    this.list.push({ id, surface, what, shape, x: at[0], y: at[1], axes, drag, from, fixed });
  }

  /** A handle beyond an end, or before it if the picture ends there, that turns everything about a
   * point.
   * @param now degrees
   * @param values of the scene, for an angle */
  turning(
    surface: string, [cx, cy]: [number, number], end: [number, number], now: number,
    key: string, values: (angle: number) => Record<string, unknown>,
  ) {
    const far = Math.hypot(end[0] - cx, end[1] - cy);
    if (!far || !this.away) return;
    const [ux, uy] = [(end[0] - cx) / far, (end[1] - cy) / far];
    const base = Math.atan2(uy, ux) / DEGREE;
    const bounds = this.axis(key, now, "degrees");
    const ahead = ([1, -1] as const).map((side) => side * this.away);
    const off = ahead.find((one) => far + one > this.away
      && this.hasRoom(end[0] + one * ux, end[1] + one * uy)) ?? this.away;
    this.list.push({
      id: `turn-${surface}`, surface, what: "turn", shape: "turn", from: end,
      x: end[0] + off * ux, y: end[1] + off * uy, axes: [bounds],
      drag: (x, y) => {
        const turned = Math.atan2(y - cy, x - cx) / DEGREE - base;
        return [now + turned - 360 * Math.round(turned / 360)];
      },
      values: ([angle]) => values(angle),
    });
  }

  /** Turn a body by its points about their middle.
   * @param points m, by their keys */
  spin(surface: string, points: [string, [number, number]][]) {
    const middle = [0, 1].map((part) =>
      points.reduce((sum, [, point]) => sum + point[part] / points.length, 0)) as [number, number];
    const end = points[points.length - 1][1], [x, y] = middle;
    const now = Math.atan2(end[1] - points[0][1][1], end[0] - points[0][1][0]) / DEGREE;
    this.turning(surface, middle, end, now, points[0][0], (angle) => {
      const [c, s] = [Math.cos((angle - now) * DEGREE), Math.sin((angle - now) * DEGREE)];
      return Object.fromEntries(points.map(([key, [px, py]]) => [key, [
        x + c * (px - x) - s * (py - y), y + s * (px - x) + c * (py - y),
      ].map((value) => Number(value.toFixed(9)))]));
    });
  }

  /** A speed as an arrow along a direction. */
  arrow(key: string, surface: string, at: [number, number], way: [number, number], speed: number) {
    const tip: [number, number] = [
      at[0] + ARROW * speed * way[0], at[1] + ARROW * speed * way[1],
    ];
    this.add(key, surface, "speed", "arrow", tip, [this.axis(key, speed, "m/s")], (x, y) =>
      [((x - at[0]) * way[0] + (y - at[1]) * way[1]) / ARROW], at);
  }

  belts() {
    const { incoming, outgoing } = this.scene;
    if (!incoming) return;
    const { pulley_radius: radius, length, incline_deg: incline } = incoming;
    const [s, c] = [Math.sin(incline * DEGREE), Math.cos(incline * DEGREE)];
    const end: [number, number] = [-radius * s, radius * c];
    this.add("incoming.pulley_radius", "incoming", "radius", "point", [0, -radius],
      [this.axis("incoming.pulley_radius", radius, "m")], (x, y) => [Math.hypot(x, y)]);
    this.add("incoming.length", "incoming", "begin", "point",
      [end[0] - length * c, end[1] - length * s],
      [this.axis("incoming.length", length, "m"),
        this.axis("incoming.incline_deg", incline, "degrees")],
      (x, y) => {
        // The tangent from the place to the pulley.
        const far = Math.hypot(x, y);
        if (far <= radius) return [length, incline];
        const turn = Math.atan2(y, -x) - Math.asin(radius / far);
        return [Math.sqrt(far * far - radius * radius), -turn / DEGREE];
      });
    const at = Math.min(0.5 * length, 0.25);
    this.arrow("incoming.speed", "incoming",
      [end[0] - at * c - 0.03 * s, end[1] - at * s + 0.03 * c], [c, s], incoming.speed);
    if (!outgoing) return;
    const top = radius - outgoing.drop, last = outgoing.start + outgoing.length;
    // Ahead of the plate, inside the picture, as the belt may be long.
    const plate = this.scene.plates.find(({ pivot }) => !pivot);
    const ahead = radius + (plate ? plate.distance + AHEAD_OF_PLATE : 0);
    const middle = Math.min(Math.max(ahead, outgoing.start), last);
    this.add("outgoing.drop", "outgoing", "height", "point", [middle, top],
      [this.axis("outgoing.drop", outgoing.drop, "m")], (_, y) => [radius - y]);
    this.add("outgoing.start", "outgoing", "begin", "point", [outgoing.start, top],
      [this.axis("outgoing.start", outgoing.start, "m"),
        { ...this.axis("outgoing.length", outgoing.length, "m"), step: 0 }],
      (x) => [Math.min(x, last - 0.01), last - Math.min(x, last - 0.01)]);
    this.add("outgoing.length", "outgoing", "end", "point", [last, top],
      [this.axis("outgoing.length", outgoing.length, "m")], (x) => [x - outgoing.start]);
    this.arrow("outgoing.speed", "outgoing", [middle, top - 0.05], [1, 0], outgoing.speed);
  }

  plates() {
    const { plates, incoming } = this.scene;
    plates.forEach((plate, n) => {
      const table = plates.length > 1 ? `plate[${n}]` : "plate";
      const name = (plate.pivot && plate.name) || "plate";
      const front = incoming ? incoming.pulley_radius : 0;
      const [x, y] = plate.pivot ?? [front + plate.distance, plate.pivot_height];
      const angle = plate.angle_deg * DEGREE;
      const up: [number, number] = [-Math.sin(angle), Math.cos(angle)];
      const { segments, surfaces } = this.machine;
      const own = segments.find(({ surface }) => surfaces[surface] === name);
      const below = own ? own.length - plate.above : plate.below ?? 0.5;
      this.add(`${table}.pivot`, name, "pivot", "point", [x, y], plate.pivot
        ? this.place(`${table}.pivot`, [x, y])
        : [this.axis(`${table}.distance`, plate.distance, "m"),
          this.axis(`${table}.pivot_height`, y, "m")],
      (px, py) => [plate.pivot ? px : px - front, py]);
      const turned: (px: number, py: number, side: number) => number[] = (px, py, side) => [
        Math.atan2(-side * (px - x), side * (py - y)) / DEGREE, Math.hypot(px - x, py - y),
      ];
      this.add(`${table}.angle_deg`, name, "angle", "end",
        [x + plate.above * up[0], y + plate.above * up[1]],
        [this.axis(`${table}.angle_deg`, plate.angle_deg, "degrees"),
          this.axis(`${table}.above`, plate.above, "m")], (px, py) => turned(px, py, 1));
      this.add(`${table}.below`, name, "end", "end", [x - below * up[0], y - below * up[1]],
        [this.axis(`${table}.angle_deg`, plate.angle_deg, "degrees"),
          this.axis(`${table}.below`, below, "m")], (px, py) => turned(px, py, -1));
      this.turning(name, [x, y], [x - below * up[0], y - below * up[1]], plate.angle_deg,
        `${table}.angle_deg`, (value) => ({ [`${table}.angle_deg`]: value }));
      this.motion({ ...plate, pivot: undefined }, table, name);
    });
  }

  /** Places that belong to a motion. */
  motion({ pivot, hinge, travel }: { pivot?: Point } & Moves, table: string, name: string) {
    const places: [string, string, Point | "pivot" | undefined][] = [
      ["hinge", "hinge", hinge], ["travel.to", "goal", travel?.to],
      ["pivot", "pivot", table.startsWith("surface") ? pivot : undefined]];
    for (const [key, what, at] of places) {
      if (!Array.isArray(at)) continue;
      this.add(`${table}.${key}`, name, what, "point", at, this.place(`${table}.${key}`, at),
        (x, y) => [x, y]);
    }
  }

  conveyor(n: number) {
    const belt = this.scene.conveyor[n], table = `conveyor[${n}]`, r = belt.pulley_radius;
    const [[x0, y0], [x1, y1]] = [belt.from, belt.to];
    this.add(`${table}.from`, belt.name, "begin", "point", belt.from,
      this.place(`${table}.from`, belt.from), (x, y) => [x, y], undefined, belt.to);
    this.add(`${table}.to`, belt.name, "end", "point", belt.to,
      this.place(`${table}.to`, belt.to), (x, y) => [x, y], undefined, belt.from);
    this.spin(belt.name, [[`${table}.from`, belt.from], [`${table}.to`, belt.to]]);
    this.add(`${table}.pulley_radius`, belt.name, "radius", "point", [x0, y0 - r],
      [this.axis(`${table}.pulley_radius`, r, "m")], (x, y) => [Math.hypot(x - x0, y - y0)]);
    const way = Math.hypot(x1 - x0, y1 - y0), [dx, dy] = [(x1 - x0) / way, (y1 - y0) / way];
    const side = dx >= 0 ? 1 : -1;
    this.arrow(`${table}.speed`, belt.name, [0.5 * (x0 + x1) - side * dy * (r + 0.03),
      0.5 * (y0 + y1) + side * dx * (r + 0.03)], [dx, dy], belt.speed);
  }

  surface(n: number) {
    const row = this.scene.surface[n], table = `surface[${n}]`;
    this.motion(row, table, row.name);
    if (row.center) {
      const [x, y] = row.center, radius = row.radius;
      const at = (degrees: number) => [
        x + radius * Math.cos(degrees * DEGREE), y + radius * Math.sin(degrees * DEGREE),
      ] as [number, number];
      const whole = Math.abs(row.to_deg - row.from_deg) >= 360;
      this.add(`${table}.center`, row.name, "center", "point", row.center,
        this.place(`${table}.center`, row.center), (px, py) => [px, py]);
      const middle = at(0.5 * (row.from_deg + row.to_deg));
      this.add(`${table}.radius`, row.name, "radius", "point", middle,
        [this.axis(`${table}.radius`, radius, "m")], (px, py) => [Math.hypot(px - x, py - y)]);
      for (const [key, what, degrees] of whole ? [] : ([
        ["from_deg", "begin", row.from_deg], ["to_deg", "end", row.to_deg],
      ] as [string, string, number][])) {
        this.add(`${table}.${key}`, row.name, what, "end", at(degrees),
          [this.axis(`${table}.${key}`, degrees, "degrees")], (px, py) => {
            const angle = Math.atan2(py - y, px - x) / DEGREE;
            return [angle + 360 * Math.round((degrees - angle) / 360)];
          });
      }
      if (!whole) {
        const { from_deg: begin, to_deg: end } = row, mean = 0.5 * (begin + end);
        this.turning(row.name, [x, y], middle, mean, `${table}.from_deg`, (angle) => {
          const by = angle - mean, fit = by > 0 ? -360 : 360;
          // Angles go up to one turn either way.
          const out = [begin + by, end + by].some((one) => Math.abs(one) > 360) ? fit : 0;
          return { [`${table}.from_deg`]: begin + by + out, [`${table}.to_deg`]: end + by + out };
        });
      }
      return;
    }
    const keys = row.given.from ? ["from", "to"] : null;
    const { points = [] } = row;
    const key = (i: number) => (keys ? `${table}.${keys[i]}` : `${table}.points[${i}]`);
    points.forEach((point, i) => {
      const what = i === 0 ? "begin" : i === points.length - 1 ? "end" : "corner";
      this.add(key(i), row.name, what, "point", point, this.place(key(i), point),
        (x, y) => [x, y], undefined, points[i ? i - 1 : 1]);
    });
    this.spin(row.name, points.map((point, i) => [key(i), point]));
    if (row.speed) {
      const [[x0, y0], [x1, y1]] = points;
      const way = Math.hypot(x1 - x0, y1 - y0);
      this.arrow(`${table}.speed`, row.name, [0.5 * (x0 + x1), 0.5 * (y0 + y1)],
        [(x1 - x0) / way, (y1 - y0) / way], row.speed);
    }
  }

  sensor(n: number) {
    const { name, from, to } = this.scene.sensor[n], table = `sensor[${n}]`;
    const keys = [`${table}.from`, `${table}.to`];
    this.add(keys[0], name, "begin", "point", from, this.place(keys[0], from), (x, y) => [x, y],
      undefined, to);
    this.add(keys[1], name, "end", "point", to, this.place(keys[1], to), (x, y) => [x, y],
      undefined, from);
    this.spin(name, [[keys[0], from], [keys[1], to]]);
  }

  /** The ends of a joint: at another particle, or at a place. */
  joint({ kind, from, over, particle, other }: Joint, name: string) {
    const { releases, radius } = this.machine, row = Number(name.split(" ")[1]) - 1;
    const table = `${kind}[${row}]`, own = releases[particle], far = releases[other ?? -1];
    const nearest = (x: number, y: number, not?: number) =>
      particlesAt(this.machine, [x, y], NEAR * this.away).find((i) => i !== not);
    const begin: Point = from ?? [far.x, far.y];
    if (over) {
      this.add(`${table}.over`, name, "pulley", "point", over, this.place(`${table}.over`, over),
        (x, y) => [x, y]);
    }
    else this.list.push({
      id: `${table}.from`, surface: name, what: from ? "anchor" : "tied", shape: "point",
      x: begin[0], y: begin[1], axes: this.place(`${table}.from`, begin), drag: (x, y) => [x, y],
      values: kind === "pin" ? undefined : ([x, y]) => {
        const found = nearest(x, y, particle);
        return { [`${table}.from`]: found === undefined ? [x, y] : undefined,
          [`${table}.other`]: found };
      },
    });
    const most = radius.length - 1;
    if (most) {
      this.list.push({
        id: `${table}.particle`, surface: name, what: "particle", shape: "end", x: own.x, y: own.y,
        axes: [{ key: `${table}.particle`, value: particle, unit: "", step: 1, low: 0, high: most }],
        drag: (x, y) => [nearest(x, y, other) ?? particle],
      });
    }
  }

  stream(n: number) {
    const { streams } = this.scene, stream = streams[n];
    const table = streams.length > 1 ? `stream[${n}]` : "stream";
    stream.fill?.forEach((corner, i) => {
      const key = `${table}.fill[${i}]`;
      this.add(key, stream.name, i ? "end" : "begin", "point", corner, this.place(key, corner),
        (x, y) => [x, y]);
    });
    if (!stream.at) return;
    this.add(`${table}.at`, stream.name, "release", "point", stream.at,
      this.place(`${table}.at`, stream.at), (x, y) => [x, y]);
    const { velocity, to } = stream;
    if (to) {
      this.add(`${table}.to`, stream.name, "end", "point", to, this.place(`${table}.to`, to),
        (x, y) => [x, y], undefined, stream.at);
    }
    if (!velocity) return;
    // Beside the ball, which can itself be grabbed, also for a ball released at rest.
    const [x, y] = [stream.at[0] + this.away, stream.at[1]], [vx, vy] = velocity;
    this.add(`${table}.velocity`, stream.name, "velocity", "arrow",
      [x + ARROW * vx, y + ARROW * vy], [0, 1].map((part) =>
        this.axis(`${table}.velocity`, velocity[part], "m/s", part)),
      (px, py) => [(px - x) / ARROW, (py - y) / ARROW], stream.at);
  }
}

/** Words of handles that place a body. */
const PLACES = ["pivot", "center", "height", "release", "hinge", "goal", "anchor"], ENDS = ["begin", "end", "corner"];

/** Whether a handle is a body's own place. */
const isPlace = ({ id, what, axes }: Handle) => PLACES.includes(what)
  || (ENDS.includes(what) && axes.every(({ part }) => part !== undefined)
    && /^(surface|conveyor|stream|sensor)/.test(id));

/** A handle that moves whole bodies, grabbed at a point, m; null if none has its own place. */
function bodyOf(handles: Handle[], names: string[], x: number, y: number): Handle | null {
  const own = handles.filter((one) => names.includes(one.surface) && isPlace(one));
  if (!own.length) return null;
  return {
    ...own[0], values: undefined, id: `body-${names[0]}`, x, y,
    axes: own.flatMap(({ axes }) => axes), whole: true,
    places: own.map((one) => [one.x, one.y]),
    drag: (px, py) => own.flatMap((one) => one.drag(one.x + px - x, one.y + py - y)),
  };
}

/** The values of the scene for a handle's axes, by key. */
function valuesOf({ axes, values: own }: Handle, numbers: number[]): Record<string, unknown> {
  const values: Record<string, any> = {};
  const held = axes.map(({ low, high }, n) => Math.min(high, Math.max(low, numbers[n])));
  if (own) return own(held);
  axes.forEach(({ key, part }, n) => {
    const value = held[n];
    if (part === undefined) values[key] = value;
    else (values[key] ??= [])[part] = value;
  });
  return values;
}

/** Round to a step, without digits from rounding. */
const roundTo = (
  value: number, step: number,
) => Number((Math.round(value / step) * step).toPrecision(12));

export { ARROW, Handles, bodyOf, roundTo, valuesOf };
