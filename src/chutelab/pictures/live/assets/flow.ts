// Passages through a line drawn by the user, and through the sensors of a scene: number, rate,
// places and speeds.

import { Chart, onWidth, roundUp } from "./chart.ts";
import { QUANTILES, countUntil, quantile } from "./crowd.ts";
import { histogram } from "./landing.ts";
import { card, follow, html } from "./panels.ts";
import { svg } from "./scenery.ts";
import type { Lab } from "./lab.ts";
import { slices } from "./scene.ts";
import type { Recording, Track } from "./recording.ts";
import type { Words } from "./words.ts";

type Point = [number, number];

/** Time at which a centre passes the line, s; place, m from the line's first end; 1 if it comes
 * from the left of the line, seen from its first end, -1 if from the right; and speed, m/s. */
export type Passage = { t: number, at: number, way: number, speed: number, disk: number };

/** Halvings until the time of a passage is known to rounding, as in Python. */
const HALVINGS = 60;

/** Bars of the flow over time, about, and the least time of one, s. */
const BARS = 12, SHORTEST = 0.01;

/** Columns of a knot. */
const X = 1, Y = 2, VX = 3, VY = 4;

/** The passages of a track between two of its knots. Its curve is divided where its distance from
 * the line is largest or smallest, so that the distance is monotone in each part. */
function passagesOf(
  track: Track, disk: number, i: number, [ax, ay]: Point, [bx, by]: Point,
): Passage[] {
  const long = Math.hypot(bx - ax, by - ay), [ux, uy] = [(bx - ax) / long, (by - ay) / long];
  const t = track.at(i, 0), h = track.at(i + 1, 0) - t;
  // No time passes in an impact, which may move a centre by rounding.
  if (!(long > 0)) return [];
  // Distance to the left of the line, and its rate, at the knots and on the curve between them.
  const off = (k: number) => (track.at(k, Y) - ay) * ux - (track.at(k, X) - ax) * uy;
  const rate = (k: number) => h * (track.at(k, VY) * ux - track.at(k, VX) * uy);
  const p = off(i), q = off(i + 1), v = rate(i), w = rate(i + 1);
  const b = 3 * (q - p) - 2 * v - w, c = v + w - 2 * (q - p);
  const height = (s: number) => p + s * (v + s * (b + s * c));
  // Its slope v + 2 b s + 3 c s² is zero there.
  const root = b * b - 3 * c * v, far = -b - Math.sign(b || 1) * Math.sqrt(Math.max(0, root));
  const turns = [far / (3 * c), v / far].filter((s) => root > 0 && s > 0 && s < 1)
    .sort((one, other) => one - other);
  const found: Passage[] = [];
  let from = 0, low = p;
  for (const to of [...turns, 1]) {
    const high = to < 1 ? height(to) : q;
    if ((low < 0) !== (high < 0)) {
      let [a, z] = [from, to];
      for (let n = 0; n < HALVINGS; n += 1) {
        const middle = 0.5 * (a + z);
        if ((height(middle) < 0) === (low < 0)) a = middle;
        else z = middle;
      }
      const [x, y] = [track.placeOn(i, X, VX, h, z), track.placeOn(i, Y, VY, h, z)];
      const [vx, vy] = [track.paceOn(i, X, VX, h, z), track.paceOn(i, Y, VY, h, z)];
      const at = (x - ax) * ux + (y - ay) * uy, way = low < 0 ? -1 : 1;
      const speed = Math.hypot(vx, vy);
      if (at >= 0 && at <= long) found.push({ t: t + h * z, at, way, speed, disk });
    }
    [from, low] = [to, high];
  }
  return found;
}

/** The passages of a run through a line, as it goes on. */
class Passing {
  ends: Point[] = [];
  /** Those found so far, in the order of time. */
  passages: Passage[] = [];
  /** The tracks, with the number of knots read of each. */
  tracks: Track[] = [];
  seen: number[] = [];

  /** The line has moved, m: count again. */
  move(ends: Point[]) {
    this.ends = ends;
    this.tracks = [];
  }

  /** Read what the run has added. */
  count(recording: Recording) {
    const { ends: [from, to] } = this;
    if (this.tracks !== recording.tracks) {
      this.tracks = recording.tracks;
      this.seen = this.tracks.map(() => 0);
      this.passages = [];
    }
    const more: Passage[] = [];
    this.tracks.forEach((track, n) => {
      const sure = track.count - track.tip - 1;
      for (; this.seen[n] < sure; this.seen[n] += 1) {
        more.push(...passagesOf(track, n, this.seen[n], from, to));
      }
    });
    if (more.length) this.passages = [...this.passages, ...more].sort((a, b) => a.t - b.t);
  }

  /** Number of passages up to a time. @param t s */
  until = (t: number) => countUntil(this.passages, t);
}

class Flow extends Passing {
  rate;
  across;
  panel;
  head;
  charts;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    super();
    this.rate = new Chart(words, 132);
    this.across = new Chart(words, 110);
    this.head = html("p", { class: "result" });
    this.charts = html("div", { hidden: "" },
      html("p", { class: "chart-title" }, words.say("flow-rate")), this.rate.root,
      html("p", { class: "chart-title" }, words.say("flow-across")), this.across.root);
    this.panel = card("flow", words.say("flow"), this.head, this.charts);
    this.panel.hidden = true;
    home.prepend(this.panel);
    follow(lab, this.panel, ["run"], () => this.draw());
    follow(lab, this.panel, ["time"], () => this.fill());
    onWidth(this.rate.root, (width) => {
      this.rate.width = this.across.width = width;
      this.draw();
    });
  }

  /** Show it with its ends at two places, m, or not at all. */
  show(ends: Point[]) {
    this.panel.hidden = !ends.length;
    this.move(ends);
  }

  move(ends: Point[]) {
    super.move(ends);
    this.draw();
  }

  /** Width of the bars over time, s. */
  get step() {
    const { begin, end } = this.lab.recording as Recording;
    return Math.max(SHORTEST, roundUp((end - begin) / BARS));
  }

  /** Passages per second at a time: in its bar, as far as the run has come.
   * @param t s */
  perSecond(t: number) {
    const { step } = this, from = Math.max(t - step, this.lab.start);
    return t > from ? (this.until(t) - this.until(from)) / (t - from) : 0;
  }

  draw() {
    const { recording } = this.lab, { rate, across } = this;
    if (!this.ends.length || !recording || !isFinite(recording.begin)) return;
    this.fill();
    const { step, passages } = this;
    this.charts.hidden = !passages.length;
    if (!passages.length) return;
    const first = passages[0].t, last = passages[passages.length - 1].t;
    const mean = last > first ? (passages.length - 1) / (last - first) : 0;
    const from = Math.floor(first / step), bars = Math.floor(last / step) - from + 1;
    const counts: number[] = new Array(bars).fill(0);
    for (const { t } of passages) counts[Math.floor(t / step) - from] += 1 / step;
    rate.frame([from * step, (from + bars) * step], [0, Math.max(1, mean, ...counts) * 1.08],
      { below: "t / s", beside: "1/s" });
    rate.marks.append(svg("path", { class: "bins", d: rate.bars(from * step, step, counts) }));
    if (mean) rate.line([first, last], [mean, mean], "curve-b");
    // From the middle of the line to its ends.
    const [[ax, ay], [bx, by]] = this.ends, half = 0.5 * Math.hypot(bx - ax, by - ay);
    const places = passages.map(({ at }) => 1e3 * (at - half));
    const { from: left, width, counts: many } = histogram(places);
    across.frame([left, left + width * many.length], [0, Math.max(1, ...many) * 1.08],
      { below: "mm", beside: "n", whole: true });
    across.marks.append(
      svg("path", { class: "bins filled", d: across.bars(left, width, many) }));
  }

  /** Passages up to the time shown. */
  fill() {
    if (!this.ends.length || !this.lab.recording) return;
    this.rate.point(this.lab.t);
    const [rate, ...more] = this.says;
    this.head.replaceChildren(html("b", {}, rate), ` ${more.join(", ")}`);
  }

  /** In words: rate, number so far, and number that came back. */
  get says() {
    this.count(this.lab.recording as Recording);
    const { words, lab: { t } } = this, n = this.until(t);
    const back = this.passages.slice(0, n).reduce((sum, { way }) => sum + Number(way > 0), 0);
    const less = Math.min(back, n - back);
    const rate = this.perSecond(t), digits = rate >= 100 ? 3 : 2;
    return [words.say("flow-per-second", { rate: words.number(rate, digits) }),
      words.say("flow-so-far", { n, all: this.tracks.length }),
      ...(less ? [words.say("flow-back", { n: less })] : [])];
  }
}

/** Passages forward and back; 1/s, m/s and its quantiles, kg/s, and t/h of the material's whole
 * width. NaN if unknown */
export type Reading = { count: number, back: number, rate: number, speed: number,
  speeds: number[], flow: number, whole: number };

/** The reading of passages, like Python's `reading`: rates are from the first of them to the last.
 * @param mass of each particle, kg
 * @param slices width of the material in slices; NaN if not given */
function readingOf(passages: Passage[], mass: number[], slices: number): Reading {
  const on = passages.filter(({ way }) => way > 0), count = on.length;
  const span = count > 1 ? on[count - 1].t - on[0].t : 0;
  const brought = on.slice(1).reduce((sum, { disk }) => sum + mass[disk], 0);
  const speeds = on.map(({ speed }) => speed).sort((a, b) => a - b);
  const flow = span ? brought / span : NaN;
  return {
    count, back: passages.length - count, rate: span ? (count - 1) / span : NaN,
    speed: on.reduce((sum, { speed }) => sum + speed, 0) / count,
    speeds: QUANTILES.map((share) => quantile(speeds, share)), flow, whole: 3.6 * flow * slices,
  };
}

class SensorsPanel {
  body = html("tbody");
  panel;
  flowHead;
  /** By name. */
  counts: Map<string, Passing> = new Map();

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    const heads = ["count", "rate", "flow", "speed"].map((id) => html("th", { scope: "col" },
      words.say(`sensor-${id}`)));
    this.flowHead = heads[2];
    this.panel = card("sensors", words.say("sensors"), html("table", { class: "sensors" },
      html("thead", {}, html("tr", {}, html("td"), ...heads)), this.body),
    html("p", { class: "note" }, words.say("sensors-note")));
    home.prepend(this.panel);
    lab.on("scene", () => this.name());
    this.name();
    follow(lab, this.panel, ["run", "time", "scene"], () => this.draw());
  }

  /** Show the present sensors. */
  name() {
    const sensors = this.lab.scene?.sensor ?? [], before = this.counts;
    this.counts = new Map(sensors.map(({ name, from, to }) => {
      const its = before.get(name) ?? new Passing();
      if (String(its.ends) !== String([from, to])) its.move([from, to]);
      return [name, its];
    }));
    this.panel.hidden = !sensors.length;
  }

  /** Readings up to the time shown. */
  get readings(): [string, Reading][] {
    const { recording, scene, t } = this.lab, [stream] = scene?.streams ?? [];
    const wide = scene && stream?.width !== undefined
      ? slices(stream, scene.particles[scene.kinds[0]]) : NaN;
    const { machine: { mass } } = recording as Recording;
    return [...this.counts].map(([name, its]) => {
      its.count(recording as Recording);
      return [name, readingOf(its.passages.slice(0, its.until(t)), mass, wide)];
    });
  }

  draw() {
    const { words } = this;
    const { readings } = this;
    // Without a width it belongs to the slice, like a crowd's numbers.
    const isWhole = readings.some(([, { whole }]) => isFinite(whole));
    this.flowHead.textContent = words.say(isWhole ? "sensor-whole" : "sensor-flow");
    this.body.replaceChildren(...readings.map(([name, one]) => {
      const { count, back, rate, speeds, flow, whole } = one;
      const many = back ? words.say("sensor-back", { count, back }) : String(count);
      return html("tr", { "data-id": name }, html("th", { scope: "row" }, words.name(name)),
        html("td", {}, many), html("td", {}, words.number(rate, 3)),
        html("td", {}, words.number(isWhole ? whole : 3.6 * flow, 3)),
        html("td", {}, speeds.map((one) => words.number(one, 2)).join(" / ")));
    }));
  }
}

export { Flow, SensorsPanel, readingOf };
