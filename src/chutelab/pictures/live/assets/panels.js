// Beside the picture: the energy ledger as bars that close, and the numbers of one transfer.

import { RADIANS, arcCos } from "./trig.js";
import { predict } from "./prediction.js";

/**
 * @typedef {import("./lab.js").Lab} Lab
 * @typedef {import("./words.js").Words} Words
 * @typedef {import("./recording.js").Recording} Recording
 * @typedef {import("./recording.js").Ledger} Ledger
 */

/** @param {string} name @param {Record<string, string>} [attributes]
 * @param {(string | Node)[]} children @returns {any} */
function html(name, attributes = {}, ...children) {
  const element = document.createElement(name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** A panel with a title, which can be folded.
 * @param {string} id @param {string} title @param {(string | Node)[]} children */
function card(id, title, ...children) {
  const body = html("div", { class: "body" }, ...children);
  return html("details", { class: "card", id, open: "" }, html("summary", {}, title), body);
}

const SIGNS = /** @type {[keyof Ledger, number][]} */ ([
  ["start", 1], ["belt_work", 1], ["kinetic", -1], ["potential", -1], ["restitution_loss", -1],
  ["friction_loss", -1], ["residual", 1],
]);

/** What was put in, and where it is: an entry of the other sign changes sides.
 * @param {Ledger} ledger */
function stacks(ledger) {
  const entries = SIGNS.map(([name, sign]) => /** @type {[string, number]} */ ([name, sign * ledger[name]]));
  return {
    putIn: entries.map(([name, value]) => /** @type {[string, number]} */ ([name, Math.max(value, 0)])),
    isNow: entries.map(([name, value]) => /** @type {[string, number]} */ ([name, Math.max(-value, 0)])),
  };
}

class EnergyPanel {
  /** @param {Element} home @param {Lab} lab @param {Words} words */
  constructor(home, lab, words) {
    this.lab = lab;
    this.words = words;
    this.bars = ["put-in", "is-now"].map(() => html("div", { class: "bar" }));
    this.cells = new Map(SIGNS.map(([name]) => [name, html("td")]));
    const rows = SIGNS.map(([name]) => html("tr", {},
      html("th", { scope: "row" }, html("i", { class: `energy-${name}` }), words.say(`energy-${name}`)),
      this.cells.get(name)));
    const bars = html("div", { class: "bars", "aria-hidden": "true" },
      html("span", {}, words.say("put-in")), this.bars[0],
      html("span", {}, words.say("is-now")), this.bars[1]);
    home.append(card("energy", words.say("energy"), bars, html("table", {}, html("tbody", {}, ...rows)),
      html("p", { class: "note" }, words.say("energy-note"))));
    lab.on("time", () => this.refresh());
    lab.on("run", () => this.refresh());
  }

  refresh() {
    const { recording, t } = this.lab;
    if (!recording) return;
    const ledger = recording.ledger(Math.min(t, recording.end));
    // Heights count from the lowest point of the run, so that nothing is negative.
    const low = recording.lowest;
    ledger.start -= low;
    ledger.potential -= low;
    const { putIn, isNow } = stacks(ledger);
    const size = putIn.reduce((sum, [, value]) => sum + value, 0);
    const largest = Math.max(size, this.largest ?? 0);
    if (t <= recording.begin || size > (this.largest ?? 0)) this.largest = size;
    [putIn, isNow].forEach((parts, n) => {
      this.bars[n].replaceChildren(...parts.filter(([, value]) => value > 0).map(([name, value]) => {
        const part = html("i", { class: `energy-${name}` });
        part.style.width = `${(100 * value) / (largest || 1)}%`;
        return part;
      }));
    });
    for (const [name] of SIGNS) {
      this.cells.get(name).textContent = this.words.energy(ledger[name]);
    }
  }

  /** @type {number | undefined} */
  largest;
}

const RELEASE_KINDS = { separation: 1, impact: 3, landing: 4 };

/**
 * @typedef {{id: string, symbol: string, unit: string, simulated: number, analytic: number}} Row
 */

/** The numbers of the first particle's transfer, as the picture and the paper name them.
 * @param {Recording} recording @param {any} found of `predict` @returns {Row[]} */
function numbersOf(recording, found) {
  const { machine } = recording;
  const its = recording.events.filter(({ disk }) => disk === 0);
  const plate = machine.surfaces.indexOf("plate");
  const left = its.find(({ kind }) => kind === RELEASE_KINDS.separation);
  const hit = its.find(({ kind, surface }) => kind === RELEASE_KINDS.impact && surface === plate);
  const down = its.find(({ kind }) => kind === RELEASE_KINDS.landing);
  const speed = (/** @type {number[] | undefined} */ v) => (v ? Math.hypot(v[0], v[1]) : NaN);
  const far = left ? Math.hypot(left.x, left.y) : NaN;
  const degrees = (/** @type {number} */ radians) => radians / RADIANS;
  const row = (
    /** @type {string} */ id, /** @type {string} */ symbol, /** @type {string} */ unit,
    /** @type {number} */ simulated, /** @type {number} */ analytic = NaN,
  ) => ({ id, symbol, unit, simulated, analytic });
  const impactX = found.phi1 === undefined ? NaN : found.impactX;
  return [
    row("phi1", "φ₁", "°", left ? degrees(arcCos(Math.min(1, left.y / far))) : NaN, degrees(found.phi1)),
    row("v1", "v₁", "m/s", speed(left?.after), found.v1),
    row("t2", "t₂", "s", hit && left ? hit.t - left.t : NaN, found.t2),
    row("v2", "v₂", "m/s", speed(hit?.before), found.v2),
    row("v2r", "v₂ᵣ", "m/s", speed(hit?.after), found.v2r),
    row("t3", "t₃", "s", down && hit ? down.t - hit.t : NaN, found.t3),
    row("v3", "v₃", "m/s", speed(down?.before), found.v3),
    row("x", "x", "m", down ? down.x : NaN, impactX - found.x3),
  ];
}

class NumbersPanel {
  /** @param {Element} home @param {Lab} lab @param {Words} words */
  constructor(home, lab, words) {
    this.lab = lab;
    this.words = words;
    this.body = html("tbody");
    const head = html("thead", {}, html("tr", {}, html("td"),
      html("th", { scope: "col" }, words.say("simulated")),
      html("th", { scope: "col" }, words.say("analytic"))));
    this.reason = html("p", { class: "note" });
    home.append(card("numbers", words.say("numbers"),
      html("table", {}, head, this.body), this.reason));
    lab.on("run", () => this.refresh());
  }

  refresh() {
    const { recording, scene } = this.lab, { words } = this;
    if (!recording || !scene || recording.state === "running") return;
    const found = predict(scene);
    this.body.replaceChildren(...numbersOf(recording, found)
      .filter(({ simulated, analytic }) => isFinite(simulated) || isFinite(analytic))
      .map(({ id, symbol, unit, simulated, analytic }) => html("tr", { "data-id": id },
        html("th", { scope: "row" }, html("b", {}, symbol), ` ${words.say(`number-${id}`)}, ${unit}`),
        html("td", {}, words.number(simulated)), html("td", {}, words.number(analytic)))));
    this.reason.textContent = found.reason ? words.say(found.reason) : "";
  }
}

export { EnergyPanel, NumbersPanel, card, html, numbersOf, stacks };
