// The legend in the picture: colours of speeds, sizes or streams.

import { freePlace } from "./callout.ts";
import { STEPS } from "./balls.ts";
import { svg } from "./scenery.ts";
import type { Stage } from "./stage.ts";

/** Width of the ramp and height of one of its steps, px: the height tried first, and one for less
 * room; distance of lines of text; and width of a letter, about. */
const WIDE = 14, TALL = [19, 12], LINE = 22, LETTER = 8.5;

/** Radius of a stream's dot, and distance from its left side to the text, px. */
const DOT = 7, BESIDE = 3 * DOT;

class Legend {
  layer = svg("g", { class: "hues" });
  /** State that was drawn last. */
  drawn = "";

  constructor(readonly stage: Stage) {
    stage.over.prepend(this.layer);
    // Labels keep clear of it.
    stage.drawers.unshift(() => this.draw());
  }

  /** Its lines from the top, each with a step of colour or a stream. */
  get lines(): [number, string][] {
    const { balls, lab: { machine }, words } = this.stage;
    if (balls.hue === "kind") {
      const { streams = [] } = machine ?? {};
      return streams.map((name, n) => [n, words.name(name)]);
    }
    if (balls.hue === "material") return [];
    const { range: [low, high], unit } = balls;
    const tell = (value: number) => words.plain(Number(value.toPrecision(3)));
    return [[STEPS, `${tell(high)} ${unit}`], [0.5 * STEPS, tell(0.5 * (low + high))],
      [0, tell(low)]];
  }

  draw() {
    const { stage, layer, lines } = this, { view, words, balls, held, lab } = stage;
    const { x, y, scale, width, height } = view;
    const notes = lines.length && stage.isLarger ? [words.say("drawn-larger")] : [];
    const now = JSON.stringify([lines, balls.hue, notes, x, y, scale, width, height, stage.scaleAt,
      lab.recording?.state]);
    // It stays in place during a drag.
    if (held || now === this.drawn) return;
    this.drawn = now;
    layer.replaceChildren();
    stage.legend = null;
    layer.removeAttribute("role");
    if (!lines.length) {
      if (stage.strip) stage.keepFree(0);
      return;
    }
    const title = words.say(`hue-${balls.hue}`), ramp = balls.hue !== "kind";
    const wide = Math.max(...[title, ...notes].map(({ length }) => LETTER * length),
      ...lines.map(([, text]) => BESIDE + LETTER * text.length));
    const highs = ramp ? TALL.map((tall) => STEPS * tall) : [LINE * lines.length];
    for (const high of highs) {
      const whole = high + LINE * (1.3 + notes.length);
      const [px, py] = this.find(wide, whole);
      if (!stage.legend) continue;
      this.write(px, py + 0.6 * LINE, title, "title");
      if (ramp) this.ramp(px, py + 1.3 * LINE, high, lines);
      else {
        lines.forEach(([n, text], row) => {
          const middle = py + LINE * (row + 1.7);
          layer.append(svg("circle", { cx: px + DOT, cy: middle, r: DOT, class: `kind-${n % 5}` }));
          this.write(px + BESIDE, middle + 5, text);
        });
      }
      notes.forEach((note) => this.write(px, py + whole - 4, note, "small"));
      break;
    }
    if (!stage.legend) this.flat(title, lines);
    // If a machine fills all of a small picture, make room.
    if (!stage.legend && !stage.strip && !stage.moved) {
      stage.keepFree(LINE);
      return;
    }
    layer.setAttribute("role", "img");
    layer.setAttribute("aria-label", `${title}: ${lines.map(([, text]) => text).join(", ")}`);
  }

  /** Find room for a size, px, or use the strip kept free; the upper left corner. */
  find(wide: number, high: number): [number, number] {
    const { stage } = this, { view: { free }, strip, corner: [x], moved } = stage;
    const inStrip: [number, number] | null = high <= strip && !moved ? [x, free.top] : null;
    const at = freePlace(stage, [wide, high], stage.corner, [stage.scaleBox]) ?? inStrip;
    if (!at) return [0, 0];
    const [left, bottom] = at;
    stage.legend = { left, right: left + wide, top: bottom - high, bottom };
    return [left, bottom - high];
  }

  /** Everything in one line, if there is little room. */
  flat(title: string, lines: [number, string][]) {
    if (this.stage.balls.hue === "kind") {
      const long = (text: string) => LETTER * text.length;
      const each = (text: string) => long(text) + 2 * BESIDE;
      const wide = lines.reduce((sum, [, text]) => sum + each(text), long(title));
      const [x, y] = this.find(wide, LINE);
      if (!this.stage.legend) return;
      this.write(x, y + 16, title, "title");
      let from = x + long(title) + BESIDE;
      for (const [n, text] of lines) {
        this.layer.append(svg("circle", { cx: from + DOT, cy: y + 11, r: DOT,
          class: `kind-${n % 5}` }));
        this.write(from + BESIDE, y + 16, text);
        from += each(text);
      }
      return;
    }
    const [[, high], , [, low]] = lines, first = `${title} ${low}`;
    const before = LETTER * first.length + 8, long = STEPS * TALL[1];
    const [x, y] = this.find(before + long + 8 + LETTER * high.length, LINE);
    if (!this.stage.legend) return;
    const from = x + before;
    this.write(x, y + 16, first);
    for (let n = 0; n < STEPS; n += 1) {
      this.layer.append(svg("rect", { x: from + n * TALL[1], y: y + 4, width: TALL[1], height: WIDE,
        class: `v${n}` }));
    }
    this.layer.append(svg("rect", { x: from, y: y + 4, width: long, height: WIDE, class: "ring" }));
    this.write(from + long + 8, y + 16, high);
  }

  ramp(x: number, y: number, high: number, lines: [number, string][]) {
    const tall = high / STEPS;
    for (let n = 0; n < STEPS; n += 1) {
      this.layer.append(svg("rect", { x, y: y + high - (n + 1) * tall, width: WIDE, height: tall,
        class: `v${n}` }));
    }
    this.layer.append(svg("rect", { x, y, width: WIDE, height: high, class: "ring" }));
    for (const [step, text] of lines) this.write(x + WIDE + 7, y + high - step * tall + 5, text);
  }

  write(x: number, y: number, text: string, kind = "") {
    this.layer.append(svg("text", { x, y, class: kind }, text));
  }
}

export { Legend };
