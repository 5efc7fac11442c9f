"""The live page in a real browser: the same bits as Python, and a page that asks for nothing."""

from __future__ import annotations

import shutil

import numpy as np
import pytest

import chutelab
from chutelab.pictures.live.page import write
from chutelab.results import Kind
from chutelab.scene import load

playwright = pytest.importorskip(
    "playwright.sync_api", reason='needs Playwright: pip install "chutelab[test]"'
)
CHROMIUM = next(filter(None, map(shutil.which, ("chromium", "chromium-browser"))), None)
pytestmark = pytest.mark.skipif(
    CHROMIUM is None, reason="needs a browser: apt-get install chromium"
)

SCENES = ("perpendicular", "inclined-40", "spoon", "cascade", "inclined-conveyor")

# A page without `eval` cannot be waited for by a condition.
READY = """() => new Promise((resolve) => {
  const look = () => (globalThis.chutelab?.lab.recording.tracks[0].count > 0
    ? resolve() : setTimeout(look, 5));
  look();
})"""

# Takes hold of random handles, as a pointer would, and waits until the run is there.
DRAG = """async ([count, seed]) => {
  const { lab, stage } = chutelab;
  let state = seed;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  const done = () => new Promise((resolve) => {
    const look = () => (lab.recording.state === "running" ? setTimeout(look, 1) : resolve());
    look();
  });
  const answers = [];
  for (let tries = 0; answers.length < count && tries < 20 * count; tries += 1) {
    if (random() < 0.1) lab.reset();
    const handle = stage.handles[Math.floor(random() * stage.handles.length)];
    const [x, y] = [handle.x + 0.3 * (random() - 0.5), handle.y + 0.3 * (random() - 0.5)];
    stage.take(handle.id);
    stage.dragTo(x, y);
    stage.letGo();
    if (lab.fault) continue;
    await done();
    if (lab.recording.state !== "done") throw new Error(lab.recording.state);
    const { rows, count: knots } = lab.recording.tracks[0];
    answers.push({ toml: chutelab.toml(), knots: Array.from(rows.slice(0, 10 * knots)) });
  }
  return answers;
}"""


@pytest.fixture(scope="module")
def browser():
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=CHROMIUM)
        yield opened
        opened.close()


@pytest.fixture
def shown(browser, tmp_path):
    """Open a scene; at the end nothing must have been asked for, and nothing said."""
    pages, said, asked = [], [], []

    def show(name, overrides=(), **options):
        path = tmp_path / f"{len(pages)}.html"
        write(load(name, overrides), path)
        page = browser.new_page(**options)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(path.as_uri())
        page.evaluate(READY)
        pages.append(page)
        return page

    yield show
    for page in pages:
        page.close()
    assert not said
    assert all(url.startswith(("file:", "blob:")) for url in asked)


def lands_as_in_python(page, file, seed, count):
    """Drag, and run what is saved with both engines: knots of contact, the landing of exact."""
    answers = page.evaluate(DRAG, [count, seed])
    assert len(answers) == count
    flights = 0
    for answer in answers:
        file.write_text(answer["toml"], encoding="utf-8")
        scene = load(file)
        ours = chutelab.simulate(scene, engine="contact")
        its = np.array(answer["knots"]).reshape(-1, 10)
        knots = ours.knots
        columns = np.column_stack([knots["t"], knots["position"], knots["velocity"]])
        assert np.array_equal(its[:, :5], columns), answer["toml"]
        # What lasts on a surface for a while, after the ride, is of second order in the step.
        left = ours.events["t"][ours.events["kind"] == Kind.SEPARATION]
        flown = knots[knots["t"] >= (left[0] if len(left) else 0.0)]
        gain = np.diff(flown["velocity"], axis=0) + np.diff(flown["t"])[:, None] * [0.0, 9.81]
        if len(left) and np.abs(gain[np.diff(flown["t"]) > 0.0]).max(initial=0.0) < 1e-9:
            exact = chutelab.simulate(scene, engine="exact").knots["position"][-1]
            assert np.abs(exact - its[-1, 1:3]).max() < 1e-10, answer["toml"]
            flights += 1
    return flights


@pytest.mark.parametrize(
    "each", [pytest.param(6, id="few"), pytest.param(40, id="200", marks=pytest.mark.slow)]
)
def test_what_is_dragged_into_place_lands_as_it_does_in_python(shown, tmp_path, each):
    flights = 0
    for seed, name in enumerate(SCENES, 1):
        page = shown(name, ["stream.count=1"])
        flights += lands_as_in_python(page, tmp_path / "saved.toml", seed, each)
    assert flights > each
