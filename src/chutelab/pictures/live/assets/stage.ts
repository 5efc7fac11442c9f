// The picture: surfaces, tracks and handles in SVG, particles on a canvas between them.

import { openHandles } from "./controls.ts";
import { drawOutline, freePlace } from "./callout.ts";
import { endsOf } from "./edit.ts";
import { ARROW, Handles, bodyOf, roundTo, valuesOf, type Handle } from "./handles.ts";
import { CALM, eased, html } from "./panels.ts";
import { Balls } from "./balls.ts";
import { Scenery, set, svg } from "./scenery.ts";
import { paintJoints, paintPins } from "./joints.ts";
import { cornersOf } from "./machine.ts";
import { predict } from "./prediction.ts";
import { historyOf } from "./stages.ts";
import { View, boxOf } from "./view.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Words } from "./words.ts";

/** Most tracks drawn; more could not be told apart. */
const MOST_TRACKS = 40;

/** Distance from an end to the handle that turns it, px. */
const BEYOND = 38;

/** Radius of what a finger hits, px. */
const FINGER = 22.5;

/** An angle within NEARLY of a multiple of ROUND snaps to it, degrees. */
const ROUND = 15, NEARLY = 1.5;

type Point = [number, number];

/** Least drawn radius of a particle, px, and where there are few, so that they are easily found. */
const LEAST = 1.2, LEAST_FEW = 3;

/** Least radius, px, at which a particle shows its rotation. */
const SPUN = 8;

/** Most distance of a drawn line from the true track, px; as a share of the machine's size while
 * the scale is not yet known. */
const FINE = 0.2, FINE_SHARE = 1e-3;

/** Number of times at which moving parts are looked at for the view. */
const POSES = 64;

/** Height of the text above the scale bar, px. */
const ABOVE = 24;

class Stage {
  view;
  show;
  back;
  canvas;
  front;
  scenery;
  balls;
  paths;
  grips;
  over;
  handles: Handle[] = [];
  gripOf: Map<string, any> = new Map();
  held: Handle | null = null;
  /** Selected parts; a single one shows its handles. */
  parts: string[] = [];
  /** `ghost` is what is dragged, as it was before; `outline` marks selected and pointed parts;
   * `magnet` marks the point to which a dragged one has snapped. */
  ghost = svg("g", { class: "surfaces ghost" });
  outline = svg("g", { class: "outline" });
  magnet = svg("circle", { class: "magnet", r: 9 });
  tip;
  fitted = false;

  constructor(readonly home: HTMLElement, readonly lab: Lab, readonly words: Words) {
    this.view = new View();
    this.show = { strobe: true, trails: true, velocity: false, forces: false, handles: true };
    this.back = svg("svg", { "aria-hidden": "true" });
    this.canvas = document.createElement("canvas");
    this.front = svg("svg", { role: "group", tabindex: 0, id: "picture",
      "aria-label": words.say("stage") });
    this.canvas.setAttribute("aria-hidden", "true");
    home.append(this.back, this.canvas, this.front);
    this.scenery = new Scenery(this.view, words);
    this.balls = new Balls(lab, (name) => this.colour(name));
    this.paths = svg("g", { class: "paths" });
    const { ground, layer, scale } = this.scenery;
    this.back.append(steel(), ground, this.ghost, this.outline, layer, this.paths, scale);
    this.tip = html("p", { class: "tip", role: "status" });
    home.after(this.tip);
    new ResizeObserver(([{ borderBoxSize: [{ inlineSize, blockSize }] }]) => {
      this.tipSize = [inlineSize, blockSize];
      if (this.held && this.at) this.tell(this.at);
    }).observe(this.tip);
    this.grips = svg("g", { class: "grips" });
    /** Layers of the tools, below the handles. */
    this.over = svg("g", { class: "over" });
    this.front.append(this.over, this.magnet, this.grips);
    new ResizeObserver(() => this.resize()).observe(home);
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.recolour());
    lab.on("scene", () => {
      if (JSON.stringify(lab.scene?.view) !== this.chosen) this.fit();
      else if (this.held) this.rebuildSoon();
      else this.rebuild();
    });
    lab.on("run", () => this.traced());
    lab.on("time", () => this.paint());
    this.listen();
    this.resize();
  }

  /** Adapt to the size of the page. A page in a hidden frame has none; it is drawn once it has
   * one. */
  resize() {
    const { clientWidth: width, clientHeight: height } = this.home;
    if (!width || !height) return;
    this.view.resize(width, height);
    const style = getComputedStyle(this.home);
    const inset = (side: string) => parseFloat(style.getPropertyValue(`padding-${side}`)) || 0;
    this.view.free = {
      left: inset("left"), top: inset("top") + this.strip, right: width - inset("right"),
      bottom: height - inset("bottom"),
    };
    // In a lesson the scale bar is at the top, where no belt is.
    const low = style.getPropertyValue("--scale-at") ? height - 44
      : inset("bottom") + 20;
    this.corner = [inset("left") + 24, height - low];
    const dense = globalThis.devicePixelRatio || 1;
    this.canvas.width = Math.round(width * dense);
    this.canvas.height = Math.round(height * dense);
    for (const layer of [this.back, this.front]) {
      layer.setAttribute("viewBox", `0 0 ${width} ${height}`);
    }
    if (!this.fitted || !this.moved) this.fit();
    else this.rebuild();
  }

  /** Whether the run is hidden because the student is to predict it first. */
  blind = false;

  /** Whether the user has moved or zoomed the view. */
  moved = false;

  fit() {
    const { machine, recording, scene } = this.lab;
    if (!machine) return;
    const bare = boxOf(machine, []);
    const fine = FINE_SHARE * Math.max(bare.right - bare.left, bare.top - bare.bottom);
    const points = recording ? this.trackPoints(recording, fine).flat() : [];
    const chosen = scene?.view;
    if (chosen) {
      const [[left, bottom], [right, top]] = [chosen.from, chosen.to];
      this.view.fit({ left, bottom, right, top }, 0);
    } else this.view.fit(boxOf(machine, points, this.lab.data.live?.predict, this.swept));
    this.chosen = JSON.stringify(chosen);
    this.fitted = points.length > 0;
    this.moved = false;
    this.rebuild();
  }

  /** The machine at the shown time. */
  get posed() {
    const { machine, recording, t } = this.lab;
    return machine && (recording?.machine === machine ? recording.posed(t) : machine);
  }

  /** Points passed by the ends of moving parts in the run so far, m. */
  get swept(): Point[] {
    const { machine, recording } = this.lab;
    if (!machine?.movers.length || !recording) return [];
    const moves = new Set(machine.movers.map(({ surface }) => surface));
    const end = isFinite(recording.end) ? recording.end : 0;
    return Array.from({ length: POSES + 1 }, (_, n) => recording.posed((end * n) / POSES))
      .flatMap(({ segments, arcs }) => [
        ...segments.filter(({ surface }) => moves.has(surface))
          .flatMap(({ ends: [x, y, u, v] }): Point[] => [[x, y], [u, v]]),
        ...arcs.filter(({ surface }) => moves.has(surface))
          .flatMap(({ x, y, radius: r }): Point[] => [[x - r, y - r], [x + r, y + r]]),
      ]);
  }

  /** `[view]` of the shown scene, as text. */
  chosen: string | undefined;

  /** @param fine m */
  trackPoints(recording: Recording, fine: number) {
    const shown = recording.machine.interact ? [] : recording.tracks.slice(0, MOST_TRACKS);
    return shown.map((_, i) => recording.points(i, fine));
  }

  /** More of the run is there: draw its tracks, and fit the first view when the run has ended. */
  traced() {
    const { recording } = this.lab;
    if (recording && !this.fitted && recording.state !== "running") this.fit();
    this.balls.measure();
    if (this.soon) {
      this.rebuild();
      return;
    }
    if (this.lab.playing && recording?.machine.interact) this.drawPaths();
    else this.drawTracks();
    // While it is played, the next frame paints anyway.
    if (!this.lab.playing) this.paint();
    for (const draw of this.drawers) draw();
  }

  /** The lower left corners of the free part and of the scale bar, and the bar's length, px. */
  corner: Point = [24, 0];
  scaleAt: Point = this.corner;
  long = 0;

  /** The box of the scale bar with its text, px; `legend` is that of the legend. */
  get scaleBox() {
    const [left, bottom] = this.scaleAt;
    return { left, right: left + this.long, top: bottom - ABOVE, bottom };
  }

  legend: Stage["frame"] = null;
  /** Height of a strip at the top that is kept free of the machine if the legend fits nowhere else,
   * px. */
  strip = 0;

  /** Keep a strip of this height free at the top; 0 for none. */
  keepFree(strip: number) {
    this.strip = strip;
    this.resize();
  }

  /** Boxes of the labels in the picture, px. */
  labels: { left: number, right: number, top: number, bottom: number }[] = [];

  /** Functions of the tools that draw anew when the view, the machine or its run has changed. */
  drawers: (() => void)[] = [];

  /** The requested frame of a rebuild that waits for the run; 0 if none does. */
  soon = 0;

  /** Rebuild in the next frame, together with the new run: without waiting, the run would
   * flicker. */
  rebuildSoon() {
    this.placeHandles();
    this.soon ||= requestAnimationFrame(() => this.rebuild());
  }

  rebuild() {
    cancelAnimationFrame(this.soon);
    this.soon = 0;
    if (this.view.width < 2) return;
    const { machine, scene } = this.lab;
    if (machine) this.scenery.draw(machine, scene);
    this.placeScale();
    this.scenery.drawGround(...this.scaleAt, this.shown);
    this.drawTracks();
    this.placeHandles();
    this.paint();
    for (const draw of this.drawers) draw();
  }

  /** Share of a mesh that the scale bar shows. */
  shown = 1;

  /** Find a place for the scale bar, which does not move during a drag: half as long a one where
   * there is more room. */
  placeScale() {
    const whole = this.view.mesh * this.view.scale;
    if (!this.held) {
      const found = [1, 0.5].map((share) =>
        [share, freePlace(this, [share * whole, ABOVE], this.corner)] as const);
      const [share, place] = found.find(([, at]) => at) ?? [1, this.corner];
      [this.shown, this.scaleAt] = [share, place ?? this.corner];
    }
    this.long = this.shown * whole;
  }

  /** Draw tracks only now and then: while a crowd is played they change little between frames. */
  drawPaths = eased(() => this.drawTracks(), () => CALM);

  drawTracks() {
    const { recording } = this.lab, { view } = this;
    this.paths.replaceChildren();
    if (!recording || !this.show.trails || this.blind) return;
    const { envelopes = [] } = historyOf(this.lab) ?? {};
    // Paths on surfaces that move would go through where these are now.
    const { pulley, movers } = recording.machine, stands = pulley || !movers.length;
    for (const { stream, lines } of stands ? envelopes : []) this.drawEnvelope(stream, lines);
    if (envelopes.length) return;
    // The calculated flight is a double line; the run lies inside of it as long as the two
    // agree.
    const at = ([x, y]: Point) => `${view.px(x).toFixed(1)} ${view.py(y).toFixed(1)}`;
    const d = this.calculated.map(([from, bend, to]) => `M${at(from)}Q${at(bend)} ${at(to)}`).join("");
    if (d) this.paths.append(svg("path", { d, class: "rail" }), svg("path", { d, class: "rail within" }));
    for (const points of this.trackPoints(recording, FINE / view.scale)) {
      if (points.length < 2) continue;
      const line = points.map(({ x, y }) => `${view.px(x).toFixed(1)},${view.py(y).toFixed(1)}`);
      this.paths.append(svg("polyline", { points: line.join(" "), class: "track" }));
    }
  }

  /** The calculated flights to the plate and from there to the belt, as control points of quadratic
   * Bézier curves, m: beginning, intersection of the tangents at both ends, end. */
  get calculated(): [Point, Point, Point][] {
    const { scene, recording } = this.lab, belt = scene?.incoming;
    if (!belt || !recording || recording.machine.interact) return [];
    const { phi1, v1, t2, x2, y2, v3x, t3, y3 } = predict(scene, recording).numbers;
    const ride = belt.pulley_radius + recording.machine.radius[0], half = 0.5 * v1 * t2;
    const [x, y] = [ride * Math.sin(phi1), ride * Math.cos(phi1)], [u, v] = [x + x2, y - y2];
    const down = 0.5 * y3 - 0.25 * scene.gravity * t3 * t3;
    const flights: [Point, Point, Point][] = [
      [[x, y], [x + half * Math.cos(phi1), y - half * Math.sin(phi1)], [u, v]],
      [[u, v], [u - 0.5 * v3x * t3, v - down], [u - v3x * t3, v - y3]]];
    return flights.filter((flight) => flight.flat().every(isFinite));
  }

  /** Draw an envelope: the band between its outer lines, and its middle line. Where the path turns
   * sharply, for instance at its end where half of the particles have come to rest, neighbouring
   * cross-sections intersect: of these only the first is drawn.
   * @param lines m */
  drawEnvelope(stream: number, lines: [number, number][][]) {
    const { view } = this, cuts: Point[][] = [];
    for (const n of lines[0].keys()) {
      const cut = lines.map((line) => line[n]), last = cuts.at(-1);
      const folds = last && cross(last[0], last[2], cut[0], cut[2]);
      if (!folds && cut.every(([x]) => isFinite(x))) cuts.push(cut);
    }
    const [right, middle, left] = lines.map((_, q) => cuts.map((cut) =>
      `${view.px(cut[q][0]).toFixed(1)},${view.py(cut[q][1]).toFixed(1)}`));
    const band = svg("polygon", { points: [...right, ...left.reverse()].join(" "), class: "envelope" },
      svg("title", {}, this.words.say("envelope")));
    if (this.isMixed) band.style.fill = `var(--kind-${stream % 5})`;
    this.paths.append(band, svg("polyline", { points: middle.join(" "), class: "track" }));
  }

  /** Whether particles are coloured by their stream. */
  get isMixed() {
    return (this.lab.scene?.kinds.length ?? 0) > 1;
  }

  /** The least radius of a particle, px. */
  get least() {
    return (this.lab.recording?.tracks.length ?? 0) <= MOST_TRACKS ? LEAST_FEW : LEAST;
  }

  /** Whether some particles are drawn larger than they are. */
  get isLarger() {
    const { machine } = this.lab;
    return machine?.radius.some((radius) => radius * this.view.scale < this.least) ?? false;
  }

  /** Paint the particles, and bring moving parts to the shown time. */
  paint() {
    const { lab, view, canvas } = this;
    const { recording, machine, t } = lab;
    const context = canvas.getContext("2d");
    if (!context || !recording || !machine) return;
    const dense = globalThis.devicePixelRatio || 1;
    context.setTransform(dense, 0, 0, dense, 0, 0);
    context.clearRect(0, 0, view.width, view.height);
    this.scenery.turn(t, recording.swings);
    // The outlines of particles and joints move with them.
    if (this.parts.length || this.pointed) this.drawOutline();
    const { least } = this;
    if (this.show.strobe && !this.blind && !machine.interact) this.strobe(context);
    paintJoints(context, recording, t, view, this.colour("muted"));
    const spins = machine.inertia.some((value) => value > 0);
    const marks = new Path2D();
    for (let i = 0; i < recording.tracks.length; i += 1) {
      const state = recording.tracks[i].state(t);
      if (!state || (state.ended && recording.tracks.length > 1)) continue;
      const x = view.px(state.x), y = view.py(state.y);
      const r = Math.max(least, (machine.radius[i] ?? 0) * view.scale);
      if (x < -r || x > view.width + r || y < -r || y > view.height + r) continue;
      const angle = spins ? recording.tracks[i].angle(t) : 0;
      const speed = Math.hypot(state.vx, state.vy);
      const corners = cornersOf(machine, i, state, angle);
      if (corners.length) {
        const larger = r / (machine.radius[i] * view.scale);
        this.balls.paintCorners(context, i, corners.map(([u, v]): Point =>
          [x + larger * (view.px(u) - x), y + larger * (view.py(v) - y)]), r, speed);
        continue;
      }
      this.balls.paint(context, i, x, y, r, speed);
      if (!spins || r < SPUN) continue;
      // A line from the centre shows the rotation.
      marks.moveTo(x, y);
      marks.lineTo(x + r * Math.cos(angle), y - r * Math.sin(angle));
    }
    context.lineWidth = 1;
    context.strokeStyle = this.colour("ink");
    context.stroke(marks);
    paintPins(context, recording, t, view, this.colour("ink"));
    for (const draw of this.painters) draw(context);
  }

  /** Functions that paint over the particles. */
  painters: ((context: CanvasRenderingContext2D) => void)[] = [];

  /** The theme has changed between light and dark. */
  recolour() {
    this.colours.clear();
    this.paint();
  }

  /** Returns a colour of page.css in the present theme. */
  colour(name: string) {
    const known = this.colours.get(name)
      ?? getComputedStyle(this.home).getPropertyValue(`--${name}`);
    this.colours.set(name, known);
    return known;
  }

  /** Colours by name, kept because asking the browser takes longer than painting a particle. */
  colours: Map<string, string> = new Map();

  /** Paint dots at round times on the first track. */
  strobe(context: CanvasRenderingContext2D) {
    const { recording } = this.lab;
    if (!recording) return;
    const step = this.strobeStep;
    context.fillStyle = this.colour("track");
    for (const track of recording.tracks.slice(0, 1)) {
      for (let n = Math.ceil(track.begin / step - 1e-9); n * step <= track.end; n += 1) {
        const state = track.state(n * step);
        if (!state) continue;
        context.beginPath();
        context.arc(this.view.px(state.x), this.view.py(state.y), 2.6, 0, 2 * Math.PI);
        context.fill();
      }
    }
  }

  /** A round interval, s, that gives the first track about twenty dots. */
  get strobeStep() {
    const track = this.lab.recording?.tracks[0];
    const span = track?.count ? track.end - track.begin : 1;
    const rough = Math.max(span, 1e-6) / 20, ten = 10 ** Math.floor(Math.log10(rough));
    return [1, 2, 5, 10].map((n) => n * ten).find((step) => step >= rough) ?? 10 * ten;
  }

  placeHandles() {
    const { machine, scene } = this.lab;
    if (!machine || !scene) return;
    const { lab: { data }, view } = this, { left, right, top, bottom } = view.free;
    const isBetween = (value: number, low: number, high: number) =>
      value > low + FINGER && value < high - FINGER;
    const hasRoom = (x: number, y: number) =>
      isBetween(view.px(x), left, right) && isBetween(view.py(y), top, bottom);
    const all = () => new Handles(scene, machine, data, BEYOND / view.scale, hasRoom).list;
    this.handles = this.show.handles ? openHandles(all(), data) : [];
    for (const more of this.further) this.handles.push(...more());
    const wanted = new Set(this.handles.map(({ id }) => id));
    for (const [id, grip] of this.gripOf) {
      if (wanted.has(id)) continue;
      // Focus the play button: the space bar plays there as it did on the handle.
      if (grip === document.activeElement) document.getElementById("play")?.focus();
      grip.remove();
      this.gripOf.delete(id);
    }
    for (const handle of this.handles) {
      const grip = this.gripOf.get(handle.id) ?? this.newGrip(handle.id);
      this.describe(grip, handle);
      // Inserting it again would take its focus.
      if (!grip.isConnected) this.grips.append(grip);
    }
    this.drawOutline();
  }

  /** Select parts. */
  choose(parts: string[]) {
    this.parts = parts;
    for (const handle of this.handles) {
      this.gripOf.get(handle.id)?.classList.toggle("own", this.isSeen(handle));
    }
    this.drawOutline();
  }

  /** Returns whether a handle is shown: its part is the only selected one, or it is a tool's. */
  isSeen({ surface, change }: Handle) {
    return change !== undefined || (this.parts.length === 1 && this.parts[0] === surface);
  }

  /** Boxes that labels avoid, px. */
  covered: { left: number, right: number, top: number, bottom: number }[] = [];

  /** The part under the pointer. */
  pointed = "";

  /** The frame round several selected parts, px. */
  frame: { left: number, right: number, top: number, bottom: number } | null = null;

  drawOutline() {
    drawOutline(this);
  }

  /** Functions that return handles of tools. */
  further: (() => Handle[])[] = [];

  newGrip(id: string) {
    const grip = svg("g", { class: "grip", role: "slider", tabindex: 0, "data-id": id },
      svg("path", { class: "stem" }), svg("circle", { class: "room", r: 20 }),
      svg("path", { class: "knob" }));
    this.gripOf.set(id, grip);
    return grip;
  }

  describe(grip: any, handle: Handle) {
    const { view, words } = this, x = view.px(handle.x), y = view.py(handle.y);
    set(grip, "transform", `translate(${x} ${y})`);
    grip.classList.toggle("own", this.isSeen(handle));
    const [stem, , knob] = grip.children;
    set(knob, "d", KNOBS[handle.shape]);
    if (handle.from) {
      const [u, v] = [view.px(handle.from[0]) - x, view.py(handle.from[1]) - y];
      set(stem, "d", `M${u} ${v}L0 0`);
      const angle = (Math.atan2(-v, -u) * 180) / Math.PI;
      set(knob, "transform", u || v ? `rotate(${angle})` : "");
    }
    const [first] = handle.axes;
    const name = `${words.name(handle.surface)}: ${words.say(`handle-${handle.what}`)}`;
    const values = handle.says ? [handle.says]
      : handle.axes.filter(({ step }) => step).map((axis) => words.value(axis));
    set(grip, "aria-label", name);
    // The attribute allows no exponent, and a bound above 0 may be the smallest number there is.
    const plain = (value: number) => String(Math.round(1e6 * value) / 1e6);
    set(grip, "aria-valuenow", plain(first.value));
    set(grip, "aria-valuetext", values.join(", "));
    if (isFinite(first.low)) set(grip, "aria-valuemin", plain(first.low));
    if (isFinite(first.high)) set(grip, "aria-valuemax", plain(first.high));
    handle.axes.forEach(({ value }, n) => { if (!isFinite(value)) handle.axes[n].value = 0; });
  }

  listen() {
    this.front.addEventListener("pointerdown", (event: PointerEvent) => {
      const grip = (event.target as Element).closest(".grip");
      if (!grip) return;
      // Take the nearest of several handles within reach.
      const [px, py] = this.placeOf(event), { view } = this;
      const far = ({ x, y }: Handle) => Math.hypot(view.px(x) - px, view.py(y) - py);
      const [meant] = this.handles.filter((one) => this.isSeen(one)
        || one.id === grip.getAttribute("data-id")).sort((a, b) => far(a) - far(b));
      if (!this.take(meant.id)) return;
      event.preventDefault();
      this.gripOf.get(meant.id).focus();
      this.front.setPointerCapture(event.pointerId);
    });
    this.front.addEventListener("pointermove", (event: PointerEvent) => this.aim(event));
    for (const end of ["pointerup", "pointercancel"]) {
      this.front.addEventListener(end, () => {
        if (!this.held) return;
        this.follow();
        this.letGo();
      });
    }
    this.front.addEventListener("keydown", (event: KeyboardEvent) => {
      const grip = (event.target as Element).closest(".grip");
      const handle = this.handles.find(({ id }) => id === grip?.getAttribute("data-id"));
      if (handle && this.nudge(handle, event)) event.preventDefault();
    });
  }

  /** Let the held handle follow the pointer. */
  aim(event: PointerEvent) {
    if (!this.held) return;
    this.latest = this.placeOf(event);
    this.loose = event.altKey;
    this.finger = event.pointerType === "touch";
    // There may be several events per frame: use the latest.
    if (!this.waiting) this.waiting = requestAnimationFrame(() => this.follow());
  }

  /** Where the pointer is, if it has moved since the last frame, px. */
  latest: Point | undefined;

  /** Whether snapping is off (Alt), and whether a finger drags. */
  loose = false;
  finger = false;

  waiting = 0;

  placeOf(event: PointerEvent): Point {
    const box = this.front.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  }

  follow() {
    cancelAnimationFrame(this.waiting);
    this.waiting = 0;
    if (this.latest) this.dragTo(this.latest);
    this.latest = undefined;
  }

  /** Take hold of a handle by its id. */
  take(id: string) {
    const handle = this.handles.find((one) => one.id === id);
    if (!handle) return null;
    this.gripOf.get(id)?.classList.add("held");
    return this.hold(handle);
  }

  /** Hold a handle or a body, and show where it was as a ghost. */
  hold(handle: Handle): Handle {
    this.held = handle;
    if (handle.change) return handle;
    const names = handle.whole ? this.parts : [handle.surface];
    this.ghost.replaceChildren(...names.flatMap((name) =>
      this.scenery.drawingsOf(name).map((one) => one.cloneNode(true))));
    this.ends = this.lab.machine ? endsOf(this.lab.machine, names) : [];
    this.was = this.words.values(handle.axes, true);
    document.body.classList.add("dragging");
    return handle;
  }

  /** Ends of other parts, m; and the values of the held handle before the drag, as text. */
  ends: Point[] = [];
  was = "";

  /** Move the held handle to a point, px. */
  dragTo(at: Point) {
    const { held, view } = this;
    if (!held) return;
    const [x, y] = [view.worldX(at[0]), view.worldY(at[1])];
    if (held.change) {
      held.change(held.drag(x, y));
      return;
    }
    const { snap } = view, { axes } = held;
    let caught: Point | null = null, numbers: number[];
    if (held.whole) {
      const by = this.shiftOf(held, at);
      caught = by.caught;
      numbers = held.drag(held.x + by.way[0], held.y + by.way[1])
        .map((value) => Number(value.toPrecision(12)));
    } else if (held.shape === "point" && axes.every(({ unit }) => unit === "m") && !this.loose) {
      const near = view.near(at, this.ends, held.fixed);
      if (near.caught) caught = near.at;
      numbers = held.drag(...near.at).map((value) => Number(value.toPrecision(12)));
    } else {
      const speed = Math.max(0.01, 0.5 * 10 ** Math.ceil(Math.log10(snap / ARROW)));
      const fine: Record<string, number> = { degrees: 0.5, "m/s": speed };
      numbers = held.drag(x, y).map((value, n) => {
        const round = roundTo(value, ROUND);
        return axes[n].unit === "degrees" && !this.loose && Math.abs(value - round) < NEARLY
          ? round : roundTo(value, fine[axes[n].unit] ?? snap);
      });
    }
    this.magnet.classList.toggle("on", caught !== null);
    if (caught) {
      this.magnet.setAttribute("cx", view.px(caught[0]));
      this.magnet.setAttribute("cy", view.py(caught[1]));
    }
    this.lab.change(valuesOf(held, numbers), { done: false });
    this.tell(at);
  }

  /** Returns how far to move a body: until one of its ends meets an end of another part, else by
   * round steps. */
  shiftOf({ x, y, places = [] }: Handle, at: Point): { way: Point, caught: Point | null } {
    const { view } = this, [dx, dy] = [view.worldX(at[0]) - x, view.worldY(at[1]) - y];
    for (const [px, py] of this.loose ? [] : places) {
      const pixel: Point = [view.px(px + dx), view.py(py + dy)];
      const near = view.near(pixel, this.ends);
      if (this.ends.includes(near.at)) {
        return { way: [near.at[0] - px, near.at[1] - py], caught: near.at };
      }
    }
    return { way: [roundTo(dx, view.snap), roundTo(dy, view.snap)], caught: null };
  }

  /** Width and height of the text beside the pointer, px, and the pointer when it was written. */
  tipSize: Point = [0, 0];
  at?: Point;

  /** Write the changed value beside the pointer, or why it is refused. */
  tell(at: Point) {
    const [px, py] = this.at = at;
    const { lab, words, held, view, tip } = this;
    const now = this.handles.find(({ id }) => id === held?.id) ?? bodyOf(this.handles,
      this.parts, 0, 0);
    if (!held || !now) return;
    tip.classList.toggle("refused", lab.fault !== null);
    tip.replaceChildren(...(lab.fault ? [words.fault(lab.fault)] : [
      html("b", {}, words.values(now.axes)), html("span", {}, words.say("was", { value: this.was })),
    ]));
    // Asking for the size here would force another layout.
    const [wide, high] = this.tipSize;
    // Put it above a finger, which hides what is below.
    const left = Math.min(px + 22, view.width - wide - 8), over = this.finger ? -high - 40 : 26;
    const top = Math.min(Math.max(py + over, 8), view.height - high - 8);
    tip.style.transform = `translate(${Math.max(8, left)}px, ${top}px)`;
  }

  letGo() {
    if (!this.held) return;
    this.gripOf.get(this.held.id)?.classList.remove("held");
    this.held = null;
    this.ghost.replaceChildren();
    this.magnet.classList.remove("on");
    document.body.classList.remove("dragging");
    this.tip.replaceChildren();
    this.lab.settle();
    this.rebuild();
  }

  nudge(handle: Handle, { key, shiftKey }: KeyboardEvent): boolean {
    const ways: Record<string, [number, number]> = {
      ArrowRight: [0, 1], ArrowLeft: [0, -1], ArrowUp: [1, 1], ArrowDown: [1, -1],
      PageUp: [0, 10], PageDown: [0, -10],
    };
    if (!(key in ways)) return false;
    const [which, sign] = ways[key];
    const free = handle.axes.map(({ step }, n) => (step ? n : -1)).filter((n) => n >= 0);
    const n = free[Math.min(which, free.length - 1)];
    const numbers = handle.axes.map(({ value }) => value);
    const step = handle.axes[n].step * (shiftKey ? 0.1 : 1);
    numbers[n] = roundTo(numbers[n] + sign * step, step);
    if (handle.change) {
      handle.change(numbers);
      return true;
    }
    const axes = handle.axes.filter((axis, i) => i === n || axis.part !== undefined || !axis.step);
    const kept = axes.map((axis) => numbers[handle.axes.indexOf(axis)]);
    this.lab.change(valuesOf({ ...handle, axes }, kept));
    return true;
  }
}

/** Returns whether the lines from `a` to `b` and from `c` to `d` intersect. */
function cross(a: Point, b: Point, c: Point, d: Point) {
  const side = ([px, py]: Point, [qx, qy]: Point, [x, y]: Point) =>
    Math.sign((qx - px) * (y - py) - (qy - py) * (x - px));
  return side(a, b, c) !== side(a, b, d) && side(c, d, a) !== side(c, d, b);
}

/** Returns the gradient of plates and wheels. */
function steel() {
  return svg("defs", {}, svg("linearGradient", { id: "steel", x1: 0, y1: 0, x2: 1, y2: 1 },
    svg("stop", { offset: 0, class: "steel-a" }), svg("stop", { offset: 1, class: "steel-b" })));
}

const KNOBS = {
  point: "M-7 0A7 7 0 1 0 7 0A7 7 0 1 0 -7 0Z",
  end: "M0 -8L8 0L0 8L-8 0Z",
  turn: "M-11 0A11 11 0 1 0 11 0A11 11 0 1 0 -11 0ZM4.5 -2.5A5.2 5.2 0 1 0 5 2.5M5.200 -6v4h-4",
  arrow: "M-6 -7L8 0L-6 7Z",
};

export { Stage };
