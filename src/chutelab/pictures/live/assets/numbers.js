// The numbers of a transfer by the paper's symbols: as simulated, beside the closed form. Of a
// crowd first those of the crowd, and of particle 0 if somebody asks.

import { FEWEST, crowdOf } from "./crowd.js";
import { card, follow, html } from "./panels.js";
import { historyOf } from "./stages.js";
import { predict } from "./prediction.js";

/**
 * @typedef {import("./lab.js").Lab} Lab
 * @typedef {import("./words.js").Words} Words
 * @typedef {import("./recording.js").Recording} Recording
 * @typedef {import("./scene.js").Scene} Scene
 * @typedef {import("./stages.js").Stages} Stages
 * @typedef {{id: string, symbol: string, unit: string, simulated: number, analytic: number}} Row
 */

const SYMBOLS = /** @type {Record<string, [string, string]>} */ ({
  phi1: ["φ₁", "°"], v1: ["v₁", "m/s"], t2: ["t₂", "s"], x2: ["x₂", "m"], v2: ["v₂", "m/s"],
  v2r: ["v₂′", "m/s"], t3: ["t₃", "s"], x3: ["x₃", "m"], v3: ["v₃", "m/s"], d2: ["d₂", "m"],
  d3: ["d₃", "m"], x: ["x", "m"], t: ["t", "s"],
});

/** What is below this is rounding, in any of the units. */
const ROUNDED = 1e-12;

/** Without the last digits: where a value is halfway, both columns are to round it the same way.
 * @param {number} value */
const tidy = (value) => Number(value.toPrecision(11));

/** @param {number[]} values */
function mean(values) {
  let sum = 0, many = 0;
  for (const value of values) {
    if (!isFinite(value)) continue;
    sum += value;
    many += 1;
  }
  return sum / many;
}

/** Each number as the mean over all particles that have it, and as predicted; NaN where there is
 * none.
 * @param {Stages[]} stages @param {Record<string, number>} found those of `predict`
 * @param {number} pulley its radius, m @param {number[]} radius of each particle, m
 * @returns {Row[]} */
function numbersOf(stages, found, pulley, radius) {
  // What leaves a wall or a hopper has not left a pulley.
  if (!isFinite(pulley)) stages = stages.map(({ hit, down }) => ({ hit, down }));
  const speed = (/** @type {number[]} */ v) => Math.hypot(v[0], v[1]);
  const over = (/** @type {(its: Stages, i: number) => number} */ value) => mean(stages.map(value));
  // The paper counts x3 back from the plate, and heights down.
  const simulated = /** @type {Record<string, number>} */ ({
    phi1: over(({ left }) => (left ? (Math.atan2(left.x, left.y) * 180) / Math.PI : NaN)),
    v1: over(({ left }) => (left ? speed(left.after) : NaN)),
    t2: over(({ left, hit }) => (left && hit ? hit.t - left.t : NaN)),
    x2: over(({ left, hit }) => (left && hit ? hit.x - left.x : NaN)),
    v2: over(({ hit }) => (hit ? speed(hit.before) : NaN)),
    v2r: over(({ hit }) => (hit ? speed(hit.after) : NaN)),
    t3: over(({ hit, down }) => (hit && down ? down.t - hit.t : NaN)),
    x3: over(({ hit, down }) => (hit && down ? hit.x - down.x : NaN)),
    v3: over(({ down }) => (down ? speed(down.before) : NaN)),
    d2: over(({ hit, down }) => (hit && down ? hit.y - down.y : NaN)),
    d3: over(({ down }, i) => (down ? pulley + radius[i] - down.y : NaN)),
    x: over(({ down }) => (down ? down.x : NaN)),
    // With a plate between, t2 and t3 say it.
    t: over(({ left, hit, down }) => (left && down && !hit ? down.t - left.t : NaN)),
  });
  const { phi1, x2, x3, y3 } = found;
  const analytic = /** @type {Record<string, number>} */ ({
    ...found,
    phi1: (phi1 * 180) / Math.PI,
    d2: y3,
    x: (pulley + radius[0]) * Math.sin(phi1) + x2 - x3,
  });
  return Object.entries(SYMBOLS).map(([id, [symbol, unit]]) => ({
    id, symbol, unit, simulated: simulated[id], analytic: analytic[id] ?? NaN,
  }));
}

class NumbersPanel {
  /** @param {Element} home @param {Lab} lab @param {Words} words */
  constructor(home, lab, words) {
    this.lab = lab;
    this.words = words;
    this.body = html("tbody");
    this.simulated = html("th", { scope: "col" });
    const head = html("thead", {}, html("tr", {}, html("td"), this.simulated,
      html("th", { scope: "col" }, words.say("analytic"))));
    this.reason = html("p", { class: "note" });
    this.lone = html("div", {}, html("table", {}, head, this.body), this.reason);
    this.crowd = html("tbody");
    this.lead = html("table", { class: "crowd" }, this.crowd);
    this.asked = html("details", { class: "values" }, html("summary", {}, words.say("particle-0")));
    const panel = card("numbers", words.say("numbers"), this.lead, this.asked, this.lone);
    this.asked.before(this.lone);
    home.append(panel);
    follow(lab, panel, ["run"], () => this.refresh());
  }

  refresh() {
    const { words, lab } = this;
    const { machine } = /** @type {Recording} */ (lab.recording), many = machine.releases.length;
    const { numbers, reason } = predict(/** @type {Scene} */ (lab.scene));
    const history = historyOf(lab), crowd = many >= FEWEST, { stages = [] } = history ?? {};
    this.lead.hidden = this.asked.hidden = !crowd;
    if (crowd && history) {
      const { arrivals, landings } = history;
      this.tellCrowd(crowdOf(/** @type {Recording} */ (lab.recording), arrivals, landings.length));
    }
    if (crowd) this.asked.append(this.lone);
    else this.asked.before(this.lone);
    const rows = numbersOf(crowd ? stages.slice(0, 1) : stages, numbers,
      machine.pulley?.radius ?? NaN, machine.radius)
      .filter(({ simulated, analytic }) => isFinite(simulated) || isFinite(analytic));
    this.body.replaceChildren(...rows.map(({ id, symbol, unit, simulated, analytic }) =>
      html("tr", { "data-id": id },
        html("th", { scope: "row" }, html("b", {}, symbol), ` ${words.say(`number-${id}`)}, ${unit}`),
        ...[simulated, analytic].map((value) =>
          html("td", {}, words.number(Math.abs(value) < ROUNDED ? 0 : tidy(value)))))));
    this.simulated.textContent = many > 1 && !crowd ? words.say("simulated-mean", { n: many })
      : words.say("simulated");
    const why = reason ? words.say(`reason-${reason.text}`, Object.fromEntries(Object
      .entries(reason.words).map(([key, value]) => [key, typeof value === "number"
        ? words.number(value) : words.name(value)]))) : "";
    this.reason.textContent = rows.length || !machine.pulley ? why : words.say("numbers-none");
  }

  /** @param {import("./crowd.js").CrowdNumbers} its */
  tellCrowd({ released, arrived, landed, flow, mean, spread, quantiles, work, power, losses }) {
    const { words } = this;
    const all = /** @type {Recording} */ (this.lab.recording).machine.releases.length;
    const metres = (/** @type {number} */ x) => `${words.fixed(x, 3)} m`;
    const rows = /** @type {[string, string, string][]} */ ([
      ["released", words.say("crowd-released"), `${released} / ${all}`],
      ["arrived", words.say("crowd-arrived"), arrived ? String(arrived) : ""],
      ["landed", words.say("crowd-landed"), landed ? String(landed) : ""],
      ["flow", words.say("crowd-flow"), isFinite(flow) ? `${words.number(flow, 3)} t/h` : ""],
      ["place", words.say("crowd-place"), arrived ? `${metres(mean)} ± ${metres(spread)}` : ""],
      ["quantiles", words.say("crowd-quantiles"),
        arrived ? `${quantiles.map((x) => words.fixed(x, 3)).join(" / ")} m` : ""],
      ["power", words.say("crowd-power"),
        work ? `${words.energy(work)}, ${words.number(power, 3)} W` : ""],
      ...losses.map(([name, loss]) => [`loss-${name}`,
        words.say("crowd-loss", { name: words.name(name) }), words.energy(loss)]),
    ]);
    this.crowd.replaceChildren(...rows.filter(([, , told]) => told).map(([id, name, told]) =>
      html("tr", { "data-id": id }, html("th", { scope: "row" }, name), html("td", {}, told))));
  }
}

export { NumbersPanel, SYMBOLS, numbersOf };
