// The base of every page: reads its data, starts the engine's thread, and joins the parts.

import { Bench } from "./bench.ts";
import { watchLaws } from "./breaches.ts";
import { Engine } from "./engine.ts";
import { Arrows } from "./arrows.ts";
import { CurvesPanel } from "./curves.ts";
import { FEWEST } from "./crowd.ts";
import { EnergyPanel } from "./energy.ts";
import { Film } from "./film.ts";
import { Inspector } from "./inspector.ts";
import { Keep } from "./keep.ts";
import { listenToKeys } from "./keyboard.ts";
import { toToml } from "./keys.ts";
import { Lab } from "./lab.ts";
import { LandingPanel } from "./landing.ts";
import { LoadsPanel } from "./loads.ts";
import { NumbersPanel } from "./numbers.ts";
import { startPlan } from "./plan.ts";
import { Show } from "./show.ts";
import { Sound } from "./sound.ts";
import { Stage } from "./stage.ts";
import { Symbols } from "./symbols.ts";
import { Transport } from "./transport.ts";
import { Words } from "./words.ts";
import type { Palette } from "./palette.ts";

type Parts = { lab: Lab, stage: Stage, words: Words, bench: Bench, inspector: Inspector,
  symbols: Symbols, newEngine: () => Engine };

const byId = (id: string): any => document.getElementById(id);

/** @param join adds the parts of only a sandbox, or only a lesson */
async function start(join: (parts: Parts) => { palette?: Palette | null, lesson?: object,
  sensors?: object, tools?: object }) {
  const { data, core, newThread, thread } = (globalThis as any).booted;
  const asked = new URLSearchParams(location.search).get("lang");
  if (asked && asked === data.other?.language) {
    const { language, strings } = data;
    Object.assign(data, data.other, { other: { language, strings } });
    document.documentElement.lang = asked;
  }
  const words = new Words(data.language, data.strings);
  for (const element of document.querySelectorAll("[data-say]")) {
    element.textContent = words.say((element as HTMLElement).dataset.say ?? "");
  }
  for (const element of document.querySelectorAll("[data-label]")) {
    const name = words.say(element.getAttribute("data-label") ?? "");
    element.setAttribute("aria-label", name);
    if (element.matches("button")) (element as HTMLElement).title = name;
  }
  const module = await core;
  if (!module) {
    byId("broken").remove();
    byId("fault").textContent = words.say("fault-no-engine");
    byId("fault").hidden = false;
    return;
  }
  await startPlan(module, data.layout);
  const newEngine = (own = newThread()) => new Engine(own, module, data.layout);
  const lab = new Lab(data, newEngine(thread));
  const stage = new Stage(byId("stage"), lab, words);
  // For a crowd its numbers and arrivals come first.
  const crowd = (lab.machine?.releases.length ?? 0) >= FEWEST && !data.lesson;
  const panels = (crowd ? [NumbersPanel, LandingPanel, EnergyPanel, CurvesPanel]
    : [EnergyPanel, NumbersPanel, LandingPanel, CurvesPanel])
    .map((Panel) => new Panel(byId("panels"), lab, words));
  watchLaws(byId("law"), lab, words);
  new Arrows(stage, words);
  const symbols = new Symbols(stage);
  const loads = data.lesson ? undefined : new LoadsPanel(byId("panels"), lab, stage, words);
  new Show(lab, stage, words, symbols, loads);
  const inspector = new Inspector(byId("panels"), lab, words);
  const bench = new Bench(byId("bench"), stage, inspector, lab, words);
  const { marks } = new Transport(lab, stage, words);
  new Sound(lab, words);
  new Film(lab, stage, words);
  new Keep(byId("panels"), stage, lab, words);
  const more = join({ lab, stage, words, bench, inspector, symbols, newEngine });
  for (const panel of document.querySelectorAll(
    "#panels > .card, #share, .tools, .looks, .watch")) {
    const name = panel.matches(".card, #share") ? panel.id : "tools";
    if (data.live?.panels && !data.live.panels.includes(name)) panel.classList.add("unwanted");
  }
  listenToKeys(bench, more.palette ?? null, marks, lab, words);
  Object.assign(globalThis, {
    chutelab: { lab, stage, bench, panels, loads, ...more, toml: () => toToml(lab.given as any) },
  });
  byId("broken").remove();
}

export { start };
