// Place, velocity and energy of one particle over time, with a movable line to read values.

import { Chart, onWidth, rangeOf } from "./chart.ts";
import { card, follow, html } from "./panels.ts";
import type { Lab } from "./lab.ts";
import type { Recording, Ledger } from "./recording.ts";
import type { Words } from "./words.ts";

type Sample = { t: number } & Record<string, number>;
/** `name` of the value, `kind` of the line */
type Line = { name: string, kind: string };

const DIAGRAMS: { id: string, unit: string, lines: Line[] }[] = [
  { id: "place", unit: "m", lines: [{ name: "x", kind: "curve-a" }, { name: "y", kind: "curve-b" }] },
  { id: "velocity", unit: "m/s", lines: [
    { name: "vx", kind: "curve-a" }, { name: "vy", kind: "curve-b" }, { name: "v", kind: "curve-c" },
  ] },
  { id: "energies", unit: "J", lines: [
    "kinetic", "potential", "belt_work", "restitution_loss", "friction_loss",
  ].map((name) => ({ name, kind: `energy-line-${name}` })) },
];

/** Times between the first and the last at which curves are drawn. */
const MANY = 160;

/** Most knots at which curves are drawn exactly; with more they are too dense to see. */
const MOST_KNOTS = 300;

/** Share of the span by which a sample is before a time: an impact has two values. */
const JUST = 1e-9;

/** Place, velocity and energies of a particle at a time; null if it is not under way. */
function sampleAt(recording: Recording, index: number, t: number): Sample | null {
  const track = recording.tracks[index], state = track.state(t);
  if (!state) return null;
  const { x, y, vx, vy } = state;
  const ledger = recording.ledgerOf(index, t) as Ledger;
  const { mass, gravity, ground } = recording.machine, low = mass[index] * gravity * ground;
  return { ...ledger, potential: ledger.potential - low, t, x, y, vx, vy, v: Math.hypot(vx, vy) };
}

/** Samples of a particle over all its time, with the values before and after each of its knots. */
function samplesOf(recording: Recording, index: number): Sample[] {
  const track = recording.tracks[index];
  const { begin, end } = track ?? { begin: NaN, end: NaN };
  if (!(end >= begin)) return [];
  const span = end - begin;
  const times = Array.from({ length: MANY + 1 }, (_, n) => begin + (span * n) / MANY);
  times[MANY] = end;
  for (let i = 0; i < track.count && track.count <= MOST_KNOTS; i += 1) {
    const t = track.at(i, 0);
    times.push(Math.max(begin, t - JUST * span), t);
  }
  return times.sort((a, b) => a - b)
    .map((t) => sampleAt(recording, index, t) as Sample);
}

class CurvesPanel {
  charts;
  legends;
  board;
  which;
  choice;
  table;
  values;
  panel;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.charts = DIAGRAMS.map(({ id }) => new Chart(words, id === "energies" ? 130 : 120));
    this.legends = DIAGRAMS.map(() => html("p", { class: "legend" }));
    this.board = html("div", {
      class: "curves", role: "slider", tabindex: "0", "aria-label": words.say("curves-slider"),
    }, ...DIAGRAMS.flatMap((_, n) => [this.legends[n], this.charts[n].root]));
    this.which = html("input", { type: "number", min: "0", value: "0", id: "particle" });
    this.choice = html("label", { class: "field" }, words.say("particle"), this.which);
    this.table = html("table");
    this.values = html("details", { class: "values" },
      html("summary", {}, words.say("curves-table")), html("div", { class: "wide" }, this.table));
    const panel = card("curves", words.say("curves"), this.choice, this.board,
      html("p", { class: "note" }, words.say("curves-note")), this.values);
    home.append(panel);
    this.panel = panel;
    follow(lab, panel, ["run"], () => this.draw());
    follow(lab, panel, ["time"], () => this.read());
    onWidth(this.board, (width) => {
      for (const chart of this.charts) chart.width = width;
      if (lab.recording) this.draw();
    });
    this.which.addEventListener("change", () => this.draw());
    this.values.addEventListener("toggle", () => this.tabulate());
    this.listen();
  }

  /** Time of the line, s; the present time unless it is moved. */
  cursor: number | null = null;

  samples: Sample[] = [];

  get index() {
    const many = this.lab.recording?.tracks.length ?? 1;
    return Math.min(Math.max(Math.round(Number(this.which.value)) || 0, 0), many - 1);
  }

  listen() {
    const { board, lab, charts } = this;
    const move = (t: number | null) => {
      this.cursor = t;
      this.read();
    };
    board.addEventListener("pointermove", (event: PointerEvent) =>
      move(charts[0].worldX(event.clientX)));
    board.addEventListener("pointerleave", () => move(null));
    board.addEventListener("blur", () => move(null));
    board.addEventListener("click", (event: MouseEvent) => {
      lab.pause();
      lab.seek(charts[0].worldX(event.clientX));
    });
    board.addEventListener("keydown", (event: KeyboardEvent) => {
      const [low, high] = charts[0].x, step = (high - low) / (event.shiftKey ? 1000 : 100);
      const at = this.cursor ?? lab.t;
      const places: Record<string, number> = {
        ArrowRight: at + step, ArrowUp: at + step, ArrowLeft: at - step, ArrowDown: at - step,
        PageUp: at + 10 * step, PageDown: at - 10 * step, Home: low, End: high,
      };
      if (event.key in places) move(Math.min(high, Math.max(low, places[event.key])));
      else if (event.key === "Enter" || event.key === " ") {
        lab.pause();
        lab.seek(at);
      } else if (event.key === "Escape") move(null);
      else return;
      event.preventDefault();
    });
  }

  draw() {
    const recording = this.lab.recording as Recording;
    if (!this.panel.open) return;
    const many = recording.tracks.length;
    this.choice.hidden = many < 2;
    this.which.max = String(many - 1);
    const samples = this.samples = samplesOf(recording, this.index);
    if (!samples.length) return;
    const times = samples.map(({ t }) => t);
    const span = rangeOf(times, 0), track = recording.tracks[this.index], last = track.count - 1;
    // Nothing follows the impact with which a track ends; its values after it are dots.
    const isBlow = last > 0 && track.at(last - 1, 0) === track.at(last, 0);
    const until = isBlow ? times.indexOf(span[1]) : times.length;
    DIAGRAMS.forEach(({ unit, lines }, n) => {
      const chart = this.charts[n];
      const shown = lines.filter(({ name }, i) => unit !== "J" || i < 2
        || samples.some((sample) => Math.abs(sample[name]) > 1e-12));
      const factor = unit === "J" && this.small ? 1000 : 1;
      const curves = shown.map(({ name }) => samples.map((sample) => factor * sample[name]));
      chart.frame(span, rangeOf(curves.flat()), { below: "t / s", beside: factor > 1 ? "mJ" : unit });
      shown.forEach(({ kind }, i) => {
        chart.line(times.slice(0, until), curves[i], kind);
        if (until < times.length) chart.dot(span[1], curves[i][until], kind);
      });
      this.legends[n].replaceChildren(...shown.map(({ name, kind }) => html("span", {},
        html("i", { class: `swatch ${kind}` }), `${this.nameOf(name)} `,
        html("b", { "data-of": name }))));
    });
    this.tabulate();
    this.read();
  }

  /** Whether energies are shown in mJ. */
  get small() {
    return this.samples.every(({ kinetic, potential }) => Math.max(kinetic, potential) < 1);
  }

  nameOf(name: string) {
    return name.length > 2 ? this.words.say(`energy-${name}`) : name;
  }

  /** Move the line, and show the values that it crosses. */
  read() {
    const { lab, words, samples } = this;
    if (!lab.recording || !samples.length || !lab.recording.tracks[this.index]) return;
    const [low, high] = this.charts[0].x;
    const t = Math.min(high, Math.max(low, this.cursor ?? lab.t));
    const sample = sampleAt(lab.recording, this.index, t);
    if (!sample) return;
    const told = [`t = ${words.fixed(t, 3)} s`];
    DIAGRAMS.forEach(({ unit }, n) => {
      this.charts[n].point(t);
      for (const cell of this.legends[n].querySelectorAll("b")) {
        const name = cell.dataset.of;
        const value = unit === "J" ? words.energy(sample[name])
          : `${words.fixed(sample[name], 3)} ${unit}`;
        cell.textContent = value;
        told.push(`${this.nameOf(name)} = ${value}`);
      }
    });
    this.board.setAttribute("aria-valuemin", String(low));
    this.board.setAttribute("aria-valuemax", String(high));
    this.board.setAttribute("aria-valuenow", String(t));
    this.board.setAttribute("aria-valuetext", told.join(", "));
  }

  /** The same as numbers, on request. */
  tabulate() {
    const { words, samples } = this;
    if (!this.values.open) return;
    const columns = ["t", ...DIAGRAMS.slice(0, 2).flatMap((
      { lines },
    ) => lines.map(({ name }) => name))];
    const units = ["s", "m", "m", "m/s", "m/s", "m/s"];
    const head = html("thead", {}, html("tr", {}, ...columns.map((name, n) =>
      html("th", { scope: "col" }, `${name}, ${units[n]}`))));
    const every = Math.ceil(samples.length / 40);
    const rows = samples.filter((_, i) => i % every === 0 || i === samples.length - 1)
      .map((sample) => html("tr", {}, ...columns.map((name) =>
        html("td", {}, words.fixed(sample[name], 3)))));
    this.table.replaceChildren(head, html("tbody", {}, ...rows));
  }
}

export { CurvesPanel, samplesOf };
