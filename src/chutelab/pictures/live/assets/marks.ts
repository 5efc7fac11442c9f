// Events of a run as marks on the time bar: separations, impacts, landings, gates.

import { onWidth } from "./chart.ts";
import { FEWEST } from "./crowd.ts";
import { html, icon } from "./panels.ts";
import type { Event } from "./core.ts";
import type { Lab } from "./lab.ts";
import type { Machine } from "./machine.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

type Happening = { t: number, kind: string, name?: string };

/** Kinds of the core's events that are marked, with their icons. */
const KINDS: Record<number, string> = {
  1: "separation", 3: "impact", 4: "landing", 5: "collision", 7: "settle",
};
const ICONS: Record<string, string> = {
  separation: "leave", impact: "hit", landing: "land", collision: "hit", settle: "land",
  opens: "gate", closes: "gate", starts: "play",
};

/** Least distance of marks, pixels, and most events of one mark. */
const APART = 26, TOLD = 3;

/** If there is no room for fingers, marks are ticks without function; least distance of ticks,
 * pixels. */
const FINE = matchMedia("(min-width: 720px) and (pointer: fine)"), TICKS = 5;

/** s by which the time shown may differ from an event's. */
const THEN = 1e-9;

/** Times at which gates of a machine open and close, and triggered motions begin. */
function gatesOf({ segments, arcs, movers, surfaces }: Machine): Happening[] {
  const gates = new Map([...segments, ...arcs].map((one) => [one.surface, one]));
  const starts = movers.filter(({ begins }) => begins > 0 && isFinite(begins))
    .map(({ begins, surface }) => ({ t: begins, kind: "starts", name: surfaces[surface] }));
  return [...starts, ...[...gates].flatMap(([surface, { appears, vanishes }]) => {
    const name = surfaces[surface], closes = appears > 0 && isFinite(appears);
    return [...(closes ? [{ t: appears, kind: "closes", name }] : []),
      ...(isFinite(vanishes) ? [{ t: vanishes, kind: "opens", name }] : [])];
  })];
}

class Marks {
  root;
  /** All events, and their marks. */
  all: Happening[] = [];
  shown: { button: HTMLElement, first: number, last: number }[] = [];
  wide = 400;
  drawn = "";
  /** Events of the run, the number read, and the marks found. */
  read = { events: [] as Event[], many: 0, found: [] as Happening[], down: false };

  constructor(readonly lab: Lab, readonly stage: Stage, readonly words: Words) {
    this.root = html("div", { class: "marks", role: "group", "aria-label": words.say("marks") });
    document.getElementById("time")?.before(this.root);
    stage.drawers.push(() => this.draw());
    for (const news of ["time", "play"] as const) lab.on(news, () => this.mark());
    this.root.addEventListener("keydown", (event: KeyboardEvent) => {
      const way = ({ ArrowRight: 1, ArrowLeft: -1 } as Record<string, number>)[event.key];
      const at = this.shown.findIndex(({ button }) => button === document.activeElement);
      if (!way || !this.shown[at + way]) return;
      event.preventDefault();
      this.shown[at + way].button.focus();
      this.shown[at + way].button.click();
    });
    onWidth(this.root, (width) => {
      this.wide = width;
      this.draw();
    });
  }

  /** By time: the events of the first particle of a few, the first landing of a crowd, and gates.
   */
  get happenings(): Happening[] {
    const { recording, machine } = this.lab;
    if (!recording || !machine || !isFinite(recording.begin)) return [];
    const { events } = recording, { surfaces } = machine;
    if (this.read.events !== events) {
      this.read = { events, many: 0, found: [], down: false };
    }
    const { read } = this, isCrowd = machine.releases.length >= FEWEST;
    for (; read.many < events.length; read.many += 1) {
      const { t, kind, disk, surface } = events[read.many], said = KINDS[kind];
      if (!said || (isCrowd ? said !== "landing" || read.down : disk > 0)) continue;
      read.down ||= said === "landing";
      read.found.push({ t, kind: said, name: surfaces[surface] });
    }
    return [...gatesOf(machine), ...read.found].sort((a, b) => a.t - b.t);
  }

  /** An event in words. */
  tell({ t, kind, name = "" }: Happening) {
    const { words } = this;
    return `${words.say(`mark-${kind}`, { name: words.name(name) })}, ${words.fixed(t, 3)} s`;
  }

  draw() {
    const { lab, root, wide } = this, span = lab.horizon - lab.start;
    // A run that is to be predicted has no marks.
    this.all = this.stage.blind || !(span > 0) ? [] : this.happenings;
    const { matches: fine } = FINE, now = JSON.stringify([this.all, lab.start, span, wide, fine]);
    if (now === this.drawn) return;
    this.drawn = now;
    const marks: { at: number, of: Happening[] }[] = [];
    for (const one of this.all) {
      const at = (one.t - lab.start) / span, last = marks.at(-1);
      if (at < 0 || at > 1) continue;
      if (last && (at - last.at) * wide < (fine ? APART : TICKS)) last.of.push(one);
      else marks.push({ at, of: [one] });
    }
    const had = root.contains(document.activeElement);
    this.shown = marks.map(({ at, of }) => {
      const said = of.slice(0, TOLD).map((one) => this.tell(one)).join("; ");
      const says = of.length > TOLD ? `${said} …` : said;
      const button = fine ? html("button", { "aria-label": says, "data-says": says,
        class: at > 0.5 ? "late" : "", click: () => this.go(of[0].t) }, icon(ICONS[of[0].kind]))
        : html("i");
      button.style.setProperty("--at", String(at));
      return { button, first: of[0].t, last: of[of.length - 1].t };
    });
    this.marked = "";
    root.replaceChildren(...this.shown.map(({ button }) => button));
    this.mark();
    if (had) root.querySelector("[tabindex='0']")?.focus();
  }

  go(t: number) {
    this.lab.pause();
    this.lab.seek(t);
  }

  /** Go to the next event, or the previous one. */
  jump(way: number) {
    const { t } = this.lab, far = (one: Happening) => way * (one.t - t);
    const there = this.all.filter((one) => far(one) > THEN);
    if (there.length) this.go(there.reduce((a, b) => (far(b) < far(a) ? b : a)).t);
  }

  /** Distinguish past, present and coming events. */
  mark() {
    const { lab: { t, playing }, shown } = this;
    const done = shown.filter(({ first }) => first <= t + THEN).length;
    const at = !playing && done && t <= shown[done - 1].last + THEN ? done : 0;
    if (String([done, at]) === this.marked) return;
    this.marked = String([done, at]);
    shown.forEach(({ button }, n) => {
      button.classList.toggle("done", n < done);
      button.classList.toggle("now", n === at - 1);
      if (FINE.matches) button.tabIndex = n === Math.max(0, done - 1) ? 0 : -1;
    });
  }

  /** The event at the time shown, in words. */
  get saysNow() {
    const { t } = this.lab;
    const now = this.all.filter((one) => Math.abs(one.t - t) < THEN).map((one) => this.tell(one));
    return now.join("; ");
  }

  /** Number of past events, and the one shown, as displayed last. */
  marked = "";
}

export { Marks };
