// Loads on surfaces: the mean force on each in bins of time, as arrows in the picture and as a
// table; like Python's `results/loads.py`.

import { drawArrows } from "./arrows.ts";
import { LOAD_ROW } from "./core.ts";
import { card, follow, html } from "./panels.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** Default width of a bin, s; and length of the largest force, px. */
const EVERY = 0.02, LARGEST = 80;

/** N, and place in m; means are over the bins from the first to the last with a load. */
export type Load = { name: string, now: number, mean: number, peak: number, force: number[],
  place: number[] };

/** The loads of each loaded surface; `now` is in the bin of a time, s. */
function loadsOf({ machine, loads, shift }: Recording, t: number): Load[] {
  const { surfaces, loads: every } = machine, wide = surfaces.length * LOAD_ROW;
  const bins = wide ? loads.length / wide : 0, bin = Math.floor((t - shift) / every + 1e-9);
  return surfaces.flatMap((name, n) => {
    const at = (k: number, column: number) => loads[k * wide + n * LOAD_ROW + column];
    let first = -1, last = -1, sum = 0, peak = 0;
    for (let k = 0; k < bins; k += 1) {
      if (!at(k, 2) && !at(k, 3)) continue;
      if (first < 0) first = k;
      last = k;
      sum += at(k, 0) / every;
      peak = Math.max(peak, Math.abs(at(k, 0)) / every);
    }
    if (first < 0) return [];
    const is = bin >= 0 && bin < bins && at(bin, 0) > 0;
    return [{
      name, mean: sum / (last - first + 1), peak, now: is ? at(bin, 0) / every : 0,
      force: is ? [at(bin, 2) / every, at(bin, 3) / every] : [0, 0],
      place: is ? [at(bin, 5) / at(bin, 0), at(bin, 6) / at(bin, 0)] : [NaN, NaN],
    }];
  });
}

class LoadsPanel {
  body = html("tbody");
  panel;

  constructor(home: Element, readonly lab: Lab, readonly stage: Stage, readonly words: Words) {
    const heads = ["now", "mean", "peak"].map((id) => html("th", { scope: "col" },
      words.say(`load-${id}`)));
    this.panel = card("loads", words.say("loads"), html("table", { class: "sensors" },
      html("thead", {}, html("tr", {}, html("td"), ...heads)), this.body),
    html("p", { class: "note" }, words.say("loads-note")));
    home.prepend(this.panel);
    const look = () => { this.panel.hidden = !lab.machine?.loads; };
    lab.on("scene", look);
    lab.on("run", look);
    look();
    follow(lab, this.panel, ["run", "time"], () => this.draw());
    stage.painters.push((context) => this.paint(context));
  }

  /** Record loads, or no longer; the run starts again. */
  show(on: boolean) {
    const { lab } = this, { machine, scene } = lab;
    lab.loads = on ? scene?.run.loads ?? EVERY : 0;
    if (!machine) return;
    machine.loads = lab.loads;
    lab.run(0);
  }

  get loads() {
    const { recording, t } = this.lab;
    return recording?.machine.loads ? loadsOf(recording, t) : [];
  }

  draw() {
    const { words } = this;
    this.body.replaceChildren(...this.loads.map(({ name, now, mean, peak }) =>
      html("tr", { "data-id": name }, html("th", { scope: "row" }, words.name(name)),
        ...[now, mean, peak].map((value) => html("td", {}, words.number(value, 3))))));
  }

  paint(context: CanvasRenderingContext2D) {
    const { loads, stage: { view, blind } } = this;
    const most = loads.reduce((found, { peak }) => Math.max(found, peak), 0);
    if (!most || blind) return;
    drawArrows(context, loads.filter(({ now }) => now).map(({ place: [x, y], force: [u, v] }) => {
      const [px, py, k] = [view.px(x), view.py(y), LARGEST / most];
      // It ends where it presses.
      return [px - k * u, py + k * v, px, py];
    }), this.stage.colour("strike"));
  }
}

export { LoadsPanel, loadsOf };
