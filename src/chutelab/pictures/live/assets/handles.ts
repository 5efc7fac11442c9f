// What can be taken hold of: where it is, which keys of the scene it moves, and how far.

import type { Machine } from "./machine.ts";
import type { Scene } from "./scene.ts";

/** A number of the scene; `part` of one that is a point */
type Axis = { key: string, part?: number, value: number, unit: string, step: number,
  low: number, high: number };
/** `what` is a word of the catalogue; `drag` tells the axes' values for a place in the world.
 * One of a tool takes them by `change` itself, and may say more than its values. One of a `whole`
 * body has the axes of all its places. */
export type Handle = { id: string, surface: string, what: string, shape: "point" | "turn" | "arrow",
  x: number, y: number, from?: [number, number], axes: Axis[],
  drag: (x: number, y: number) => number[], change?: (numbers: number[]) => void,
  says?: string, whole?: boolean };

/** m of arrow for each m/s. */
const ARROW = 0.08;

/** m beyond the plate, where the outgoing belt is taken hold of. */
const AHEAD_OF_PLATE = 0.1;

const DEGREE = Math.PI / 180;

/** Steps of arrow keys by unit. */
const STEPS: Record<string, number> = { m: 0.01, degrees: 1, "m/s": 0.1 };

class Handles {
  list: Handle[] = [];

  /** @param lab the page's data */
  constructor(readonly scene: Scene, readonly machine: Machine, readonly lab: any) {
    this.belts();
    this.plates();
    scene.conveyor.forEach((_, n) => this.conveyor(n));
    scene.surface.forEach((_, n) => this.surface(n));
    scene.streams.forEach((_, n) => this.stream(n));
  }

  axis(key: string, value: number, unit: string, part?: number) {
    const plain = key.replace(/\[\d+\]/, "");
    const [table, name] = plain.split(".");
    const rule = this.lab.tables[table]?.[name] ?? {};
    const [low, high] = this.lab.live?.ranges?.[key] ?? this.lab.live?.ranges?.[plain]
      ?? [rule.low ?? -Infinity, rule.high ?? Infinity];
    return { key, part, value, unit, step: STEPS[unit], low, high };
  }

  /** A point of the scene. */
  place(key: string, [x, y]: [number, number]) {
    return [this.axis(key, x, "m", 0), this.axis(key, y, "m", 1)];
  }

  add(
    id: string, surface: string, what: string, shape: Handle["shape"], at: [number, number],
    axes: Axis[], drag: Handle["drag"], from?: [number, number],
  ) {
    this.list.push({ id, surface, what, shape, x: at[0], y: at[1], axes, drag, from });
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
    // Ahead of the plate, where it is in the picture; the belt may be long.
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
      this.add(`${table}.angle_deg`, name, "angle", "turn",
        [x + plate.above * up[0], y + plate.above * up[1]],
        [this.axis(`${table}.angle_deg`, plate.angle_deg, "degrees"),
          this.axis(`${table}.above`, plate.above, "m")], (px, py) => turned(px, py, 1));
      this.add(`${table}.below`, name, "end", "turn", [x - below * up[0], y - below * up[1]],
        [this.axis(`${table}.angle_deg`, plate.angle_deg, "degrees"),
          this.axis(`${table}.below`, below, "m")], (px, py) => turned(px, py, -1));
    });
  }

  conveyor(n: number) {
    const belt = this.scene.conveyor[n], table = `conveyor[${n}]`, r = belt.pulley_radius;
    const [[x0, y0], [x1, y1]] = [belt.from, belt.to];
    this.add(`${table}.from`, belt.name, "begin", "point", belt.from,
      this.place(`${table}.from`, belt.from), (x, y) => [x, y]);
    this.add(`${table}.to`, belt.name, "end", "point", belt.to,
      this.place(`${table}.to`, belt.to), (x, y) => [x, y]);
    this.add(`${table}.pulley_radius`, belt.name, "radius", "point", [x0, y0 - r],
      [this.axis(`${table}.pulley_radius`, r, "m")], (x, y) => [Math.hypot(x - x0, y - y0)]);
    const way = Math.hypot(x1 - x0, y1 - y0), [dx, dy] = [(x1 - x0) / way, (y1 - y0) / way];
    const side = dx >= 0 ? 1 : -1;
    this.arrow(`${table}.speed`, belt.name, [0.5 * (x0 + x1) - side * dy * (r + 0.03),
      0.5 * (y0 + y1) + side * dx * (r + 0.03)], [dx, dy], belt.speed);
  }

  surface(n: number) {
    const row = this.scene.surface[n], table = `surface[${n}]`;
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
        this.add(`${table}.${key}`, row.name, what, "turn", at(degrees),
          [this.axis(`${table}.${key}`, degrees, "degrees")], (px, py) => {
            const angle = Math.atan2(py - y, px - x) / DEGREE;
            return [angle + 360 * Math.round((degrees - angle) / 360)];
          });
      }
      return;
    }
    const keys = row.given.from ? ["from", "to"] : null;
    const { points = [] } = row;
    points.forEach((point, i) => {
      const key = keys ? `${table}.${keys[i]}` : `${table}.points[${i}]`;
      const what = i === 0 ? "begin" : i === points.length - 1 ? "end" : "corner";
      this.add(key, row.name, what, "point", point, this.place(key, point), (x, y) => [x, y]);
    });
    if (row.speed) {
      const [[x0, y0], [x1, y1]] = points;
      const way = Math.hypot(x1 - x0, y1 - y0);
      this.arrow(`${table}.speed`, row.name, [0.5 * (x0 + x1), 0.5 * (y0 + y1)],
        [(x1 - x0) / way, (y1 - y0) / way], row.speed);
    }
  }

  stream(n: number) {
    const { streams } = this.scene, stream = streams[n];
    if (!stream.at) return;
    const table = streams.length > 1 ? `stream[${n}]` : "stream";
    this.add(`${table}.at`, stream.name, "release", "point", stream.at,
      this.place(`${table}.at`, stream.at), (x, y) => [x, y]);
    const { velocity } = stream;
    if (!velocity) return;
    const [x, y] = stream.at, [vx, vy] = velocity;
    this.add(`${table}.velocity`, stream.name, "velocity", "arrow",
      [x + ARROW * vx, y + ARROW * vy], [0, 1].map((part) =>
        this.axis(`${table}.velocity`, velocity[part], "m/s", part)),
      (px, py) => [(px - x) / ARROW, (py - y) / ARROW], stream.at);
  }
}

/** What places a body, by the name of the handle. */
const PLACES = ["pivot", "center", "height"], ENDS = ["begin", "end", "corner"];

/** What moves a whole body by what it is grabbed at, m; null if it has a place of its own. */
function bodyOf(handles: Handle[], name: string, x: number, y: number): Handle | null {
  const own = handles.filter(({ id, surface, what }) => surface === name
    && (PLACES.includes(what) || (ENDS.includes(what) && /^(surface|conveyor)/.test(id))));
  if (!own.length) return null;
  return {
    ...own[0], id: `body-${name}`, x, y, axes: own.flatMap(({ axes }) => axes), whole: true,
    drag: (px, py) => own.flatMap((one) => one.drag(one.x + px - x, one.y + py - y)),
  };
}

/** The values of the scene that a handle's axes stand for, by key. */
function valuesOf({ axes }: Handle, numbers: number[]): Record<string, unknown> {
  const values: Record<string, any> = {};
  axes.forEach(({ key, part, low, high }, n) => {
    const value = Math.min(high, Math.max(low, numbers[n]));
    if (part === undefined) values[key] = value;
    else (values[key] ??= [])[part] = value;
  });
  return values;
}

/** Round to a step, without the digits that rounding leaves. */
const roundTo = (
  value: number, step: number,
) => Number((Math.round(value / step) * step).toPrecision(12));

export { ARROW, Handles, bodyOf, roundTo, valuesOf };
