// Velocities, forces and impulses as arrows on the particles, with bars for their scale.

import { roundUp } from "./chart.ts";
import { ARROW } from "./handles.ts";
import { historyOf } from "./stages.ts";
import type { Machine } from "./machine.ts";
import type { Track } from "./recording.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** From x, y to x, y, px */
type Arrow = [number, number, number, number];

/** Length of the largest weight, and of the largest impulse, px. */
const WEIGHT = 38, IMPULSE = 64;

/** An arrow of an impulse is shown for so many s of simulated time. */
const STAYS = 0.15;

/** Shorter arrows are points, px. */
const SHORTEST = 1.5;

/** Force other than gravity, N, from the curvature of the track by Newton's second law. The curve
 * between two knots is cubic, so that its acceleration at the share s of the time h between them is
 * (6 Δ/h (1 - 2 s) + va (6 s - 4) + vb (6 s - 2)) / h.
 * @param mass kg
 * @param gravity m/s²; along -up */
function contactForce(
  track: Track, t: number, mass: number, { gravity, up }: Machine,
): [number, number] {
  const i = Math.min(track.knotBefore(t), track.count - 2);
  if (i < 0 || t >= track.end) return [0, 0];
  const [T, X, Y, VX, VY] = [0, 1, 2, 3, 4];
  const h = track.at(i + 1, T) - track.at(i, T);
  if (!(h > 0)) return [0, 0];
  const s = (t - track.at(i, T)) / h;
  const acceleration = (place: number, pace: number) => {
    const slope = (track.at(i + 1, place) - track.at(i, place)) / h;
    return (6 * slope * (1 - 2 * s) + track.at(i, pace) * (6 * s - 4)
      + track.at(i + 1, pace) * (6 * s - 2)) / h;
  };
  return [mass * (acceleration(X, VX) + gravity * up[0]),
    mass * (acceleration(Y, VY) + gravity * up[1])];
}

class Arrows {
  constructor(readonly stage: Stage, readonly words: Words) {
    stage.painters.push((context) => this.paint(context));
  }

  paint(context: CanvasRenderingContext2D) {
    const { stage, words } = this, { show, view, lab } = stage, { recording, t } = lab;
    if (!recording || (!show.velocity && !show.forces)) return;
    const { machine, tracks } = recording;
    const weight = Math.max(...machine.mass) * machine.gravity;
    const perNewton = weight > 0 ? WEIGHT / weight : 0;
    const velocities: Arrow[] = [];
    const gravities: Arrow[] = [];
    const contacts: Arrow[] = [];
    tracks.forEach((track, i) => {
      const state = track.state(t);
      if (!state || state.ended) return;
      const x = view.px(state.x), y = view.py(state.y);
      if (x < 0 || x > view.width || y < 0 || y > view.height) return;
      const k = ARROW * view.scale;
      if (show.velocity) velocities.push([x, y, x + k * state.vx, y - k * state.vy]);
      if (!show.forces) return;
      const its = machine.mass[i] * machine.gravity;
      const fall = perNewton * its;
      gravities.push([x, y, x - fall * machine.up[0], y + fall * machine.up[1]]);
      const [fx, fy] = contactForce(track, t, machine.mass[i], machine);
      // The remainder in flight is rounding.
      if (Math.hypot(fx, fy) > 1e-6 * its) {
        contacts.push([x, y, x + perNewton * fx, y - perNewton * fy]);
      }
    });
    const colour = (name: string) => this.stage.colour(name);
    /** name, colour, unit, px of one unit */
    const bars: [string, string, string, number][] = [];
    if (show.forces) {
      const history = historyOf(lab), largest = history?.largestBlow ?? 0;
      const blows = history?.blowsBetween(t - STAYS, t) ?? [];
      const perUnit = largest ? IMPULSE / largest : 0;
      drawArrows(context, gravities, colour("muted"));
      drawArrows(context, contacts, colour("belt"));
      drawArrows(context, blows.map(({ x, y, px, py }) => [view.px(x),
        view.py(y), view.px(x) + perUnit * px, view.py(y) - perUnit * py] as Arrow), colour("strike"));
      if (perUnit) bars.push(["impulse", colour("strike"), "N s", perUnit]);
      if (perNewton) {
        bars.push(["contact-force", colour("belt"), "N", perNewton]);
        bars.push(["weight", colour("muted"), "N", perNewton]);
      }
    }
    if (show.velocity) {
      drawArrows(context, velocities, colour("accent"));
      bars.push(["velocity", colour("accent"), "m/s", ARROW * view.scale]);
    }
    bars.forEach(([name, ink, unit, size], n) => {
      const value = roundUp(24 / size), y = 16 + 18 * n;
      drawArrows(context, [[12, y, 12 + value * size, y]], ink);
      context.font = "13px system-ui, sans-serif";
      const text = `${words.number(value, 1)} ${unit} (${words.say(`arrow-${name}`)})`;
      context.strokeStyle = colour("card");
      context.lineWidth = 4;
      context.strokeText(text, 20 + value * size, y + 4);
      context.fillStyle = colour("ink");
      context.fillText(text, 20 + value * size, y + 4);
    });
  }
}

function drawArrows(context: CanvasRenderingContext2D, arrows: Arrow[], ink: string) {
  context.strokeStyle = ink;
  context.fillStyle = ink;
  context.lineWidth = 2;
  context.beginPath();
  for (const [x, y, u, v] of arrows) {
    context.moveTo(x, y);
    context.lineTo(u, v);
  }
  context.stroke();
  context.beginPath();
  for (const [x, y, u, v] of arrows) {
    const long = Math.hypot(u - x, v - y);
    if (long < SHORTEST) continue;
    const head = Math.min(8, 0.6 * long), c = (head * (u - x)) / long, s = (head * (v - y)) / long;
    context.moveTo(u, v);
    context.lineTo(u - c - 0.45 * s, v - s + 0.45 * c);
    context.lineTo(u - c + 0.45 * s, v - s - 0.45 * c);
  }
  context.fill();
}

export { Arrows, contactForce, drawArrows };
