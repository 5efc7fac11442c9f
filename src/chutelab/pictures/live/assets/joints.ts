// Strings, rods and pins as they are at a time, as `plots/machinery.py` draws them.

import type { Recording } from "./recording.ts";
import type { View } from "./view.ts";

/** px; radius of the dot of a fixed end. */
const DOT = 3;

/** Paint all joints at a time, s: a slack string sags between its ends. */
export function paintJoints(
  context: CanvasRenderingContext2D, { machine, tracks }: Recording, t: number, view: View,
  colour: (name: string) => string,
) {
  const lines = new Path2D(), dots = new Path2D();
  for (const { kind, particle, other, from, length } of machine.joints) {
    if (from) {
      dots.moveTo(view.px(from[0]) + DOT, view.py(from[1]));
      dots.arc(view.px(from[0]), view.py(from[1]), DOT, 0, 2 * Math.PI);
    }
    const end = tracks[particle].state(t), far = tracks[other]?.state(t);
    const begin = from ? { x: from[0], y: from[1] } : far;
    if (!begin || !end || kind === "pin") continue;
    const x = end.x - begin.x, y = end.y - begin.y;
    // Pulled down at its middle it would be twice as deep there: a curve whose middle is at half
    // of what its control point is.
    const sag = kind === "string" ? Math.sqrt(Math.max(length * length - x * x - y * y, 0)) : 0;
    lines.moveTo(view.px(begin.x), view.py(begin.y));
    lines.quadraticCurveTo(view.px(begin.x + x / 2), view.py(begin.y + y / 2 - sag),
      view.px(end.x), view.py(end.y));
  }
  context.lineWidth = 1.2;
  context.strokeStyle = context.fillStyle = colour("muted");
  context.stroke(lines);
  context.fill(dots);
}
