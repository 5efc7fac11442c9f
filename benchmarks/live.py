"""How fast the live page is, in Debian's headless chromium driven by Playwright.

    python benchmarks/live.py

    open   from asking for the file to the first picture with a track, ms, of five times
    drag   the plate turned by its handle once a frame, a lone transfer: ms from the value to the
           track on the picture, and frames in a second
    crowd  300 and 1,000 particles that meet and are under way, played in real time: frames in a
           second, and seconds of the run in one of the wall
"""

import shutil
import tempfile
from pathlib import Path
from statistics import median

from playwright.sync_api import Page, sync_playwright

from chutelab.pictures.live.page import write
from chutelab.scene import Scene, from_dict, load

READY = """() => new Promise((resolve) => {
  const look = () => (globalThis.chutelab?.lab.recording.tracks[0].count > 0
    && document.querySelector(".track, canvas")
    ? requestAnimationFrame(() => resolve(performance.now())) : setTimeout(look, 1));
  look();
})"""

DRAG = """async () => {
  const { lab, stage } = chutelab, delays = [];
  const frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  const began = performance.now();
  for (let n = 0; n < 200; n += 1) {
    const handle = stage.handles.find(({ id }) => id === "plate.angle_deg");
    stage.take(handle.id);
    const asked = performance.now();
    stage.dragTo(0.6 + 0.002 * (n % 100), 0.4);
    await new Promise((resolve) => {
      const look = () => (lab.recording.state === "done" ? resolve() : channel.port2.postMessage(0));
      const channel = new MessageChannel();
      channel.port1.onmessage = look;
      look();
    });
    delays.push(performance.now() - asked);
    await frame();
  }
  stage.letGo();
  delays.sort((a, b) => a - b);
  return [delays[100], delays[190], 200 / ((performance.now() - began) / 1000)];
}"""

PLAY = """async (seconds) => {
  const { lab } = chutelab, frame = () => new Promise((resolve) => requestAnimationFrame(resolve));
  lab.play();
  while (lab.t < 0.3) await frame();
  const [from, began] = [lab.t, performance.now()];
  let frames = 0;
  while (performance.now() - began < 1000 * seconds && lab.playing) {
    await frame();
    frames += 1;
  }
  const took = (performance.now() - began) / 1000;
  return [frames / took, (lab.t - from) / took, lab.recording.tracks.filter(({ count }) => count).length];
}"""


def crowd(count: int) -> Scene:
    """Return a box with so many particles, half full, on a floor that runs: they never rest."""
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
                {"name": "floor", "from": [-side, -0.01], "to": [side, -0.01], "speed": 0.5},
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
        page = browser.new_page(viewport={"width": 1366, "height": 620})
        folder = Path(made)
        first = [opened(page, load("perpendicular"), folder) for _ in range(5)]
        print(f"open   {median(first):.0f} ms, at most {max(first):.0f} ms")
        half, most, rate = page.evaluate(DRAG)
        print(f"drag   {half:.1f} ms, 95 % within {most:.1f} ms; {rate:.0f} frames/s")
        for count in (300, 1000):
            opened(page, crowd(count), folder)
            rate, pace, there = page.evaluate(PLAY, 6.0)
            print(f"crowd  {there} particles: {rate:.0f} frames/s, {pace:.2f} s in a second")
        browser.close()


if __name__ == "__main__":
    main()
