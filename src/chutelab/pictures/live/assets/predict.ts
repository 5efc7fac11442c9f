// First say where it will land, then see: path, landing and numbers are hidden until then.

import { historyOf } from "./stages.ts";
import { svg } from "./scenery.ts";
import type { Stage } from "./stage.ts";
import type { Lab } from "./lab.ts";
import type { Scene } from "./scene.ts";
import type { Words } from "./words.ts";

/** Steps of arrow keys, m; with Shift a tenth of it. */
const MARK_STEP = 0.01;

/** Where the outgoing belt runs; null if there is none. */
function landingLine(
  { incoming, outgoing }: Scene,
): { y: number, left: number, right: number } | null {
  return outgoing && incoming ? {
    y: incoming.pulley_radius - outgoing.drop, left: outgoing.start,
    right: outgoing.start + outgoing.length,
  } : null;
}

/** Where it went: the mean of all landings, or of where tracks ended in a run without a belt to
 * land on; null as long as there is nothing. */
function whereTo(lab: Lab, lands: boolean): [number, number] | null {
  const { recording } = lab;
  if (!recording || (!lands && recording.state === "running")) return null;
  const places = lands ? historyOf(lab)?.landings ?? []
    : recording.tracks.flatMap((track) => track.state(track.end) ?? []);
  if (!places.length) return null;
  const mean = (axis: "x" | "y") =>
    places.reduce((sum, place) => sum + place[axis], 0) / places.length;
  return [mean("x"), mean("y")];
}

class Prediction {
  /** Whether everything is hidden; whether the learner has said where. */
  hides = true;
  isSet = false;
  always = false;
  /** Whether play was pressed too early. */
  asked = false;
  at: [number, number] = [0, 0];
  note;
  show;
  grip;
  line;
  belt?: { y: number, left: number, right: number } | null;

  constructor(readonly stage: Stage, readonly lab: Lab, readonly words: Words) {
    this.note = document.getElementById("guess") as any;
    this.show = document.getElementById("show-all") as any;
    this.grip = svg("g", { class: "guess", role: "slider", tabindex: 0 });
    this.grip.append(svg("circle", { class: "room", r: 20 }),
      svg("path", { d: "M0 0L-8 -17A9.5 9.5 0 1 1 8 -17Z" }));
    this.grip.setAttribute("aria-label", words.say("mark"));
    this.grip.setAttribute("aria-describedby", "guess");
    this.line = svg("path", { class: "miss" });
    stage.over.append(this.line, this.grip);
    this.show.hidden = false;
    this.show.textContent = words.say("show-at-once");
    this.show.addEventListener("click", () => {
      this.always = !this.always;
      this.show.setAttribute("aria-pressed", String(this.always));
      this.hide(!this.always);
    });
    lab.mayPlay = () => this.begin();
    lab.on("scene", () => this.changed());
    lab.on("run", () => this.place());
    stage.painters.push(() => this.place());
    this.listen();
    this.changed();
  }

  given: object | undefined;

  /** Another scene asks anew. */
  changed() {
    const { lab, stage } = this, { view } = stage;
    if (this.given === lab.given || !lab.scene) return;
    const first = !this.given;
    this.given = lab.given;
    this.belt = landingLine(lab.scene);
    if (first || !this.isSet) {
      this.at = this.belt
        ? [Math.min(Math.max(view.x, this.belt.left), this.belt.right), this.belt.y]
        : [view.x, view.y];
    }
    this.isSet = this.asked = false;
    if (!this.always) this.hide(true);
  }

  hide(hides: boolean) {
    const { lab, stage } = this;
    this.hides = hides;
    if (hides) {
      lab.pause();
      this.lab.t = lab.start;
    }
    stage.blind = hides;
    document.documentElement.classList.toggle("predicting", hides);
    for (const id of ["time", "back", "forward"]) {
      (document.getElementById(id) as any).disabled = hides;
    }
    if (!lab.playing) lab.tell("time");
    stage.rebuild();
  }

  /** Play was pressed. */
  begin() {
    if (!this.hides) return true;
    if (this.isSet) this.hide(false);
    else {
      this.asked = true;
      this.place();
      this.grip.focus();
    }
    return this.isSet;
  }

  set(x: number, y: number) {
    const { belt } = this;
    this.at = belt ? [Math.min(Math.max(x, belt.left), belt.right), belt.y] : [x, y];
    this.isSet = true;
    this.place();
  }

  listen() {
    const { grip, stage } = this;
    let held = false;
    grip.addEventListener("pointerdown", (event: PointerEvent) => {
      if (!this.hides) return;
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
        // It may be right where it stands.
        if (held && !this.isSet) this.set(...this.at);
        held = false;
      });
    }
    grip.addEventListener("keydown", (event: KeyboardEvent) => {
      const ways: Record<string, [number, number]> = {
        ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1],
        PageUp: [10, 0], PageDown: [-10, 0], Enter: [0, 0],
      };
      const way = ways[event.key];
      if (!way || !this.hides) return;
      event.preventDefault();
      const step = MARK_STEP * (event.shiftKey ? 0.1 : 1);
      this.set(this.at[0] + way[0] * step, this.at[1] + way[1] * step);
    });
  }

  /** Put the mark where it belongs, and say how far off it was once that is known. */
  place() {
    const { lab, stage: { view }, words, grip, at: [x, y], belt } = this;
    grip.setAttribute("transform", `translate(${view.px(x)} ${view.py(y)})`);
    grip.setAttribute("aria-valuenow", String(x));
    grip.setAttribute("aria-valuetext",
      [x, ...(belt ? [] : [y])].map((value) => words.value({ value, unit: "m" })).join(", "));
    grip.setAttribute("aria-disabled", String(!this.hides));
    grip.style.display = this.always ? "none" : "";
    const went = !this.hides && this.isSet ? whereTo(lab, Boolean(belt)) : null;
    this.line.setAttribute("d", went
      ? `M${view.px(x)} ${view.py(y)}L${view.px(went[0])} ${view.py(went[1])}` : "");
    const off = went ? Math.hypot(went[0] - x, belt ? 0 : went[1] - y) : 0;
    const wish = this.isSet ? "mark-play" : this.asked ? "mark-first" : "mark-set";
    const isOver = this.isSet && lab.recording?.state !== "running";
    const said = this.always ? "" : this.hides ? words.say(wish)
      : went ? words.say("mark-off", { distance: words.number(100 * off, 3) })
        : isOver ? words.say("mark-none") : "";
    this.note.hidden = !said;
    // Only what is new is read out.
    if (this.note.textContent !== said) this.note.textContent = said;
  }
}

export { Prediction };
