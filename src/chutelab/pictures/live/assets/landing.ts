// Arrivals of a stream on the outgoing belt: a histogram, and the mean of the first n with its
// error.

import { Chart, onWidth, rangeOf, roundUp } from "./chart.ts";
import { countUntil } from "./crowd.ts";
import { card, follow, html } from "./panels.ts";
import { svg } from "./scenery.ts";
import { historyOf } from "./stages.ts";
import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

type Histogram = { from: number, width: number, counts: number[] };

/** Points of a running mean that are drawn at most. */
const MOST_POINTS = 300;

/** Counts of values in bins of a round width, about √n bins.
 * @param of values for which the bins are chosen */
function histogram(values: number[], of: number[] = values): Histogram {
  const [low, high] = rangeOf(of, 0);
  // All may land at one place.
  const span = Math.max(high - low, 1e-4 * Math.max(Math.abs(low), Math.abs(high), 1e-6));
  const width = roundUp(span / Math.max(4, Math.min(40, Math.sqrt(of.length))));
  const first = Math.floor(low / width), last = Math.floor(high / width);
  const counts = new Array(last - first + 1).fill(0);
  for (const value of values) counts[Math.floor(value / width) - first] += 1;
  return { from: first * width, width, counts };
}

/** The mean of the first n values and its standard error s/√n, for n = 1, 2, ...
 * (Welford's recurrence); the error of a single value is not known. */
function runningMean(values: number[]): { mean: number, error: number }[] {
  let mean = 0, squares = 0;
  return values.map((value, i) => {
    const n = i + 1, off = value - mean;
    mean += off / n;
    squares += off * (value - mean);
    return { mean, error: n > 1 ? Math.sqrt(squares / (n - 1) / n) : NaN };
  });
}

class LandingPanel {
  bars;
  means;
  charts;
  result;
  panel;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.bars = new Chart(words, 150);
    this.means = new Chart(words, 130);
    this.result = html("p", { class: "result" });
    this.charts = html("div", {},
      html("p", { class: "chart-title" }, words.say("landing-histogram")), this.bars.root,
      html("p", { class: "chart-title" }, words.say("landing-mean")), this.means.root);
    this.charts.hidden = true;
    this.panel = card("landing", words.say("landing"), this.charts, this.result,
      html("p", { class: "note" }, words.say("landing-note")));
    this.panel.hidden = true;
    home.append(this.panel);
    const look = () => {
      this.panel.hidden = (lab.machine?.releases.length ?? 0) < 2 || !lab.scene?.outgoing;
    };
    lab.on("scene", look);
    look();
    follow(lab, this.panel, ["run"], () => this.draw());
    follow(lab, this.panel, ["time"], () => this.fill());
    onWidth(this.bars.root, (width) => {
      this.bars.width = this.means.width = width;
      this.draw();
    });
  }

  /** In the order of time. */
  arrivals: { t: number, x: number }[] = [];

  draw() {
    const { words } = this;
    if (this.panel.hidden || !this.panel.open) return;
    this.arrivals = historyOf(this.lab)?.arrivals.list ?? [];
    const places = this.arrivals.map(({ x }) => x);
    this.charts.hidden = !places.length;
    const all = histogram(places);
    const { from, width, counts } = all;
    this.all = all;
    this.bars.frame([from, from + width * Math.max(1, counts.length)],
      [0, Math.max(1, ...counts) * 1.08], { below: "x / m", beside: "n", whole: true });
    this.filled = svg("path", { class: "bins filled" });
    this.bars.marks.append(
      svg("path", { class: "bins", d: this.bars.bars(from, width, counts) }), this.filled);
    this.running = runningMean(places);
    const { running } = this;
    const some = running.map((_, i) => i)
      .filter((i) => i % Math.ceil(running.length / MOST_POINTS) === 0 || i === running.length - 1);
    const sides = [1, -1].map((sign) => some.filter((i) => isFinite(running[i].error))
      .map((i) => [i + 1, running[i].mean + sign * running[i].error]));
    // The first few are far off, and must not make all the others look flat.
    const few = Math.min(5, 0.5 * running.length);
    const seen = sides.flat().filter(([n]) => n > few).map(([, x]) => x);
    this.means.frame([0, Math.max(2, running.length)], rangeOf(seen), { below: "n", beside: "x / m" });
    const { means } = this;
    const path = [...sides[0], ...sides[1].reverse()]
      .map(([n, x]) => `${means.px(n).toFixed(1)} ${means.py(x).toFixed(1)}`);
    if (path.length) means.marks.append(svg("path", { class: "band", d: `M${path.join("L")}Z` }));
    means.line(some.map((i) => i + 1), some.map((i) => running[i].mean), "curve-a");
    this.result.textContent = places.length ? "" : words.say("landing-none");
    this.fill();
  }

  /** Arrivals up to the present time. */
  fill() {
    const { arrivals, words, all } = this;
    if (this.panel.hidden || !all || !arrivals.length) return;
    const counts = all.counts.map(() => 0), n = countUntil(arrivals, this.lab.t);
    for (const { x } of arrivals.slice(0, n)) {
      counts[Math.floor(x / all.width) - Math.round(all.from / all.width)] += 1;
    }
    this.filled.setAttribute("d", this.bars.bars(all.from, all.width, counts));
    this.means.point(n || NaN);
    // Before the first arrival show the whole run.
    const which = n || arrivals.length, { mean, error } = this.running[which - 1];
    // Both with the same number of decimals; less than a nanometre is rounding.
    const places = error > 1e-9 ? Math.max(3, 1 - Math.floor(Math.log10(error))) : 3;
    this.result.textContent = words.say(isFinite(error) ? "landing-result" : "landing-first", {
      n: which, mean: words.fixed(mean, places), error: words.fixed(error, places),
    });
  }

  all: Histogram | undefined;

  running: { mean: number, error: number }[] = [];

  filled: any;
}

export { LandingPanel, histogram, runningMean };
