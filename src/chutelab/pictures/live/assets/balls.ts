// Particles: shaded balls in the colour of their material, or flat discs coloured by kind or speed.

import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Point } from "./scene.ts";

export type Hue = "material" | "kind" | "speed" | "size";

/** Light, middle and dark colour of a ball, by material; without one it has its stream's colour. */
const SHADES: Record<string, [string, string, string]> = {
  steel: ["#ffffff", "#c3ccd3", "#59656f"],
  rubber: ["#f3a08a", "#c4432a", "#6d1f10"],
  gravel: ["#e3dfda", "#9b948c", "#57514b"],
  limestone: ["#fbf8f0", "#d3cab6", "#85795f"],
  sand: ["#fff3cf", "#e0b860", "#94702a"],
  coal: ["#8a8f96", "#3f444b", "#15181c"],
  "iron-ore": ["#e0a08c", "#98503c", "#4f2519"],
  wheat: ["#fdeab5", "#d9ab4a", "#8a6420"],
  wood: ["#f3d7ad", "#c58f4e", "#7a5122"],
  polyethylene: ["#ffffff", "#d5dfe6", "#8797a5"],
  glass: ["#ffffff", "#9fd6e6", "#2f7f98"],
  ice: ["#ffffff", "#cfeaf6", "#6fa9c6"],
};

/** The same for streams without a material, with the colours of `--kind-N`. */
const STREAMS: [string, string, string][] = [
  ["#ffb595", "#d4582f", "#7b2a10"], ["#ffe09a", "#e69f00", "#8a5c00"],
  ["#c8e8fb", "#56b4e9", "#1f6c9c"], ["#f0d0e2", "#cc79a7", "#7d3d61"],
  ["#a5e6d1", "#009e73", "#005740"],
];

/** Steps of colour of a speed or a size. */
const STEPS = 8;

/** For the range of speeds of a run: particles and times that are sampled, the quantile of speeds
 * at the end of the colours, and the factor by which a run must become longer to be sampled again.
 */
const SOME = 100, TIMES = 24, MOST = 0.98, LONGER = 1.2;

/** Pixels of radius below which a ball is a flat disc. */
const SHADED = 2.5;

/** Radius of the largest picture of a ball, px: larger ones are drawn by scaling it; and how many
 * pictures are kept. */
const LARGEST = 48, KEPT = 200;

class Balls {
  hue: Hue = "material";
  pictures: Map<string, HTMLCanvasElement> = new Map();
  /** Beginning of the first colour and end of the last one, and their unit: m/s, or mm of radius.
   */
  range: [number, number] = [0, 1];
  unit = "m/s";

  constructor(readonly lab: Lab, readonly colour: (name: string) => string) {}

  /** Whether a material has its own shades. */
  isShaded = (material: string) => material in SHADES;

  /** Name of a particle's shades: its material, or the number of its stream. */
  kindOf(i: number): string {
    const { scene, machine } = this.lab, release = machine?.releases[i];
    const material = this.hue === "kind" ? "" : scene?.particles[release?.kind ?? 0]?.material ?? "";
    return SHADES[material] ? material : String((release?.stream ?? 0) % STREAMS.length);
  }

  /** Light, middle and dark of a particle. */
  shades(i: number) {
    const kind = this.kindOf(i);
    return SHADES[kind] ?? STREAMS[Number(kind)];
  }

  /** The step of a speed, m/s, or of a radius, mm. */
  step(value: number) {
    const [low, high] = this.range;
    return Math.max(0, Math.min(STEPS - 1, Math.floor((STEPS * (value - low)) / (high - low))));
  }

  /** Paint a particle at a place, px. @param speed m/s */
  paint(
    context: CanvasRenderingContext2D, i: number, x: number, y: number, r: number, speed: number,
  ) {
    const ramp = this.hue === "speed" || this.hue === "size";
    if (ramp || r < SHADED) {
      const value = this.hue === "speed" ? speed : 1e3 * (this.lab.machine?.radius[i] ?? 0);
      context.fillStyle = ramp ? this.colour(`v${this.step(value)}`) : this.shades(i)[1];
      context.beginPath();
      context.arc(x, y, r, 0, 2 * Math.PI);
      context.fill();
      if (r < SHADED) return;
      context.lineWidth = Math.min(1, 0.2 * r);
      context.strokeStyle = this.colour("ring");
      context.stroke();
      return;
    }
    const size = Math.min(LARGEST, Math.ceil(r * (globalThis.devicePixelRatio || 1)));
    const picture = this.picture(this.kindOf(i), size), wide = (r * picture.width) / (2 * size);
    context.drawImage(picture, x - wide, y - wide, 2 * wide, 2 * wide);
  }

  /** Paint a box or polygon by its corners, px, with the same direction of light as balls. */
  paintCorners(
    context: CanvasRenderingContext2D, i: number, corners: Point[], r: number, speed: number,
  ) {
    const ramp = this.hue === "speed" || this.hue === "size";
    const value = this.hue === "speed" ? speed : 1e3 * (this.lab.machine?.radius[i] ?? 0);
    const [light, middle, dark] = this.shades(i), [x, y] = [0, 1].map((n) =>
      corners.reduce((sum, corner) => sum + corner[n], 0) / corners.length);
    let fill: string | CanvasGradient = ramp ? this.colour(`v${this.step(value)}`) : middle;
    if (!ramp && r >= SHADED) {
      fill = context.createLinearGradient(x - 0.6 * r, y - 0.8 * r, x + 0.6 * r, y + 0.8 * r);
      fill.addColorStop(0, light);
      fill.addColorStop(0.45, middle);
      fill.addColorStop(1, dark);
    }
    context.fillStyle = fill;
    context.beginPath();
    for (const corner of corners) context.lineTo(...corner);
    context.closePath();
    context.fill();
    if (r < SHADED) return;
    context.lineWidth = Math.min(1, 0.2 * r);
    context.strokeStyle = ramp ? this.colour("ring") : dark;
    context.stroke();
  }

  /** A shaded ball, made once for each radius, px, as drawing a large one small takes long. */
  picture(kind: string, size = LARGEST) {
    const name = `${kind} ${size}`, known = this.pictures.get(name);
    if (known) return known;
    if (this.pictures.size > KEPT) this.pictures.clear();
    const canvas = document.createElement("canvas"), half = size + 1;
    canvas.width = canvas.height = 2 * half;
    const context = canvas.getContext("2d") as CanvasRenderingContext2D;
    const [light, middle, dark] = SHADES[kind] ?? STREAMS[Number(kind)];
    const shade = context.createRadialGradient(half - 0.32 * size, half - 0.4 * size, 0,
      half - 0.32 * size, half - 0.4 * size, 1.6 * size);
    shade.addColorStop(0, light);
    shade.addColorStop(0.38, middle);
    shade.addColorStop(1, dark);
    context.fillStyle = shade;
    context.beginPath();
    context.arc(half, half, size, 0, 2 * Math.PI);
    context.fill();
    this.pictures.set(name, canvas);
    return canvas;
  }

  /** The run whose speeds were sampled, and the time of the next sample, s. */
  known = { recording: null as Recording | null, now: 0, again: 0 };

  /** Set the range of the colours: up to a round speed that few particles exceed, and only for a
   * short time, or from the smallest particle to the largest. */
  measure() {
    const { recording, machine } = this.lab;
    if (this.hue === "size" && machine) {
      const low = machine.radius.reduce((least, r) => Math.min(least, 1e3 * r), Infinity);
      this.range = [low, machine.radius.reduce((most, r) => Math.max(most, 1e3 * r), 0)];
      this.unit = "mm";
      this.known.recording = null;
    }
    if (this.hue !== "speed" || !recording || !isFinite(recording.begin)) return;
    const { tracks, begin, state } = recording;
    const now = recording.machine.interact && state === "running" ? recording.now : recording.end, { known } = this;
    if (known.recording === recording && now >= known.now && now < known.again) return;
    this.known = { recording, now, again: begin + LONGER * (now - begin) };
    const every = Math.ceil(tracks.length / SOME), speeds: number[] = [];
    for (let i = 0; i < tracks.length; i += every) {
      for (let n = 1; n <= TIMES; n += 1) {
        const its = tracks[i].state(begin + ((now - begin) * n) / TIMES);
        if (its && !its.ended) speeds.push(Math.hypot(its.vx, its.vy));
      }
    }
    speeds.sort((a, b) => a - b);
    const most = Math.max(1e-3, speeds[Math.ceil(MOST * (speeds.length - 1))] ?? 0);
    const ten = 10 ** Math.floor(Math.log10(most));
    this.range = [0, ten * ([1, 2, 5, 10].find((n) => n * ten >= most) ?? 10)];
    this.unit = "m/s";
  }

  /** Whether the particles differ in size. */
  get hasSizes() {
    const [first, ...more] = this.lab.machine?.radius ?? [];
    return more.some((radius) => radius !== first);
  }
}

export { Balls, STEPS };
