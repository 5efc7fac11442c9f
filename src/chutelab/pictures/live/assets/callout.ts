// Where the card of what is chosen stands: in the best free place, with a line to that.

import { svg } from "./scenery.ts";
import type { Inspector } from "./inspector.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { View } from "./view.ts";

type Point = [number, number];

/** Pixels from one place that is tried to the next, and that the card keeps off its part. */
const STEP = 24, OFF = 26;

/** What it costs to cover a point of what is chosen, of a path, and of anything else; a pixel away
 * from what is chosen costs one. */
const OWN = 4000, PATH = 60, OTHER = 30;

/** Pixels from one of the points that stand for a line to the next. */
const ALONG = 22;

/** Points along a line through points, those among them. */
function along(points: Point[]): Point[] {
  return points.flatMap(([x, y], n) => {
    const [u, v] = points[n + 1] ?? [x, y];
    const many = Math.min(200, Math.ceil(Math.hypot(u - x, v - y) / ALONG));
    return Array.from({ length: Math.max(1, many) }, (_, k) =>
      [x + (k / many || 0) * (u - x), y + (k / many || 0) * (v - y)] as Point);
  });
}

/** Points along the surfaces of a machine, and where its balls start and are, px, by name. */
function pointsOf({ machine, recording, t }: Lab, view: View): [string, Point[]][] {
  if (!machine) return [];
  const px = (x: number, y: number): Point => [view.px(x), view.py(y)];
  const bend = (x: number, y: number, radius: number, begin: number, extent: number) =>
    Array.from({ length: 25 }, (_, n) => begin + (n * extent) / 24).map((angle) =>
      px(x + radius * Math.cos(angle), y + radius * Math.sin(angle)));
  const { surfaces, segments, arcs, pulley, streams, releases } = machine;
  return [
    ...segments.map(({ ends: [x, y, u, v], surface }) =>
      [surfaces[surface], along([px(x, y), px(u, v)])] as [string, Point[]]),
    ...arcs.map(({ x, y, radius, begin, extent, surface }) =>
      [surfaces[surface], bend(x, y, radius, begin, extent)] as [string, Point[]]),
    ...(pulley ? [[surfaces[pulley.surface], bend(0, 0, pulley.radius, 0, 2 * Math.PI)] as
      [string, Point[]]] : []),
    ...releases.slice(0, 100).map((release, i) => {
      const { x, y } = recording?.tracks[i]?.state(t) ?? release;
      return [streams[release.stream], [px(x, y), px(release.x, release.y)]] as [string, Point[]];
    }),
  ];
}

class Callout {
  leader = svg("path", { class: "leader" });

  constructor(readonly inspector: Inspector, readonly stage: Stage, readonly lab: Lab) {
    stage.over.append(this.leader);
    inspector.listeners.push(() => this.place());
    stage.drawers.push(() => this.place());
  }

  place() {
    const { inspector: { panel, parts }, stage, lab, leader } = this, { view } = stage;
    leader.setAttribute("d", "");
    const floats = !panel.hidden && getComputedStyle(panel).position === "fixed";
    if (!floats) {
      panel.style.transform = "";
      return;
    }
    const { free } = view, { offsetWidth: wide, offsetHeight: high } = panel;
    const isSeen = ([x, y]: Point) => x > 0 && x < view.width && y > 0 && y < view.height;
    const own: Point[] = [], other: Point[] = [];
    for (const [name, points] of pointsOf(lab, view)) {
      (parts.includes(name) ? own : other).push(...points.filter(isSeen));
    }
    const grips = stage.handles.filter(({ surface }) => parts.includes(surface))
      .map(({ x, y }) => [view.px(x), view.py(y)] as Point);
    const { recording } = lab, path: Point[] = recording && !recording.machine.interact
      ? recording.tracks.slice(0, 5).flatMap((_, i) => along(recording.points(i, 4 / view.scale)
        .map(({ x, y }) => [view.px(x), view.py(y)] as Point))) : [];
    const mean = (n: number) => own.reduce((sum, point) => sum + point[n], 0) / own.length;
    const [cx, cy] = own.length ? [mean(0), mean(1)] : [free.right, free.top];
    let best = Infinity, at: Point = [free.right - wide, free.top];
    const count = (points: Point[], x: number, y: number, off: number) =>
      points.filter(([px, py]) => px > x - off && px < x + wide + off
        && py > y - off && py < y + high + off).length;
    const bottom = Math.max(free.top, Math.min(free.bottom, view.height - 8) - high);
    for (let x = free.left + 8; x <= free.right - wide; x += STEP) {
      for (let y = free.top; y <= bottom; y += STEP) {
        const cost = Math.hypot(x + 0.5 * wide - cx, y + 0.5 * high - cy)
          + OWN * count([...own, ...grips], x, y, OFF) + PATH * count(path, x, y, 8)
          + OTHER * count(other, x, y, 4);
        if (cost < best) [best, at] = [cost, [x, y]];
      }
    }
    const box = stage.home.getBoundingClientRect();
    panel.style.transform = `translate(${box.left + at[0]}px, ${box.top + at[1]}px)`;
    // From the nearest point of what is chosen to the nearest of the card.
    const edge = ([x, y]: Point): Point => [Math.min(Math.max(x, at[0]), at[0] + wide),
      Math.min(Math.max(y, at[1]), at[1] + high)];
    const far = (point: Point) => Math.hypot(edge(point)[0] - point[0], edge(point)[1] - point[1]);
    const [first] = own.sort((a, b) => far(a) - far(b));
    if (!first || far(first) < OFF) return;
    const [x, y] = first;
    leader.setAttribute("d", `M${edge(first)}L${x} ${y}m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0`);
  }
}

export { Callout, pointsOf };
