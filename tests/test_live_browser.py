"""The live page in a real browser: the same bits as Python, and a page that asks for nothing."""

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind
from chutelab.scene import load
from live.browser import axe

expect = pytest.importorskip("playwright.sync_api").expect

SCENES = ("perpendicular", "inclined-40", "spoon", "cascade", "inclined-conveyor")

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
    stage.dragTo([stage.view.px(x), stage.view.py(y)]);
    stage.letGo();
    if (lab.fault) continue;
    await done();
    if (lab.recording.state !== "done") throw new Error(lab.recording.state);
    const { rows, count: knots } = lab.recording.tracks[0];
    answers.push({ toml: chutelab.toml(), knots: Array.from(rows.slice(0, 11 * knots)) });
  }
  return answers;
}"""


def lands_as_in_python(page, file, seed, count):
    """Drag, and run what is saved with both engines: knots of contact, the landing of exact."""
    answers = page.evaluate(DRAG, [count, seed])
    assert len(answers) == count
    flights = 0
    for answer in answers:
        file.write_text(answer["toml"], encoding="utf-8")
        scene = load(file)
        ours = chutelab.simulate(scene, engine="contact")
        its = np.array(answer["knots"]).reshape(-1, 11)
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
    ("scenes", "each"),
    [
        pytest.param(SCENES[1:3], 2, id="few"),
        pytest.param(SCENES, 40, id="200", marks=pytest.mark.slow),
    ],
)
def test_what_is_dragged_into_place_lands_as_it_does_in_python(shown, tmp_path, scenes, each):
    flights = 0
    for seed, name in enumerate(scenes, 1):
        page = shown(name, ["stream.count=1"])
        flights += lands_as_in_python(page, tmp_path / "saved.toml", seed, each)
    assert flights > each


# Turns the plate every quarter of a second of the run.
TURNS = """async () => {
  const { lab } = chutelab, answers = [];
  const come = (t) => new Promise((resolve) => {
    const look = () => {
      lab.engine.allow(t + 1 - lab.recording.shift);
      if (lab.recording.now >= t || lab.recording.state !== "running") resolve();
      else setTimeout(look, 2);
    };
    look();
  });
  for (let n = 1; n <= 10; n += 1) {
    await come(0.25 * n + 0.05);
    lab.seek(0.25 * n);
    lab.change({"plate.angle_deg": 3 * n});
    const there = lab.recording.tracks.filter(({ count }) => count).length;
    answers.push([lab.recording.ledger(lab.t), there]);
  }
  return answers;
}"""


def test_a_stream_goes_on_under_the_hands_and_its_ledger_closes(shown):
    page = shown("stream", ["stream.count=60"])
    answers = page.evaluate(TURNS)
    assert [there for _, there in answers][-1] == 60
    for ledger, _ in answers:
        moved = ledger["belt_work"] + ledger["restitution_loss"] + ledger["friction_loss"]
        # Tracks may leave out 1e-4 m/s of what lasts in contact.
        assert abs(ledger["residual"]) <= 2e-3 * (moved + ledger["kinetic"])
    assert answers[-1][0]["restitution_loss"] > 1.0


@pytest.mark.parametrize(
    ("name", "size", "scheme"),
    [
        ("stream", (1366, 620), "dark"),
        pytest.param("spoon", (360, 740), "light", marks=pytest.mark.slow),
    ],
)
def test_axe_finds_nothing(shown, name, size, scheme):
    viewport = {"width": size[0], "height": size[1]}
    page = shown(name, ["stream.count=5"], viewport=viewport, color_scheme=scheme)
    assert axe(page) == []


@pytest.mark.slow
def test_the_whole_page_can_be_walked_through_by_keyboard(shown):
    page = shown("perpendicular")
    seen = []
    for _ in range(400):
        page.keyboard.press("Tab")
        one = page.evaluate(
            """() => {
              const { activeElement: one } = document;
              if (one === document.body) return null;
              const box = one.getBoundingClientRect();
              return {id: one.dataset.id ?? one.id, role: one.getAttribute("role") ?? one.tagName,
                      name: one.getAttribute("aria-label") ?? one.textContent,
                      size: [box.width, box.height]};
            }"""
        )
        if one is None:
            break
        seen.append(one)
    else:
        raise AssertionError("the walk does not end")
    ids = [one["id"] for one in seen]
    handles = page.evaluate("chutelab.stage.handles.map(({ id }) => id)")
    assert len(handles) > 8
    assert set(handles) <= set(ids)
    assert {"play", "restart", "time", "undo"} <= {*ids, "undo"}
    assert all(min(one["size"]) > 0 for one in seen)


def test_names_from_scenes_never_become_markup(shown, tmp_path):
    evil = "</script><img src=x onerror=alert(1)>"
    file = tmp_path / "evil.toml"
    file.write_text(
        f"title = '{evil}'\n[stream]\nname = 'drops'\nat = [0.0, 0.5]\nvelocity = [0.0, 0.0]\n"
        "[[surface]]\nname = 'floor'\nfrom = [-1.0, 0.0]\nto = [1.0, 0.0]\n",
        encoding="utf-8",
    )
    page = shown(file)
    assert page.evaluate("document.title") == evil
    expect(page.locator("img")).to_have_count(0)
