// What moves in the scene, drawn over what rests.

const MARK = 26; // px between two marks on a running belt

/** The fastest that the first particle gets in any run, m/s: the longest arrow. */
const fastest = variants.reduce((most, variant) => {
  if (!variant.offsets || variant.fault) return most;
  const [from, to] = variant.offsets;
  for (let i = from; i < to; i += 1) most = Math.max(most, Math.hypot(knots.vx[i], knots.vy[i]));
  return most;
}, 0);

class Film extends Picture {
  /** Draw everything at one time. */
  show(variant, t, shown) {
    const pen = this.begin(canvas);
    pen.drawImage(rest, 0, 0, this.view.width, this.view.height);
    if (!variant.offsets) return;
    this.machinery(pen, variant, t);
    this.line(pen, trackPoints(variant, 0, variant.span[0], t), this.colour("track"), 2.6);
    for (let particle = variant.count - 1; particle >= 0; particle -= 1) {
      this.particle(pen, variant, particle, t);
    }
    if (shown.arrows) this.arrows(pen, variant, t);
  }

  /** Spokes and marks that show what runs, and how fast. */
  machinery(pen, variant, t) {
    const { view } = this;
    if (variant.pulley) {
      const [radius, speed] = variant.pulley;
      pen.beginPath();
      for (let spoke = 0; spoke < 5; spoke += 1) {
        const angle = (speed * t) / radius + (spoke * 2 * Math.PI) / 5;
        const reach = 0.86 * radius * view.scale;
        pen.moveTo(view.x(0), view.y(0));
        pen.lineTo(view.x(0) + reach * Math.cos(angle), view.y(0) + reach * Math.sin(angle));
      }
      pen.lineWidth = 2;
      pen.strokeStyle = this.colour("steel");
      pen.stroke();
    }
    for (const segment of variant.segments) {
      const part = segment.speed ? clipped(view, segment) : null;
      if (!part) continue;
      const length = Math.hypot(segment.x1 - segment.x0, segment.y1 - segment.y0) * view.scale;
      const [ux, uy] = [
        ((segment.x1 - segment.x0) * view.scale) / length,
        ((segment.y0 - segment.y1) * view.scale) / length,
      ];
      const shift = (segment.speed * t * view.scale) % MARK;
      const from = Math.ceil((part.low * length - shift) / MARK);
      const [x0, y0] = [view.x(segment.x0), view.y(segment.y0)];
      const under = 5 * (segment.x1 >= segment.x0 ? 1 : -1);
      pen.beginPath();
      for (let i = from; i * MARK + shift <= part.high * length; i += 1) {
        const at = i * MARK + shift;
        pen.moveTo(x0 + at * ux, y0 + at * uy);
        pen.lineTo(x0 + at * ux - uy * under, y0 + at * uy + ux * under);
      }
      pen.lineWidth = 2;
      pen.strokeStyle = this.colour("belt");
      pen.stroke();
    }
  }

  particle(pen, variant, particle, t) {
    const state = stateAt(variant, particle, t);
    if (!state) return;
    const first = particle === 0;
    const least = first ? 6 : 3;
    const radius = Math.max(variant.radius * this.view.scale, least);
    const [x, y] = [this.view.x(state.x), this.view.y(state.y)];
    pen.globalAlpha = state.ended && !first ? 0.45 : 1;
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    pen.fillStyle = this.colour(first ? "track" : "stream");
    pen.fill();
    pen.lineWidth = first ? 1.5 : 1;
    pen.strokeStyle = this.colour("card");
    pen.stroke();
    pen.globalAlpha = 1;
  }

  /** The first particle's velocity with its components. */
  arrows(pen, variant, t) {
    const state = stateAt(variant, 0, t);
    const speed = state && !state.ended ? Math.hypot(state.vx, state.vy) : 0;
    if (!(speed > 0.01 * fastest)) return;
    const scale = (this.narrow ? 64 : 110) / fastest;
    const [x, y] = [this.view.x(state.x), this.view.y(state.y)];
    const tip = { x: x + scale * state.vx, y: y - scale * state.vy };
    pen.setLineDash([4, 3]);
    for (const [name, toX, toY] of [["vx", tip.x, y], ["vy", x, tip.y]]) {
      pen.beginPath();
      pen.moveTo(x, y);
      pen.lineTo(toX, toY);
      pen.lineWidth = 2;
      pen.strokeStyle = this.colour(`velocity-${name}`);
      pen.stroke();
    }
    pen.setLineDash([]);
    const length = Math.hypot(tip.x - x, tip.y - y);
    const [ux, uy] = [(tip.x - x) / length, (tip.y - y) / length];
    pen.strokeStyle = pen.fillStyle = this.colour("ink");
    pen.lineWidth = 2.2;
    pen.beginPath();
    pen.moveTo(x, y);
    pen.lineTo(tip.x - 6 * ux, tip.y - 6 * uy);
    pen.stroke();
    pen.beginPath();
    pen.moveTo(tip.x, tip.y);
    pen.lineTo(tip.x - 9 * ux - 4 * uy, tip.y - 9 * uy + 4 * ux);
    pen.lineTo(tip.x - 9 * ux + 4 * uy, tip.y - 9 * uy - 4 * ux);
    pen.closePath();
    pen.fill();
    this.write(pen, `${brief(speed, 3)} m/s`, tip.x + 8, tip.y - this.text / 2);
  }
}
