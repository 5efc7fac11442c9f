// Editing in the picture: look around, choose, move, draw, copy and delete.

import { mayDraw } from "./controls.ts";
import { isJoint } from "./checks.ts";
import {
  endsOf, rowsNamed, surfaceAt, withCopies, withJoint, withPart, withTrigger,
  type Part,
} from "./edit.ts";
import { linesOfJoints, namesOfJoints, pinsOf } from "./joints.ts";
import { cornersOf, isInside } from "./machine.ts";
import { carried, poseOf } from "./motion.ts";
import { pointsOf } from "./callout.ts";
import { bodyOf, roundTo, valuesOf, type Handle } from "./handles.ts";
import { html, iconButton } from "./panels.ts";
import { svg } from "./scenery.ts";
import { boxOf } from "./view.ts";
import type { Given } from "./scene.ts";
import type { Stage } from "./stage.ts";
import type { Inspector } from "./inspector.ts";
import type { Held, Lab } from "./lab.ts";
import type { Words } from "./words.ts";

type Place = [number, number];

/** Pixels that a finger or mouse may move during a click. */
const STRAY = 6;

/** A finger that stays for so many ms holds the part under it. */
const HOLD = 450;

const distance = ([x, y]: Place, [u, v]: Place) => Math.hypot(u - x, v - y);

/** Largest distance of a click from a line, a ball, or a pin, pixels. */
const CLICK_REACH = 14, BALL_REACH = 22, PIN_REACH = 7;

/** Most balls that can be clicked while they move; more are a crowd. */
const MOST_BALLS = 100;

const ZOOM = 1.25;

/** If a smaller share of the machine is in sight, a button offers to show everything. */
const IN_SIGHT = 0.25;

/** Shares of the picture, from its middle, at which room for a part is searched; and a sufficient
 * distance, px. */
const GRID = [-0.36, -0.24, -0.12, 0, 0.12, 0.24, 0.36], ROOM = 160;

/** Most places that are tried for a part. */
const TRIES = 12;

/** Pixels per metre. */
const SCALES = [2, 2e5];

/** Pixels by which a key moves the view, or the point that is drawn; with Shift a tenth. */
const KEY = 20;

/** Distance of a copy from the original, pixels. */
const ASIDE = [28, 28];

/** Points of a part if no pointer sets them, in sizes of new parts. */
const EXAMPLES: Record<string, Place[]> = {
  from: [[-0.2, 0], [0.2, 0]], points: [[-0.2, 0.06], [0.2, -0.06], [0, -0.15]],
  arc: [[-0.2, 0], [0.2, 0], [0, -0.12]], at: [[-0.05, 0], [0.1, 0]], center: [[-0.25, 0.1]],
  tie: [[0, 0.15], [0.12, -0.05]],
};

class Bench {
  /** The part being drawn; null while parts are chosen and moved. */
  mode: Part | null = null;
  /** Points set so far of the part being drawn, m. */
  points: Place[] = [];
  /** Fingers on the picture, pixels. */
  fingers: Map<number, Place> = new Map();
  /** Material of the next balls, "" for that of the first. */
  material = "";
  /** Called when another tool is chosen. */
  listeners: (() => void)[] = [];
  free;
  draft = svg("g", { class: "draft" });
  /** The line from a held ball to the hand. */
  lead = svg("g", { class: "draft" });
  chip;
  /** Place of the next point, m: at the pointer, or where keys moved it. */
  cursor: Place | null = null;

  constructor(
    home: any, readonly stage: Stage, readonly inspector: Inspector, readonly lab: Lab,
    readonly words: Words,
  ) {
    stage.over.prepend(this.draft, this.lead);
    this.free = mayDraw(lab.data);
    inspector.mayDelete = this.free;
    inspector.duplicate = () => this.duplicate();
    inspector.own.unit = () => stage.view.unit;
    this.chip = html("div", { class: "float chip", role: "status" });
    this.chip.hidden = true;
    this.lost = html("button", { class: "float lost", hidden: "",
      click: () => document.getElementById("fit")?.click() }, words.say("fit"));
    stage.drawers.push(() => { this.lost.hidden ||= !stage.moved; });
    stage.home.after(this.chip, this.lost);
    this.tools(home);
    this.listen();
    inspector.listeners.push(() => stage.choose(inspector.parts));
    lab.on("scene", () => {
      if (stage.parts.join() !== inspector.parts.join()) stage.choose(inspector.parts);
    });
    stage.drawers.push(() => this.sketch());
    this.set(null);
  }

  tools(home: any) {
    const { words, lab, stage } = this;
    const button = (id: string, drawing: string, act: () => void) =>
      iconButton(`tool-${id}`, drawing, words.say(id), act);
    const select = button("select", "select", () => this.set(null));
    const hand = button("hand", "hand", () => this.set(null, !this.moving));
    this.listeners.push(() => {
      select.setAttribute("aria-pressed", String(!this.mode && !this.moving));
      hand.setAttribute("aria-pressed", String(this.moving));
    });
    const { view } = stage;
    const middle = (factor: number) =>
      this.zoom(factor, view.px(view.middle[0]), view.py(view.middle[1]));
    home.prepend(...(this.free ? [select, hand] : []), button("zoom-in", "plus", () => middle(ZOOM)),
      button("zoom-out", "minus", () => middle(1 / ZOOM)));
    const presets = lab.data.live?.presets ?? [];
    if (!presets.length) return;
    const menu = html("select", { id: "presets", "aria-label": words.say("presets") });
    menu.append(new Option(words.say("presets"), ""),
      ...presets.map(({ name }: { name: string }, n: number) => new Option(name, String(n))));
    menu.addEventListener("change", () => {
      if (menu.value !== "") lab.change(presets[Number(menu.value)].set);
      menu.value = "";
    });
    home.append(menu);
  }

  /** Choose a tool, which stays until another is chosen; a part without points is added at once.
   * @param moving whether it is the one that moves the view */
  set(mode: Part | null, moving = false) {
    this.points = [];
    this.mode = mode?.places.length ? mode : null;
    this.moving = moving;
    this.stage.home.classList.toggle("looking", moving);
    this.cursor = null;
    this.stage.home.classList.toggle("drawing", this.mode !== null);
    if (this.mode || moving) this.inspector.choose();
    this.listeners.forEach((listener) => listener());
    this.sketch();
    if (mode && !this.mode) this.put(mode, []);
  }

  /** Begin to draw a part with keys, or the pointer. */
  draw(part: Part) {
    this.set(part);
    this.stage.front.focus();
  }

  listen() {
    const { stage } = this, { front } = stage;
    front.addEventListener("pointerdown", (event: PointerEvent) => {
      if (event.target !== front || event.button > 0) return;
      front.setPointerCapture(event.pointerId);
      const at = stage.placeOf(event);
      this.fingers.set(event.pointerId, at);
      this.pressed = this.fingers.size === 1 ? at : null;
      const held = this.pressed && this.heldAt(at);
      if (held) {
        this.lab.grab(held, this.worldOf(at));
        this.pressed = null;
        return;
      }
      if (this.mode && this.pressed) this.point(at, event.altKey);
      else this.grabbed = this.pressed && this.bodyAt(at, event.pointerType);
      const chooses = this.free && !this.mode && !this.moving;
      this.band = chooses && event.shiftKey && !this.nameAt(at) ? at : null;
      if (this.band) this.grabbed = null;
      clearTimeout(this.holding);
      if (event.pointerType === "touch" && this.pressed && chooses) {
        this.holding = setTimeout(() => this.holdDown(at), HOLD);
      }
    });
    front.addEventListener("pointermove", (event: PointerEvent) => {
      const at = stage.placeOf(event);
      if (this.pressed && distance(at, this.pressed) > STRAY) clearTimeout(this.holding);
      if (this.lab.hand) this.lab.hand.to = this.worldOf(at);
      else if (this.mode) this.aim(at, event.altKey);
      else if (this.band) this.stretch(at);
      else if (this.grabbed) this.carry(at, event);
      else if (this.fingers.has(event.pointerId)) {
        const alone = this.fingers.size === 1 && event.pointerType === "touch" && !this.moving;
        // One finger on an empty place scrolls the page.
        if (alone) this.fingers.set(event.pointerId, at);
        else this.look(event.pointerId, at);
      } else if (event.pointerType === "mouse" && !stage.held && !this.moving) this.hover(at);
    });
    for (const end of ["pointerup", "pointercancel"]) {
      front.addEventListener(end, () => {
        if (this.lab.hand) this.lab.drop();
      });
    }
    front.addEventListener("pointerup", (event: PointerEvent) => {
      clearTimeout(this.holding);
      if (!this.fingers.delete(event.pointerId) || !this.pressed) return;
      const at = stage.placeOf(event), still = distance(at, this.pressed) < STRAY;
      if (this.band && !still) this.catch(at);
      else if (!this.mode) {
        if (still && !this.moving) this.pick(at, event.shiftKey);
      } else if (!still && this.points.length) this.point(at, event.altKey);
      this.pressed = this.grabbed = this.band = null;
    });
    front.addEventListener("touchmove", (event: TouchEvent) => {
      if (this.band) event.preventDefault();
    }, { passive: false });
    front.addEventListener("touchstart", (event: TouchEvent) => {
      const { touches } = event, box = front.getBoundingClientRect();
      const at: Place = [touches[0].clientX - box.left, touches[0].clientY - box.top];
      // The page must not scroll while something is moved.
      const body = !this.mode
        && (this.bodyAt(at, "touch") || this.heldAt(at));
      if (touches.length > 1 || body || this.moving) event.preventDefault();
    }, { passive: false });
    front.addEventListener("pointercancel", (event: PointerEvent) => {
      clearTimeout(this.holding);
      this.fingers.delete(event.pointerId);
      this.pressed = this.band = null;
      this.draft.replaceChildren();
    });
    front.addEventListener("wheel", (event: WheelEvent) => {
      const page = document.documentElement;
      if (!event.ctrlKey && page.scrollHeight > page.clientHeight + 1) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 20 : 1;
      this.zoom(2 ** (-(event.deltaY * lines) / (event.ctrlKey ? 80 : 400)),
        ...stage.placeOf(event as any));
    }, { passive: false });
    front.addEventListener("keydown", (event: KeyboardEvent) => {
      if (event.target === front && !event.ctrlKey && !event.metaKey && this.key(event)) {
        event.preventDefault();
      }
    });
    this.lab.on("time", () => {
      if (this.lab.hand || this.lead.firstChild) this.pull();
    });
    stage.grips.addEventListener("focusin", ({ target }: FocusEvent) => {
      const id = (target as Element).getAttribute("data-id");
      const handle = stage.handles.find((one) => one.id === id);
      if (handle && !handle.change && this.inspector.part !== handle.surface) {
        this.inspector.choose(handle.surface);
      }
    });
  }

  /** Draw a line from the held thing to the hand. */
  pull() {
    const { lead, lab: { hand }, stage: { view } } = this, at = hand && this.placeOf(hand);
    if (!at) lead.replaceChildren();
    else {
      lead.replaceChildren(svg("line", { class: "pull", x1: view.px(at[0]), y1: view.py(at[1]),
        x2: view.px(hand.to[0]), y2: view.py(hand.to[1]) }));
    }
  }

  /** Place of the held thing, m; null if it is gone. */
  placeOf(held: Held): Place | null {
    const { recording, machine, t } = this.lab;
    if ("disk" in held) {
      const state = recording?.tracks[held.disk].state(t);
      return state && !state.ended ? [state.x, state.y] : null;
    }
    const mover = machine?.movers.find(({ surface }) => surface === held.surface);
    if (!mover || !recording) return null;
    const { pivot: [x, y] } = mover, [u, v] = held.grip;
    return carried(poseOf(mover, t, recording.swings.get(held.surface)), mover, [x + u, y + v]);
  }

  /** The thing that is caught at a place of a playing run, px: a ball, or a hinged surface. */
  heldAt(at: Place): Held | null {
    if (!this.catches) return null;
    const { machine } = this.lab, disk = this.ballAt(at), [x, y] = this.worldOf(at);
    if (disk >= 0 || !machine) return disk >= 0 ? { disk } : null;
    const reach = CLICK_REACH / this.stage.view.scale;
    return this.hung(surfaceAt(this.stage.posed ?? machine, x, y, reach), [x, y]);
  }

  /** A hinged surface, by its name, held at a place, m. */
  hung(name: string, [x, y]: Place): Held | null {
    const { machine, recording, t } = this.lab, surface = machine?.surfaces.indexOf(name);
    const mover = machine?.movers.find((one) => one.surface === surface && one.inertia > 0);
    if (!mover || !recording) return null;
    const { turn } = poseOf(mover, t, recording.swings.get(mover.surface)), { pivot } = mover;
    const [u, v, c, s] = [x - pivot[0], y - pivot[1], Math.cos(turn), Math.sin(turn)];
    return { surface: mover.surface, grip: [c * u + s * v, c * v - s * u] };
  }

  /** The chosen thing of a playing run, as keys catch it: the first ball of a stream, or a hinged
   * surface at the end farthest from its hinge. */
  chosenToHold(): Held | null {
    const { lab: { machine, recording, t }, inspector: { part } } = this;
    if (!this.catches || !machine || !recording) return null;
    const disk = machine.releases.findIndex(({ stream }, i) =>
      machine.streams[stream] === part && this.placeOf({ disk: i }));
    if (disk >= 0) return { disk };
    const { segments, surfaces, movers } = recording.posed(t);
    const own = segments.filter(({ surface }) => surfaces[surface] === part);
    const pivot = movers.find(({ surface }) => surfaces[surface] === part)?.pivot ?? [0, 0];
    const [end] = own.flatMap(({ ends: [x, y, u, v] }) => [[x, y], [u, v]] as Place[])
      .sort((a, b) => distance(b, pivot) - distance(a, pivot));
    return end ? this.hung(part, end) : null;
  }

  holding = 0;

  /** Beginning of a frame that chooses everything in it, px. */
  band: Place | null = null;

  /** A finger that stays on a body adds it to the choice, or removes it; elsewhere it begins a
   * frame. */
  holdDown(at: Place) {
    if (this.nameAt(at)) {
      this.pick(at, true);
      this.pressed = this.grabbed = null;
    } else {
      this.band = at;
      this.stretch([at[0] + 24, at[1] + 24]);
    }
  }

  stretch([px, py]: Place) {
    const [x, y] = this.band as Place;
    this.draft.replaceChildren(svg("rect", { class: "band-frame", x: Math.min(x, px),
      y: Math.min(y, py), width: Math.abs(px - x), height: Math.abs(py - y) }));
  }

  /** Add everything in the frame, which ends at a place, px, to the choice. */
  catch([px, py]: Place) {
    const { stage, inspector } = this, [x, y] = this.band as Place;
    const within = ([u, v]: Place) => (u - x) * (u - px) <= 0 && (v - y) * (v - py) <= 0;
    const met = pointsOf(stage).filter(([, points]) => points.some(within)).map(([name]) => name);
    this.draft.replaceChildren();
    inspector.choose(...new Set([...inspector.parts, ...met.filter((name) => this.movable(name))]));
  }

  movable = (name: string) => bodyOf(this.stage.handles, [name], 0, 0) !== null;

  /** Draw with keys: arrows move the point, Enter sets it. While a run plays, Enter catches the
   * chosen thing, and releases it; arrows move the hand. After H arrows move the view, otherwise
   * all chosen parts if there are several. */
  key({ key, shiftKey }: KeyboardEvent): boolean {
    const ways: Record<string, Place> = {
      ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1],
    };
    const { stage } = this, { view } = stage, step = shiftKey ? 0.1 * KEY : KEY;
    const { hand } = this.lab, held = hand || key !== "Enter" ? null : this.chosenToHold();
    if (key.toLowerCase() === "h") this.set(null, !this.moving);
    else if (hand && key in ways) {
      hand.to = [hand.to[0] + (ways[key][0] * step) / view.scale,
        hand.to[1] - (ways[key][1] * step) / view.scale];
    } else if (hand && key === "Enter") this.lab.drop();
    else if (held) this.lab.grab(held, this.placeOf(held) as Place);
    else if (key in ways && this.mode) {
      const [x, y] = this.cursor ?? this.points.at(-1) ?? view.middle, [dx, dy] = ways[key];
      const far = shiftKey ? view.snap : roundTo(KEY / view.scale, view.snap) || view.snap;
      this.cursor = [roundTo(x + dx * far, view.snap), roundTo(y - dy * far, view.snap)];
      this.sketch();
    } else if (key in ways && !this.moving && stage.frame) {
      const body = bodyOf(stage.handles, stage.parts, 0, 0), [dx, dy] = ways[key];
      const far = shiftKey ? view.snap : 10 * view.snap;
      if (body) this.lab.change(valuesOf(body, body.drag(dx * far, -dy * far).map((value) =>
        Number(value.toPrecision(12)))));
    } else if (key in ways && this.moving) {
      view.x += (ways[key][0] * step) / view.scale;
      view.y -= (ways[key][1] * step) / view.scale;
      stage.moved = true;
      stage.rebuild();
    } else if (key === "Enter" && this.mode) this.take(this.cursor ?? this.next());
    else return false;
    return true;
  }

  /** Whether arrows move the view. */
  moving = false;

  /** The grabbed body, which moves once the pointer has moved. */
  grabbed: Handle | null = null;

  /** Whether a moving ball is caught, instead of its starting place moved. */
  get catches() {
    const { lab } = this;
    return this.free && lab.playing && !this.mode && !this.moving;
  }

  worldOf = ([px, py]: Place): [number, number] =>
    [this.stage.view.worldX(px), this.stage.view.worldY(py)];

  isNear([px, py]: Place, x: number, y: number, r: number) {
    const { view } = this.stage;
    return Math.hypot(view.px(x) - px, view.py(y) - py) < Math.max(r, BALL_REACH);
  }

  /** The particle at a place, px; -1 if there is none. */
  ballAt(at: Place) {
    const { machine, recording, t } = this.lab, { scale } = this.stage.view;
    const { view } = this.stage;
    let least = Infinity, nearest = -1;
    machine?.releases.forEach((_, i) => {
      const state = recording?.tracks[i]?.state(t);
      if (!state || state.ended) return;
      const corners = cornersOf(machine, i, state, recording?.tracks[i].angle(t) ?? 0);
      const isIn = corners.length > 0
        && isInside(corners, [view.worldX(at[0]), view.worldY(at[1])]);
      const far = isIn ? 0 : Math.hypot(view.px(state.x) - at[0], view.py(state.y) - at[1]);
      if (far >= Math.max((machine.radius[i] ?? 0) * scale, BALL_REACH) || far >= least) return;
      [least, nearest] = [far, i];
    });
    return nearest;
  }

  /** The thing at a place, px: a ball, at its start or at present, or a surface. */
  nameAt(at: Place) {
    const { view, handles } = this.stage, { machine } = this.lab, [px, py] = at;
    if (!machine) return "";
    const start = handles.find(({ what, x, y }) => what === "release" && this.isNear(at, x, y, 0));
    if (start) return start.surface;
    const ball = this.ballAt(at), { recording, t } = this.lab;
    const pin = recording && pinsOf(recording, t).find(({ at: [x, y] }) =>
      Math.hypot(view.px(x) - px, view.py(y) - py) < PIN_REACH);
    if (pin) return pin.name;
    const name = surfaceAt(this.stage.posed ?? machine, view.worldX(px), view.worldY(py),
      CLICK_REACH / view.scale,
      (this.lab.scene?.sensor ?? []).concat(recording ? linesOfJoints(recording, t) : []));
    const few = machine.releases.length < MOST_BALLS;
    return ball >= 0 && few ? machine.streams[machine.releases[ball].stream] : name;
  }

  /** The body at a place, px, to be moved: with a finger only a chosen one. */
  bodyAt(at: Place, pointer: string) {
    if (this.moving) return null;
    const { view, handles, frame } = this.stage, { parts } = this.inspector;
    const isIn = frame && at[0] > frame.left && at[0] < frame.right && at[1] > frame.top
      && at[1] < frame.bottom;
    const name = isIn ? parts[0] : this.nameAt(at);
    if (!name || (pointer === "touch" && !parts.includes(name))) return null;
    const names = parts.includes(name) ? parts : [name];
    const body = bodyOf(handles, names, view.worldX(at[0]), view.worldY(at[1]));
    return body && { ...body, surface: name };
  }

  /** Move the grabbed body along. @param at pixels */
  carry(at: Place, event: PointerEvent) {
    const { stage, grabbed, pressed, inspector } = this;
    if (stage.held || !grabbed || !pressed) return;
    if (distance(at, pressed) < STRAY) return;
    if (!inspector.parts.includes(grabbed.surface)) inspector.choose(grabbed.surface);
    stage.hold(grabbed);
    // This move may be the only one: if events come late, many are reported as one.
    stage.aim(event);
  }

  /** Show what a click would choose. */
  hover(at: Place) {
    const { stage } = this, name = this.nameAt(at);
    stage.front.classList.toggle("on-body", name !== "");
    if (name === stage.pointed) return;
    stage.pointed = name;
    stage.drawOutline();
  }

  /** A finger came down on nothing. */
  pressed: Place | null = null;

  /** A finger moved: one moves the view, two zoom it, too. */
  look(id: number, at: Place) {
    const { view } = this.stage;
    const spread = () => {
      const [[ax, ay], second] = [...this.fingers.values()], [bx, by] = second ?? [ax, ay];
      return { x: 0.5 * (ax + bx), y: 0.5 * (ay + by), far: Math.hypot(bx - ax, by - ay) };
    };
    const before = spread();
    this.fingers.set(id, at);
    const now = spread();
    view.x -= (now.x - before.x) / view.scale;
    view.y += (now.y - before.y) / view.scale;
    this.zoom(before.far > 1 && now.far > 1 ? now.far / before.far : 1, now.x, now.y);
  }

  zoom(factor: number, px: number, py: number) {
    const { stage } = this, [least, most] = SCALES;
    const scale = Math.min(most, Math.max(least, stage.view.scale * factor));
    stage.view.zoom(scale / stage.view.scale, px, py);
    stage.moved = true;
    // There are more events than frames.
    this.waiting ||= requestAnimationFrame(() => {
      this.waiting = 0;
      stage.rebuild();
      this.offer();
    });
  }

  /** Offer to show everything if little of the machine is in sight. */
  offer() {
    const { stage: { view }, lab: { machine }, lost } = this;
    if (!machine) return;
    const { left, right, top, bottom } = boxOf(machine, []);
    const share = (low: number, high: number, end: number) =>
      Math.max(0, Math.min(high, end) - Math.max(low, 0)) / Math.max(1, high - low);
    lost.hidden = share(view.px(left), view.px(right), view.width)
      * share(view.py(top), view.py(bottom), view.height) >= IN_SIGHT;
  }

  lost;

  waiting = 0;

  /** The intended place, m. @param at pixels */
  meant(at: Place, loose: boolean) {
    const { stage, lab, mode } = this, { view } = stage;
    const ball = mode && isJoint(mode.table) ? lab.machine?.releases[this.ballAt(at)] : undefined;
    if (ball) return { at: [ball.x, ball.y] as Place, caught: true };
    if (loose || !lab.machine) {
      const [x, y] = [view.worldX(at[0]), view.worldY(at[1])];
      return { at: [roundTo(x, view.snap), roundTo(y, view.snap)] as Place, caught: false };
    }
    const last = this.points.length === 1 && mode?.places.length === 2 ? this.points[0] : undefined;
    return view.near(at, endsOf(lab.machine, []), last);
  }

  /** The pointer is over a place, px. */
  aim(at: Place, loose: boolean) {
    const found = this.meant(at, loose), { magnet, view } = this.stage;
    this.cursor = found.at;
    magnet.classList.toggle("on", found.caught);
    magnet.setAttribute("cx", view.px(found.at[0]));
    magnet.setAttribute("cy", view.py(found.at[1]));
    this.sketch();
  }

  /** Set a point of the part being drawn. @param at pixels */
  point(at: Place, loose: boolean) {
    this.take(this.meant(at, loose).at);
  }

  /** @param at m */
  take(at: Place) {
    const { mode } = this;
    if (!mode) return;
    this.points.push(at);
    this.cursor = null;
    if (this.points.length < mode.places.length) {
      this.sketch();
      return;
    }
    const { points } = this;
    this.points = [];
    this.put(mode, points);
  }

  /** Place of the next point without a pointer, m. */
  next(): Place {
    return this.example()[this.points.length];
  }

  /** Points of a part without a pointer: around a place, or the middle of the view.
   * @param about m */
  example(part = this.mode, about: Place = this.stage.view.middle): Place[] {
    const { view } = this.stage, [first] = part?.places ?? [];
    const shares = EXAMPLES[first] ?? [[0, 0]];
    const size = Math.min(view.unit, (0.7 * (view.free.right - view.free.left)) / view.scale);
    return shares.map(([u, v]) => [roundTo(about[0] + u * size, view.snap),
      roundTo(about[1] + v * size, view.snap)]);
  }

  /** Places near the middle of the view and far from everything, the best first, m. */
  rooms(): Place[] {
    const { stage } = this, { view } = stage, { left, right, top, bottom } = view.free;
    const there = pointsOf(stage).flatMap(([, points]) => points);
    const [cx, cy] = [0.5 * (left + right), 0.5 * (top + bottom)];
    const found = GRID.flatMap((u) => GRID.map((v) => {
      const [x, y] = [cx + u * (right - left), cy + v * (bottom - top)];
      const free = there.reduce((least, [px, py]) =>
        Math.min(least, Math.hypot(px - x, py - y)), ROOM);
      return { good: free - 0.5 * Math.hypot(x - cx, y - cy), x, y };
    }));
    return found.sort((a, b) => b.good - a.good).slice(0, TRIES)
      .map(({ x, y }) => [view.worldX(x), view.worldY(y)]);
  }

  /** Add a part to the scene. If its tool stays, the part is not chosen. */
  put(part: Part, points: Place[]) {
    const { lab } = this, { given, machine } = lab;
    if (!given) return;
    // A ball falls into a run that goes on; after its end it belongs to the next run.
    const goesOn = machine?.interact && !(lab.t >= given.run?.until);
    const start = goesOn ? roundTo(Math.max(0, lab.t), 1e-3) : 0;
    const { unit, scale } = this.stage.view, { parts, tables } = lab.data;
    const reach = CLICK_REACH / scale, [ball] = parts.filter((one: Part) => one.part === "ball");
    const changed = isJoint(part.table)
      ? withJoint(given, part, points, unit, this.material, machine, ball, reach)
      : part.part === "trigger" ? withTrigger(given, part, points, unit, machine, reach)
      : withPart(given, part, points, unit, this.material, start, tables[part.table]);
    lab.asked = "";
    // The view does not change while a machine grows.
    this.stage.fitted = this.stage.moved = true;
    lab.replace(changed);
    this.sketch();
    if (lab.fault) return;
    const rows = changed[part.table];
    this.made = part.table === "incoming" ? "incoming"
      : rows.at(-1).name ?? `${part.table} ${rows.length}`;
    if (!this.mode) this.inspector.choose(this.made);
  }

  /** The part added last. */
  made = "";

  /** Add a part where it has room, and choose it: its handle gets the focus. @param about m */
  place(part: Part, about?: Place) {
    this.set(null);
    if (about) this.put(part, this.example(part, about));
    else {
      for (const place of part.places.length ? this.rooms() : [this.stage.view.middle]) {
        this.put(part, part.places.length ? this.example(part, place) : []);
        if (!this.lab.fault) break;
      }
    }
    if (this.lab.fault) return;
    const handle = this.stage.handles.find(({ surface }) => surface === this.inspector.part);
    this.stage.gripOf.get(handle?.id ?? "")?.focus();
  }

  /** The points set of the part being drawn, the missing ones, and a preview. */
  sketch() {
    const { mode, stage, chip, words, draft } = this, { view } = stage;
    draft.replaceChildren();
    // The example of an empty page makes room.
    stage.home.classList.toggle("begun", this.points.length > 0);
    this.chip.hidden = mode === null;
    if (!mode) {
      stage.magnet.classList.remove("on");
      return;
    }
    const all = this.cursor ? [...this.points, this.cursor] : this.points;
    const pixels = all.map(([x, y]) => [view.px(x), view.py(y)] as Place);
    if (pixels.length > 1) {
      // An arc with its ends and a third point is complete.
      const [a, b, c] = pixels;
      const turn = c && (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
      let path = `M${a}L${b}`;
      if (mode.places[0] === "arc" && c && Math.abs(turn) > 1) {
        const radius = (distance(a, b) * distance(b, c) * distance(a, c)) / (2 * Math.abs(turn));
        const wide = (a[0] - c[0]) * (b[0] - c[0]) + (a[1] - c[1]) * (b[1] - c[1]) > 0 ? 1 : 0;
        path = `M${a}A${radius} ${radius} 0 ${wide} ${turn > 0 ? 0 : 1} ${b}`;
      }
      draft.append(svg("path", { d: path }));
    }
    pixels.forEach(([cx, cy], n) => {
      const kind = n < this.points.length ? "set" : "next";
      draft.append(svg("circle", { cx, cy, r: 13, class: kind }),
        svg("text", { x: cx, y: cy + 5, "text-anchor": "middle", class: kind }, String(n + 1)));
    });
    const count = mode.places.length, now = this.points.length;
    const told = `${mode.part} ${now}`;
    if (told === chip.dataset.told) return;
    chip.dataset.told = told;
    const done = html("button", { id: "done", click: () => this.set(null) }, words.say("done"),
      html("span", { class: "note" }, " Esc"));
    const pips = html("span", { class: "pips", "aria-hidden": "true" }, ...mode.places.map((_, n) =>
      html("i", { class: n < now ? "on" : "" })));
    const key = mode.places[now], again = count > 1 && key === mode.places[0];
    const where = `draw-${key}${again ? `-${now + 1}` : ""}`;
    chip.replaceChildren(pips, html("b", {}, words.say("point-of", { now: now + 1, count })),
      html("span", {}, words.say(where)), done);
  }

  /** Choose the clicked part, or nothing. @param add it to the choice, or remove it from that */
  pick(at: Place, add: boolean) {
    const { inspector } = this, name = this.nameAt(at), { parts } = inspector;
    if (!add) inspector.choose(...(name ? [name] : []));
    else if (name) {
      inspector.choose(...(parts.includes(name) ? parts.filter((one) => one !== name)
        : [...parts, name]));
    }
  }

  /** Copied rows. */
  copied: [string, Given][] = [];

  copy() {
    const { given } = this.lab;
    if (given) this.copied = rowsNamed(given, this.inspector.parts);
  }

  /** Add copies beside the originals, each time further away, and choose them. */
  paste() {
    const { lab, stage, copied } = this, { scale, snap } = stage.view;
    if (!lab.given || !copied.length || !this.free) return;
    const [given, names] = withCopies(lab.given, copied, [
      roundTo(ASIDE[0] / scale, snap), roundTo(-ASIDE[1] / scale, snap)]);
    lab.asked = "";
    lab.replace(given);
    if (lab.fault) return;
    this.copied = rowsNamed(given, names);
    this.inspector.choose(...names);
  }

  duplicate() {
    const before = this.copied;
    this.copy();
    this.paste();
    this.copied = before;
  }

  /** Choose everything that has its own name. */
  all() {
    const { machine } = this.lab;
    const names = [...machine?.surfaces ?? [], ...machine?.streams ?? [],
      ...(machine ? namesOfJoints(machine) : [])];
    this.inspector.choose(...names.filter(this.movable));
  }
}

export { Bench };
