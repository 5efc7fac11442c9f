// What rests in the scene, drawn once for each position of the sliders.

const canvas = document.getElementById("scene");
const rest = document.createElement("canvas");
const STRUCK = ["impact", "landing", "collision"];

function colours() {
  const style = getComputedStyle(document.documentElement);
  const known = {};
  return (name) => (known[name] ??= style.getPropertyValue(`--${name}`).trim());
}

class Picture {
  constructor() {
    this.colour = colours();
  }

  /** Fit the canvas to its place; the window's shape decides the height. */
  resize() {
    const [left, right, bottom, top] = data.window;
    const width = canvas.parentElement.clientWidth;
    const narrow = width < 560;
    const room = window.innerHeight * (narrow ? 0.42 : 0.55);
    const height = Math.round(
      Math.min(Math.max((width * (top - bottom)) / (right - left) + FOOT, 230), Math.max(room, 250)),
    );
    const ratio = window.devicePixelRatio || 1;
    canvas.style.height = `${height}px`;
    for (const surface of [canvas, rest]) {
      surface.width = Math.round(width * ratio);
      surface.height = Math.round(height * ratio);
    }
    this.ratio = ratio;
    this.size = [width, height];
    this.text = narrow ? 12 : 13.5;
    this.narrow = narrow;
  }

  begin(surface) {
    const pen = surface.getContext("2d");
    pen.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    pen.clearRect(0, 0, this.view.width, this.view.height);
    pen.lineJoin = "round";
    pen.font = `${this.text}px system-ui, "Segoe UI", Roboto, "Noto Sans", sans-serif`;
    return pen;
  }

  line(pen, points, colour, width, dash = []) {
    if (points.length < 2) return;
    pen.beginPath();
    for (const { x, y } of points) pen.lineTo(this.view.x(x), this.view.y(y));
    pen.strokeStyle = colour;
    pen.lineWidth = width;
    pen.setLineDash(dash);
    pen.stroke();
    pen.setLineDash([]);
  }

  /** Text with a halo, kept inside the canvas. */
  write(pen, text, x, y, { colour = "ink", align = "left" } = {}) {
    const lines = text.split("\n");
    const width = Math.max(...lines.map((line) => pen.measureText(line).width));
    const height = this.text * 1.25;
    let left = align === "right" ? x - width : align === "center" ? x - width / 2 : x;
    left = Math.min(Math.max(left, 5), this.view.width - width - 5);
    const top = Math.min(Math.max(y, 4), this.view.height - lines.length * height - 4);
    pen.textBaseline = "top";
    pen.textAlign = "left";
    pen.lineWidth = 4;
    pen.strokeStyle = this.colour("card");
    pen.fillStyle = this.colour(colour);
    lines.forEach((line, i) => {
      pen.strokeText(line, left, top + i * height);
      pen.fillText(line, left, top + i * height);
    });
    return { left, right: left + width, top, bottom: top + lines.length * height };
  }

  /** Draw what does not move. */
  still(variant, shown) {
    this.view = viewOf(windowOf(variant), ...this.size);
    const pen = this.begin(rest);
    this.grid(pen);
    this.landing = null;
    if (!variant.offsets) {
      this.axes(pen);
      return;
    }
    this.wheelRadius = variant.pulley ? variant.pulley[0] : 0;
    if (variant.pulley) this.wheel(pen, this.wheelRadius);
    for (const segment of variant.segments) this.surface(pen, segment);
    if (shown.parabola) {
      for (const arc of variant.arcs) {
        this.line(pen, arcPoints(arc), this.colour("analytic"), this.narrow ? 4.5 : 6, [9, 5]);
      }
    }
    pen.globalAlpha = Math.min(0.35, Math.max(0.08, 6 / variant.count));
    for (let particle = variant.count - 1; particle > 0; particle -= 1) {
      const points = trackPoints(variant, particle, ...variant.span, 80);
      this.line(pen, points, this.colour("stream"), 1);
    }
    pen.globalAlpha = 0.45;
    this.line(pen, trackPoints(variant, 0, ...variant.span), this.colour("track"), 1.6);
    pen.globalAlpha = 1;
    if (shown.strobe) this.strobe(pen, variant);
    this.axes(pen);
    this.strikes(pen, variant);
    this.labels(pen, variant);
  }

  /** Where the lines of the grid are, m. */
  marks() {
    const { view } = this;
    const step = roundStep((this.narrow ? 52 : 76) / view.scale);
    const between = (least, most) => {
      const first = Math.ceil(least / step - 1e-9);
      const count = Math.floor(most / step + 1e-9) - first + 1;
      return Array.from({ length: count }, (_, i) => (first + i) * step);
    };
    return {
      across: between(view.left, view.right),
      up: between(view.bottom, view.top),
      digits: Math.max(0, -Math.floor(Math.log10(step) + 1e-9)),
    };
  }

  grid(pen) {
    const { view } = this;
    const { across, up } = this.marks();
    pen.beginPath();
    for (const x of across) {
      pen.moveTo(view.x(x), 0);
      pen.lineTo(view.x(x), view.height);
    }
    for (const y of up) {
      pen.moveTo(0, view.y(y));
      pen.lineTo(view.width, view.y(y));
    }
    pen.lineWidth = 1;
    pen.strokeStyle = this.colour("grid");
    pen.stroke();
  }

  /** The figures of the grid: x along the lower edge, y along the left one. */
  axes(pen) {
    const { view } = this;
    const { across, up, digits } = this.marks();
    const size = this.text - 2;
    pen.save();
    pen.font = pen.font.replace(/[\d.]+px/, `${size}px`);
    const label = (value) => minus((Math.abs(value) < 1e-9 ? 0 : value).toFixed(digits));
    const inside = across.filter((x) => view.x(x) > 34 && view.x(x) < view.width - 24);
    inside.forEach((x, i) => {
      const text = label(x) + (i === inside.length - 1 ? " m" : "");
      this.write(pen, text, view.x(x), view.height, { colour: "muted", align: "center" });
    });
    for (const y of up) {
      const at = view.y(y);
      if (at > 10 && at < view.height - 24) {
        this.write(pen, label(y), 4, at - size / 2, { colour: "muted" });
      }
    }
    pen.restore();
  }

  wheel(pen, radius) {
    const { view } = this;
    pen.beginPath();
    pen.arc(view.x(0), view.y(0), radius * view.scale, 0, 2 * Math.PI);
    pen.fillStyle = this.colour("steel-light");
    pen.fill();
    pen.lineWidth = 2.5;
    pen.strokeStyle = this.colour("belt");
    pen.stroke();
  }

  surface(pen, segment) {
    const part = clipped(this.view, segment);
    if (!part) return;
    pen.beginPath();
    pen.moveTo(part.begin.x, part.begin.y);
    pen.lineTo(part.end.x, part.end.y);
    pen.lineWidth = segment.name === "plate" ? 4 : 3;
    pen.strokeStyle = this.colour(isBelt(segment) ? "belt" : "ink");
    pen.stroke();
  }

  strobe(pen, variant) {
    pen.lineWidth = 1.5;
    pen.strokeStyle = this.colour("track");
    pen.fillStyle = this.colour("card");
    const step = variant.strobe;
    const begin = Math.ceil(variant.span[0] / step - 1e-9);
    const end = Math.min(Math.floor(variant.span[1] / step + 1e-9), begin + 400);
    for (let i = begin; i <= end; i += 1) {
      const state = stateAt(variant, 0, i * step);
      if (!state || state.ended) continue;
      pen.beginPath();
      pen.arc(this.view.x(state.x), this.view.y(state.y), this.narrow ? 2.8 : 3.6, 0, 2 * Math.PI);
      pen.fill();
      pen.stroke();
    }
  }

  /** A cross where the first particle strikes something; an arrow where it lands. */
  strikes(pen, variant) {
    const { view } = this;
    for (const [t, kind] of variant.events) {
      if (!STRUCK.includes(kind)) continue;
      const state = stateAt(variant, 0, t);
      const [x, y, r] = [view.x(state.x), view.y(state.y), 5];
      pen.beginPath();
      for (const side of [-1, 1]) {
        pen.moveTo(x - r, y - side * r);
        pen.lineTo(x + r, y + side * r);
      }
      pen.lineWidth = 2.4;
      pen.strokeStyle = this.colour("strike");
      pen.stroke();
      if (kind === "landing" && !this.landing) {
        const foot = y + variant.radius * view.scale + 4;
        pen.beginPath();
        pen.moveTo(x, foot);
        pen.lineTo(x - 6, foot + 9);
        pen.lineTo(x + 6, foot + 9);
        pen.closePath();
        pen.fillStyle = this.colour("strike");
        pen.fill();
        this.landing = this.write(pen, `lands at ${brief(state.x, 3)} m`, x, foot + 12, {
          colour: "strike", align: "center",
        });
      }
    }
  }

  labels(pen, variant) {
    const named = new Set();
    for (const segment of variant.segments) {
      const part = clipped(this.view, segment);
      if (!part || named.has(segment.name)) continue;
      named.add(segment.name);
      this.label(pen, segment, part);
    }
  }

  label(pen, segment, { begin, end }) {
    const { name, speed } = segment;
    const colour = isBelt(segment) ? "belt" : "ink";
    const [low, high] = begin.y > end.y ? [begin, end] : [end, begin];
    if (name === "plate") {
      const turned = (Math.atan2(segment.x0 - segment.x1, segment.y1 - segment.y0) * 180) / Math.PI;
      const text = `plate, ${brief(turned, 3)}°\nε = ${brief(segment.restitution, 3)}`;
      // On the back, where no particle is expected.
      const share = turned > 8 ? 0.35 : 1;
      const at = { x: low.x + share * (high.x - low.x), y: low.y + share * (high.y - low.y) };
      this.write(pen, text, at.x + 10, turned > 8 ? at.y - 2.5 * this.text - 2 : at.y, { colour });
    } else if (name === "incoming") {
      const text = this.narrow ? motion(speed) : `incoming belt\n${motion(speed)}`;
      const left = Math.min(begin.x, end.x) + 34;
      const width = Math.max(...text.split("\n").map((line) => pen.measureText(line).width));
      // Above the belt where the pulley leaves no room below.
      const above = left + width > this.view.x(-this.wheelRadius) - 4;
      const top = above ? begin.y - 12 - this.text * 1.25 * text.split("\n").length : begin.y + 8;
      this.write(pen, text, left, top, { colour });
    } else if (name === "outgoing") {
      const text = this.narrow ? motion(speed) : `outgoing belt, ${motion(speed)}`;
      const width = pen.measureText(text).width;
      const [left, right] = [Math.min(begin.x, end.x), Math.max(begin.x, end.x)];
      const taken = this.landing && this.landing.right > right - width - 20;
      const place = taken ? { x: left + 34, align: "left" } : { x: right - 8, align: "right" };
      this.write(pen, text, place.x, begin.y + 8, { colour, align: place.align });
    } else {
      const text = speed ? `${name}, ${motion(speed)}` : name;
      this.write(pen, text, (begin.x + end.x) / 2, (begin.y + end.y) / 2 + 8, {
        colour, align: "center",
      });
    }
  }
}

const isBelt = (segment) =>
  segment.name === "incoming" || segment.name === "outgoing" || segment.speed !== 0;

const motion = (speed) =>
  speed ? `${brief(Math.abs(speed), 3)} m/s ${speed > 0 ? "→" : "←"}` : "at rest";
