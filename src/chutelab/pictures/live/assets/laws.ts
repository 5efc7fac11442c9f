// The line that says which law a run broke, as the core finds it once the run is over.

import type { Breach } from "./breaches.ts";
import type { Lab } from "./lab.ts";
import type { Recording } from "./recording.ts";
import type { Words } from "./words.ts";

/** What is said of each law, in the order of the core's enum Law. */
const SAID = ["law-finite", "law-through", "law-inside", "law-energy", "law-losses", "law-ledger"];

/** The line below the picture that says which law is broken. */
function watchLaws(line: HTMLElement, lab: Lab, words: Words) {
  lab.on("run", () => {
    const { recording } = lab, first = recording?.breaches[0];
    line.hidden = !first;
    line.textContent = recording && first ? lawSaid(first, recording, words) : "";
  });
}

function lawSaid(broken: Breach, { machine }: Recording, words: Words) {
  const { law, surface, particle, t, x, y } = broken;
  const where = {
    name: words.name(machine.surfaces[surface] ?? ""), particle, t: words.number(t),
    x: words.number(x), y: words.number(y),
  };
  // What one particle has got unexplained is no solver's doing.
  const said = SAID[law] === "law-energy" && particle >= 0 ? "law-ledger" : SAID[law];
  return words.say("law-broken", { what: words.say(said, where) });
}

export { SAID, watchLaws };
