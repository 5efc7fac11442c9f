// Play, pause, step, time slider and speed; undo and redo.

import { Marks } from "./marks.ts";
import { slide, style } from "./panels.ts";
import { RATES, type Lab } from "./lab.ts";
import type { Stage } from "./stage.ts";
import type { Words } from "./words.ts";

/** Positions of the time slider. */
const PLACES = 1000;

/** Longest frame that counts, s: after it was hidden, a page goes on where it was. */
const LONGEST = 0.1;

/** Time over which the pace is measured, s; below this share of the wanted pace it is slow. */
const GAUGED = 2, SLOW = 0.95;

/** Time without pointer or key after which projector mode shows the picture alone, ms. */
const ASLEEP = 3000;

class Transport {
  playButton;
  time;
  clock;
  rate;
  undoButton;
  redoButton;
  fault;
  then;
  slow;
  why;
  marks;

  constructor(readonly lab: Lab, stage: Stage, readonly words: Words) {
    const element = (id: string) => document.getElementById(id) as any;
    this.playButton = element("play");
    this.time = element("time");
    this.clock = element("clock");
    this.rate = element("rate");
    const buttons: Record<string, () => void> = {
      restart: () => lab.restart(),
      back: () => this.step(-1),
      play: () => (lab.playing ? lab.pause() : lab.play()),
      forward: () => this.step(1),
      undo: () => lab.undo(),
      redo: () => lab.redo(),
      reset: () => lab.reset(),
      fit: () => stage.fit(),
      full: () => project(),
    };
    for (const [id, act] of Object.entries(buttons)) {
      const button = element(id);
      button.title = words.say(id);
      button.setAttribute("aria-label", words.say(id));
      button.addEventListener("click", act);
    }
    for (const rate of RATES) {
      const text = `${words.local(String(rate))}×`;
      this.rate.append(new Option(text, String(rate), rate === 1, rate === 1));
    }
    this.rate.addEventListener("change", () => { lab.rate = Number(this.rate.value); });
    this.time.addEventListener("input", () => {
      // Read it first: a pause sets the slider back to the shown time.
      const share = Number(this.time.value) / PLACES;
      lab.pause();
      lab.seek(lab.start + (lab.horizon - lab.start) * share);
    });
    this.marks = new Marks(lab, stage, words);
    this.slow = element("slow");
    this.why = element("slow-why");
    this.why.textContent = words.say("slow-why");
    this.slow.addEventListener("click", () => this.explain(this.why.hidden));
    this.undoButton = element("undo");
    this.redoButton = element("redo");
    this.fault = element("fault");
    for (const news of ["scene", "run", "time", "play"] as const) {
      lab.on(news, () => this.refresh());
    }
    this.refresh();
    this.then = performance.now();
    requestAnimationFrame((now) => this.frame(now));
  }

  /** @param now ms */
  frame(now: number) {
    const { lab } = this, seconds = Math.min((now - this.then) / 1000, LONGEST), before = lab.t;
    lab.tick(seconds);
    this.gauge(seconds, lab.t - before);
    this.then = now;
    requestAnimationFrame((next) => this.frame(next));
  }

  /** Real and shown time of the last played frames, s. */
  frames: [number, number][] = [];

  /** Say so if the engine is slower than the wanted pace, averaged over two seconds. */
  gauge(seconds: number, shown: number) {
    const { lab, frames, slow, words } = this;
    if (!lab.playing) frames.length = 0;
    else frames.push([seconds, shown]);
    const total = (n: number) => frames.reduce((sum, frame) => sum + frame[n], 0);
    while (total(0) - (frames[0]?.[0] ?? 0) > GAUGED) frames.shift();
    const pace = total(1) / total(0), under = lab.recording?.state === "running";
    const isSlow = total(0) > 0.5 * GAUGED && under && pace < SLOW * Math.min(1, lab.rate);
    if (slow.hidden === isSlow) {
      slow.hidden = !isSlow;
      if (!isSlow) this.explain(false);
    }
    const said = isSlow ? words.say("slow", { pace: words.number(pace, 1) }) : "";
    if (slow.textContent !== said) slow.textContent = said;
  }

  explain(on: boolean) {
    this.slow.setAttribute("aria-expanded", String(on));
    this.why.hidden = !on;
  }

  /** Step by a sixtieth of a second at the chosen pace. */
  step(sign: number) {
    this.lab.pause();
    this.lab.seek(this.lab.t + (sign * this.lab.rate) / 60);
  }

  refresh() {
    const { lab, words } = this;
    const span = lab.horizon - lab.start, track = this.time.parentElement;
    // Mark the computed part of the slider until all is computed.
    const ready = span > 0 ? (lab.end - lab.start) / span : 1;
    track.classList.toggle("computing", ready < 1);
    style(track, "--ready", ready.toFixed(3));
    slide(this.time, span > 0 ? Math.round(((lab.t - lab.start) / span) * PLACES) : 0);
    const clock = `${words.fixed(lab.t, 3)} s`;
    this.clock.textContent = clock;
    // Screen readers read the time only while it stands still.
    if (!lab.playing) this.time.setAttribute("aria-valuetext", this.marks.saysNow || clock);
    this.playButton.classList.toggle("playing", lab.playing);
    const says = words.say(lab.playing ? "pause" : "play");
    if (this.playButton.ariaLabel !== says) this.playButton.ariaLabel = says;
    const { undoButton, redoButton } = this, { activeElement } = document;
    undoButton.disabled = !lab.past.length;
    redoButton.disabled = !lab.future.length;
    // A disabled button loses the focus: pass it on.
    if (undoButton.disabled && activeElement === undoButton) redoButton.focus();
    if (redoButton.disabled && activeElement === redoButton) undoButton.focus();
    this.fault.hidden = !lab.fault || lab.asked !== "" || document.body.matches(".dragging");
    if (lab.fault) this.fault.textContent = words.fault(lab.fault);
  }
}

/** Whether the energy card was open before projector mode. */
let wasOpen = false;

/** Switch projector mode (large, full screen) on or off. */
function project() {
  const { classList } = document.documentElement, on = classList.toggle("projector");
  document.getElementById("full")?.setAttribute("aria-pressed", String(on));
  if (on) wake();
  // An open energy card would hide a part of the machine on a small screen.
  const energy = document.getElementById("energy") as HTMLDetailsElement | null;
  if (energy) [wasOpen, energy.open] = [energy.open, !on && wasOpen];
  // If full screen is not allowed, the page is at least large.
  if (on) document.documentElement.requestFullscreen?.().catch(() => {});
  else if (document.fullscreenElement) document.exitFullscreen();
}

let sleep = 0;

/** Show the controls of projector mode for a while. */
function wake() {
  const { classList } = document.documentElement;
  classList.add("awake");
  clearTimeout(sleep);
  sleep = setTimeout(() => {
    if (!document.querySelector("#panels :focus, #views :focus-visible")) classList.remove("awake");
  }, ASLEEP);
}

for (const news of ["pointermove", "pointerdown", "keydown"]) {
  addEventListener(news, () => {
    if (document.documentElement.matches(".projector")) wake();
  });
}

export { Transport };
