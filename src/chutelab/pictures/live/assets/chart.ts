// A small diagram in SVG: axes with round numbers, lines, and elements over them.

import { svg } from "./scenery.ts";
import type { Words } from "./words.ts";

type Range = [number, number];

const NUMBERS = 46, DIGIT = 7, GAP = 6, RIGHT = 10, TOP = 10, BOTTOM = 24;

/** Round numbers within a range, about so many. */
function ticks(low: number, high: number, many: number): number[] {
  if (!(high > low)) return isFinite(low) ? [low] : [];
  const step = roundUp((high - low) / many);
  const numbers = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) {
    numbers.push(Number((n * step).toPrecision(12)));
  }
  return numbers;
}

/** The smallest of 1, 2 and 5 times a power of ten that is not smaller. */
function roundUp(size: number) {
  const ten = 10 ** Math.floor(Math.log10(size));
  return [1, 2, 5, 10].map((n) => n * ten).find((step) => step >= size * (1 - 1e-9)) ?? 10 * ten;
}

/** The range of values, with some room, also round a single value.
 * @param room share of the span */
function rangeOf(values: number[], room: number = 0.06): Range {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) return [0, 1];
  // Rounding must not fill a diagram.
  const span = Math.max(high - low, 1e-4 * Math.max(Math.abs(low), Math.abs(high), 1e-6));
  return [low - room * span, high + room * span];
}

/** Report the width of an element, now and whenever it changes. */
function onWidth(element: Element, act: (width: number) => void) {
  new ResizeObserver(([{ contentRect: { width } }]) => {
    if (width > 0) act(Math.max(200, width));
  }).observe(element);
}

class Chart {
  width = 320;
  root;
  grid;
  marks;
  cursor;
  /** Left end of the axes, px: beside the widest number. */
  left = NUMBERS + GAP;
  x: Range = [0, 1];
  y: Range = [0, 1];

  /** @param height px */
  constructor(readonly words: Words, readonly height: number) {
    this.grid = svg("g", { class: "chart-grid" });
    this.marks = svg("g");
    this.cursor = svg("path", { class: "chart-cursor" });
    this.root = svg("svg", { class: "chart", "aria-hidden": "true" }, this.grid, this.marks,
      this.cursor);
  }

  /** Empty it, and draw axes.
   * @param say names of the axes;
   *   `whole`: the numbers beside count something */
  frame(
    x: Range, y: Range,
    { below = "", beside = "", whole = false }: { below?: string, beside?: string, whole?: boolean } = {},
  ) {
    const { words, height } = this;
    this.x = x;
    this.y = y;
    this.root.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
    this.root.setAttribute("height", String(height));
    this.grid.replaceChildren();
    this.marks.replaceChildren();
    const right = this.width - RIGHT, bottom = height - BOTTOM;
    const label = (x1: number, y1: number, text: string, anchor: string) =>
      this.grid.append(svg("text", { x: x1, y: y1, "text-anchor": anchor }, text));
    const name = (value: number, all: number[]) => words.fixed(value, decimals(all));
    const across = ticks(...x, Math.max(2, this.width / 64)), up = ticks(...y, height / 24)
      .filter((value) => !whole || Number.isInteger(value));
    const widest = Math.max(0, ...up.map((value) => name(value, up).length));
    this.left = Math.max(NUMBERS, DIGIT * widest) + GAP;
    const { left } = this;
    for (const value of across) {
      this.grid.append(svg("path", { d: `M${this.px(value)} ${TOP}V${bottom}` }));
      // The axis' own name stands at the right end.
      if (!below || this.px(value) < right - 7 * below.length - 18) {
        label(this.px(value), bottom + 15, name(value, across), "middle");
      }
    }
    for (const value of up) {
      this.grid.append(svg("path", { d: `M${left} ${this.py(value)}H${right}`,
        class: value === 0 ? "zero" : "" }));
      const py = this.py(value);
      if (!beside || py > TOP + 14) label(left - GAP, py + 4, name(value, up), "end");
    }
    if (below) label(right, bottom + 15, below, "end");
    if (beside) label(left - GAP, TOP + 6, beside, "end");
  }

  px(x: number) {
    const { left, width, x: [low, high] } = this;
    return left + ((x - low) / (high - low || 1)) * (width - left - RIGHT);
  }

  py(y: number) {
    const bottom = this.height - BOTTOM;
    return bottom - ((y - this.y[0]) / (this.y[1] - this.y[0] || 1)) * (bottom - TOP);
  }

  /** The value at a place of the screen along the lower axis. */
  worldX(clientX: number) {
    const box = this.root.getBoundingClientRect();
    const px = (clientX - box.left) * (this.width / box.width);
    const part = (px - this.left) / (this.width - this.left - RIGHT);
    return this.x[0] + Math.min(1, Math.max(0, part)) * (this.x[1] - this.x[0]);
  }

  /** @param kind its class */
  line(x: ArrayLike<number>, y: ArrayLike<number>, kind: string) {
    const tenth = (px: number) => Math.round(10 * px) / 10;
    const points = Array.from(x, (value, i) => `${tenth(this.px(value))},${tenth(this.py(y[i]))}`);
    this.marks.append(svg("polyline", { points: points.join(" "), class: `curve ${kind}` }));
  }

  /** The outline of bars of a width, from a place on. */
  bars(from: number, width: number, counts: number[]) {
    const tenth = (px: number) => px.toFixed(1), base = this.py(0);
    return `M${tenth(this.px(from))} ${base}${counts.map((count, n) =>
      `V${tenth(this.py(count))}H${tenth(this.px(from + (n + 1) * width))}`).join("")}V${base}Z`;
  }

  /** @param kind the class of its line */
  dot(x: number, y: number, kind: string) {
    this.marks.append(svg("circle", { cx: this.px(x), cy: this.py(y), r: 3, class: `last ${kind}` }));
  }

  /** A vertical line across the diagram. */
  point(x: number) {
    const px = this.px(x).toFixed(1);
    this.cursor.setAttribute("d", isFinite(x) ? `M${px} ${TOP}V${this.height - BOTTOM}` : "");
  }
}

/** Number of decimals needed to distinguish numbers. */
function decimals(numbers: number[]) {
  const step = numbers.length > 1 ? Math.abs(numbers[1] - numbers[0]) : Math.abs(numbers[0] || 1);
  return Math.min(6, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

export { Chart, onWidth, rangeOf, roundUp, ticks };
