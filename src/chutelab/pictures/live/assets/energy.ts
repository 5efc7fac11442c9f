// The energy ledger as two bars of equal height: the energy put in, and where it is.

import { card, follow, html, icon } from "./panels.ts";
import type { Lab } from "./lab.ts";
import { isDriven, isPaid } from "./machine.ts";
import { ROUNDING, type Recording, type Ledger } from "./recording.ts";
import type { Words } from "./words.ts";

type Entry = [keyof Ledger, number];

const SIGNS: Entry[] = [
  ["start", 1], ["belt_work", 1], ["push_work", 1], ["kinetic", -1], ["potential", -1],
  ["spring", -1], ["restitution_loss", -1], ["friction_loss", -1], ["damper_loss", -1],
  ["changed", 1], ["residual", 1],
];

/** Entries that exist only with hinges and springs. */
const KEPT: Record<string, string[]> = { spring: ["spring", "stiffness"], damper_loss: ["damper"] };

/** Entries that are not shown where they are rounding. */
const ROUNDED: string[] = ["residual", "changed"];

/** A work below this part of the whole, in a machine without drives, is not shown: within a step
 * the paths of particles and those of hinges are interpolated apart, which leaves up to 2e-4. */
const TINY_WORK = 1e-3;

/** J; less is shown as 0. */
const UNSEEN = 5e-13;

/** The energy put in, and where it is: an entry of the opposite sign changes sides. Rounding
 * is in neither. */
function stacks(ledger: Ledger) {
  const entries = SIGNS.map(([name, sign]) => [name, sign * ledger[name]] as Entry);
  const side = (sign: number) =>
    entries.map(([name, value]) => [name, Math.max(sign * value, 0)] as Entry);
  const size = side(1).reduce((sum, [, value]) => sum + value, 0);
  const shown = ([name, value]: Entry) => !ROUNDED.includes(name) || value > ROUNDING * size;
  return { putIn: side(1).filter(shown), isNow: side(-1).filter(shown), size };
}

/** The ledger with heights from the machine's lowest point; only what has left it is lower. */
function groundedLedger(recording: Recording, t: number) {
  const ledger = recording.ledger(Math.min(t, recording.end)), { machine } = recording;
  // Only of released particles, as others have no part in the ledger yet.
  const low = recording.tracks.reduce((sum, track, i) => (track.begin <= t
    ? sum + machine.mass[i] * machine.gravity * machine.ground : sum),
  machine.movers.reduce((sum, { moment }) =>
    sum - machine.gravity * Math.hypot(...moment), 0));
  return { ...ledger, start: ledger.start - low, potential: ledger.potential - low };
}

class EnergyPanel {
  bars;
  cells;
  rows;
  closes = html("p", { class: "good" });
  zero = html("p", { class: "note" });
  /** Whether any surface, or any belt, is driven. */
  paid = false;

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    this.bars = ["put-in", "is-now"].map((id) => html("div", { class: "bar", id }));
    this.cells = new Map(SIGNS.map(([name]) => [name, html("td")]));
    this.rows = SIGNS.map(([name]) => html("tr", { "data-id": name },
      html("th", { scope: "row" }, html("i", { class: `energy-${name}` }), words.say(`energy-${name}`)),
      this.cells.get(name)));
    const bars = html("div", { class: "bars", "aria-hidden": "true" },
      html("span", {}, words.say("put-in")), this.bars[0],
      html("span", {}, words.say("is-now")), this.bars[1]);
    const panel = card("energy", words.say("energy"), bars,
      html("table", {}, html("tbody", {}, ...this.rows)), this.closes,
      this.zero);
    home.append(panel);
    // Driven surfaces give energy as belts do.
    const given = this.rows[1].firstChild.lastChild;
    lab.on("run", () => {
      this.longest = 0;
      if (!lab.machine) return;
      const { segments, arcs } = lab.machine;
      this.paid = isPaid(lab.machine);
      given.textContent = words.say(isDriven(lab.machine) ? "energy-drives" : "energy-belt_work");
      const stands = segments.length || arcs.length;
      this.zero.textContent = words.say(stands ? "energy-note" : "energy-note-free");
    });
    follow(lab, panel, ["time", "run"], () => this.refresh());
  }

  /** Energy at full height of the bars, J; 0 if it is not known yet. */
  longest = 0;

  refresh() {
    const recording = this.lab.recording as Recording, { machine } = recording;
    const ledger = groundedLedger(recording, this.lab.t);
    const { putIn, isNow, size } = stacks(ledger);
    this.longest ||= stacks(groundedLedger(recording, recording.end)).size;
    this.longest = Math.max(this.longest, size);
    [putIn, isNow].forEach((parts, n) => {
      const there = parts.filter(([, value]) => value > 0);
      this.bars[n].replaceChildren(...there.map(([name, value]) => {
        const part = html("i", { class: `energy-${name}` });
        part.style.width = `${(100 * value) / (this.longest || 1)}%`;
        return part;
      }));
    });
    const rounding = Math.max(UNSEEN, ROUNDING * size);
    this.closes.hidden = Math.abs(ledger.residual) > rounding;
    this.closes.replaceChildren(icon("tick"),
      this.words.say("energy-closes", { energy: this.words.energy(size) }));
    SIGNS.forEach(([name], n) => {
      this.cells.get(name).textContent = this.words.energy(ledger[name], size);
      this.rows[n].hidden = (ROUNDED.includes(name) && Math.abs(ledger[name]) <= rounding)
        || (name === "belt_work" && !this.paid && Math.abs(ledger[name]) < TINY_WORK * size)
        || (name === "push_work" && !recording.pushes.length && !ledger.push_work)
        || (KEPT[name] && ![...machine.movers, ...machine.joints].some((one: any) =>
          KEPT[name].some((key) => one[key])));
    });
  }
}

export { EnergyPanel, groundedLedger, stacks };
