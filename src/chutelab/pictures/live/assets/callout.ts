// The marks of a choice: dashes round it, and a card beside it, in the best place.

import { linesOfJoints, pinsOf } from "./joints.ts";
import { cornersOf } from "./machine.ts";
import { PLATE, svg } from "./scenery.ts";
import type { Inspector } from "./inspector.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Stage } from "./stage.ts";
import type { Symbols } from "./symbols.ts";

type Point = [number, number];
/** Points by name */
type Named = [string, Point[]];

/** Distance of the places that are tried, and of the card from its part, pixels. */
const STEP = 24, OFF = 26;

/** Costs of covering a point of the chosen part, of a path, and of anything else; a pixel of
 * distance from the chosen part costs one, and a pixel from the former place these. */
const OWN = 4000, PATH = 60, OTHER = 30, STAYS = 3;

/** Distance of the points that represent a line, pixels. */
const ALONG = 22;

/** Elements at the outside of a body, and most points of one of them. */
const BODIES = ".belt, .wall, rect.steel, .gauge", MOST = 200;

/** Distance of the line round a body, and least radius of a ball there, pixels. */
const AROUND = 6, LEAST = 3;

/** Distance of the strands of a belt, in its thicknesses. */
const BELT = 4.5;

/** Free margin round a box in the picture (the scale bar, the legend), and its steps to the right,
 * pixels. */
const CLEAR = 14, ASIDE = 38;

/** Most particles and times of a crowd whose places are kept free. */
const SOME = 60, TIMES = 16;

/** Pixels from bodies to the frame round several. */
const FRAME = 12;

/** Points along a line through points, which are included. */
function along(points: Point[]): Point[] {
  return points.flatMap(([x, y], n) => {
    const [u, v] = points[n + 1] ?? [x, y];
    const many = Math.min(MOST, Math.ceil(Math.hypot(u - x, v - y) / ALONG));
    return Array.from({ length: Math.max(1, many) }, (_, k) =>
      [x + (k / many || 0) * (u - x), y + (k / many || 0) * (v - y)] as Point);
  });
}

/** Points along the drawing of a machine, and starts and places of its balls, px, by name. */
function pointsOf(stage: Stage): Named[] {
  const { view, lab: { machine, recording, t } } = stage;
  const balls = machine?.releases.slice(0, MOST).map((release, i): Named => {
    const { x, y } = recording?.tracks[i]?.state(t) ?? release;
    return [machine.streams[release.stream], [
      [view.px(x), view.py(y)], [view.px(release.x), view.py(release.y)]]];
  });
  return [...surfaceLines(stage).map(([name, line]): Named => [name, along(line)]), ...balls ?? []];
}

/** Surfaces and sensors as lines through points, px, by name, with the lower side of belts; points
 * far outside the picture are at its edge. It needs no layout by the browser. */
function surfaceLines({ lab, view, scenery, posed: machine }: Stage): Named[] {
  if (!machine) return [];
  const px = (x: number, y: number, down = 0): Point => [
    Math.min(Math.max(view.px(x), -50), view.width + 50),
    Math.min(Math.max(view.py(y) + down, -50), view.height + 50),
  ];
  const { segments, arcs, pulley, surfaces } = machine, deep = BELT * scenery.thick;
  const bend = (x: number, y: number, radius: number, begin: number, extent: number) => {
    const many = Math.min(24, Math.ceil((radius * extent * view.scale) / 9) + 2);
    return Array.from({ length: many + 1 }, (_, n) => px(
      x + radius * Math.cos(begin + (n * extent) / many),
      y + radius * Math.sin(begin + (n * extent) / many)));
  };
  // Round the drive pulley and the one at the other end, and back below.
  const incoming = ({ radius: r, incline, surface }: NonNullable<typeof pulley>) => {
    const long = segments.find((one) => one.surface === surface)?.length ?? 0;
    const [c, s] = [Math.cos(incline), Math.sin(incline)], round = 2 * Math.PI;
    return [bend(0, 0, r, 0, round), bend(-long * c, -long * s, r, 0, round),
      [px(0, 0), px(-long * c, -long * s)],
      [px(r * s, -r * c), px(r * s - long * c, -r * c - long * s)]];
  };
  // Plates are steel behind their faces.
  const plates = new Set(lab.scene?.plates.map(({ name }) => name ?? "plate"));
  const steel = (PLATE * scenery.thick) / view.scale;
  return [
    ...segments.flatMap(({ x, y, tx, ty, length, speed, surface }) =>
      (speed ? [0, 0.5 * deep, deep] : [0]).flatMap((down) =>
        (plates.has(surfaces[surface]) ? [0, steel] : [0]).map((back): Named =>
          [surfaces[surface], [px(x + back * ty, y - back * tx, down),
            px(x + back * ty + tx * length, y - back * tx + ty * length, down)]]))),
    ...arcs.map(({ x, y, radius, begin, extent, surface }): Named =>
      [surfaces[surface], bend(x, y, radius, begin, extent)]),
    ...(pulley ? incoming(pulley).map((line): Named => [surfaces[pulley.surface], line]) : []),
    ...(lab.scene?.sensor ?? []).concat(lab.recording ? linesOfJoints(lab.recording, lab.t) : [])
      .map(({ name, from, to }): Named => [name, [px(...from), px(...to)]]),
  ];
}

/** Places of particles of a crowd, px. */
function passed({ view }: Stage, { tracks, begin, end }: Recording): Point[] {
  const every = Math.ceil(tracks.length / SOME);
  return tracks.filter((_, i) => i % every === 0).flatMap((track) =>
    Array.from({ length: TIMES }, (_, n) => track.state(begin + ((end - begin) * n) / (TIMES - 1)))
      .flatMap((state): Point[] => (state ? [[view.px(state.x), view.py(state.y)]] : [])));
}

/** Discs in which parts turn all the time, px: their middles and radii. What a drum holds comes
 * everywhere in it. */
function drums({ lab: { machine }, view }: Stage, lines: Named[]): [Point, number][] {
  return (machine?.movers ?? []).filter(({ turn }) => turn).map(({ surface, pivot: [x, y] }) => {
    const [u, v] = [view.px(x), view.py(y)];
    const own = lines.filter(([name]) => name === machine?.surfaces[surface]);
    return [[u, v], Math.max(0, ...own.flatMap(([, points]) =>
      points.map(([px, py]) => Math.hypot(px - u, py - v))))];
  });
}

/** Place of a box that covers neither surfaces and tracks nor taken boxes, and is in no drum: from
 * a corner up, then further to the right; null if there is none.
 * @param size width and height, px
 * @param corner its lower left one, px
 * @returns its lower left corner */
function freePlace(stage: Stage, size: Point, corner: Point, taken: Stage["covered"] = []) {
  const [wide, high] = size, [left, bottom] = corner;
  const { view, lab } = stage, { recording } = lab, { free } = view;
  const path = recording ? stage.trackPoints(recording, 4 / view.scale) : [];
  const lines = surfaceLines(stage), turning = drums(stage, lines);
  const there = [...lines.map(([, line]) => line),
    ...path.map((points) => points.map(({ x, y }) => [view.px(x), view.py(y)] as Point))]
    .flatMap(along).concat(recording?.machine.interact ? passed(stage, recording) : []);
  for (let x = left; x + wide < free.right; x += ASIDE) {
    for (let y = bottom; y - high > free.top + CLEAR; y -= ALONG) {
      const meets = (u: number, v: number) => u > x - CLEAR && u < x + wide + CLEAR
        && v > y - high - CLEAR && v < y + CLEAR;
      const isFree = taken.every((box) => box.left > x + wide + CLEAR || box.right < x - CLEAR
        || box.top > y + CLEAR || box.bottom < y - high - CLEAR)
        && turning.every(([[u, v], radius]) => Math.hypot(Math.max(x - u, u - x - wide, 0),
          Math.max(y - high - v, v - y, 0)) > radius + CLEAR);
      if (isFree && !there.some(([u, v]) => meets(u, v))) return [x, y] as Point;
    }
  }
  return null;
}

/** Dashes round chosen parts, a line round the part pointed at: below each body its own shape,
 * wider, and over that a little less wide in the colour of the background. Round several chosen
 * parts a frame by which they are moved. */
function drawOutline(stage: Stage) {
  const { lab, view, outline, parts, pointed, scenery } = stage;
  outline.replaceChildren();
  const all = svg("g");
  outline.append(all);
  const { machine, recording, t } = lab;
  for (const name of new Set([...parts, pointed])) {
    const own = parts.includes(name) ? "chosen" : "pointed";
    const bodies = scenery.drawingsOf(name).flatMap((group) =>
      [...group.querySelectorAll(BODIES)].map((shape) => {
        const wide = Number(shape.getAttribute("stroke-width") ?? 0);
        // A moving surface is changed at its place as written, which stays outlined.
        const copy = shape.cloneNode(false), body = shape.closest(".part") as Element;
        const by = [...own === "pointed" && group !== body ? [group] : [], body]
          .map((one) => one.getAttribute("transform") ?? "").join(" ").trim();
        if (by) copy.setAttribute("transform", by);
        return [copy, wide] as [any, number];
      }));
    const stream = machine?.streams.indexOf(name) ?? -1;
    machine?.releases.forEach((release, i) => {
      if (release.stream !== stream || bodies.length > 40) return;
      const track = recording?.tracks[i], now = track?.state(t);
      const state = now ?? release, angle = track && now ? track.angle(t) : release.angle;
      const r = Math.max(LEAST, machine.radius[i] * view.scale);
      const corners = cornersOf(machine, i, state, angle);
      bodies.push([corners.length ? svg("polygon", { points: corners.map(([x, y]) =>
        `${view.px(x)},${view.py(y)}`).join(" ") })
        : svg("circle", { cx: view.px(state.x), cy: view.py(state.y), r }), 0]);
    });
    for (const line of recording ? linesOfJoints(recording, t) : []) {
      if (line.name !== name) continue;
      const [[x1, y1], [x2, y2]] = [line.from, line.to].map(([x, y]) => [view.px(x), view.py(y)]);
      bodies.push([svg("line", { x1, y1, x2, y2, "stroke-linecap": "round" }), 2]);
    }
    for (const pin of recording ? pinsOf(recording, t) : []) {
      if (pin.name !== name) continue;
      bodies.push([svg("circle", { cx: view.px(pin.at[0]), cy: view.py(pin.at[1]), r: 4 }), 0]);
    }
    const layers: [number, string][] = [[AROUND + 1, own], [AROUND - 1, "within"]];
    for (const [add, kind] of layers) {
      for (const [shape, wide] of bodies) {
        const copy = shape.cloneNode(false);
        copy.setAttribute("class", kind);
        copy.setAttribute("stroke-width", wide + 2 * add);
        (own === "chosen" ? all : outline).append(copy);
      }
    }
  }
  stage.frame = null;
  if (parts.length < 2) return;
  const { x, y, width, height } = all.getBBox();
  stage.frame = {
    left: x - FRAME, right: x + width + FRAME, top: y - FRAME, bottom: y + height + FRAME,
  };
  outline.append(svg("rect", { class: "frame-all", x: x - FRAME, y: y - FRAME, rx: 6,
    width: width + 2 * FRAME, height: height + 2 * FRAME }));
}

class Callout {
  leader = svg("path", { class: "leader" });

  constructor(
    readonly inspector: Inspector, readonly stage: Stage, readonly lab: Lab,
    readonly symbols: Symbols,
  ) {
    stage.over.append(this.leader);
    inspector.listeners.push(() => this.place());
    // With more fields it is higher.
    inspector.panel.addEventListener("toggle", () => this.place(), true);
    stage.drawers.push(() => this.place());
  }

  /** Place it, and the labels again if it has moved. */
  place() {
    const { stage } = this, before = JSON.stringify(stage.covered);
    // A dragged part has no card.
    if (stage.held) return;
    stage.covered = this.find();
    if (JSON.stringify(stage.covered) !== before) this.symbols.draw();
  }

  /** Its place, px, and the parts beside it; it stays there as long as it covers nothing. */
  was = { parts: "", at: [0, 0] as Point };

  /** @returns its box, px */
  find(): Stage["covered"] {
    const { inspector: { panel, parts }, stage, lab, leader } = this, { view } = stage;
    leader.setAttribute("d", "");
    const floats = !panel.hidden && getComputedStyle(panel).position === "fixed";
    if (!floats) {
      panel.style.transform = "";
      return [];
    }
    const { free } = view, { offsetWidth: wide, offsetHeight: high } = panel;
    const isSeen = ([x, y]: Point) => x > 0 && x < view.width && y > 0 && y < view.height;
    const own: Point[] = [], other: Point[] = [];
    for (const [name, points] of pointsOf(stage)) {
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
    const names = parts.join("\n"), { was } = this;
    const bottom = Math.max(free.top, Math.min(free.bottom, view.height - 8) - high);
    for (let x = free.left + 8; x <= free.right - wide; x += STEP) {
      for (let y = free.top; y <= bottom; y += STEP) {
        const away = names === was.parts
          ? STAYS * Math.hypot(x - was.at[0], y - was.at[1]) : 0;
        const cost = Math.hypot(x + 0.5 * wide - cx, y + 0.5 * high - cy) + away
          + OWN * count([...own, ...grips], x, y, OFF) + PATH * count(path, x, y, 8)
          + OTHER * count(other, x, y, 4);
        if (cost < best) [best, at] = [cost, [x, y]];
      }
    }
    this.was = { parts: names, at };
    const box = stage.home.getBoundingClientRect();
    panel.style.transform = `translate(${box.left + at[0]}px, ${box.top + at[1]}px)`;
    // From the nearest point of the chosen part to the nearest of the card.
    const edge = ([x, y]: Point): Point => [Math.min(Math.max(x, at[0]), at[0] + wide),
      Math.min(Math.max(y, at[1]), at[1] + high)];
    const far = (point: Point) => Math.hypot(edge(point)[0] - point[0], edge(point)[1] - point[1]);
    const [first] = own.sort((a, b) => far(a) - far(b));
    const covered = [{
      left: at[0], right: at[0] + wide, top: at[1], bottom: at[1] + high,
    }];
    if (!first || far(first) < OFF) return covered;
    const [x, y] = first;
    leader.setAttribute("d", `M${edge(first)}L${x} ${y}m-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0`);
    return covered;
  }
}

export { Callout, drawOutline, freePlace, passed, pointsOf, surfaceLines };
