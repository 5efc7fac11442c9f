// The picture as an image, and as a video: surfaces and tracks, particles, tools.

import { download, fileStem } from "./share.ts";
import type { Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** The parts of the page's style that a separate picture needs. */
const KEPT = ["fill", "stroke", "stroke-width", "stroke-linecap", "stroke-dasharray", "opacity",
  "font-family", "font-size", "font-style", "paint-order", "text-anchor", "dominant-baseline",
  "display", "stop-color", "stroke-linejoin", "font-weight"];

/** Pixels of a saved picture for each of the page's. */
const DENSE = 2;

/** Frames of a video in a second, and bits in a second. */
const FRAMES = 30, BITS = 6e6;

/** Time that the end is shown, ms; otherwise a slow encoder would lose the last frames. */
const TAIL = 400;

/** Formats that browsers write, the best first. */
const TYPES = ["video/webm;codecs=vp9", "video/webm;codecs=vp8", "video/webm", "video/mp4"];

type Layers = [HTMLImageElement, HTMLImageElement];

class Film {
  button = document.getElementById("film") as HTMLButtonElement;
  recorder: MediaRecorder | null = null;
  /** Cached layers below and above the particles. */
  layers: Layers | null = null;
  canvas = document.createElement("canvas");

  constructor(readonly lab: Lab, readonly stage: Stage, readonly words: Words) {
    this.button.addEventListener("click", () => (this.recorder ? this.stop() : this.start()));
    lab.on("play", () => { if (this.recorder && lab.isOver) this.stop(); });
    this.name();
  }

  name() {
    const name = this.words.say(this.recorder ? "film-stop" : "film-start");
    this.button.title = name;
    this.button.setAttribute("aria-label", name);
    this.button.setAttribute("aria-pressed", String(Boolean(this.recorder)));
  }

  /** Play, and record the picture until the run is over or the button is pressed again. */
  async start() {
    const { lab, stage, canvas } = this;
    const mimeType = TYPES.find((type) => globalThis.MediaRecorder?.isTypeSupported(type));
    if (!mimeType) {
      this.button.title = this.words.say("film-none");
      return;
    }
    // Codecs want even numbers of pixels.
    const { width, height } = stage.view, scale = Math.max(1, 1280 / width);
    canvas.width = 2 * Math.round(0.5 * scale * width);
    canvas.height = 2 * Math.round(0.5 * scale * height);
    const layers = await layersOf(stage), parts: Blob[] = [];
    this.layers = layers;
    this.frame();
    const recorder = new MediaRecorder(canvas.captureStream(FRAMES),
      { mimeType, videoBitsPerSecond: BITS });
    recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
    recorder.addEventListener("stop", () => {
      const ending = mimeType.slice(6, mimeType.includes(";") ? mimeType.indexOf(";") : undefined);
      download(`${fileStem(lab.scene?.title ?? "")}.${ending}`, new Blob(parts, { type: mimeType }),
        mimeType);
    });
    this.recorder = recorder;
    recorder.start();
    this.name();
    if (!lab.playing) lab.play();
    this.renew();
    const draw = () => {
      if (!this.recorder) return;
      this.frame();
      requestAnimationFrame(draw);
    };
    draw();
  }

  stop() {
    const { recorder } = this;
    this.recorder = null;
    this.name();
    const until = performance.now() + TAIL;
    const hold = () => {
      this.frame();
      if (performance.now() < until) requestAnimationFrame(hold);
      else recorder?.stop();
    };
    hold();
  }

  frame() {
    if (this.layers) compose(this.canvas, this.stage, this.layers);
  }

  /** Draw belts and labels again as often as time allows. */
  async renew() {
    while (this.recorder) {
      this.layers = await layersOf(this.stage);
      await new Promise(requestAnimationFrame);
    }
  }
}

/** The layers below and above the particles. */
async function layersOf(stage: Stage): Promise<Layers> {
  const { width, height } = stage.view;
  return [await drawnSvg(stage.back, stage.back, width, height),
    await drawnSvg(stage.front, stage.over, width, height)];
}

/** Draw everything visible on the stage over a whole canvas. */
function compose(canvas: HTMLCanvasElement, stage: Stage, [below, above]: Layers) {
  const context = canvas.getContext("2d") as CanvasRenderingContext2D;
  context.fillStyle = stage.colour("stage");
  context.fillRect(0, 0, canvas.width, canvas.height);
  for (const layer of [below, stage.canvas, above]) {
    context.drawImage(layer, 0, 0, canvas.width, canvas.height);
  }
}

async function pictureOf(stage: Stage) {
  const canvas = document.createElement("canvas");
  canvas.width = DENSE * stage.view.width;
  canvas.height = DENSE * stage.view.height;
  compose(canvas, stage, await layersOf(stage));
  return canvas;
}

/** A part of an SVG as an image, with the style it has on the page. */
async function drawnSvg(
  whole: any, part: any, width: number, height: number,
): Promise<HTMLImageElement> {
  const root = whole.cloneNode(false), copy = part.cloneNode(true);
  const [from, to] = [part, copy].map((one) => [one, ...one.querySelectorAll("*")]);
  from.forEach((element: Element, n: number) => {
    const style = getComputedStyle(element);
    for (const name of KEPT) to[n].setAttribute(name, style.getPropertyValue(name));
  });
  root.append(...(part === whole ? copy.childNodes : [copy]));
  for (const [name, value] of Object.entries({ width, height })) root.setAttribute(name, value);
  const image = new Image();
  const text = new XMLSerializer().serializeToString(root);
  image.src = `data:image/svg+xml,${encodeURIComponent(text)}`;
  await image.decode();
  return image;
}

export { Film, pictureOf };
