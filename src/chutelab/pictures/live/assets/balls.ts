// Particles: shaded balls in the colour of their material, or flat discs by kind or by speed.

import type { Lab } from "./lab.ts";

export type Hue = "material" | "kind" | "speed";

/** Light, middle and dark of a ball, by material; what is of none has that of its stream. */
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

/** The same for streams without a material, which are of the colours of `--kind-N`. */
const STREAMS: [string, string, string][] = [
  ["#ffb595", "#d4582f", "#7b2a10"], ["#ffe09a", "#e69f00", "#8a5c00"],
  ["#c8e8fb", "#56b4e9", "#1f6c9c"], ["#f0d0e2", "#cc79a7", "#7d3d61"],
  ["#a5e6d1", "#009e73", "#005740"],
];

/** Steps of colour of the speed. */
const STEPS = 8;

/** Pixels of radius below which a ball is a flat disc. */
const SHADED = 2.5;

/** Radius of the largest picture of a ball, px: larger ones are drawn by scaling it; and how many
 * pictures are kept. */
const LARGEST = 48, KEPT = 200;

class Balls {
  hue: Hue = "material";
  pictures: Map<string, HTMLCanvasElement> = new Map();
  /** m/s that has the last colour. */
  fastest = 1;

  constructor(readonly lab: Lab, readonly colour: (name: string) => string) {}

  /** Whether a material has shades of its own. */
  isShaded = (material: string) => material in SHADES;

  /** What names a particle's shades: its material, or the number of its stream. */
  kindOf(i: number): string {
    const { scene, machine } = this.lab, release = machine?.releases[i];
    const material = this.hue === "kind" ? "" : scene?.particles[release?.kind ?? 0]?.material ?? "";
    return SHADES[material] ? material : String((release?.stream ?? 0) % STREAMS.length);
  }

  /** The step of a speed, m/s. */
  step(speed: number) {
    return Math.max(0, Math.min(STEPS - 1, Math.floor((STEPS * speed) / this.fastest)));
  }

  /** Paint one at a place, px. @param speed m/s */
  paint(
    context: CanvasRenderingContext2D, i: number, x: number, y: number, r: number, speed: number,
  ) {
    if (this.hue === "speed" || r < SHADED) {
      const shades = SHADES[this.kindOf(i)] ?? STREAMS[Number(this.kindOf(i))];
      context.fillStyle = this.hue === "speed" ? this.colour(`v${this.step(speed)}`) : shades[1];
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

  /** A shaded ball, made once for each radius, px: to draw a large one small takes long. */
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

  /** A round speed, m/s, that few particles of the run exceed. */
  measure() {
    let most = 0;
    for (const { before } of this.lab.recording?.events.slice(0, 2000) ?? []) {
      most = Math.max(most, Math.hypot(before[0], before[1]));
    }
    const ten = 10 ** Math.floor(Math.log10(Math.max(most, 1e-3)));
    this.fastest = ten * ([1, 2, 5, 10].find((n) => n * ten >= most) ?? 10);
  }
}

export { Balls };
