// Draws a machine: running belts, pulleys, plates with a struck face, walls, the grid.
//
// Bodies have volume. The surface that particles meet is the outer edge of a belt and the coloured
// face of a plate; what is drawn of their thickness lies on the other side.

import { carried, poseOf, type Swings } from "./motion.ts";
import type { Mover } from "./plan.ts";
import type { Arc, Machine, Segment } from "./machine.ts";
import type { Scene } from "./scene.ts";
import type { View } from "./view.ts";
import type { Words } from "./words.ts";

const SVG = "http://www.w3.org/2000/svg";

/** Returns an element with attributes, listeners (functions, by the name of the event) and
 * children. */
function filled(element: any, attributes: Record<string, unknown>, children: (string | Node)[]) {
  for (const [key, value] of Object.entries(attributes)) {
    if (typeof value === "function") element.addEventListener(key, value);
    else element.setAttribute(key, String(value));
  }
  element.append(...children);
  return element;
}

/** Set an attribute, unless it has this value already: that saves the browser work. */
function set(element: Element, name: string, value: string) {
  if (element.getAttribute(name) !== value) element.setAttribute(name, value);
}

const svg = (
  name: string, attributes: Record<string, unknown> = {}, ...children: (string | Node)[]
): any => filled(document.createElementNS(SVG, name), attributes, children);

/** Distance between the cleats of a belt and length of a cleat, px. */
const PITCH = 24, CLEAT = 5;

/** Thickness of belts, px: least, most, and as a share of the picture's height. */
const THICK = [3.5, 9, 0.0117];

/** Distance of the two strands of a belt without pulleys, in thicknesses of the belt. */
const STRANDS = 4.5;

/** Thickness of plates, in thicknesses of belts. */
const PLATE = 1.4;

/** Thickness of walls: least and most, px, and its limits as shares of the picture's height and of
 * the smallest bend's radius. The last leaves room between pegs. */
const WALL = [0.8, 4.5, 0.02, 0.4];

/** Least radius of a pulley drawn with spokes, and distance between rollers, px. */
const SPOKED = 9, ROLLERS = 128;

/** What moves with the shown time: cleats, or the spokes of a turning wheel. */
type Moving = { element: any, speed: number, x?: number, y?: number, radius?: number };
/** Drawings of a moving part. */
type Carried = { elements: any[], mover: Mover };
type Gate = { element: any, piece: Segment | Arc };

class Scenery {
  moving: Moving[] = [];
  gates: Gate[] = [];
  carried: Carried[] = [];
  /** Drawings of parts by everything that determines them, each with what moves in it; `grid` is
   * the same key for the grid. */
  kept: Map<string, { element: any, moving: Moving[] }> = new Map();
  grid = "";
  layer: any;
  ground: any;
  scale: any;
  thick = 6;
  wide = WALL[1];
  /** The user wants less motion: belts and wheels then stand still in the picture. */
  calm = matchMedia("(prefers-reduced-motion: reduce)");

  constructor(readonly view: View, readonly words: Words) {
    this.ground = svg("g", { class: "ground", "aria-hidden": "true" });
    this.scale = svg("g", { class: "scale", "aria-hidden": "true" });
    this.layer = svg("g", { class: "surfaces" });
  }

  draw(machine: Machine, scene: Scene | undefined) {
    const { height } = this.view, [least, most, share] = THICK;
    this.thick = Math.min(most, Math.max(least, share * height));
    const bend = machine.arcs.reduce((small, arc) => Math.min(small, arc.radius), Infinity);
    this.wide = Math.max(WALL[0],
      Math.min(WALL[1], WALL[2] * height, WALL[3] * bend * this.view.scale));
    const { kept, view: { x, y, scale, width, free } } = this, drawn: any[] = [];
    const seen = [x, y, scale, width, height, free, this.wide];
    this.kept = new Map();
    // Keep the drawing of an unchanged part: the browser has nothing to paint.
    const part = (name: string, of: unknown, make: () => any) => {
      const key = JSON.stringify([name, of, seen]), was = kept.get(key), from = this.moving.length;
      kept.delete(key);
      const element = was?.element ?? make();
      if (was) this.moving.push(...was.moving);
      else {
        element.setAttribute("data-part", name);
        element.append(svg("title", {}, this.words.name(name)));
      }
      this.kept.set(key, { element, moving: this.moving.slice(from) });
      drawn.push(element);
      return element;
    };
    this.moving = [];
    this.gates = [];
    this.carried = machine.movers.map((mover) => ({ elements: [], mover }));
    const { pulley, releases } = machine;
    const bodies: [() => any, Segment | Arc, unknown?][] = [];
    const plates = new Set(scene?.plates.map(({ name }) => name ?? "plate") ?? []);
    const round = (arc: Arc) => arc.extent >= 2 * Math.PI && arc.speed !== 0;
    const belts = new Map<number, { lines: Segment[], wheels: Arc[] }>();
    for (const line of machine.segments.filter(({ speed }) => speed)) {
      const its = belts.get(line.surface) ?? { lines: [], wheels: [] };
      belts.set(line.surface, its);
      its.lines.push(line);
    }
    for (const arc of machine.arcs) {
      if (round(arc) && belts.has(arc.surface)) belts.get(arc.surface)?.wheels.push(arc);
      else if (round(arc)) {
        const holds = releases.some((one) => Math.hypot(one.x - arc.x, one.y - arc.y) < arc.radius);
        bodies.push([() => this.drum(arc, holds), arc, holds]);
      } else bodies.push([() => this.bend(arc), arc]);
    }
    for (const { lines, wheels } of belts.values()) {
      if (wheels.length) bodies.push([() => this.conveyor(wheels), lines[0], wheels]);
      else if (lines[0].surface === pulley?.surface) {
        bodies.push([() => this.incoming(lines[0], machine), lines[0], pulley]);
      } else for (const line of lines) bodies.push([() => this.belt(line), line]);
    }
    for (const line of machine.segments.filter(({ speed }) => !speed)) {
      const isPlate = plates.has(machine.surfaces[line.surface]);
      bodies.push([() => (isPlate ? this.plate(line) : this.wall(line)), line, isPlate]);
    }
    for (const { name, from, to } of scene?.sensor ?? []) {
      part(name, [from, to], () => this.sensor(from, to));
    }
    for (const [draw, body, more] of bodies) {
      const make = () => (body.one_sided ? svg("g", {}, draw(), this.passage(body)) : draw());
      const { surface, appears, vanishes } = body;
      const waits = machine.triggers.some((one) => one.surface === surface && one.doing !== "starts");
      const moves = this.carried.find(({ mover }) => mover.surface === surface);
      const element = part(machine.surfaces[surface], [body, more, Boolean(moves)],
        () => (moves ? svg("g", {}, make()) : make()));
      moves?.elements.push(element);
      if (waits || isFinite(appears) || isFinite(vanishes)) {
        element.classList.add("gate");
        this.gates.push({ element, piece: body });
      }
    }
    for (const { mover } of this.carried) {
      const row = [...scene?.plates ?? [], ...scene?.surface ?? []]
        .find(({ name }) => (name ?? "plate") === machine.surfaces[mover.surface]);
      drawn.push(this.motion(mover, machine, row?.travel?.to));
    }
    const stays = new Set(drawn);
    for (const old of [...this.layer.children]) if (!stays.has(old)) old.remove();
    let next = this.layer.firstChild;
    for (const one of drawn) {
      if (one === next) next = one.nextSibling;
      else this.layer.insertBefore(one, next);
    }
  }

  /** Returns symbols of a part's motion: bolt, spring, motor and stops of a hinge, or arrows
   * along its path. */
  motion(mover: Mover, { segments, arcs }: Machine, goal?: [number, number]) {
    const { view } = this, group = svg("g", { class: "motion" });
    const { pivot, by, frequency, way, lasts, turn, inertia, spring, stops, motor } = mover;
    const at = ([x, y]: [number, number]) => [view.px(x), view.py(y)];
    const own = [...segments.filter(({ surface }) => surface === mover.surface)
      .flatMap(({ ends: [x, y, u, v] }): [number, number][] => [[x, y], [u, v]]),
    ...arcs.filter(({ surface }) => surface === mover.surface)
      .map(({ x, y }): [number, number] => [x, y])];
    const far = ([x, y]: [number, number]) => Math.hypot(x - pivot[0], y - pivot[1]);
    const tip = own.reduce((best, one) => (far(one) > far(best) ? one : best), own[0] ?? pivot);
    const [px, py] = at(pivot), draw = (d: string, kind: string) =>
      group.append(svg("path", { d, class: kind }));
    const arrow = (from: number[], to: number[]) => {
      const long = Math.hypot(to[0] - from[0], to[1] - from[1]) || 1;
      const [u, v] = [(to[0] - from[0]) / long, (to[1] - from[1]) / long];
      draw(`M${from}L${to}m${-6 * u - 4 * v} ${-6 * v + 4 * u}L${to}`
        + `l${-6 * u + 4 * v} ${-6 * v - 4 * u}`, "way");
    };
    const speed = inertia ? motor[1] && motor[0] : turn;
    if (speed) {
      const side = Math.sign(speed), end = [px - 15 * side, py + 4];
      draw(`M${px + 15 * side} ${py + 4}A15.5 15.5 0 1 ${speed > 0 ? 0 : 1} ${end}`, "way");
      arrow([end[0] - side, end[1] - 4], end);
    }
    if (inertia && spring) {
      const turns = Array.from({ length: 37 }, (_, n) => [
        px + (2 + 0.28 * n) * Math.cos(n / 2.2), py - (2 + 0.28 * n) * Math.sin(n / 2.2)]);
      draw(`M${turns.join("L")}`, "spring");
    }
    if (inertia) {
      for (const angle of stops.filter(isFinite)) {
        draw(`M${px} ${py}L${at(carried({ x: pivot[0], y: pivot[1], turn: angle }, mover, tip))}`,
          "limit");
      }
    }
    if (inertia || turn) group.append(svg("circle", { cx: px, cy: py, r: 4.5, class: "bolt" }));
    if (lasts && goal) arrow([px, py], at([pivot[0] + way[0], pivot[1] + way[1]]));
    if (frequency) {
      const [x, y] = at([0.5 * (pivot[0] + tip[0]), 0.5 * (pivot[1] + tip[1])]);
      const size = Math.hypot(...by) || 1, [u, v] = [by[0] / size, -by[1] / size];
      const long = Math.max(14, size * view.scale) + 6;
      for (const sign of [1, -1]) arrow([x, y], [x + sign * long * u, y + sign * long * v]);
    }
    return group;
  }

  /** Returns the drawings of a part. */
  drawingsOf(name: string): any[] {
    return [...this.layer.children].filter((one) => one.getAttribute("data-part") === name);
  }

  /** Bring moving parts, cleats and wheels to a time, s.
   * @param swings motions of hinges by surface */
  turn(t: number, swings?: Map<number, Swings>) {
    const { view, view: { scale } } = this;
    for (const { elements, mover } of this.carried) {
      const pose = poseOf(mover, t, swings?.get(mover.surface)), { pivot: [x, y] } = mover;
      const way = `translate(${(pose.x - x) * scale} ${(y - pose.y) * scale}) rotate(${
        (-pose.turn * 180) / Math.PI} ${view.px(x)} ${view.py(y)})`;
      for (const element of elements) set(element, "transform", way);
    }
    for (const { element, speed, x, y, radius } of this.calm.matches ? [] : this.moving) {
      if (radius === undefined) {
        set(element, "stroke-dashoffset", String(-((speed * t * scale) % PITCH)));
      } else {
        const angle = ((speed * t) / radius) * (180 / Math.PI);
        set(element, "transform", `rotate(${angle % 360} ${x} ${y})`);
      }
    }
    for (const { element, piece: { appears, vanishes } } of this.gates) {
      element.classList.toggle("absent", t < appears || t >= vanishes);
    }
  }

  /** Draw grid lines at round numbers of metres, and the scale bar, a share of a mesh long. */
  drawGround(left: number, low: number, share: number) {
    const { view, ground } = this, { width, height, scale, mesh: step } = view;
    const now = JSON.stringify([view.x, view.y, scale, width, height, left, low, share]);
    if (now === this.grid) return;
    this.grid = now;
    const lines = (offset: number) => {
      let path = "";
      for (let n = Math.ceil(view.worldX(0) / step - offset); ; n += 1) {
        const x = view.px((n + offset) * step);
        if (x > width) break;
        path += `M${x.toFixed(1)} 0V${height}`;
      }
      for (let n = Math.ceil(view.worldY(height) / step - offset); ; n += 1) {
        const y = view.py((n + offset) * step);
        if (y < 0) break;
        path += `M0 ${y.toFixed(1)}H${width}`;
      }
      return path;
    };
    const size = share * step, long = size * scale, y = low;
    const [value, unit] = size < 0.01 ? [1e3 * size, "mm"] : [size, "m"];
    const text = svg("text", { x: left + 0.5 * long, y: y - 8, "text-anchor": "middle" },
      `${this.words.plain(Number(value.toPrecision(3)))} ${unit}`);
    ground.replaceChildren(
      svg("path", { d: lines(0.5), class: "minor" }), svg("path", { d: lines(0), class: "major" }));
    const bar = `M${left} ${y - 5}v10m0-5h${long}m0-5v10`;
    this.scale.replaceChildren(svg("path", { d: bar, class: "halo" }), svg("path", { d: bar }),
      text);
  }

  /** Returns a belt with running cleats along a path in px; its outer edge is on the left of the
   * path. */
  band(path: string, speed: number, edge = "") {
    const group = svg("g");
    const cleats = svg("path", {
      d: path, class: "cleat", "stroke-width": 0.42 * this.thick,
      "stroke-dasharray": `${CLEAT} ${PITCH - CLEAT}`,
    });
    group.append(svg("path", { d: path, class: "belt", "stroke-width": this.thick }), cleats);
    if (edge) group.append(svg("path", { d: edge, class: "belt-edge" }));
    this.moving.push({ element: cleats, speed });
    return group;
  }

  /** Add the frame that carries a belt: a bar, in the belt's coordinates, px. */
  frame(group: any, from: number, to: number, y: number, thick: number) {
    if (to - from < 20 || thick < 3) return;
    group.append(svg("rect", {
      class: "frame", x: from, y: y - 0.5 * thick, width: to - from, height: thick,
      rx: Math.min(5, thick / 4),
    }));
  }

  /** Write the speed of a belt on its frame if the frame is large enough. */
  tell(
    group: any, from: number, to: number, y: number, thick: number, speed: number, upright = 1,
  ) {
    if (thick < 15 || to - from < 150) return;
    const said = `${this.words.fixed(Math.abs(speed), 1)} m/s`;
    const text = svg("text", {
      class: "on-frame", x: 0.5 * (from + to), y: y + 5, "text-anchor": "middle",
      transform: upright < 0 ? `rotate(180 ${0.5 * (from + to)} ${y})` : "",
    });
    text.textContent = speed * upright > 0 ? `${said} →` : `← ${said}`;
    group.append(text);
  }

  wheel(x: number, y: number, r: number, speed: number, radius: number) {
    const group = svg("g", { class: "wheel" });
    group.append(svg("circle", { cx: x, cy: y, r, class: "steel" }));
    if (r < SPOKED) return group;
    const spokes = svg("g"), wide = Math.max(1.5, 0.12 * r);
    for (let n = 0; n < 5; n += 1) {
      const [c, s] = [Math.cos(0.4 * Math.PI * n), Math.sin(0.4 * Math.PI * n)];
      spokes.append(svg("path", {
        class: "spoke", "stroke-width": wide,
        d: `M${x + 0.3 * r * c} ${y + 0.3 * r * s}L${x + 0.8 * r * c} ${y + 0.8 * r * s}`,
      }));
    }
    group.append(spokes, svg("circle", { cx: x, cy: y, r: 0.16 * r, class: "bolt" }));
    this.moving.push({ element: spokes, speed, x, y, radius });
    return group;
  }

  /** Returns the incoming belt: a loop round the drive pulley and an equal pulley at the other
   * end. */
  incoming({ length, speed }: Segment, { pulley }: Machine) {
    const { view, thick } = this, group = svg("g", { class: "part" });
    const { radius, incline } = pulley as { radius: number, incline: number };
    const [x, y, scale] = [view.px(0), view.py(0), view.scale];
    const r = radius * scale, inner = Math.max(r - 0.5 * thick, 0.5 * r), long = length * scale;
    group.setAttribute("transform", `rotate(${(-incline * 180) / Math.PI} ${x} ${y})`);
    const loop = stadium(x - long, x, y, inner), out = inner + 0.36 * thick;
    const edge = `M${x - long} ${y - out}H${x}A${out} ${out} 0 0 1 ${x + out} ${y}`;
    const wheel = Math.max(r - thick - 1, 0.4 * r);
    // Begin at the left edge of the picture at most, so that the speed is visible.
    const seen = Math.max(x - long + r, -0.02 * view.width);
    if (r > 2 * thick) {
      const wide = Math.min(26, 0.6 * wheel);
      this.frame(group, x - long + 1.3 * r, x - 1.3 * r, y, wide);
      this.tell(group, Math.max(seen, this.view.free.left), x - 1.3 * r, y, wide, speed);
    }
    group.append(this.band(loop, speed, edge),
      this.wheel(x - long, y, wheel, speed, radius), this.wheel(x, y, wheel, speed, radius));
    return group;
  }

  /** Returns a belt without pulleys: a loop on rollers, below the surface that carries. */
  belt({ x, y, tx, ty, length, speed }: Segment) {
    const { view, thick } = this, group = svg("g", { class: "part" });
    const long = length * view.scale, back = Math.abs(tx) > 1e-9 ? tx < 0 : ty < 0;
    // Coordinates along the belt, from its left end; particles are above.
    const [ax, ay] = back ? [x + tx * length, y + ty * length] : [x, y];
    const angle = Math.atan2(back ? -ty : ty, back ? -tx : tx);
    const [px, py] = [view.px(ax), view.py(ay)];
    group.setAttribute("transform", `translate(${px} ${py}) rotate(${(-angle * 180) / Math.PI})`);
    const turn = Math.min(0.5 * STRANDS * thick, 0.25 * long), top = 0.5 * thick;
    const onward = back ? -speed : speed;
    const middle = top + turn, loop = stadium(0, long, middle, turn);
    const roller = Math.max(turn - 0.8 * thick, 1);
    this.frame(group, 0, long, middle, Math.min(24, 2 * turn - 1.6 * thick));
    const rollers = Math.max(1, Math.round(long / ROLLERS));
    for (let n = 0; n <= rollers && rollers < 400; n += 1) {
      group.append(svg("circle", { cx: (long * n) / rollers, cy: middle, r: roller, class: "bolt" }));
    }
    group.append(this.band(loop, onward, `M0 ${0.14 * thick}H${long}`));
    const level = Math.abs(angle) < 0.02;
    const { free } = view;
    const left = level ? Math.max(0, free.left - px) : 0;
    const right = level ? Math.min(long, free.right - px) : long;
    const between = (right - left) / Math.max(1, Math.round((right - left) / ROLLERS));
    if (between > 90 && 2 * turn - 1.6 * thick >= 15) {
      // Between two rollers, near the middle of the visible part.
      const spacing = long / rollers, n = Math.round(0.5 * (left + right) / spacing - 0.5);
      const at = (n + 0.5) * spacing;
      this.tell(group, at - 80, at + 80, middle, 24, onward);
    }
    return group;
  }

  /** Returns a belt round two pulleys, which carries on both strands. */
  conveyor(wheels: Arc[]) {
    const { view, thick } = this, group = svg("g", { class: "part" });
    const [a, b] = wheels, scale = view.scale;
    const r = a.radius * scale, inner = Math.max(r - 0.5 * thick, 0.5 * r);
    const angle = Math.atan2(b.y - a.y, b.x - a.x), long = Math.hypot(b.x - a.x, b.y - a.y) * scale;
    const [px, py] = [view.px(a.x), view.py(a.y)];
    group.setAttribute("transform", `translate(${px} ${py}) rotate(${(-angle * 180) / Math.PI})`);
    const loop = stadium(0, long, 0, inner);
    const speed = a.speed, wheel = Math.max(r - thick - 1, 0.4 * r);
    const upright = Math.cos(angle) >= 0 ? 1 : -1, wide = Math.min(24, 0.6 * wheel);
    if (wheel > SPOKED) {
      this.frame(group, 1.3 * r, long - 1.3 * r, 0, wide);
      this.tell(group, 1.3 * r, long - 1.3 * r, 0, wide, speed, upright);
    }
    group.append(this.band(loop, speed), this.wheel(0, 0, wheel, speed, a.radius),
      this.wheel(long, 0, wheel, speed, a.radius));
    return group;
  }

  /** Returns a full turning circle: a drum if particles begin inside of it, else a wheel. */
  drum(arc: Arc, holds: boolean) {
    const { view, thick } = this, { x, y, radius, speed } = arc;
    const group = svg("g", { class: "part" });
    const [px, py, r] = [view.px(x), view.py(y), radius * view.scale];
    const line = r + (holds ? 0.5 : -0.5) * thick;
    const ring = stadium(px, px, py, line);
    if (!holds) group.append(this.wheel(px, py, Math.max(r - thick - 1, 0.4 * r), speed, radius));
    group.append(this.band(ring, speed));
    return group;
  }

  /** Returns an arc: a running belt if it has a speed, else a wall. */
  bend(arc: Arc) {
    const group = svg("g", { class: "part" });
    if (arc.speed) group.append(this.band(this.arcPath(arc), arc.speed));
    else group.append(this.line(this.arcPath(arc)));
    return group;
  }

  arcPath({ x, y, radius, begin, extent }: Arc) {
    const { view } = this, r = radius * view.scale;
    const at = (angle: number) =>
      `${view.px(x + radius * Math.cos(angle))} ${view.py(y + radius * Math.sin(angle))}`;
    const parts = extent >= 2 * Math.PI ? 2 : 1;
    let path = `M${at(begin)}`;
    for (let n = 1; n <= parts; n += 1) {
      const wide = extent / parts > Math.PI ? 1 : 0;
      path += `A${r} ${r} 0 ${wide} 0 ${at(begin + (extent * n) / parts)}`;
    }
    return path;
  }

  /** Returns a plate: a face, and steel behind it (on the right, seen along the segment). */
  plate({ x, y, tx, ty, length }: Segment) {
    const { view, thick } = this, group = svg("g", { class: "part" });
    const long = length * view.scale, deep = PLATE * thick;
    const angle = Math.atan2(ty, tx);
    group.setAttribute("transform",
      `translate(${view.px(x)} ${view.py(y)}) rotate(${(-angle * 180) / Math.PI})`);
    const face = 0.25 * thick;
    group.append(
      svg("rect", { class: "steel", x: 0, y: face, width: long, height: deep, rx: 1.5 }),
      svg("path", { class: "face", d: `M0 ${face}H${long}`, "stroke-width": 2 * face }),
    );
    return group;
  }

  /** Returns a counting line; its arrow shows the direction that counts up: to the right of the
   * line. */
  sensor(from: [number, number], to: [number, number]) {
    const { view } = this, group = svg("g", { class: "part sensor" });
    const [x, y, u, v] = [view.px(from[0]), view.py(from[1]), view.px(to[0]), view.py(to[1])];
    const long = Math.hypot(u - x, v - y) || 1, across = [(y - v) / long, (u - x) / long];
    const [mx, my] = [0.5 * (x + u), 0.5 * (y + v)];
    const tip = [mx + 16 * across[0], my + 16 * across[1]];
    const barb = (side: number) => [tip[0] - 6 * across[0] + side * 5 * across[1],
      tip[1] - 6 * across[1] - side * 5 * across[0]];
    group.append(svg("path", { class: "gauge", d: `M${x} ${y}L${u} ${v}`, "stroke-width": 3 }),
      svg("path", { class: "way", d: `M${mx} ${my}L${tip}M${barb(1)}L${tip}L${barb(-1)}` }));
    return group;
  }

  wall({ x, y, tx, ty, length }: Segment) {
    const { view } = this, group = svg("g", { class: "part" });
    const end = [x + tx * length, y + ty * length];
    group.append(this.line(`M${view.px(x)} ${view.py(y)}L${view.px(end[0])} ${view.py(end[1])}`));
    return group;
  }

  /** Returns an arrow across a one-sided surface, in the direction in which particles pass. */
  passage(body: Segment | Arc) {
    const { view } = this, isBent = "begin" in body, { x, y, one_sided: side } = body;
    const middle = isBent ? body.begin + 0.5 * body.extent : 0;
    const [u, v] = isBent ? [side * Math.cos(middle), side * Math.sin(middle)]
      : [-side * body.ty, side * body.tx];
    const [px, py] = isBent
      ? [view.px(x + side * body.radius * u), view.py(y + side * body.radius * v)]
      : [view.px(x + 0.5 * body.length * body.tx), view.py(y + 0.5 * body.length * body.ty)];
    const at = (ahead: number, aside: number) =>
      `${px + ahead * u - aside * v} ${py - ahead * v - aside * u}`;
    return svg("path", {
      d: `M${at(-11, 0)}L${at(13, 0)}M${at(7, 5)}L${at(13, 0)}L${at(7, -5)}`, class: "passage",
    });
  }

  /** Returns a wall along a path in px. */
  line = (d: string) => svg("path", { d, class: "wall", "stroke-width": this.wide });
}

/** Returns the path of a belt round two wheels, clockwise from the top of the left one, px. */
const stadium = (left: number, right: number, y: number, r: number) =>
  `M${left} ${y - r}H${right}A${r} ${r} 0 0 1 ${right} ${y + r}H${left}`
  + `A${r} ${r} 0 0 1 ${left} ${y - r}`;

export { PLATE, Scenery, filled, set, svg };
