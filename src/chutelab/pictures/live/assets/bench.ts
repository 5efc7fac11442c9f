// What is done on the picture itself: look around, choose, draw, drop and delete.

import { mayDraw } from "./controls.ts";
import { surfaceAt, withArc, withLine, withParticle } from "./edit.ts";
import { bodyOf, roundTo, type Handle } from "./handles.ts";
import { html, iconButton } from "./panels.ts";
import { svg } from "./scenery.ts";
import type { Stage } from "./stage.ts";
import type { Inspector } from "./inspector.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

type Place = [number, number];
type Mode = "move" | "line" | "arc" | "drop";

/** What stands on the buttons, see page.html. */
const DRAWINGS: Record<string, string> = {
  move: "select", line: "line", arc: "arc", drop: "ball", delete: "bin", "zoom-in": "plus",
  "zoom-out": "minus",
};

/** Points that a thing is drawn by. */
const POINTS = { move: 0, line: 2, arc: 3, drop: 1 };

/** Pixels that a finger or a mouse may stray while it clicks. */
const STRAY = 6;

/** How far from a line it can be clicked, pixels. */
const CLICK_REACH = 14;

const ZOOM = 1.25;

/** Pixels per metre. */
const SCALES = [2, 2e5];

class Bench {
  mode: Mode = "move";
  /** The points that are set of what is being drawn. */
  points: Place[] = [];
  /** Fingers on the picture, pixels. */
  fingers: Map<number, Place> = new Map();
  draft;
  chosen;
  modes?: [Mode, any][];
  remove?: any;

  constructor(
    home: any, readonly stage: Stage, readonly inspector: Inspector, readonly lab: Lab,
    readonly words: Words,
  ) {
    this.draft = svg("path", { class: "draft" });
    this.chosen = svg("path", { class: "chosen" });
    stage.over.prepend(this.chosen, this.draft);
    inspector.mayDelete = mayDraw(lab.data);
    this.tools(home);
    this.listen();
    inspector.listeners.push(() => this.mark());
    lab.on("scene", () => this.mark());
    stage.painters.push(() => this.follow());
    this.set("move");
  }

  tools(home: any) {
    const { words, lab, stage } = this, free = mayDraw(lab.data);
    const button = (id: string, act: (event: MouseEvent) => void) => {
      const made = iconButton(`tool-${id}`, DRAWINGS[id], words.say(id));
      made.addEventListener("click", act);
      return made;
    };
    this.modes = ((free ? ["move", "line", "arc", "drop"] : []) as Mode[]).map((mode) =>
      [mode, button(mode, ({ detail }) => {
        this.set(mode);
        // It was a key, not a click, so there is no mouse to draw with.
        if (detail === 0 && mode !== "move") this.draw(this.example());
      })] as [Mode, any]);
    this.remove = button("delete", () => this.inspector.takeAway());
    const middle = (factor: number) =>
      this.zoom(factor, stage.view.px(stage.view.middle[0]), stage.view.py(stage.view.middle[1]));
    const zooms = [
      button("zoom-in", () => middle(ZOOM)), button("zoom-out", () => middle(1 / ZOOM)),
    ];
    home.prepend(...this.modes.map(([, made]) => made), ...(free ? [this.remove] : []), ...zooms);
    const presets = lab.data.live?.presets ?? [];
    if (!presets.length) return;
    const menu = html("select", { id: "presets", "aria-label": words.say("presets") });
    menu.append(new Option(words.say("presets"), ""),
      ...presets.map(({ name }: { name: string }, n: number) =>
        new Option(name, String(n))));
    menu.addEventListener("change", () => {
      if (menu.value !== "") lab.change(presets[Number(menu.value)].set);
      menu.value = "";
    });
    home.append(menu);
  }

  set(mode: Mode) {
    this.mode = mode;
    this.points = [];
    this.draft.setAttribute("d", "");
    this.stage.home.classList.toggle("drawing", mode !== "move");
    for (const [one, button] of this.modes ?? []) {
      button.setAttribute("aria-pressed", String(one === mode));
    }
  }

  listen() {
    const { front } = this.stage;
    front.addEventListener("pointerdown", (event: PointerEvent) => {
      if (event.target !== front || event.button > 0) return;
      front.setPointerCapture(event.pointerId);
      const at = this.stage.placeOf(event);
      this.fingers.set(event.pointerId, at);
      this.pressed = this.fingers.size === 1 ? at : null;
      this.grabbed = this.pressed && this.mode === "move"
        ? this.bodyAt(at, event.pointerType) : null;
      if (this.mode !== "move" && this.pressed) this.put(at);
    });
    front.addEventListener("pointermove", (event: PointerEvent) => {
      const at = this.stage.placeOf(event);
      if (this.mode !== "move") this.sketch(at);
      else if (this.grabbed) this.carry(at, event);
      else if (this.fingers.has(event.pointerId)) {
        const alone = this.fingers.size === 1 && event.pointerType === "touch";
        // One finger on an empty place scrolls the page.
        if (alone) this.fingers.set(event.pointerId, at);
        else this.look(event.pointerId, at);
      }
    });
    front.addEventListener("pointerup", (event: PointerEvent) => {
      if (!this.fingers.delete(event.pointerId) || !this.pressed) return;
      const at = this.stage.placeOf(event);
      const still = Math.hypot(at[0] - this.pressed[0], at[1] - this.pressed[1]) < STRAY;
      if (this.mode === "move") {
        if (still) this.pick(at);
      } else if (!still) this.put(at);
      this.pressed = this.grabbed = null;
    });
    front.addEventListener("touchstart", (event: TouchEvent) => {
      const { touches } = event, box = front.getBoundingClientRect();
      const at: Place = [touches[0].clientX - box.left, touches[0].clientY - box.top];
      // The page must not scroll away under what is moved.
      const body = this.mode === "move" && this.bodyAt(at, "touch");
      if (touches.length > 1 || body) event.preventDefault();
    }, { passive: false });
    front.addEventListener("pointercancel", (event: PointerEvent) => {
      this.fingers.delete(event.pointerId);
      this.pressed = null;
    });
    front.addEventListener("wheel", (event: WheelEvent) => {
      const page = document.documentElement;
      if (!event.ctrlKey && page.scrollHeight > page.clientHeight + 1) return;
      event.preventDefault();
      const lines = event.deltaMode === 1 ? 20 : 1;
      this.zoom(2 ** (-(event.deltaY * lines) / (event.ctrlKey ? 80 : 400)),
        ...this.stage.placeOf(event as any));
    }, { passive: false });
    this.stage.grips.addEventListener("focusin", ({ target }: FocusEvent) => {
      const id = (target as Element).getAttribute("data-id");
      const handle = this.stage.handles.find((one) => one.id === id);
      if (handle) this.inspector.choose(handle.surface);
    });
  }

  /** The body that is grabbed, and moves once the pointer has moved. */
  grabbed: Handle | null = null;

  /** The body at a place, px, to move it: with a finger only one that is chosen. */
  bodyAt([px, py]: Place, pointer: string) {
    const { view, handles } = this.stage, { machine } = this.lab;
    const [x, y] = [view.worldX(px), view.worldY(py)];
    const name = machine ? surfaceAt(machine, x, y, CLICK_REACH / view.scale) : "";
    if (!name || (pointer === "touch" && name !== this.inspector.part)) return null;
    return bodyOf(handles, name, x, y);
  }

  /** Move the body that is grabbed along. @param at pixels */
  carry(at: Place, event: PointerEvent) {
    const { stage, grabbed, pressed } = this;
    if (stage.held || !grabbed || !pressed) return;
    if (Math.hypot(at[0] - pressed[0], at[1] - pressed[1]) < STRAY) return;
    if (this.inspector.part !== grabbed.surface) this.inspector.choose(grabbed.surface);
    stage.held = grabbed;
    // This move may be the only one: where all comes late, many are told as one.
    stage.aim(event);
  }

  /** Where a finger came down that does nothing else. */
  pressed: Place | null = null;

  /** A finger went on: one moves what is shown, two make it larger or smaller, too. */
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
    // More events than frames come.
    this.waiting ||= requestAnimationFrame(() => {
      this.waiting = 0;
      stage.rebuild();
    });
  }

  waiting = 0;

  /** @param at pixels */
  worldOf([px, py]: Place): Place {
    const { view } = this.stage;
    return [roundTo(view.worldX(px), view.snap), roundTo(view.worldY(py), view.snap)];
  }

  /** Set a point of what is being drawn. @param at pixels */
  put(at: Place) {
    this.points.push(this.worldOf(at));
    if (this.points.length >= POINTS[this.mode]) this.draw(this.points);
  }

  /** @param at pixels */
  sketch(at: Place) {
    const { view } = this.stage;
    const corners = [...this.points, this.worldOf(at)]
      .map(([x, y]) => `${view.px(x)} ${view.py(y)}`);
    this.draft.setAttribute("d", corners.length > 1 ? `M${corners.join("L")}` : "");
  }

  /** Add what was drawn to the scene, and choose it. */
  draw(points: Place[]) {
    const { lab, mode } = this, { given, machine } = lab;
    if (!given) return;
    const [a, b, c] = points;
    const start = machine?.interact ? roundTo(Math.max(0, lab.t), 1e-3) : 0;
    const changed = mode === "line" ? withLine(given, a, b)
      : mode === "arc" ? withArc(given, a, b, c) : withParticle(given, a, start);
    const table = mode === "drop" ? "stream" : "surface";
    this.set("move");
    lab.replace(changed);
    if (lab.fault) return;
    this.inspector.choose(changed[table][changed[table].length - 1].name);
    const made = this.stage.handles.findLast(({ surface }) => surface === this.inspector.part);
    this.stage.gripOf.get(made?.id ?? "")?.focus();
  }

  /** A place for something new in the middle of what is seen. */
  example(): Place[] {
    const { left, right, top, bottom } = this.stage.view.free;
    const at = (u: number, v: number) =>
      this.worldOf([left + u * (right - left), top + v * (bottom - top)]);
    return this.mode === "line" ? [at(0.4, 0.5), at(0.6, 0.6)]
      : this.mode === "arc" ? [at(0.4, 0.5), at(0.5, 0.65), at(0.6, 0.5)] : [at(0.5, 0.25)];
  }

  /** Choose the surface that was clicked, or the scene. @param at pixels */
  pick([px, py]: Place) {
    const { view } = this.stage, { machine } = this.lab;
    if (!machine) return;
    const name = surfaceAt(machine, view.worldX(px), view.worldY(py), CLICK_REACH / view.scale);
    this.inspector.choose(name || "scene");
  }

  /** Show what is chosen. */
  mark() {
    const { lab, stage, inspector } = this, { machine } = lab;
    stage.part = inspector.part;
    for (const { id, surface } of stage.handles) {
      stage.gripOf.get(id)?.classList.toggle("own", surface === inspector.part);
    }
    if (!machine || !this.remove) return;
    this.remove.disabled = !inspector.canDelete;
    const { view } = stage, surface = machine.surfaces.indexOf(inspector.part);
    const own = (piece: { surface: number }) => piece.surface === surface;
    const lines = machine.segments.filter(own).map(({ x, y, tx, ty, length }) =>
      `M${view.px(x)} ${view.py(y)}L${view.px(x + tx * length)} ${view.py(y + ty * length)}`);
    const arcs = machine.arcs.filter(own).map((arc) => stage.scenery.arcPath(arc));
    this.chosen.setAttribute("d", [...lines, ...arcs].join(""));
    this.seen = `${view.scale} ${view.x} ${view.y} ${view.width} ${view.height}`;
  }

  seen = "";

  /** Keep the mark in its place while the view is moved. */
  follow() {
    const { scale, x, y, width, height } = this.stage.view;
    if (this.seen !== `${scale} ${x} ${y} ${width} ${height}`) this.mark();
  }
}

export { Bench };
