// What the panels and tools of the page work out, without a screen: a JSON question on stdin, the
// answers on stdout.
import { readFileSync } from "node:fs";

import { core, load, machineOf, recordingOf } from "./run.mjs";

const { bytesOf } = await load("core.js");
const { groundedLedger, stacks } = await load("energy.js");
const { Arrivals } = await load("arrival.js");
const { crowdOf } = await load("crowd.js");
const { judge, runOf: judged } = await load("breaches.js");
const { SAID } = await load("breaches.js");
const { numbersOf } = await load("numbers.js");
const { RunHistory } = await load("stages.js");
const { histogram, runningMean } = await load("landing.js");
const { samplesOf } = await load("curves.js");
const { contactForce } = await load("arrows.js");
const { ticks } = await load("chart.js");
const { placed, spaceOf } = await load("symbols.js");
const { StopWatch, angleBetween, nearestOn } = await load("tools.js");

function lawsOf(recording) {
  return judge(core, judged(recording)).map(({ law, surface, particle, t }) =>
    ({ law: SAID[law], name: recording.machine.surfaces[surface], particle, t }));
}

// What a run may not do, each done to a sound one.
const T = 0, Y = 2, VX = 3, FRICTION = 8;
const FAULTS = {
  none: () => {},
  "law-finite": ({ set, last }) => set(last, VX, NaN),
  "law-inside": ({ set, touch, radius }) => set(touch, Y, (y) => y - 0.2 * radius),
  "law-through": ({ set, touch, last, radius }) => {
    for (let n = touch + 1; n <= last; n += 1) set(n, Y, (y) => y - 4 * radius);
  },
  "law-energy": ({ recording, set, last }) => {
    if (recording.machine.interact) recording.gained = 1e-3;
    else set(last, VX, (vx) => 1.1 * vx + 0.1);
  },
  "law-losses": ({ set, last }) => set(last, FRICTION, -1),
  // It goes on where another one is.
  "law-apart": ({ recording, set, last, beside }) => {
    const there = recording.tracks[beside];
    set(last, 1, there.at(there.count - 1, 1) + 1e-3);
    set(last, Y, there.at(there.count - 1, Y));
  },
  "law-solved": ({ recording }) => { recording.unsolved = 0.11; },
  "law-ledger": ({ set, last }) => set(last, VX, (vx) => 1.1 * vx + 0.1),
};

function faultyOf({ scene, fault }) {
  const recording = recordingOf(built(scene));
  const event = recording.events.find(({ kind }) => kind === 4), { disk } = event;
  const track = recording.tracks[disk], radius = recording.machine.radius[disk];
  const set = (knot, column, value) => {
    const at = knot * 11 + column;
    track.rows[at] = typeof value === "function" ? value(track.rows[at]) : value;
  };
  const touch = Array.from({ length: track.count }, (_, n) => n)
    .find((n) => track.at(n, T) >= event.t);
  const ends = recording.tracks.map((one) => one.at(one.count - 1, T));
  const beside = ends.findIndex((t, i) => i !== disk && Math.abs(t - ends[disk]) < 0.05);
  FAULTS[fault]({ recording, set, touch, last: track.count - 1, radius, beside });
  return { laws: lawsOf(recording), disk, at: event.t };
}

function runOf(scene) {
  const machine = built(scene);
  const recording = recordingOf(machine), { begin, end } = recording;
  const history = new RunHistory(recording, "plate"), { stages, landings, arrivals } = history;
  const times = Array.from({ length: 400 }, (_, n) => begin + ((end - begin) * n) / 399);
  for (const { t } of recording.events.slice(0, 400)) times.push(t - 1e-9, t, t + 1e-9);
  const track = recording.tracks[0];
  return {
    numbers: numbersOf(stages, {}, machine.pulley?.radius ?? null, machine.radius),
    crowd: crowdOf(recording, arrivals, landings.length),
    arrivals: arrivals.found,
    envelopes: history.envelopes,
    laws: lawsOf(recording),
    points: recording.points(0, 1e-4).map(({ x, y }) => [x, y]),
    landings: landings.map(({ t, x }) => [t, x]),
    ledger: recording.ledger(end),
    ledgers: times.map((t) => {
      const ledger = groundedLedger(recording, t);
      return { t, ...ledger, ...stacks(ledger) };
    }),
    samples: samplesOf(recording, 0),
    forces: times.map((t) => [t, ...contactForce(track, t, machine.mass[0], machine)]),
    nearest: [0.1, 0.37, 0.62, 0.9].map((part) => {
      const t = track.begin + part * (track.end - track.begin), { x, y } = track.state(t);
      return { asked: t, ...nearestOn(track, x, y) };
    }),
  };
}

function watchOf(acts) {
  const watch = new StopWatch();
  for (const [act, t] of acts) watch[act](t);
  return { reading: watch.reading(acts.at(-1)[1]), laps: watch.laps };
}

const revive = (_, value) => (["Infinity", "-Infinity"].includes(value) ? Number(value) : value);
const asked = JSON.parse(readFileSync(0, "utf8"), revive);
const built = (scene) => machineOf(scene, asked.lab);
process.stdout.write(JSON.stringify({
  runs: asked.scenes?.map(runOf),
  arrivals: asked.crowds?.map((scene) => new Arrivals(recordingOf(built(scene))).found),
  laws: asked.sound?.map((scene) => lawsOf(recordingOf(built(scene)))),
  faulty: asked.faulty?.map(faultyOf),
  histograms: asked.values?.map((values) => histogram(values)),
  means: asked.values?.map(runningMean),
  ticks: asked.ranges?.map(([low, high]) => ticks(low, high, 5)),
  labels: asked.labels?.map((labels) => placed(labels, []).map(spaceOf)),
  angles: asked.angles?.map((points) => angleBetween(...points)),
  watches: asked.watches?.map(watchOf),
  packed: asked.packed?.map((text) => [...bytesOf(text)]),
}));
