// What the sensors of a scene count: how many pass, how many a second, and how fast they are.

import { Passing } from "./flow.ts";
import { card, follow, html } from "./panels.ts";
import type { Lab } from "./lab.ts";
import type { Passage } from "./flow.ts";
import type { Recording } from "./recording.ts";
import type { Words } from "./words.ts";

/** Passages the way that counts on, and back; 1/s, and m/s. NaN where it is not known */
export type Reading = { count: number, back: number, rate: number, speed: number };

/** What passages tell, as Python's `reading`: a rate is from the first of them to the last. */
function readingOf(passages: Passage[]): Reading {
  const on = passages.filter(({ way }) => way > 0), count = on.length;
  const span = count > 1 ? on[count - 1].t - on[0].t : 0;
  return {
    count, back: passages.length - count, rate: span ? (count - 1) / span : NaN,
    speed: on.reduce((sum, { speed }) => sum + speed, 0) / count,
  };
}

class SensorsPanel {
  body = html("tbody");
  panel;
  /** By name. */
  counts: Map<string, Passing> = new Map();

  constructor(home: Element, readonly lab: Lab, readonly words: Words) {
    const heads = ["count", "rate", "speed"].map((id) => html("th", { scope: "col" },
      words.say(`sensor-${id}`)));
    this.panel = card("sensors", words.say("sensors"), html("table", { class: "sensors" },
      html("thead", {}, html("tr", {}, html("td"), ...heads)), this.body),
    html("p", { class: "note" }, words.say("sensors-note")));
    home.prepend(this.panel);
    lab.on("scene", () => this.name());
    this.name();
    follow(lab, this.panel, ["run", "time", "scene"], () => this.draw());
  }

  /** Have those that are there now. */
  name() {
    const sensors = this.lab.scene?.sensor ?? [], before = this.counts;
    this.counts = new Map(sensors.map(({ name, from, to }) => {
      const its = before.get(name) ?? new Passing();
      if (String(its.ends) !== String([from, to])) its.move([from, to]);
      return [name, its];
    }));
    this.panel.hidden = !sensors.length;
  }

  /** What each tells up to the time that is shown. */
  get readings(): [string, Reading][] {
    const { recording, t } = this.lab;
    return [...this.counts].map(([name, its]) => {
      its.count(recording as Recording);
      return [name, readingOf(its.passages.slice(0, its.until(t)))];
    });
  }

  draw() {
    const { words } = this;
    this.body.replaceChildren(...this.readings.map(([name, { count, back, rate, speed }]) => {
      const many = back ? words.say("sensor-back", { count, back }) : String(count);
      return html("tr", { "data-id": name }, html("th", { scope: "row" }, words.name(name)),
        html("td", {}, many), html("td", {}, words.number(rate, 3)),
        html("td", {}, words.number(speed, 3)));
    }));
  }
}

export { SensorsPanel, readingOf };
