// Measuring tools in the picture: flow line, tape, protractor, stop watch and tracer.

import { roundUp } from "./chart.ts";
import { eased, html, iconButton } from "./panels.ts";
import { svg } from "./scenery.ts";
import { placed, takenBy } from "./symbols.ts";
import type { Flow } from "./flow.ts";
import type { Stage } from "./stage.ts";
import type { Handle } from "./handles.ts";
import type { Lab } from "./lab.ts";
import type { Track, State } from "./recording.ts";
import type { Words } from "./words.ts";

type Point = [number, number];

/** A strobe dot within MAGNET is taken; a track must be within REACH, px. */
const MAGNET = 8, REACH = 26;

/** Most tracks that can be traced: as many as are drawn. */
const MOST_TRACED = 40;

/** Steps of the search for the nearest point of a track. */
const COARSE = 200, FINER = 30;

/** Returns when a track is nearest to a point: the nearest of many points of it, then refined.
 * @param y m
 * @returns time, s, and distance, m */
function nearestOn(track: Track, x: number, y: number): { t: number, far: number } {
  const { begin, end } = track;
  const far = (t: number) => {
    const state = track.state(Math.min(end, Math.max(begin, t)));
    return state ? Math.hypot(state.x - x, state.y - y) : Infinity;
  };
  const step = (end - begin) / COARSE;
  let at = begin;
  for (let n = 1; n <= COARSE; n += 1) if (far(begin + n * step) < far(at)) at = begin + n * step;
  let [low, high] = [Math.max(begin, at - step), Math.min(end, at + step)];
  for (let n = 0; n < FINER; n += 1) {
    const a = low + (high - low) / 3, b = high - (high - low) / 3;
    if (far(a) < far(b)) high = b;
    else low = a;
  }
  const t = 0.5 * (low + high);
  return { t, far: far(t) };
}

/** Returns the angle at a corner between the directions to two points, degrees from 0 to 180. */
function angleBetween([x, y]: Point, [ax, ay]: Point, [bx, by]: Point) {
  const [ux, uy, vx, vy] = [ax - x, ay - y, bx - x, by - y];
  return (Math.atan2(Math.abs(ux * vy - uy * vx), ux * vx + uy * vy) * 180) / Math.PI;
}

/** A stop watch that follows the picture's time, also backwards. */
class StopWatch {
  /** Reading when it was last started, s */
  before = 0;

  /** When it was started, s; null while it is stopped. */
  since: number | null = null;

  laps: number[] = [];

  reading(t: number) {
    return this.before + (this.since === null ? 0 : t - this.since);
  }

  /** Start or stop it. */
  toggle(t: number) {
    const reading = this.reading(t);
    this.since = this.since === null ? t : null;
    this.before = reading;
  }

  lap(t: number) {
    this.laps.push(this.reading(t));
  }

  reset() {
    this.before = 0;
    this.since = null;
    this.laps = [];
  }
}

class Tools {
  layer;
  panel;
  dial?: any;
  laps?: any;
  starter?: any;

  /** @param flow the counting line; lessons have none */
  constructor(
    readonly lab: Lab, readonly stage: Stage, readonly words: Words, readonly flow?: Flow,
  ) {
    this.layer = svg("g", { class: "measures", "aria-hidden": "true" });
    stage.over.append(this.layer);
    const bar = html("div", { class: "tools", role: "group", "aria-label": words.say("tools") });
    document.getElementById("fit")?.after(bar);
    for (const name of [...(flow ? ["flow"] : []), "tape", "protractor", "watch", "tracer"]) {
      const button = iconButton(`tool-${name}`, name, words.say(`tool-${name}`), () =>
        this.toggle(name, button));
      button.setAttribute("aria-pressed", "false");
      bar.append(button);
    }
    this.panel = this.watchPanel();
    stage.home.parentElement?.append(this.panel);
    stage.further.push(() => this.handles());
    stage.drawers.push(() => this.draw());
    const redraw = eased(() => this.draw());
    lab.on("run", () => {
      if (this.on.has("tracer")) stage.placeHandles();
    });
    lab.on("time", () => {
      this.readWatch();
      if (this.on.has("flow")) redraw();
    });
    const hover = eased(() => this.hover());
    for (const news of ["pointermove", "pointerdown"]) {
      stage.front.addEventListener(news, (event: PointerEvent) => {
        this.pointer = stage.placeOf(event);
        if (this.on.has("tracer") && !stage.held) hover();
      });
    }
  }

  on: Set<string> = new Set();

  tape: Point[] = [];

  /** The corner, and a point on each leg. */
  protractor: Point[] = [];

  /** What is traced: time, s, and number of the particle, from 0. */
  traced = { t: 0, index: 0 };

  watch = new StopWatch();

  /** Where the pointer was last, px. */
  pointer: Point = [0, 0];

  toggle(name: string, button: any) {
    const { view } = this.stage, on = !this.on.has(name);
    button.setAttribute("aria-pressed", String(on));
    if (on) this.on.add(name);
    else this.on.delete(name);
    // Put a tool in the middle of the visible part.
    const least = Math.min(view.free.right - view.free.left, view.height);
    const size = roundUp((0.12 * least) / view.scale);
    const [x, y] = view.middle;
    const at = (dx: number, dy: number) =>
      [this.tidy(x + dx * size), this.tidy(y + dy * size)] as Point;
    if (name === "flow") this.flow?.show(on ? [at(-1, -0.5), at(1, -0.5)] : []);
    if (name === "tape") this.tape = [at(-1, -0.5), at(1, -0.5)];
    if (name === "protractor") this.protractor = [at(-1, -0.5), at(1, -0.5), at(0, 0.7)];
    if (name === "watch") this.panel.hidden = !on;
    if (name === "tracer") this.traced = { t: this.lab.t, index: 0 };
    this.readWatch();
    this.refresh();
  }

  /** @param value m */
  tidy(value: number) {
    const { snap } = this.stage.view;
    return Number((Math.round(value / snap) * snap).toPrecision(12));
  }

  refresh() {
    this.stage.placeHandles();
    this.draw();
  }

  handles(): Handle[] {
    const list: Handle[] = [];
    const point = (tool: string, points: Point[],
      names: string[]) => {
      points.forEach(([x, y], n) => list.push({
        id: `${tool}-${n}`, surface: tool, what: names[n], shape: "point", x, y,
        axes: [x, y].map((value, part) => ({
          key: tool, part, value, unit: "m", step: 0.01, low: -Infinity, high: Infinity,
        })),
        drag: (px, py) => [this.tidy(px), this.tidy(py)],
        change: ([px, py]) => {
          points[n] = [px, py];
          if (tool === "flow") this.flow?.move(points);
          this.refresh();
        },
        says: `${this.texts[tool]().join(", ")}; `
          + `x = ${this.words.fixed(x, 3)} m, y = ${this.words.fixed(y, 3)} m`,
      }));
    };
    if (this.flow && this.on.has("flow")) point("flow", this.flow.ends, ["first", "second"]);
    if (this.on.has("tape")) point("tape", this.tape, ["first", "second"]);
    if (this.on.has("protractor")) point("protractor", this.protractor, ["vertex", "first", "second"]);
    const tracer = this.on.has("tracer") && this.tracerHandle();
    return tracer ? [...list, tracer] : list;
  }

  tracerHandle(): Handle | null {
    const { recording } = this.lab, track = recording?.tracks[this.traced.index];
    if (!recording || !track?.count) return null;
    const { begin, end } = track;
    const t = Math.min(end, Math.max(begin, this.traced.t));
    const state = track.state(t) as State;
    const many = recording.tracks.length;
    const axes = [{
      key: "tracer", value: t, unit: "s", step: this.stage.strobeStep, low: begin, high: end,
    }];
    if (many > 1) {
      axes.push({ key: "particle", value: this.traced.index, unit: "", step: 1, low: 0, high: many - 1 });
    }
    return {
      id: "tracer", surface: "tracer", what: "point", shape: "point", x: state.x, y: state.y, axes,
      drag: (x, y) => this.nearest(x, y) ?? axes.map(({ value }) => value),
      change: ([when, which = 0]) => {
        const index = Math.min(many - 1, Math.max(0, which)), its = recording.tracks[index];
        this.traced = { t: Math.min(its.end, Math.max(its.begin, when)), index };
        this.refresh();
      },
      says: this.tracerTexts(t, state).join(", "),
    };
  }

  /** Returns the nearest traceable point: of a drawn track, at a strobe dot if one is close; in a
   * crowd, whose tracks are not drawn, the present position of a particle.
   * @param y m
   * @returns time, s, and number of the particle, from 0 */
  nearest(x: number, y: number): [number, number] | null {
    const { stage, lab } = this, { recording } = lab;
    if (!recording) return null;
    const found: { t: number, far: number, index: number }[] = [];
    const crowd = recording.machine.interact;
    recording.tracks.slice(0, crowd ? Infinity : MOST_TRACED).forEach((track, index) => {
      if (!track.count) return;
      if (!crowd) {
        found.push({ ...nearestOn(track, x, y), index });
        return;
      }
      const state = track.state(lab.t);
      if (state) found.push({ t: lab.t, far: Math.hypot(state.x - x, state.y - y), index });
    });
    if (!found.length) return null;
    const { t, index } = found.reduce((best, one) => (one.far < best.far ? one : best));
    const step = stage.strobeStep, dot = Math.round(t / step) * step;
    const state = crowd ? null : recording.tracks[index].state(dot);
    const close = state && Math.hypot(state.x - x, state.y - y) * stage.view.scale < MAGNET;
    return [close ? dot : t, index];
  }

  /** Trace the point under the pointer. */
  hover() {
    const { stage, lab } = this, { view } = stage, [px, py] = this.pointer;
    const found = this.nearest(view.worldX(px), view.worldY(py));
    if (!found) return;
    const [t, index] = found, state = lab.recording?.tracks[index].state(t);
    if (!state || Math.hypot(view.px(state.x) - px, view.py(state.y) - py) > REACH) return;
    this.traced = { t, index };
    this.refresh();
  }

  /** Functions that return a tool's texts, by the name of the tool. */
  texts: Record<string, () => string[]> = {
    flow: () => this.flow?.says ?? [], tape: () => this.tapeTexts(),
    protractor: () => [this.angleText()],
  };

  tapeTexts() {
    const [[x, y], [u, v]] = this.tape, { words } = this;
    return [`${words.fixed(Math.hypot(u - x, v - y), 3)} m`, `Δx = ${words.fixed(u - x, 3)} m`,
      `Δy = ${words.fixed(v - y, 3)} m`];
  }

  angleText() {
    const [corner, a, b] = this.protractor;
    return `${this.words.fixed(angleBetween(corner, a, b), 1)}°`;
  }

  tracerTexts(t: number, { x, y, vx, vy }: State) {
    const tell = (value: number) => this.words.fixed(value, 3);
    return [`t = ${tell(t)} s`, `x = ${tell(x)} m`, `y = ${tell(y)} m`,
      `v = ${tell(Math.hypot(vx, vy))} m/s`];
  }

  draw() {
    const { layer, lab } = this, { view } = this.stage;
    const at = ([x, y]: Point) => [view.px(x), view.py(y)] as Point;
    layer.replaceChildren();
    if (this.flow && this.on.has("flow")) {
      const [[x, y], [u, v]] = this.flow.ends.map(at);
      layer.append(svg("path", { d: `M${x} ${y}L${u} ${v}`, class: "tape" }));
      this.write("flow", x > u ? [x, y] : [u, v], this.flow.says);
    }
    if (this.on.has("tape")) {
      const [[x, y], [u, v]] = this.tape.map(at);
      layer.append(svg("path", { d: `M${x} ${y}L${u} ${v}`, class: "tape" }),
        svg("path", { d: `M${x} ${y}H${u}V${v}`, class: "thin" }));
      this.write("tape", [0.5 * (x + u), 0.5 * (y + v)], this.tapeTexts());
    }
    if (this.on.has("protractor")) {
      const [[x, y], [ax, ay], [bx, by]] = this.protractor.map(at);
      const r = Math.min(34, 0.6 * Math.hypot(ax - x, ay - y), 0.6 * Math.hypot(bx - x, by - y));
      const [alpha, beta] = [Math.atan2(ay - y, ax - x), Math.atan2(by - y, bx - x)];
      // Draw the smaller of the two angles, clockwise or counterclockwise on the screen.
      const sweep = Math.sin(beta - alpha) > 0 ? 1 : 0;
      const arc = [alpha, beta].map((angle) =>
        `${x + r * Math.cos(angle)} ${y + r * Math.sin(angle)}`);
      layer.append(svg("path", { d: `M${ax} ${ay}L${x} ${y}L${bx} ${by}`, class: "tape" }),
        svg("path", { d: `M${arc[0]}A${r} ${r} 0 0 ${sweep} ${arc[1]}`, class: "tape" }));
      this.write("protractor", [x, y], [this.angleText()]);
    }
    const track = this.on.has("tracer") && lab.recording?.tracks[this.traced.index];
    if (track && track.count) {
      const t = Math.min(track.end, Math.max(track.begin, this.traced.t));
      const state = track.state(t) as State;
      this.write("tracer", at([state.x, state.y]), this.tracerTexts(t, state));
    }
  }

  /** Places of the tools' texts, px, by tool, with what they depend on: they stay while only
   * time passes. */
  spots: Map<string, { of: string, at: Point }> = new Map();

  /** Write lines of text in a free place near a point, or beside it if there is none.
   * @param place px */
  write(tool: string, [x, y]: Point, lines: string[]) {
    const { stage, lab } = this, { view } = stage, rows = lines.length;
    const long = Math.ceil(Math.max(...lines.map((line) => line.length)) / 4) * 4;
    const of = JSON.stringify([x, y, rows, long, view.scale, view.width, view.height, lab.given,
      lab.recording?.state]);
    const known = this.spots.get(tool);
    if (known?.of !== of || stage.held) {
      const wanted = { text: "0".repeat(long), x, y, rows, asked: true, side: -0.25 * Math.PI };
      const [found] = placed([wanted], [...takenBy(stage), ...stage.labels]);
      const beside = x < view.width - 150 ? 1 : -1;
      const at: Point = found ? [found.x, found.y]
        : [x + beside * (5 * long + 14), Math.min(Math.max(y + 22, 22), view.height - 18 * rows)];
      this.spots.set(tool, { of, at });
    }
    const [cx, cy] = this.spots.get(tool)?.at as Point;
    lines.forEach((line, n) => this.layer.append(svg("text", { x: cx,
      y: cy + 18 * (n - 0.5 * (rows - 1)) + 5, "text-anchor": "middle" }, line)));
  }

  watchPanel() {
    const { words, watch, lab } = this;
    this.dial = html("output", { class: "dial" });
    this.laps = html("ol", { class: "laps", "aria-label": words.say("watch-laps") });
    const button = (id: string, act: () => void) => {
      const click = () => {
        act();
        this.readWatch();
      };
      return html("button", { id, click }, words.say(id));
    };
    this.starter = button("watch-start", () => watch.toggle(lab.t));
    const named = { class: "watch", role: "group", "aria-label": words.say("tool-watch") };
    const panel = html("div", named,
      this.dial, this.starter, button("watch-lap", () => watch.lap(lab.t)),
      button("watch-reset", () => watch.reset()), this.laps);
    panel.hidden = true;
    return panel;
  }

  readWatch() {
    if (this.panel.hidden) return;
    const { words, watch } = this;
    this.dial.textContent = `${words.fixed(watch.reading(this.lab.t), 3)} s`;
    this.starter.textContent = words.say(watch.since === null ? "watch-start" : "watch-stop");
    if (this.laps.children.length !== watch.laps.length) {
      this.laps.replaceChildren(...watch.laps.map((
        lap,
      ) => html("li", {}, `${words.fixed(lap, 3)} s`)));
    }
  }
}

export { StopWatch, Tools, angleBetween, nearestOn };
