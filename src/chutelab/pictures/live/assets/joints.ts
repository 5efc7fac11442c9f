// Strings, rods, springs and pins as they are at a time, as `plots/machinery.py` draws them.

import type { Machine, Tied } from "./machine.ts";
import type { Recording } from "./recording.ts";
import type { Point } from "./scene.ts";
import type { View } from "./view.ts";

/** px; radius of the dot of a fixed end, of a pin, and widths of lines. */
const DOT = 3, PIN = 4.5, THIN = 1.4, THICK = 3.2;

/** Of a spring's length at rest: half of its width. */
const COIL = 0.05;

/** Shares of a spring's way at which it turns to and fro. */
const TURNS = Array.from({ length: 13 }, (_, n) => n / 12);

/** Names of all joints: kind and number, as of tables whose rows have none. */
export function namesOfJoints({ joints }: Machine) {
  return joints.map(({ kind }, n) =>
    `${kind} ${joints.slice(0, n + 1).filter((one) => one.kind === kind).length}`);
}

/** Where a joint begins and ends at a time, s and m; null while one of its particles is not
 * there. */
export function endsOfJoint({ particle, other, from }: Tied, { tracks }: Recording, t: number) {
  const end = tracks[particle]?.state(t), far = tracks[other]?.state(t);
  const begin: Point | null = from ?? (far ? [far.x, far.y] : null);
  return begin && end ? [begin, [end.x, end.y] as Point] as const : null;
}

/** Joints as lines at a time, s, but for pins. */
export function linesOfJoints(recording: Recording, t: number) {
  const names = namesOfJoints(recording.machine);
  return recording.machine.joints.flatMap((joint, n) => {
    const ends = joint.kind === "pin" ? null : endsOfJoint(joint, recording, t);
    const isLine = ends && Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]) > 0;
    return isLine ? [{ name: names[n], from: ends[0], to: ends[1] }] : [];
  });
}

/** Pins with their names at a time, s and m. */
export function pinsOf(recording: Recording, t: number) {
  const names = namesOfJoints(recording.machine);
  return recording.machine.joints.flatMap((joint, n) =>
    (joint.kind === "pin" ? [{ name: names[n], at: pinAt(joint, recording, t) }] : []));
}

/** Where a pin is at a time, m: it turns with its particle. */
function pinAt({ particle, from }: Tied, { tracks, machine }: Recording, t: number): Point {
  const state = tracks[particle].state(t), [x, y] = from as Point;
  if (!state) return [x, y];
  const first = machine.releases[particle], angle = tracks[particle].angle(t);
  const [u, v, c, s] = [x - first.x, y - first.y, Math.cos(angle), Math.sin(angle)];
  return [state.x + c * u - s * v, state.y + s * u + c * v];
}

/** Paint all joints but pins at a time, s: a slack string sags along gravity between its
 * ends. */
export function paintJoints(
  context: CanvasRenderingContext2D, recording: Recording, t: number, view: View, colour: string,
) {
  const thin = new Path2D(), thick = new Path2D(), dots = new Path2D();
  for (const joint of recording.machine.joints) {
    const { kind, from, length } = joint;
    const ends = endsOfJoint(joint, recording, t);
    if (kind === "pin") continue;
    if (from) {
      dots.moveTo(view.px(from[0]) + DOT, view.py(from[1]));
      dots.arc(view.px(from[0]), view.py(from[1]), DOT, 0, 2 * Math.PI);
    }
    if (!ends) continue;
    const [[u, v], [x, y]] = ends, [dx, dy] = [x - u, y - v], far = Math.hypot(dx, dy);
    const line = kind === "rod" ? thick : thin;
    line.moveTo(view.px(u), view.py(v));
    if (kind === "spring") {
      const wide = (COIL * length) / (far || 1);
      TURNS.forEach((share, n) => {
        const aside = n < 2 || n > 10 ? 0 : n % 2 ? -wide : wide;
        line.lineTo(view.px(u + share * dx - aside * dy), view.py(v + share * dy + aside * dx));
      });
      continue;
    }
    // Pulled along gravity at its middle it would be twice as deep there: a curve whose middle
    // is at half of what its control point is.
    const sag = kind === "string" ? Math.sqrt(Math.max(length * length - far * far, 0)) : 0;
    const [across, up] = recording.machine.up;
    line.quadraticCurveTo(view.px(u + dx / 2 - across * sag), view.py(v + dy / 2 - up * sag),
      view.px(x), view.py(y));
  }
  context.strokeStyle = context.fillStyle = colour;
  for (const [lines, width] of [[thin, THIN], [thick, THICK]] as const) {
    context.lineWidth = width;
    context.stroke(lines);
  }
  context.fill(dots);
}

/** Paint all pins at a time, s: over their particles. */
export function paintPins(
  context: CanvasRenderingContext2D, recording: Recording, t: number, view: View, colour: string,
) {
  context.strokeStyle = colour;
  context.lineWidth = THIN;
  context.beginPath();
  for (const { at } of pinsOf(recording, t)) {
    const x = view.px(at[0]), y = view.py(at[1]);
    context.moveTo(x + PIN, y);
    context.arc(x, y, PIN, 0, 2 * Math.PI);
    context.moveTo(x - PIN, y);
    context.lineTo(x + PIN, y);
    context.moveTo(x, y - PIN);
    context.lineTo(x, y + PIN);
  }
  context.stroke();
}
