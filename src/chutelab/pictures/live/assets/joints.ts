// Strings, rods, springs and pins as they are at a time, as `plots/machinery.py` draws them.

import type { Machine, Tied } from "./machine.ts";
import type { Recording } from "./recording.ts";
import type { Point } from "./scene.ts";
import type { View } from "./view.ts";

/** px; radius of the dot of a fixed end, of a pin, and widths of lines. */
const DOT = 3, PIN = 4.5, THIN = 1.4, THICK = 3.2;

/** Half of a spring's width, as a share of its length at rest. */
const COIL = 0.05;

/** Shares of a spring's length at which its zigzag turns. */
const TURNS = Array.from({ length: 13 }, (_, n) => n / 12);

/** Names of all joints: kind and number, as for tables whose rows have no names. */
export function namesOfJoints({ joints }: Machine) {
  return joints.map(({ kind }, n) =>
    `${kind} ${joints.slice(0, n + 1).filter((one) => one.kind === kind).length}`);
}

/** Ends and lengths of the parts of a joint at a time, s and m; none while one of its particles is
 * not under way. Over a pulley a string has two parts, equally slack. */
function waysOfJoint(
  { kind, particle, other, from, length }: Tied, { tracks }: Recording, t: number,
) {
  const end = tracks[particle]?.state(t), far = tracks[other]?.state(t);
  const begin: Point | null = from ?? (far ? [far.x, far.y] : null);
  if (!begin || !end) return [];
  if (kind !== "string" || !from || other < 0) {
    return [{ from: begin, to: [end.x, end.y], length }];
  }
  if (!far) return [];
  const legs = [end, far].map(({ x, y }) => Math.hypot(x - from[0], y - from[1]));
  return [end, far].map(({ x, y }, n) =>
    ({ from, to: [x, y], length: (length + legs[n] - legs[1 - n]) / 2 }));
}

/** Joints as lines at a time, s, except pins. */
export function linesOfJoints(recording: Recording, t: number) {
  const names = namesOfJoints(recording.machine);
  return recording.machine.joints.flatMap((joint, n) => (joint.kind === "pin" ? []
    : waysOfJoint(joint, recording, t).flatMap(({ from, to }) =>
      (Math.hypot(to[0] - from[0], to[1] - from[1]) > 0
        ? [{ name: names[n], from, to: to as Point }] : []))));
}

/** Pins with their names at a time, s and m. */
export function pinsOf(recording: Recording, t: number) {
  const names = namesOfJoints(recording.machine);
  return recording.machine.joints.flatMap((joint, n) =>
    (joint.kind === "pin" ? [{ name: names[n], at: pinAt(joint, recording, t) }] : []));
}

/** Place of a pin at a time, m: it turns with its particle. */
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
    const { kind, from } = joint;
    if (kind === "pin") continue;
    if (from) {
      dots.moveTo(view.px(from[0]) + DOT, view.py(from[1]));
      dots.arc(view.px(from[0]), view.py(from[1]), DOT, 0, 2 * Math.PI);
    }
    for (const { from: [u, v], to: [x, y], length } of waysOfJoint(joint, recording, t)) {
      const [dx, dy] = [x - u, y - v], far = Math.hypot(dx, dy);
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
      // Pulled along gravity at its middle it would be twice as deep there; the middle of the curve
      // is at half the depth of its control point.
      const sag = kind === "string" ? Math.sqrt(Math.max(length * length - far * far, 0)) : 0;
      const [across, up] = recording.machine.up;
      line.quadraticCurveTo(view.px(u + dx / 2 - across * sag), view.py(v + dy / 2 - up * sag),
        view.px(x), view.py(y));
    }
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
