// The runs of a step: a table filled by a button, rows that set the machine, and the paths of the
// runs, grey and numbered.

import { toCsv, download, fileStem } from "./share.ts";
import { historyOf } from "./stages.ts";
import { html, grown, icon } from "./panels.ts";
import { measure } from "./quantities.ts";
import { Recording } from "./recording.ts";
import { resolve, type Given, type Scene } from "./scene.ts";
import { build } from "./machine.ts";
import { svg } from "./scenery.ts";
import { valueOfTree, known, type Tree } from "./formula.ts";
import { valueAt, withValues } from "./keys.ts";
import type { Engine } from "./engine.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

type Row = { head: string, set: Record<string, unknown> };
/** A formula of quantities, null if filled in by hand; `given` values are printed. */
type Column = { head: string, value: Tree | null, unit: string, given: (string | number)[] };
export type Wanted = { columns: Column[], rows: Row[], free: number, set: Record<string, unknown> };
/** A run of a row: changed keys, its values, and cells filled in by hand */
export type Noted = { set?: Record<string, unknown>, values?: (number | null)[],
  own?: Record<number, string>, head?: string };

/** Least distance of the numbers of paths, px. */
const ROOM = 30;

/** The values of a scene, independent of their form. */
const plain = (scene: Scene) =>
  JSON.stringify(scene, (key, value) => (["given", "title", "live"].includes(key)
    ? undefined : value === Infinity ? "inf" : value));

/** A table as rows of cells: numbers, and markup of heads, of empty cells and of those filled in by
 * hand. */
function tableOf({ columns, rows, free }: Wanted, noted: Noted[], words: Words) {
  const written = (text: string) => html("i", {}, text).innerHTML;
  return [
    [words.say("my-runs"), ...columns.map(({ head, unit }) => (unit ? `${head}, ${words.unit(unit)}` : head))],
    ...Array.from({ length: rows.length + free }, (_, n) => {
      const { values, own, head } = noted[n] ?? {};
      return [rows[n]?.head ?? written(head ?? words.say("own-run")), ...columns.map(({ given }, k) =>
        given[n] ?? values?.[k] ?? written(own?.[k] ?? ""))];
    }),
  ];
}

class Runs {
  root;
  button;
  wait;
  body;
  marks;
  numbers;
  /** Paths by row, m. */
  paths: Map<number, { x: number, y: number }[]> = new Map();
  /** Whether the button was pressed too early. */
  asked = false;
  /** The row that was noted last. */
  latest = -1;

  /** @param noted by row, kept with the answers
   * @param changed called when something was noted
   * @param label of the student's own runs */
  constructor(
    readonly lab: Lab, readonly stage: Stage, readonly words: Words, readonly wanted: Wanted,
    readonly noted: Noted[], readonly changed: () => void, readonly newEngine: () => Engine,
    readonly label: () => string,
  ) {
    const click = () => {
      this.asked = Boolean(this.reason);
      this.note();
    };
    this.button = html("button", { class: "main", id: "note", "aria-describedby": "note-wait", click },
      icon("note"), html("span", { class: "long" }, words.say("note-run")),
      html("span", { class: "short" }, words.say("step-note")));
    this.wait = html("p", { class: "note", id: "note-wait", role: "status" });
    this.body = html("tbody");
    const head = wanted.columns.map(({ head: name, unit }) =>
      html("th", { scope: "col" }, ...grown(name), unit ? `, ${words.unit(unit)}` : ""));
    const csv = html("button", { class: "quiet", click: () => this.save() }, words.say("csv"));
    this.root = html("div", { class: "runs-of" }, html("div", { class: "wide", tabindex: "0",
      role: "region", "aria-label": words.say("my-runs") },
    html("table", { class: "runs" }, html("caption", { class: "hidden" }, words.say("my-runs")),
      html("thead", {}, html("tr", {}, html("th", { scope: "col" }, words.say("my-runs")), ...head)),
      this.body)), ...(wanted.rows.length && !this.isByHand ? [html("p", { class: "note" }, words.say("row-sets"))] : []),
    csv);
    this.marks = svg("g", { class: "noted-all", "aria-hidden": "true" });
    this.numbers = svg("g", { class: "noted-all", "aria-hidden": "true" });
    stage.paths.before(this.marks);
    stage.over.append(this.numbers);
    this.draw();
    this.refresh();
    this.again();
  }

  remove() {
    this.marks.remove();
    this.numbers.remove();
  }

  /** Whether no cell is filled by a run. */
  get isByHand() {
    return this.wanted.columns.every(({ value }) => value === null);
  }

  /** Whether every required run is noted, or at least one in a table of free rows. */
  get isDone() {
    const { rows } = this.wanted;
    if (this.isByHand) return this.noted.some((one) => Object.values(one?.own ?? {}).some(Boolean));
    return rows.length ? rows.every((_, n) => this.noted[n]?.values)
      : this.noted.some((one) => one?.values);
  }

  given({ set }: { set?: Record<string, unknown> }): Given {
    const { lab, wanted } = this;
    return withValues(lab.first, { ...wanted.set, ...set });
  }

  /** The row of the present machine, -1 if there is none. */
  get row() {
    const { lab, wanted: { rows, free }, noted } = this;
    if (!lab.scene) return -1;
    const now = plain(lab.scene);
    const same = (one?: { set?: Record<string, unknown> }) => one?.set !== undefined
      && plain(resolve(this.given(one), lab.data)) === now;
    const found = rows.findIndex(same);
    if (found >= 0) return found;
    for (let n = rows.length; n < rows.length + free; n += 1) {
      if (!noted[n]?.values || same(noted[n])) return n;
    }
    return -1;
  }

  /** Why nothing can be noted yet, as a word of the catalogue; "" if it can. */
  get reason() {
    const { lab } = this;
    if (!lab.isOver || lab.t <= lab.start || lab.recording?.state !== "done") return "note-wait";
    return this.row < 0 ? "note-no-row" : "";
  }

  /** Put the run's values into its row. */
  note() {
    const { lab, wanted, noted, row } = this, history = historyOf(lab);
    if (this.reason || !lab.recording || !lab.scene || !history) {
      this.changed();
      return;
    }
    const run = { recording: lab.recording, history, scene: lab.scene };
    const values = wanted.columns.map(({ value }) => {
      if (value === null) return null;
      const found = valueOfTree(value, (name) => known(name) ?? measure(name, run));
      return isFinite(found) ? Number(found.toPrecision(7)) : null;
    });
    const set = wanted.rows[row]?.set ?? this.changes;
    const own = wanted.rows[row] ? {} : { head: this.label() };
    noted[row] = { ...noted[row], set, values, ...own };
    this.latest = row;
    this.keepPath(row, lab.recording);
    this.draw();
    this.refresh();
    this.changed();
  }

  /** What differs from the step's machine, by key. */
  get changes() {
    const { lab } = this, base = this.given({});
    const found: Record<string, unknown> = {};
    for (const key of lab.data.live?.controls ?? []) {
      const [now, was] = [lab.given as Given, base].map((one) => valueAt(one, key));
      if (JSON.stringify(now) !== JSON.stringify(was)) found[key] = now;
    }
    return found;
  }

  keepPath(row: number, recording: Recording) {
    if (recording.machine.interact || recording.tracks.length > 1) return;
    this.paths.set(row, recording.points(0, 2e-4));
    this.drawPaths();
  }

  /** Repeat a run noted at an earlier visit, for its path. */
  async again() {
    const { lab, noted } = this, left = [...noted.keys()].filter((n) => noted[n]?.values);
    if (!left.length) return;
    const engine = this.newEngine();
    for (const n of left) {
      const machine = build(resolve(this.given(noted[n]), lab.data));
      if (machine.interact || machine.releases.length > 1) continue;
      const recording = new Recording(machine);
      await new Promise<void>((done) => {
        engine.run(machine, Infinity, (chunk) => {
          recording.add(chunk);
          if (recording.state !== "running") done();
        });
      });
      this.keepPath(n, recording);
    }
    engine.worker.terminate();
  }

  /** Set the machine for a row. */
  set(row: Row) {
    this.lab.replace(this.given(row));
    this.lab.restart();
  }

  /** Show the present rows. */
  draw() {
    const { wanted: { columns, rows, free }, noted, words } = this;
    const made = Array.from({ length: rows.length + free }, (_, n) => {
      const row = rows[n], one = noted[n];
      const badge = html("span", { class: "badge", "aria-hidden": "true" }, String(n + 1));
      const named = row ? grown(row.head) : [one?.head ?? words.say("own-run")];
      const head = row && !this.isByHand ? html("button", { class: "set",
        click: () => this.set(row) }, badge, html("span", {}, ...named))
        : html("span", {}, badge, ...named);
      const cells = columns.map(({ value, given, unit, head: name }, k) => {
        if (given[n] !== undefined && given[n] !== "") {
          const said = given[n];
          return html("td", { class: "given" }, typeof said === "number"
            ? words.plain(said) : words.local(said));
        }
        if (value === null) {
          const input = html("input", { type: "text", maxlength: "40",
            "aria-label": [head.textContent, ...grown(name).map((one) => one.textContent)].join(" ") });
          input.value = one?.own?.[k] ?? "";
          input.addEventListener("input", () => {
            noted[n] = { ...noted[n], own: { ...noted[n]?.own, [k]: input.value } };
            this.changed();
          });
          return html("td", {}, input);
        }
        const found = one?.values?.[k] ?? NaN, isCount = !unit && Number.isInteger(found);
        return html("td", one?.values ? {} : { class: "empty" }, !one?.values ? words.say("to-do")
          : isCount ? words.plain(found) : words.number(found));
      });
      return html("tr", n === this.latest ? { class: "new" } : {},
        html("th", { scope: "row" }, head), ...cells);
    });
    this.body.replaceChildren(...made);
  }

  /** Show whether the run can be noted, and the row of the present machine. */
  refresh() {
    const { words, reason, row } = this;
    this.button.setAttribute("aria-disabled", String(reason !== ""));
    const said = reason ? words.say(reason) : "";
    if (this.wait.textContent !== said) this.wait.textContent = said;
    [...this.body.rows].forEach((one: Element, n: number) =>
      one.classList.toggle("now", n === row && n < this.wanted.rows.length));
  }

  /** Paths below that of the run, and their numbers on top, away from other paths. */
  drawPaths() {
    const { view, home } = this.stage, taken: [number, number][] = [];
    const labels: DOMRect[] = [...home.querySelectorAll(".symbols text")]
      .map((one: any) => one.getBBox());
    this.marks.replaceChildren();
    this.numbers.replaceChildren();
    if (this.stage.blind) return;
    const lines = new Map([...this.paths].sort(([a], [b]) => a - b).map(([n, points]) =>
      [n, points.map(({ x, y }) => [view.px(x), view.py(y)] as [number, number])]));
    for (const [n, line] of lines) {
      this.marks.append(svg("polyline", { class: "noted",
        points: line.map(([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`).join(" ") }));
      const others = [...lines].flatMap(([m, its]) => (m === n ? [] : its));
      const far = ([x, y]: [number, number]) => Math.min(ROOM,
        ...others.map(([u, v]) => Math.hypot(u - x, v - y)),
        ...taken.map(([u, v]) => Math.hypot(u - x, v - y) - 0.5 * ROOM),
        ...labels.map((box) => Math.hypot(x - Math.min(Math.max(x, box.x), box.x + box.width),
          y - Math.min(Math.max(y, box.y), box.y + box.height)) - 0.5 * ROOM));
      const seen = line.filter(([x, y]) => x > 14 && x < view.width - 14 && y > 14
        && y < view.height - 14).slice(0, -Math.ceil(0.08 * line.length));
      const at = seen.reduce((best, one) => (far(one) >= far(best) ? one : best), seen[0]);
      if (!at) continue;
      taken.push(at);
      this.numbers.append(svg("circle", { cx: at[0], cy: at[1], r: 10 }),
        svg("text", { x: at[0], y: at[1] + 5, "text-anchor": "middle" }, String(n + 1)));
    }
  }

  save() {
    const { words, wanted, noted, lab } = this;
    const csv = toCsv(tableOf(wanted, noted, words).map((row) => row.map((cell) =>
      (typeof cell === "number" ? cell
        : grown(cell).map((node) => node.textContent).join("").trim()))), words.comma);
    download(`${fileStem(lab.data.lesson.title)}.csv`, `\ufeff${csv}`, "text/csv");
  }
}

export { Runs, tableOf };
