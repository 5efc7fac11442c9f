// The numbers of a transfer by the paper's symbols: simulated values beside the closed form. For a
// crowd first the crowd's numbers, and those of particle 0 on request.

import { FEWEST, crowdOf, type CrowdNumbers } from "./crowd.ts";
import { card, follow, html } from "./panels.ts";
import { historyOf, type Stages } from "./stages.ts";
import { predict } from "./prediction.ts";
import { symbolsOf } from "./quantities.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Scene } from "./scene.ts";
import type { Words } from "./words.ts";

/** By the name of the quantity; its symbol and unit are in the page's data. */
type Row = { id: string, simulated: number, analytic: number };

/** Values shown, if they happened. */
const SHOWN = ["phi1_deg", "v1", "t2", "x2", "v2", "v2r", "t3", "x3", "v3", "y3", "d3", "landing.x",
  "flight.t"];

/** Smaller values are rounding, in any unit. */
const ROUNDED = 1e-12;

/** Without the last digits, so that both columns round an exact half the same way. */
const tidy = (value: number) => Number(value.toPrecision(11));

function mean(values: number[]) {
  let sum = 0, many = 0;
  for (const value of values) {
    if (!isFinite(value)) continue;
    sum += value;
    many += 1;
  }
  return sum / many;
}

/** Each number as the mean over all particles that have it, and its prediction; NaN without one.
 * @param found those of `predict`
 * @param pulley its radius, m
 * @param radius of each particle, m */
function numbersOf(
  stages: Stages[], found: Record<string, number>, pulley: number, radius: number[],
): Row[] {
  // A particle that leaves a wall or a hopper has not left a pulley.
  if (!isFinite(pulley)) stages = stages.map(({ hit, down }) => ({ hit, down }));
  const none = { mass: NaN, angle: NaN, beltSpeed: NaN, rate: NaN };
  const each = stages.map((its, i) => ({
    ...symbolsOf(its, { ...none, pulley, radius: radius[i] }),
    "landing.x": its.down?.x ?? NaN,
    // With a plate, t2 and t3 have it.
    "flight.t": its.left && its.down && !its.hit ? its.down.t - its.left.t : NaN,
  }) as Record<string, number>);
  const { phi1, x2, x3 } = found;
  const analytic: Record<string, number> = {
    ...found,
    phi1_deg: (phi1 * 180) / Math.PI,
    "landing.x": (pulley + radius[0]) * Math.sin(phi1) + x2 - x3,
  };
  return SHOWN.map((id) => ({
    id, simulated: mean(each.map((its) => its[id])), analytic: analytic[id] ?? NaN,
  }));
}

class NumbersPanel {
  body;
  simulated;
  analytic;
  reason;
  lone;
  crowd;
  lead;
  asked;
  panel;
  none = false;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.body = html("tbody");
    this.simulated = html("th", { scope: "col", class: "of-run" });
    this.analytic = html("th", { scope: "col", class: "of-rail" }, words.say("analytic"));
    const head = html("thead", {}, html("tr", {}, html("td"), this.simulated, this.analytic));
    this.reason = html("p", { class: "note" });
    this.lone = html("div", {}, html("table", {}, head, this.body), this.reason);
    this.crowd = html("tbody");
    const when = html("caption", { class: "note" }, words.say("numbers-when"));
    this.lead = html("table", { class: "crowd" }, when, this.crowd);
    this.asked = html("details", { class: "values" }, html("summary", {}, words.say("particle-0")));
    this.panel = card("numbers", words.say("numbers"), this.lead, this.asked, this.lone);
    this.asked.before(this.lone);
    home.append(this.panel);
    // A machine that carries nothing anywhere has none of these numbers.
    lab.on("run", () => {
      if (!lab.machine || !lab.scene) return;
      const { pulley, landing, releases } = lab.machine;
      this.none = !pulley && landing < 0 && !lab.scene.plates.length;
      this.panel.hidden = this.none && releases.length < FEWEST;
    });
    follow(lab, this.panel, ["run"], () => this.refresh());
  }

  refresh() {
    const { words, lab } = this;
    const { machine } = lab.recording as Recording, many = machine.releases.length;
    const { numbers, reason } = predict(lab.scene as Scene, lab.recording as Recording);
    const history = historyOf(lab), crowd = many >= FEWEST, { stages = [] } = history ?? {};
    this.lead.hidden = this.asked.hidden = !crowd;
    if (crowd && history) {
      const { arrivals, landings } = history;
      this.tellCrowd(crowdOf(lab.recording as Recording, arrivals, landings.length));
    }
    if (crowd) this.asked.append(this.lone);
    else this.asked.before(this.lone);
    const rows = numbersOf(crowd ? stages.slice(0, 1) : stages, numbers,
      machine.pulley?.radius ?? NaN, machine.radius)
      .filter(({ simulated, analytic }) => isFinite(simulated) || isFinite(analytic));
    // Without theory there is no column of it.
    this.analytic.hidden = !rows.some(({ analytic }) => isFinite(analytic));
    this.body.replaceChildren(...rows.map(({ id, simulated, analytic }) => {
      const { symbol, unit } = lab.data.quantities[id];
      return html("tr", { "data-id": id },
        html("th", { scope: "row" }, html("b", {}, symbol),
          ` ${words.say(`number-${id}`)},\u00a0${words.unit(unit)}`),
        ...(this.analytic.hidden ? [simulated] : [simulated, analytic]).map((value) =>
          html("td", {}, words.number(Math.abs(value) < ROUNDED ? 0 : tidy(value)))));
    }));
    this.asked.hidden ||= this.none;
    this.simulated.textContent = many > 1 && !crowd ? words.say("simulated-mean", { n: many })
      : words.say("simulated");
    const why = reason ? words.say(`reason-${reason.text}`, Object.fromEntries(Object
      .entries(reason.words).map(([key, value]) => [key, typeof value === "number"
        ? words.number(value) : words.name(value)]))) : "";
    this.reason.textContent = rows.length || !machine.pulley ? why : words.say("numbers-none");
  }

  tellCrowd(
    { released, arrived, landed, flow, mean, spread, quantiles, work, power, losses }: CrowdNumbers,
  ) {
    const { words } = this;
    const all = (this.lab.recording as Recording).machine.releases.length;
    const metres = (x: number) => `${words.fixed(x, 3)} m`;
    const rows: [string, string, string][] = [
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
        words.say("crowd-loss", { name: words.name(name) }), words.energy(loss)] as [string, string, string]),
    ];
    this.crowd.replaceChildren(...rows.filter(([, , told]) => told).map(([id, name, told]) =>
      html("tr", { "data-id": id }, html("th", { scope: "row" }, name),
        // No line begins with a unit.
        html("td", {}, told.replace(/(\d) (?=\p{L})/gu, "$1\u00a0")))));
  }
}

export { NumbersPanel, numbersOf };
