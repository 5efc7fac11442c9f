// What has happened to each particle: kept up to date as the events of a run arrive.

import { Arrivals } from "./arrival.ts";
import { FEWEST, countUntil } from "./crowd.ts";
import { envelopesOf, type Envelope } from "./envelope.ts";
import type { Event } from "./core.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Scene } from "./scene.ts";

/** Separation, impact, landing */
export type Stages = { left?: Event, hit?: Event, down?: Event };
/** Impulse, N s */
type Blow = { t: number, x: number, y: number, px: number, py: number };

const STAGE = { separation: 1, impact: 3, landing: 4, collision: 5 };

/** Factor by which a run must have grown before its envelopes are computed again. */
const LONGER = 1.2;

/** Returns the name of the plate to which the paper's numbers belong. */
const plateName = ({ plates }: Scene) => (plates[0]?.pivot && plates[0].name) || "plate";

class RunHistory {
  events;
  target;
  seen = 0;
  /** The first separation, impact on the damping plate and landing of each particle. */
  stages: Stages[];
  /** First landings in the order of time. */
  landings: Event[] = [];
  /** All impacts in the order of time. */
  blows: Blow[] = [];
  largestBlow = 0;
  arrivals;
  state;
  /** Time of the run after which envelopes are computed again, s. */
  enveloped = -Infinity;

  /** @param plate name of the plate for `hit` */
  constructor(readonly recording: Recording, plate: string) {
    this.events = recording.events;
    this.target = recording.machine.surfaces.indexOf(plate);
    this.stages = recording.machine.releases.map(() => ({}));
    this.arrivals = new Arrivals(recording);
    this.state = recording.state;
    this.update();
  }

  /** Returns whether this is the history of this run, and the run has not been reset since. */
  isOf(recording: Recording) {
    return this.recording === recording && this.events === recording.events
      && this.stages.length === recording.machine.releases.length;
  }

  /** The envelopes of the streams in the run so far. */
  get envelopes() {
    const { recording, arrivals } = this, { now, begin, state } = recording;
    const t = state === "running" ? now : Infinity;
    const released = recording.tracks.filter(({ count }) => count).length;
    if (released >= FEWEST && t > this.enveloped) {
      this.enveloped = begin + LONGER * (t - begin);
      this.paths = envelopesOf(recording, arrivals.found);
    }
    return this.paths;
  }

  paths: Envelope[] = [];

  /** Read new events. */
  update() {
    const { events, recording } = this, begin = this.seen;
    // When the run ends, search all of it again, as Python does.
    if (recording.state === this.state) this.arrivals.update();
    else this.arrivals = new Arrivals(recording);
    this.state = recording.state;
    for (; this.seen < events.length; this.seen += 1) this.add(events[this.seen]);
    if (begin === this.seen) return;
    // Particles that do not meet are run one after another, so events are not in order.
    this.landings.sort((a, b) => a.t - b.t);
    this.blows.sort((a, b) => a.t - b.t);
  }

  add(event: Event) {
    const { kind, disk, before, after, t, x, y } = event, its = this.stages[disk];
    if ([STAGE.impact, STAGE.landing, STAGE.collision].includes(kind)) {
      const mass = this.recording.machine.mass[disk];
      const px = mass * (after[0] - before[0]), py = mass * (after[1] - before[1]);
      this.blows.push({ t, x, y, px, py });
      this.largestBlow = Math.max(this.largestBlow, Math.hypot(px, py));
    }
    if (kind === STAGE.separation) its.left ??= event;
    else if (kind === STAGE.impact && event.surface === this.target) its.hit ??= event;
    else if (kind === STAGE.landing && !its.down) {
      its.down = event;
      this.landings.push(event);
    }
  }

  /** Returns impacts after one time, up to another. @param to s */
  blowsBetween = (from: number, to: number) =>
    this.blows.slice(countUntil(this.blows, from), countUntil(this.blows, to));
}

let latest: RunHistory | undefined;

/** Returns the up-to-date history of a lab's run, shared by all that show it. */
function historyOf({ recording, scene }: Lab) {
  if (!recording || !scene) return null;
  if (latest?.isOf(recording)) latest.update();
  else latest = new RunHistory(recording, plateName(scene));
  return latest;
}

export { RunHistory, historyOf };
