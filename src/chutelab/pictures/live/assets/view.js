// From metres to pixels, and numbers as texts.

const PREFIXES = { "-15": "f", "-12": "p", "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M" };
const minus = (text) => text.replace(/-/g, "−");

/** A factor and a prefixed unit that bring the size to between 1 and 1000. */
function scaled(size, unit) {
  if (!(size > 0)) return [1, unit];
  const power = Math.min(Math.max(3 * Math.floor(Math.log10(size) / 3), -15), 6);
  return [10 ** -power, PREFIXES[power] + unit];
}

/** At most so many significant digits, no trailing zeros. */
function brief(value, digits = 4) {
  if (value === 0) return "0";
  const text = value.toPrecision(digits);
  return minus(/e/.test(text) ? Number(text).toExponential() : String(Number(text)));
}

const scientific = (value) => (value === 0 ? "0" : minus(value.toExponential(0).replace("e+", "e")));

const withUnit = (text, unit) => (unit === "°" ? `${text}°` : unit ? `${text} ${unit}` : text);

const ROUND = [1, 2, 5, 10];

function roundStep(least) {
  const power = 10 ** Math.floor(Math.log10(least));
  return power * ROUND.find((factor) => factor * power >= least * (1 - 1e-9));
}

const FOOT = 28; // px under the window for the figures of the x axis

/** The usual window, or a larger one for a run that does not fit in it. */
function windowOf({ window: own, offsets, fault }) {
  const usual = data.window;
  if (!offsets || fault) return usual;
  const slack = 0.015 * Math.max(usual[1] - usual[0], usual[3] - usual[2]);
  return own.map((side, i) => {
    const beyond = i % 2 ? side - usual[i] : usual[i] - side;
    return beyond > slack ? side : usual[i];
  });
}

/** The window of the world at equal scales in a box of pixels. */
function viewOf([left, right, bottom, top], width, height) {
  const room = height - FOOT;
  const scale = Math.min(width / (right - left), room / (top - bottom));
  const x0 = (left + right) / 2 - width / scale / 2;
  const y1 = (bottom + top) / 2 + room / scale / 2;
  return {
    scale, width, height,
    left: x0, right: x0 + width / scale, top: y1, bottom: y1 - height / scale,
    x: (x) => (x - x0) * scale,
    y: (y) => (y1 - y) * scale,
  };
}

/** The part of a line inside the view; null if none is. */
function clipped(view, { x0, y0, x1, y1 }) {
  let [low, high] = [0, 1];
  for (const [from, along, least, most] of [
    [x0, x1 - x0, view.left, view.right],
    [y0, y1 - y0, view.bottom, view.top],
  ]) {
    if (along === 0) {
      if (from < least || from > most) return null;
    } else {
      const shares = [(least - from) / along, (most - from) / along].sort((a, b) => a - b);
      low = Math.max(low, shares[0]);
      high = Math.min(high, shares[1]);
    }
  }
  if (low >= high) return null;
  const at = (share) => ({ x: view.x(x0 + share * (x1 - x0)), y: view.y(y0 + share * (y1 - y0)) });
  return { begin: at(low), end: at(high), low, high };
}
