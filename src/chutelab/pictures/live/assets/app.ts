// A page without steps: the sandbox of a scene.

import { Callout } from "./callout.ts";
import { Menu } from "./menu.ts";
import { Flow, SensorsPanel } from "./flow.ts";
import { start } from "./page.ts";
import { Palette } from "./palette.ts";
import { html } from "./panels.ts";
import { Phone } from "./phone.ts";
import { Prediction } from "./predict.ts";
import { Tools } from "./tools.ts";

/** A button for the page's other language; the page opens there in its present state. */
function language({ other }: any) {
  if (!other || !/^(https?|file):$/.test(location.protocol)) return;
  const name = LANGUAGES[other.language], asked = other.language;
  document.getElementById("keys")?.before(html("button", {
    class: "ib", id: "language", lang: asked, title: name, "aria-label": name,
    click: () => location.assign(`?lang=${asked}${location.hash}`),
  }, html("b", { "aria-hidden": "true" }, asked.toUpperCase())));
}

const LANGUAGES: Record<string, string> = { de: "Deutsch", en: "English" };

start(({ lab, stage, words, bench, inspector, symbols }) => {
  language(lab.data);
  const panels = document.getElementById("panels") as Element;
  const sensors = new SensorsPanel(panels, lab, words);
  const tools = new Tools(lab, stage, words, new Flow(panels, lab, words));
  new Callout(inspector, stage, lab, symbols);
  const home = stage.home.parentElement as HTMLElement;
  new Menu(lab, stage, words, bench.free);
  const palette = bench.free ? new Palette(home, bench, stage, lab, words) : null;
  new Phone(bench, palette, words);
  if (lab.data.live?.predict) new Prediction(stage, lab, words);
  const head = () => {
    const heading = document.querySelector("h1") as HTMLElement, { title } = lab.scene ?? {};
    const said = words.title(title ?? "");
    if (said && heading.textContent !== said) document.title = heading.textContent = said;
  };
  lab.on("scene", head);
  // The address may already have given another scene.
  head();
  return { palette, sensors, tools };
});
