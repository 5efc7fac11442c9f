// Predict first, then see: path, landing and numbers are not in the page until then.

import { historyOf } from "./stages.ts";
import { svg } from "./scenery.ts";
import type { Stage } from "./stage.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

export type Place = [number, number];

/** Steps of arrow keys, m; with Shift a tenth of it. */
const MARK_STEP = 0.01;

/** Most points of a sketch, and their distance in pixels. */
const MOST_POINTS = 20, APART = 12;

/** Elements that show a run; they are removed from the page while it is to be predicted. */
const TELLS = ".reveals, .tools, .looks, .watch, #panels > .card:not(#edit, #share), #share label";

const WAYS: Record<string, Place> = {
  ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
  PageUp: [10, 0], PageDown: [-10, 0],
};

/** Functions that hide the run. */
class Curtain {
  hides = false;
  away: [Element, Comment][] = [];

  constructor(readonly stage: Stage, readonly lab: Lab) {}

  set(hides: boolean) {
    const { lab, stage } = this;
    this.hides = hides;
    if (hides) {
      lab.pause();
      lab.t = lab.start;
      for (const element of document.querySelectorAll(TELLS)) {
        const place = document.createComment("");
        element.replaceWith(place);
        this.away.push([element, place]);
      }
    } else for (const [element, place] of this.away.splice(0)) place.replaceWith(element);
    stage.blind = hides;
    document.documentElement.classList.toggle("predicting", hides);
    for (const id of ["time", "back", "forward"]) {
      (document.getElementById(id) as any).disabled = hides;
    }
    if (!lab.playing) lab.tell("time");
    if (!hides) lab.tell("run");
    stage.rebuild();
  }
}

/** A flag put at the expected place of an event: on the outgoing belt, on the pulley, or anywhere.
 */
class Flag {
  at: Place = [0, 0];
  isSet = false;
  isOpen = true;
  grip;
  line;

  /** @param what an event of the run, such as "landing"
   * @param changed called once it is put somewhere */
  constructor(
    readonly stage: Stage, readonly lab: Lab, readonly words: Words, public what: string,
    readonly changed: () => void, note = "",
  ) {
    this.grip = svg("g", { class: "guess", role: "slider", tabindex: 0,
      "aria-label": words.say("mark") }, svg("circle", { class: "room", r: 22, cy: -14 }),
    svg("path", { class: "pole", d: "M0 0V-40" }), svg("path", { d: "M0 -41H25L19 -33L25 -25H0Z" }),
    svg("circle", { class: "foot", r: 4.5 }));
    if (note) this.grip.setAttribute("aria-describedby", note);
    this.line = svg("path", { class: "miss" });
    stage.over.append(this.line, this.grip);
    this.painter = () => this.place();
    stage.painters.push(this.painter);
    this.listen();
    this.begin();
  }

  painter;

  remove() {
    this.grip.remove();
    this.line.remove();
    const { painters } = this.stage;
    painters.splice(painters.indexOf(this.painter), 1);
  }

  /** Put it at its neutral place. */
  begin() {
    const { free } = this.stage.view, { view } = this.stage;
    this.at = this.near(view.worldX(0.5 * (free.left + free.right)),
      view.worldY(0.5 * (free.top + free.bottom)));
    this.isSet = false;
  }

  /** The outgoing belt's line; null if the question is not about it. */
  get belt() {
    const { incoming, outgoing } = this.lab.scene ?? {};
    return this.what === "landing" && outgoing && incoming ? {
      y: incoming.pulley_radius - outgoing.drop, left: outgoing.start,
      right: outgoing.start + outgoing.length,
    } : null;
  }

  /** The nearest allowed place. */
  near(x: number, y: number): Place {
    const { belt } = this, { pulley, radius } = this.lab.machine as any;
    if (belt) return [Math.min(Math.max(x, belt.left), belt.right), belt.y];
    if (this.what !== "separation" || !pulley) return [x, y];
    const far = Math.max(Math.hypot(x, y), 1e-9), ride = pulley.radius + radius[0];
    return [Math.max(0, (x * ride) / far), (y * ride) / far];
  }

  set(x: number, y: number) {
    this.at = this.near(x, y);
    this.isSet = true;
    this.place();
    this.changed();
  }

  listen() {
    const { grip, stage } = this;
    let held = false;
    grip.addEventListener("pointerdown", (event: PointerEvent) => {
      if (!this.isOpen) return;
      event.preventDefault();
      grip.focus();
      grip.setPointerCapture(event.pointerId);
      held = true;
    });
    grip.addEventListener("pointermove", (event: PointerEvent) => {
      const [px, py] = stage.placeOf(event);
      if (held) this.set(stage.view.worldX(px), stage.view.worldY(py));
    });
    for (const end of ["pointerup", "pointercancel"]) {
      grip.addEventListener(end, () => {
        // Its present place may be right.
        if (held && !this.isSet) this.set(...this.at);
        held = false;
      });
    }
    grip.addEventListener("keydown", (event: KeyboardEvent) => {
      const way = event.key === "Enter" ? [0, 0] : WAYS[event.key];
      if (!way || !this.isOpen) return;
      event.preventDefault();
      const step = MARK_STEP * (event.shiftKey ? 0.1 : 1);
      this.set(this.at[0] + way[0] * step, this.at[1] + way[1] * step);
    });
  }

  /** The actual place: the mean over all particles with the event; null without one. */
  get went(): Place | null {
    const { lab: { recording }, what } = this, history = historyOf(this.lab);
    if (!recording || !history || this.stage.blind || !this.isSet) return null;
    const name = { separation: "left", impact: "hit", landing: "down" }[what];
    const places = name ? history.stages.flatMap((its: any) => its[name] ?? [])
      : recording.state === "running" ? []
        : recording.tracks.flatMap((track) => track.state(track.end) ?? []);
    const mean = (axis: "x" | "y") =>
      places.reduce((sum, place) => sum + place[axis], 0) / places.length;
    return places.length ? [mean("x"), mean("y")] : null;
  }

  /** Its error, m; NaN if not known yet. */
  get off() {
    const { went, at: [x, y] } = this;
    return went ? Math.hypot(went[0] - x, this.belt ? 0 : went[1] - y) : NaN;
  }

  place() {
    const { stage: { view }, words, grip, went, at: [x, y] } = this;
    grip.setAttribute("transform", `translate(${view.px(x)} ${view.py(y)})`);
    grip.setAttribute("aria-valuenow", String(x));
    grip.setAttribute("aria-valuetext",
      [x, ...(this.belt ? [] : [y])].map((value) => words.value({ value, unit: "m" })).join(", "));
    grip.setAttribute("aria-disabled", String(!this.isOpen));
    this.line.setAttribute("d", went
      ? `M${view.px(x)} ${view.py(y)}L${view.px(went[0])} ${view.py(went[1])}` : "");
  }
}

/** A path drawn into the picture by hand, or point by point with the keyboard. */
class Sketch {
  isOpen = true;
  line;
  pen;
  tip: Place;

  /** @param changed called whenever it changes */
  constructor(
    readonly stage: Stage, readonly words: Words, public points: Place[],
    readonly changed: () => void,
  ) {
    this.tip = points[points.length - 1] ?? stage.view.middle;
    this.line = svg("path", { class: "sketch" });
    this.pen = svg("g", { class: "guess pen", role: "slider", tabindex: 0,
      "aria-label": words.say("sketch"), "aria-describedby": "sketch-keys" },
    svg("circle", { class: "room", r: 20 }), svg("circle", { class: "foot", r: 6 }));
    stage.over.append(this.line, this.pen);
    this.drawer = () => this.draw();
    stage.drawers.push(this.drawer);
    this.stop = this.listen();
    this.draw();
  }

  drawer;
  stop;

  remove() {
    this.stop();
    this.line.remove();
    this.pen.remove();
    const { drawers } = this.stage;
    drawers.splice(drawers.indexOf(this.drawer), 1);
  }

  clear() {
    this.points = [];
    this.draw();
    this.changed();
  }

  /** Use presses on the picture for drawing, before anything else uses them. */
  listen() {
    const { stage, pen } = this, { front, view, home } = stage, stopped = new AbortController();
    const options = { capture: true, signal: stopped.signal };
    let last: Place | null = null;
    const add = (event: PointerEvent) => {
      const at = stage.placeOf(event);
      if (last && Math.hypot(at[0] - last[0], at[1] - last[1]) < APART) return;
      last = at;
      this.put([view.worldX(at[0]), view.worldY(at[1])]);
    };
    front.addEventListener("pointerdown", (event: PointerEvent) => {
      if (!this.isOpen || event.button > 0) return;
      event.stopPropagation();
      event.preventDefault();
      front.setPointerCapture(event.pointerId);
      this.points = [];
      last = null;
      add(event);
    }, options);
    front.addEventListener("pointermove", (event: PointerEvent) => {
      if (!last) return;
      event.stopPropagation();
      add(event);
    }, options);
    for (const end of ["pointerup", "pointercancel"]) {
      front.addEventListener(end, () => {
        if (last) this.thin();
        last = null;
      }, options);
    }
    pen.addEventListener("keydown", (event: KeyboardEvent) => {
      const { key } = event, way = WAYS[key];
      if (!this.isOpen || !(way || key === "Enter" || key === "Backspace")) return;
      event.preventDefault();
      event.stopPropagation();
      const step = 0.05 * (event.shiftKey ? 0.1 : 1);
      if (way) this.tip = [this.tip[0] + step * way[0], this.tip[1] + step * way[1]];
      else if (key === "Enter") this.put(this.tip);
      else this.points.pop();
      this.thin();
    });
    return () => {
      stopped.abort();
      home.classList.remove("sketching");
    };
  }

  put(at: Place) {
    this.tip = at;
    this.points.push(at.map((value) => Number(value.toFixed(3))) as Place);
    this.draw();
  }

  /** Reduce the points without changing the line. */
  thin() {
    while (this.points.length > MOST_POINTS) {
      this.points = this.points.filter((_, n) => n % 2 === 0 || n === this.points.length - 1);
    }
    this.draw();
    this.changed();
  }

  draw() {
    const { stage: { view }, points, tip, words } = this;
    const at = ([x, y]: Place) => `${view.px(x).toFixed(1)} ${view.py(y).toFixed(1)}`;
    this.line.setAttribute("d", points.length > 1 ? `M${points.map(at).join("L")}` : "");
    this.pen.setAttribute("transform", `translate(${at(tip)})`);
    this.pen.style.display = this.isOpen ? "" : "none";
    this.stage.home.classList.toggle("sketching", this.isOpen);
    this.pen.setAttribute("aria-valuenow", String(points.length));
    this.pen.setAttribute("aria-valuetext", words.say("sketch-at", {
      x: words.fixed(tip[0], 2), y: words.fixed(tip[1], 2), n: points.length,
    }));
  }
}

/** The question of a page without steps: where will it land? */
class Prediction {
  curtain;
  flag;
  always = false;
  /** Whether play was pressed too early. */
  asked = false;
  note;
  show;

  constructor(readonly stage: Stage, readonly lab: Lab, readonly words: Words) {
    this.curtain = new Curtain(stage, lab);
    this.note = document.getElementById("guess") as any;
    this.show = document.getElementById("show-all") as any;
    this.flag = new Flag(stage, lab, words, "landing", () => this.tell(), "guess");
    this.show.textContent = words.say("show-at-once");
    this.show.addEventListener("click", () => {
      this.always = !this.always;
      this.show.setAttribute("aria-pressed", String(this.always));
      this.flag.grip.style.display = this.always ? "none" : "";
      this.hide(!this.always);
    });
    lab.mayPlay = () => this.begin();
    lab.on("scene", () => this.changed());
    lab.on("run", () => this.tell());
    stage.painters.push(() => this.tell());
    this.changed();
  }

  given: object | undefined;

  /** A new scene asks again. */
  changed() {
    const { lab, flag } = this;
    if (this.given === lab.given || !lab.scene) return;
    if (!this.given || !flag.isSet) flag.begin();
    this.given = lab.given;
    flag.isSet = this.asked = false;
    if (!this.always) this.hide(true);
  }

  hide(hides: boolean) {
    this.curtain.set(hides);
    this.flag.isOpen = hides;
    this.flag.place();
    this.tell();
  }

  /** Play was pressed. */
  begin() {
    const { flag, curtain } = this;
    if (!curtain.hides) return true;
    if (flag.isSet) this.hide(false);
    else {
      this.asked = true;
      this.tell();
      flag.grip.focus();
    }
    return flag.isSet;
  }

  /** Say what to do, and the error once it is known. */
  tell() {
    const { lab, words, flag, always, curtain: { hides } } = this, { off } = flag;
    const wish = flag.isSet ? "mark-play" : this.asked ? "mark-first" : "mark-set";
    const isOver = flag.isSet && lab.recording?.state !== "running";
    const said = always ? "" : hides ? words.say(wish)
      : isFinite(off) ? words.say("mark-off", { distance: words.number(100 * off, 3) })
        : isOver ? words.say("mark-none") : "";
    this.note.hidden = !said;
    this.show.hidden = !hides && !always;
    // Screen readers read only changes.
    if (this.note.textContent !== said) this.note.textContent = said;
  }
}

export { Curtain, Flag, Prediction, Sketch };
