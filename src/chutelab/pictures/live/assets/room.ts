// Where disks may be released: not in a surface that is there then.
import { ON_BELT } from "./belt.ts";
import { Fault, type Scene, type Point } from "./scene.ts";
import { atan2, lengthOf, modulo, sinCos } from "./trig.ts";
import type { Segment, Arc } from "./machine.ts";
import type { Release } from "./releases.ts";

type Room = { segments: Segment[], arcs: Arc[], names: string[] };
/** The point of a surface nearest to a place */
type Nearest = (x: number, y: number) => Point;

/** Share of the largest coordinate by which a contact may seem to overlap. */
const ROUNDING = 64.0 * Number.EPSILON;

function nearestOnSegment({ ends: [x0, y0, x1, y1] }: Segment): Nearest {
  const dx = x1 - x0;
  const dy = y1 - y0;
  const square = dx * dx + dy * dy;
  return (x, y) => {
    const along = (x - x0) * dx + (y - y0) * dy;
    const share = Math.min(Math.max(along / (square > 0.0 ? square : 1.0), 0.0), 1.0);
    return [x0 + share * dx, y0 + share * dy];
  };
}

function nearestOnArc({ x: cx, y: cy, radius, begin, extent }: Arc): Nearest {
  const [first, last] = [begin, begin + extent].map((angle) => {
    const [sine, cosine] = sinCos(angle);
    // Of the point, for its digits are those of its coordinates.
    return [(cx + radius * cosine) - cx, (cy + radius * sine) - cy];
  });
  return (x, y) => {
    let dx = x - cx;
    let dy = y - cy;
    if (!(lengthOf(dx, dy) > 0.0)) [dx, dy] = [1.0, 0.0];
    const far = lengthOf(dx, dy);
    if (modulo(atan2(dy, dx) - begin, 2.0 * Math.PI) <= extent) {
      return [radius * dx / far + cx, radius * dy / far + cy];
    }
    const near = lengthOf(dx - first[0], dy - first[1]) <= lengthOf(dx - last[0], dy - last[1]);
    const [ex, ey] = near ? first : last;
    return [ex + cx, ey + cy];
  };
}

/**
 * Returns the surfaces that may reach into the box of some places, each with its nearest points.
 * @param reach m
 */
function* surfacesNear({ segments, arcs }: Room, places: Point[], reach: (i: number) => number) {
  let [left, right, bottom, top] = [Infinity, -Infinity, Infinity, -Infinity];
  places.forEach(([x, y], i) => {
    const r = reach(i);
    left = Math.min(left, x - r);
    right = Math.max(right, x + r);
    bottom = Math.min(bottom, y - r);
    top = Math.max(top, y + r);
  });
  for (const segment of segments) {
    const [x0, y0, x1, y1] = segment.ends;
    const across = Math.max(x0, x1) > left && Math.min(x0, x1) < right;
    if (across && Math.max(y0, y1) > bottom && Math.min(y0, y1) < top) {
      yield { piece: segment, nearest: nearestOnSegment(segment) };
    }
  }
  for (const arc of arcs) yield { piece: arc, nearest: nearestOnArc(arc) };
}

/** Returns the pulleys, which are solid: whose, axis and radius, m. */
function wheelsOf({ incoming, conveyor }: Scene) {
  const wheels = conveyor.flatMap(({ name, from, to, pulley_radius: size }) => {
    return [from, to].map(([x, y]) => ({ name, x, y, size }));
  });
  const own = { name: "incoming", x: 0.0, y: 0.0, size: incoming?.pulley_radius ?? 0.0 };
  return incoming === null ? wheels : [own, ...wheels];
}

/** Tells which places a disk of a radius (m) can be in. */
export function clearOf(scene: Scene, room: Room, places: Point[], radius: number): boolean[] {
  const free = places.map(() => true);
  if (!places.length) return free;
  for (const { nearest } of surfacesNear(room, places, () => radius)) {
    places.forEach(([x, y], i) => {
      const [px, py] = nearest(x, y);
      free[i] = free[i] && lengthOf(x - px, y - py) >= radius;
    });
  }
  for (const wheel of wheelsOf(scene)) {
    places.forEach(([x, y], i) => {
      free[i] = free[i] && lengthOf(x - wheel.x, y - wheel.y) >= wheel.size + radius;
    });
  }
  return free;
}

/**
 * Returns releases of which none lies in a surface; one that does by rounding only is moved out.
 * @throws {Fault} if one does by more
 */
export function movedOut(
  scene: Scene, room: Room, releases: Release[], radius: number[],
): Release[] {
  let out = releases;
  const belt = scene.incoming;
  const places = releases.map(({ x, y }) => [x, y] as Point);
  for (const { piece, nearest } of surfacesNear(room, places, (i) => radius[i])) {
    const there = ({ t, carried }: Release) => {
      const rides = piece.surface === 0 && belt !== null && carried;
      return piece.appears <= t && t < piece.vanishes && !rides;
    };
    out = pushedOut(scene, out, nearest, radius, there, room.names[piece.surface]);
  }
  for (const { name, x, y, size } of wheelsOf(scene)) {
    const reach = radius.map((r) => size + r);
    const who = ({ carried }: Release) => name !== "incoming" || !carried;
    out = pushedOut(scene, out, () => [x, y], reach, who, name);
  }
  return out;
}

/**
 * Returns releases of which those told are at least `reach` (m) away from a surface.
 * @param name of the surface
 */
function pushedOut(
  scene: Scene, releases: Release[], nearest: Nearest, reach: number[],
  who: (release: Release) => boolean, name: string,
) {
  let deepest = -Infinity;
  let fault: Fault | null = null;
  const moved = releases.map((release, i) => {
    if (!who(release)) return release;
    const { x, y } = release;
    const [px, py] = nearest(x, y);
    const [dx, dy] = [x - px, y - py];
    const distance = lengthOf(dx, dy);
    const depth = reach[i] - distance;
    const size = Math.max(Math.abs(px), Math.abs(py), Math.abs(x), Math.abs(y));
    const rounding = ROUNDING * size;
    if (depth > Math.max(ON_BELT, rounding) && depth >= deepest) {
      const { stream } = release;
      const key = scene.streams.length > 1 ? `stream[${stream}].at` : "stream.at";
      deepest = depth;
      fault = new Fault(key, scene.streams[stream].at, "release-inside", {
        surface: name, particle: i, distance, reach: reach[i],
      });
    }
    if (!(depth > rounding)) return release;
    return { ...release, x: x + dx * (depth / distance), y: y + dy * (depth / distance) };
  });
  if (fault !== null) throw fault;
  return moved;
}
