// A small diagram in SVG: axes with round numbers, lines, and what is put over them.

import { svg } from "./stage.js";

/**
 * @typedef {import("./words.js").Words} Words
 * @typedef {[number, number]} Range
 */

const LEFT = 52, RIGHT = 10, TOP = 10, BOTTOM = 24;

/** Round numbers within a range, about so many.
 * @param {number} low @param {number} high @param {number} many @returns {number[]} */
function ticks(low, high, many) {
  if (!(high > low)) return isFinite(low) ? [low] : [];
  const step = roundUp((high - low) / many);
  const numbers = [];
  for (let n = Math.ceil(low / step - 1e-9); n * step <= high + 1e-9 * step; n += 1) {
    numbers.push(Number((n * step).toPrecision(12)));
  }
  return numbers;
}

/** The smallest of 1, 2 and 5 times a power of ten that is no smaller. @param {number} size */
function roundUp(size) {
  const ten = 10 ** Math.floor(Math.log10(size));
  return [1, 2, 5, 10].map((n) => n * ten).find((step) => step >= size * (1 - 1e-9)) ?? 10 * ten;
}

/** From the smallest to the largest, with some room; round a single value too.
 * @param {number[]} values @param {number} [room] share of the span @returns {Range} */
function rangeOf(values, room = 0.06) {
  let low = Infinity, high = -Infinity;
  for (const value of values) {
    if (value < low) low = value;
    if (value > high) high = value;
  }
  if (low > high) return [0, 1];
  // Rounding is not to fill a diagram.
  const span = Math.max(high - low, 1e-4 * Math.max(Math.abs(low), Math.abs(high), 1e-6));
  return [low - room * span, high + room * span];
}

/** Tell how wide an element is, now and whenever that changes.
 * @param {Element} element @param {(width: number) => void} act */
function onWidth(element, act) {
  new ResizeObserver(([{ contentRect: { width } }]) => {
    if (width > 0) act(Math.max(200, width));
  }).observe(element);
}

class Chart {
  /** @param {Words} words @param {number} height px */
  constructor(words, height) {
    this.words = words;
    this.height = height;
    this.width = 320;
    this.root = svg("svg", { class: "chart", "aria-hidden": "true" });
    this.grid = svg("g", { class: "chart-grid" });
    this.marks = svg("g");
    this.cursor = svg("path", { class: "chart-cursor" });
    this.root.append(this.grid, this.marks, this.cursor);
    /** @type {Range} */
    this.x = [0, 1];
    /** @type {Range} */
    this.y = [0, 1];
  }

  /** Empty it, and draw axes.
   * @param {Range} x @param {Range} y
   * @param {{below?: string, beside?: string, whole?: boolean}} [say] names of the axes;
   *   `whole`: the numbers beside count something */
  frame(x, y, { below = "", beside = "", whole = false } = {}) {
    const { words, height } = this;
    this.x = x;
    this.y = y;
    this.root.setAttribute("viewBox", `0 0 ${this.width} ${height}`);
    this.root.setAttribute("height", String(height));
    this.grid.replaceChildren();
    this.marks.replaceChildren();
    const right = this.width - RIGHT, bottom = height - BOTTOM;
    const label = (/** @type {number} */ px, /** @type {number} */ py, /** @type {string} */ text,
      /** @type {string} */ anchor) => {
      const element = svg("text", { x: px, y: py, "text-anchor": anchor });
      element.textContent = text;
      this.grid.append(element);
    };
    const name = (/** @type {number} */ value, /** @type {number[]} */ all) =>
      words.fixed(value, decimals(all));
    const across = ticks(...x, Math.max(2, this.width / 64)), up = ticks(...y, height / 24)
      .filter((value) => !whole || Number.isInteger(value));
    for (const value of across) {
      this.grid.append(svg("path", { d: `M${this.px(value)} ${TOP}V${bottom}` }));
      // The axis' own name stands at the right end.
      if (!below || this.px(value) < right - 7 * below.length - 18) {
        label(this.px(value), bottom + 15, name(value, across), "middle");
      }
    }
    for (const value of up) {
      this.grid.append(svg("path", { d: `M${LEFT} ${this.py(value)}H${right}`,
        class: value === 0 ? "zero" : "" }));
      const py = this.py(value);
      if (!beside || py > TOP + 14) label(LEFT - 6, py + 4, name(value, up), "end");
    }
    if (below) label(right, bottom + 15, below, "end");
    if (beside) label(LEFT - 6, TOP + 6, beside, "end");
  }

  /** @param {number} x */
  px(x) {
    return LEFT + ((x - this.x[0]) / (this.x[1] - this.x[0] || 1)) * (this.width - LEFT - RIGHT);
  }

  /** @param {number} y */
  py(y) {
    const bottom = this.height - BOTTOM;
    return bottom - ((y - this.y[0]) / (this.y[1] - this.y[0] || 1)) * (bottom - TOP);
  }

  /** What is at a place of the screen along the axis below. @param {number} clientX */
  worldX(clientX) {
    const box = this.root.getBoundingClientRect();
    const px = (clientX - box.left) * (this.width / box.width);
    const part = (px - LEFT) / (this.width - LEFT - RIGHT);
    return this.x[0] + Math.min(1, Math.max(0, part)) * (this.x[1] - this.x[0]);
  }

  /** @param {ArrayLike<number>} x @param {ArrayLike<number>} y @param {string} kind its class */
  line(x, y, kind) {
    const tenth = (/** @type {number} */ px) => Math.round(10 * px) / 10;
    const points = Array.from(x, (value, i) => `${tenth(this.px(value))},${tenth(this.py(y[i]))}`);
    this.marks.append(svg("polyline", { points: points.join(" "), class: `curve ${kind}` }));
  }

  /** A line upright across all of it. @param {number} x */
  point(x) {
    const px = this.px(x).toFixed(1);
    this.cursor.setAttribute("d", isFinite(x) ? `M${px} ${TOP}V${this.height - BOTTOM}` : "");
  }
}

/** How many digits behind the point tell numbers apart. @param {number[]} numbers */
function decimals(numbers) {
  const step = numbers.length > 1 ? Math.abs(numbers[1] - numbers[0]) : Math.abs(numbers[0] || 1);
  return Math.min(6, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
}

export { Chart, onWidth, rangeOf, roundUp, ticks };
