// The sound of impacts: taps, louder for a larger impulse, higher for smaller particles.

import type { Lab } from "./lab.ts";
import type { Words } from "./words.ts";

/** Most taps per second. */
const MOST = 20;

/** Time in which a tap fades, s; its pitch, Hz, for a particle of this radius, m. */
const FADE = 0.09, PITCH = 900, SIZE = 0.01;

/** First and last kind of event that makes a sound, from the core's enum Kind. */
const IMPACT = 3, COLLISION = 5;

class Sound {
  context: AudioContext | null = null;
  button = document.getElementById("sound") as HTMLButtonElement;
  /** Blows in the order of time, number of events read, and time up to which blows were heard, s.
   */
  blows: { t: number, impulse: number, radius: number }[] = [];
  seen = 0;
  since = 0;
  /** The strongest blow so far, N s. */
  loudest = 0;
  /** Time of the last tap on the clock of the sound, s. */
  last = -Infinity;

  constructor(readonly lab: Lab, readonly words: Words) {
    this.button.addEventListener("click", () => this.toggle());
    lab.on("scene", () => { this.seen = this.blows.length = this.loudest = 0; });
    lab.on("time", () => this.listen());
    this.name();
  }

  get on() {
    return this.button.getAttribute("aria-pressed") === "true";
  }

  toggle() {
    this.button.setAttribute("aria-pressed", String(!this.on));
    // Browsers allow sound only after the user has pressed something.
    this.context ??= new AudioContext();
    this.context.resume();
    this.since = this.lab.t;
    this.name();
  }

  name() {
    const name = this.words.say(this.on ? "sound-off" : "sound-on");
    this.button.title = name;
    this.button.setAttribute("aria-label", name);
    this.button.querySelector("use")?.setAttribute("href", this.on ? "#i-sound" : "#i-mute");
  }

  /** Read the blows that the run has added. */
  read() {
    const { recording, machine } = this.lab;
    if (!recording || !machine) return;
    const more = recording.events.slice(this.seen);
    this.seen = recording.events.length;
    for (const { kind, t, disk, before, after } of more) {
      if (kind < IMPACT || kind > COLLISION) continue;
      const speed = Math.hypot(after[0] - before[0], after[1] - before[1]);
      const impulse = machine.mass[disk] * speed;
      this.loudest = Math.max(this.loudest, impulse);
      this.blows.push({ t, impulse, radius: machine.radius[disk] || SIZE });
    }
    if (more.length) this.blows.sort((a, b) => a.t - b.t);
  }

  /** Tap for the strongest blow since the last frame, while the run is played. */
  listen() {
    const { lab: { t, playing }, since } = this;
    this.since = t;
    if (!this.on || !playing || t <= since) return;
    this.read();
    const now = this.blows.filter((blow) => blow.t > since && blow.t <= t);
    const strongest = now.reduce((most, one) => (one.impulse > most.impulse ? one : most),
      { impulse: 0, radius: SIZE });
    if (strongest.impulse > 0) this.tap(strongest);
  }

  tap({ impulse, radius }: { impulse: number, radius: number }) {
    const context = this.context as AudioContext, now = context.currentTime;
    if (now - this.last < 1 / MOST) return;
    this.last = now;
    // The ear hears the logarithm: a blow of a hundredth of the strongest is silent.
    const loud = Math.max(0, 1 + Math.log10(impulse / this.loudest) / 2);
    if (!loud) return;
    const gain = new GainNode(context, { gain: 0.3 * loud });
    gain.gain.exponentialRampToValueAtTime(1e-3, now + FADE);
    const frequency = Math.min(2400, Math.max(200, PITCH * Math.sqrt(SIZE / radius)));
    const tone = new OscillatorNode(context, { type: "triangle", frequency });
    tone.connect(gain).connect(context.destination);
    tone.start(now);
    tone.stop(now + FADE);
  }
}

export { Sound };
