// The paper's symbols in the picture, each at what it stands for: angle, speeds, times and
// lengths of the first particle's transfer.

import { passed, surfaceLines } from "./callout.ts";
import { historyOf } from "./stages.ts";
import { svg } from "./scenery.ts";
import type { Stage } from "./stage.ts";
import type { Event } from "./core.ts";

/** A label at its point, later its middle, px. `side` is the direction tried first, rad
 * counterclockwise from the right; one that is `asked` for may be far away. `text` is the longest
 * of its rows; `drawn` is drawn with it, and no label may lie on its `line` */
type Label = { text: string, x: number, y: number, side?: number, asked?: boolean,
  rows?: number, id?: string, drawn?: Element[], line?: [number, number][] };
/** A placed label, and the point from which a line leads to it if it is far away. */
type Placed = Label & { from?: [number, number] };
type Space = { left: number, top: number, right: number, bottom: number };

/** Height and width of a letter, px. */
const TALL = 18, WIDE = 9;

/** Distances of a label from its point, in the order in which they are tried, and the distance from
 * which a line leads to it, px. */
const AWAY = [15, 24, 34, 46, 60], FARTHER = [80, 110, 150, 200], LED = 30;

/** Distance from a point within which lines that lead from it may overlap, px. */
const OPEN = 13;

/** Distance between the boxes that stand for a line, and half their size, px. */
const ALONG = 9, THIN = 5;

/** The smallest angle that is drawn, rad. */
const LEAST_ANGLE = 0.03;

const overlap = (a: Space, b: Space) =>
  a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;

function spaceOf({ text, x, y, rows = 1 }: Label): Space {
  const half = 0.5 * WIDE * text.length + 1, high = 0.5 * TALL * rows;
  return { left: x - half, right: x + half, top: y - high, bottom: y + high };
}

/** Returns where the line from a point to a label ends: just outside of its text. */
function leadTo(label: Label, [x, y]: [number, number]): [number, number] {
  const { right, bottom } = spaceOf(label), [u, v] = [label.x - x, label.y - y];
  const inside = Math.min((right - label.x + 2) / Math.abs(u || 1e-9),
    (bottom - label.y + 3) / Math.abs(v || 1e-9));
  return [label.x - inside * u, label.y - inside * v];
}

/** Returns labels near their points, in free places; those without a free place are left out.
 * @param wanted labels at their points, the most important first
 * @param most number of labels that are placed */
function placed(wanted: Label[], taken: Space[], most = Infinity): Placed[] {
  const spaces = [...taken], found: Placed[] = [];
  const meets = (space: Space, all: Space[]) => all.some((other) => overlap(other, space));
  for (const label of wanted) {
    if (found.length < most) found.push(...place(label));
  }
  return found;

  function place(label: Label): Placed[] {
    const { text, x, y, side = Math.PI / 4, asked, rows = 1, line = [] } = label;
    const labels = spaces.slice(taken.length), own = along(line);
    if (own.some((one) => meets(one, labels))) return [];
    // The nearest edge of a block of several rows is as far away as that of one letter.
    const [wide, high] = rows > 1 ? [0.5 * WIDE * text.length, 0.5 * TALL * (rows - 1)] : [0, 0];
    for (const far of asked ? [...AWAY, ...FARTHER] : AWAY) {
      for (let n = 0; n < 8; n += 1) {
        // Try the wanted side first, then its neighbours.
        const turn = (n % 2 ? -1 : 1) * Math.ceil(n / 2), angle = side + (turn * Math.PI) / 4;
        const [c, s] = [Math.cos(angle), Math.sin(angle)];
        const at = { ...label, x: x + (far + wide) * c, y: y - (far + high) * s };
        const space = spaceOf(at);
        if (meets(space, spaces) || meets(space, own)) continue;
        if (far < LED) {
          spaces.push(space, ...own);
          return [at];
        }
        // The line to it must not cross a label, and no later label may lie on it.
        const lead = along([[x + OPEN * c, y - OPEN * s], leadTo(at, [x, y])]);
        if (lead.some((one) => meets(one, labels))) continue;
        spaces.push(space, ...own, ...lead);
        return [{ ...at, from: [x, y] }];
      }
    }
    return [];
  }
}

/** Returns boxes that fill a disc, px. */
const discs = (x: number, y: number, r: number): Space[] => [[1, 0.4], [0.8, 0.7], [0.4, 1]]
  .map(([u, v]) => ({ left: x - u * r, right: x + u * r, top: y - v * r, bottom: y + v * r }));

/** Most surfaces that labels avoid: a board of pegs has more. */
const MOST_LINES = 100;

/** Returns boxes along a line through points, px. */
function along(points: [number, number][]): Space[] {
  return points.slice(1).flatMap(([x, y], i) => {
    const [u, v] = points[i], parts = Math.ceil(Math.hypot(x - u, y - v) / ALONG);
    return Array.from({ length: Math.min(parts, 1000) + 1 }, (_, n) => {
      const share = parts ? n / parts : 0, px = u + share * (x - u), py = v + share * (y - v);
      return { left: px - THIN, right: px + THIN, top: py - THIN, bottom: py + THIN };
    });
  });
}

/** Most labels in the picture, and their order of importance. */
const MOST_LABELS = 6, ORDER = ["phi1_deg", "v1", "v2", "v2r", "x3", "v3", "d3", "y3", "t2", "t3"];

/** Returns the boxes that labels avoid: cards, scale bar, legend, handles, speeds on belts, the
 * path of a single particle or the places that a crowd passes, and visible surfaces. */
function takenBy(stage: Stage): Space[] {
  const { view, view: { free }, lab: { recording, machine } } = stage;
  const all = { left: -1e9, right: 1e9, top: -1e9, bottom: 1e9 };
  const path = recording && !recording.machine.interact ? recording.points(0, 2 / view.scale)
    .map(({ x, y }) => [view.px(x), view.py(y)] as [number, number]) : [];
  const home = stage.front.getBoundingClientRect();
  const speeds = [...stage.scenery.layer.querySelectorAll(".on-frame")].map((text) => {
    const { left, right, top, bottom } = text.getBoundingClientRect();
    return { left: left - home.left, right: right - home.left, top: top - home.top,
      bottom: bottom - home.top };
  });
  return [
    { ...all, bottom: free.top }, { ...all, top: free.bottom }, { ...all, right: free.left },
    { ...all, left: free.right }, ...stage.covered, stage.scaleBox,
    ...(stage.legend ? [stage.legend] : []), ...along(path), ...speeds,
    ...(recording?.machine.interact ? passed(stage, recording).map(([x, y]) =>
      ({ left: x - THIN, right: x + THIN, top: y - THIN, bottom: y + THIN })) : []),
    ...(machine?.pulley
      ? discs(view.px(0), view.py(0), machine.pulley.radius * view.scale) : []),
    // On a board of pegs there would be no room left.
    ...surfaceLines(stage).slice(0, MOST_LINES).flatMap(([, line]) => along(line)),
    ...stage.handles.map(({ x, y }) => {
      const [px, py] = [view.px(x), view.py(y)];
      return { left: px - 9, right: px + 9, top: py - 9, bottom: py + 9 };
    }),
  ];
}

class Symbols {
  layer;

  constructor(readonly stage: Stage) {
    this.layer = svg("g", { class: "symbols" });
    stage.back.append(this.layer);
    stage.drawers.push(() => this.draw());
    addEventListener("pointerover", (event) => this.point(event));
  }

  shown = true;

  /** The quantity whose number is under the pointer: it is placed first, with its value. */
  pointed = "";

  point({ target }: PointerEvent) {
    const row = (target as Element).closest?.("#numbers [data-id]") as HTMLElement | null;
    const id = row?.dataset.id ?? "";
    if (id === this.pointed) return;
    this.pointed = id;
    this.draw();
  }

  draw() {
    const { stage, layer } = this, { recording } = stage.lab;
    layer.replaceChildren();
    stage.labels = [];
    if (!this.shown || stage.blind || stage.held || !recording) return;
    if (recording.machine.interact) return;
    const { left, hit, down } = historyOf(stage.lab)?.stages[0] ?? {}, { view } = stage;
    this.wanted = [];
    if (left) this.separation(left);
    if (hit) {
      this.dot(hit);
      this.label("v2", hit.x, hit.y, [-1, 1]);
      this.label("v2r", hit.x, hit.y, [-1, -1]);
    }
    if (left && hit) this.flight("t2", left, hit);
    if (hit && down) {
      this.flight("t3", hit, down);
      const below = view.py(down.y) + 16, beside = Math.max(view.px(hit.x), view.px(down.x));
      this.measure("x3", [view.px(down.x), below], [view.px(hit.x), below],
        [view.py(down.y), view.py(hit.y)]);
      this.measure("y3", [beside + 22, view.py(hit.y)], [beside + 22, view.py(down.y)],
        [view.px(hit.x), view.px(down.x)]);
      const { pulley, radius } = recording.machine;
      if (pulley) {
        this.measure("d3", [beside + 48, view.py(pulley.radius + radius[0])],
          [beside + 48, view.py(down.y)], [view.px(0), view.px(down.x)]);
      }
    }
    if (down) {
      this.dot(down);
      this.label("v3", down.x, down.y, [-1, 1]);
    }
    const rank = ({ asked, id = "" }: Label) => (asked ? -1 : ORDER.indexOf(id));
    this.wanted.sort((a, b) => rank(a) - rank(b));
    const found = placed(this.wanted, takenBy(stage), MOST_LABELS);
    stage.labels = found.map(spaceOf);
    for (const label of found) {
      const { text, x, y, from, drawn = [] } = label;
      layer.append(...drawn);
      if (from) layer.append(svg("path", { d: `M${from}L${leadTo(label, from)}`, class: "leader" }));
      layer.append(svg("text", { x, y: y + 5, "text-anchor": "middle" }, text));
    }
  }

  wanted: Label[] = [];

  /** Request the label of a quantity at a point, px.
   * @param drawn what is drawn with it */
  want(
    id: string, x: number, y: number, side: number, drawn: Element[] = [],
    line: [number, number][] = [],
  ) {
    const { lab, words } = this.stage, { symbol, unit } = lab.data.quantities[id];
    if (id !== this.pointed) {
      this.wanted.push({ text: symbol, x, y, side, id, drawn, line });
      return;
    }
    const value = document.querySelector(`#numbers [data-id="${id}"] td`)?.textContent ?? "";
    const text = `${symbol} = ${value} ${words.unit(unit)}`;
    this.wanted.unshift({ text, x, y, side, asked: true, drawn, line });
  }

  /** @param y m
   * @param way direction from the point to its label */
  label(id: string, x: number, y: number, way: number[] = [1, 1]) {
    const { view } = this.stage;
    this.want(id, view.px(x), view.py(y), Math.atan2(way[1], way[0]));
  }

  dot({ x, y }: { x: number, y: number }) {
    const { view } = this.stage;
    this.layer.append(svg("circle", { cx: view.px(x), cy: view.py(y), r: 3 }));
  }

  /** Mark where the particle leaves the pulley, and the angle of that point from the top. */
  separation(left: Event) {
    const { view } = this.stage;
    const far = Math.hypot(left.x, left.y), angle = Math.atan2(left.x, left.y);
    this.dot(left);
    if (angle < LEAST_ANGLE) {
      // It leaves at the top: one label for speed and angle, unless one of them is pointed at.
      const id = this.pointed === "phi1_deg" ? "phi1_deg" : "v1";
      this.label(id, left.x, left.y, [0, 1]);
      if (this.pointed !== id) this.wanted[this.wanted.length - 1].text += ", φ₁ = 0";
      return;
    }
    this.label("v1", left.x, left.y);
    const r = 0.6 * far, [x, y] = [view.px(0), view.py(0)];
    const tip = [view.px(r * Math.sin(angle)), view.py(r * Math.cos(angle))];
    this.layer.append(svg("path", {
      d: `M${x} ${view.py(far)}V${y}L${view.px(left.x)} ${view.py(left.y)}`
        + `M${x} ${view.py(r)}A${r * view.scale} ${r * view.scale} 0 0 1 ${tip[0]} ${tip[1]}`,
    }));
    const way = [Math.sin(0.5 * angle), Math.cos(0.5 * angle)];
    this.label("phi1_deg", r * way[0], r * way[1], way);
  }

  /** Request a label at the middle of a flight. */
  flight(id: string, from: Event, to: Event) {
    const { recording } = this.stage.lab;
    const state = recording?.tracks[0].state(0.5 * (from.t + to.t));
    if (state) this.label(id, state.x, state.y);
  }

  /** Request a vertical or horizontal length between two arrow tips.
   * @param from px
   * @param to px
   * @param points where the lines to the measured points begin, px */
  measure(id: string, from: [number, number], to: [number, number], points: number[]) {
    const level = from[1] === to[1];
    if (Math.hypot(to[0] - from[0], to[1] - from[1]) < 6) return;
    const ends = [from, to].map(([x, y], n) => (level ? `M${x} ${points[n]}V${y + 4}`
      : `M${points[n]} ${y}H${x + 4}`));
    const drawn = [svg("path", { d: ends.join(""), class: "thin" }),
      svg("path", { d: `M${from[0]} ${from[1]}L${to[0]} ${to[1]}`, class: "length" })];
    this.want(id, 0.5 * (from[0] + to[0]), 0.5 * (from[1] + to[1]), level ? Math.PI : 0, drawn,
      [from, to]);
  }
}

export { Symbols, placed, spaceOf, takenBy };
