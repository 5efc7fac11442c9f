"""How fast the live page is, in Debian's headless chromium driven by Playwright.

python benchmarks/live_page.py

open   from asking for the file to the first picture of the run, ms, of five times, of a lone
       transfer and of a hopper
drag   the plate turned by its handle once a frame, a lone transfer: ms from the pointer's move to
       the track on the picture, and frames in a second
play   1 particle, and 300 and 1,000 that meet and are under way, and 1,000 that have come to lie,
       played in real time: frames in a second, and seconds of the run in one of the wall

Each line says how long the page's own thread computed for that, ms, which other programs lengthen
little, and ends with the limit that the page is to keep.
"""

import shutil
import tempfile
from pathlib import Path
from statistics import median

from playwright.sync_api import Page, sync_playwright

from chutelab.pictures.live import write
from chutelab.scene import Scene, from_dict, load

READY = """() => new Promise((resolve) => {
  const look = () => (globalThis.chutelab?.lab.recording.tracks[0].count > 0
    ? requestAnimationFrame(() => resolve(performance.now())) : setTimeout(look, 1));
  look();
})"""

DRAG = """async () => {
  const { lab, stage } = chutelab, delays = [], { view } = stage;
  const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const began = performance.now();
  stage.take("plate.angle_deg");
  for (let n = 0; n < 200; n += 1) {
    const { x, y } = stage.handles.find(({ id }) => id === "plate.angle_deg");
    const asked = performance.now();
    stage.dragTo([view.px(x) + (n % 100 < 50 ? 1 : -1), view.py(y)]);
    const { recording } = lab;
    while (!recording.drawn) await new Promise((resolve) => {
      const { port1, port2 } = new MessageChannel();
      port1.onmessage = resolve;
      recording.drawn = recording.state === "done" && !lab.waiting;
      port2.postMessage(0);
    });
    delays.push(performance.now() - asked);
    await frame();
  }
  stage.letGo();
  delays.sort((a, b) => a - b);
  return [delays[100], delays[190], 200 / ((performance.now() - began) / 1000)];
}"""

UNTIL = """async (t) => {
  const { lab } = chutelab;
  lab.play();
  while (lab.t < t) await new Promise((resolve) => requestAnimationFrame(resolve));
}"""

PLAY = """async (seconds) => {
  const { lab } = chutelab, frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const again = () => lab.playing || (lab.restart(), lab.play());
  const began = performance.now();
  let frames = 0, shown = 0, then = lab.t;
  while (performance.now() - began < 1000 * seconds) {
    again();
    await frame();
    frames += 1;
    shown += Math.max(0, lab.t - then);
    then = lab.t;
  }
  const took = (performance.now() - began) / 1000;
  const there = lab.recording.tracks.filter(({ count }) => count).length;
  return [frames / took, shown / took, there];
}"""


def crowd(count: int, speed: float = 0.5) -> Scene:
    """Return a box with so many particles, half full; on a floor that runs they never rest."""
    side = 0.011 * count**0.5
    return from_dict(
        {
            "title": f"{count} particles",
            "particle": {"radius": 0.004, "spin": True},
            "stream": {
                "count": count,
                "fill": [[-side, 0.0], [side, 2.0 * side]],
                "interact": True,
                "restitution": 0.6,
            },
            "surface": [
                {"name": "left", "from": [-side, 3.0 * side], "to": [-side, -0.01]},
                {"name": "floor", "from": [-side, -0.01], "to": [side, -0.01], "speed": speed},
                {"name": "right", "from": [side, -0.01], "to": [side, 3.0 * side]},
            ],
            "run": {"until": 30.0},
        }
    )


def opened(page: Page, scene: Scene, folder: Path) -> float:
    """Open the page of a scene; return ms to its first picture."""
    path = folder / "live.html"
    write(scene, path)
    page.goto(path.as_uri())
    return float(page.evaluate(READY))


def main() -> None:
    """Measure, and print a line for each figure."""
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as driver, tempfile.TemporaryDirectory() as made:
        browser = driver.chromium.launch(executable_path=chromium)
        page = browser.new_page(viewport={"width": 1366, "height": 768})
        session = page.context.new_cdp_session(page)
        session.send("Performance.enable", {"timeDomain": "threadTicks"})
        folder = Path(made)

        def busy() -> float:
            told = session.send("Performance.getMetrics")["metrics"]
            (spent,) = (one["value"] for one in told if one["name"] == "TaskDuration")
            return 1e3 * float(spent)

        for name, limit in (("perpendicular", 250), ("hopper", 300)):
            own, first = list[float](), list[float]()
            for _ in range(5):
                page.goto("about:blank")
                before = busy()
                first.append(opened(page, load(name), folder))
                own.append(busy() - before)
            said = f"{median(first):.0f} ms, at most {max(first):.0f} ms, own {median(own):.0f} ms"
            print(f"open   {name}: {said}; limit {limit} ms")
        opened(page, load("perpendicular"), folder)
        before = busy()
        half, most, rate = page.evaluate(DRAG)
        each = (busy() - before) / 200
        said = f"{half:.1f} ms, 95 % within {most:.1f} ms, {rate:.0f} frames/s, own {each:.1f} ms"
        print(f"drag   {said}; limit 16 ms")
        for scene, limit, begin in (
            (load("perpendicular"), 60, 0.3), (crowd(300), 60, 0.3), (crowd(1000), 30, 0.3),
            (crowd(1000, 0.0), 30, 4.0),
        ):  # fmt: skip
            opened(page, scene, folder)
            page.evaluate(UNTIL, begin)
            before = busy()
            rate, pace, there = page.evaluate(PLAY, 6.0)
            each = (busy() - before) / (6.0 * rate)
            said = f"{rate:.0f} frames/s, {pace:.2f} s in a second, own {each:.1f} ms a frame"
            lie = " that lie" if begin > 1.0 else ""
            print(f"play   {there}{lie}: {said}; limit {limit} frames/s, 0.5 s in a second")
        browser.close()


if __name__ == "__main__":
    main()
