// A page without steps: what it makes of a scene.

import { Callout } from "./callout.ts";
import { start } from "./page.ts";
import { Palette } from "./palette.ts";
import { Phone } from "./phone.ts";
import { Prediction } from "./predict.ts";

start(({ lab, stage, words, bench, inspector, symbols }) => {
  new Callout(inspector, stage, lab, symbols);
  const home = stage.home.parentElement as HTMLElement;
  const palette = bench.free ? new Palette(home, bench, stage, lab, words) : null;
  new Phone(bench, palette, words);
  if (lab.data.live?.predict) new Prediction(stage, lab, words);
  lab.on("scene", () => {
    const heading = document.querySelector("h1") as HTMLElement, { title } = lab.scene ?? {};
    if (title && heading.textContent !== title) heading.textContent = title;
  });
  return { palette };
});
