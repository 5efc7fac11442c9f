"""Machines that are built in the page, from nothing: every part, with pointer and keys, saved."""

import re

import numpy as np
import pytest

import chutelab
from chutelab import core as module
from chutelab.engines import contact as engine
from chutelab.machine import build
from chutelab.pictures.live import html
from chutelab.pictures.live.describe import EXAMPLES, PARTS, describe
from chutelab.scene import from_dict, load
from chutelab.scene.look import JOINTS, MOTIONS
from chutelab.util.words import words
from live.browser import DONE, Hand, axe, spot
from shared import call, some

expect = pytest.importorskip("playwright.sync_api").expect

HINGED = {"hinge", "mass", "inertia", "spring", "rest_deg", "damper", "stops_deg", "motor"}
"""Keys of a hinge."""

# Of a run that is over: knots of each track as Python has them, states and entries.
TRACKS = """chutelab.lab.recording.tracks.map(({ rows, count }) =>
  Array.from({ length: count }, (_, n) => Array.from(rows.slice(11 * n, 11 * n + 9))))"""

# One whose particles meet runs as far as it is asked to.
WHOLE = """() => new Promise((resolve) => {
  const { lab } = chutelab;
  const look = () => {
    lab.engine.allow(1e6);
    if (lab.recording.state === "running") setTimeout(look, 5);
    else resolve(lab.recording.state);
  };
  look();
})"""


@pytest.fixture
def empty(opened, tmp_path):
    """Open the page of an empty machine."""

    def show(language="en", **options):
        path = tmp_path / "machine.html"
        path.write_text(html(None, language=language), encoding="utf-8")
        page = opened(path, **{"viewport": {"width": 1366, "height": 768}, **options})
        page.evaluate(DONE)
        return page

    return show


def given(page):
    return page.evaluate("chutelab.lab.given")


def shown_keys(page):
    """Return the keys that have a field in the card of what is chosen."""
    found = "[...document.querySelectorAll('#chosen .entry [id^=field-]')].map((e) => e.id)"
    ids = (one.removesuffix(".touched") for one in page.evaluate(found))
    return {one.rpartition(".")[2].split("[")[0] for one in ids}


def same_bits(page, folder, until=1.5):
    """Save the scene, run the file in Python, and compare all knots with the page's."""
    page.evaluate(f"chutelab.lab.change({{ 'run.until': {until} }})")
    assert page.evaluate("chutelab.lab.fault && chutelab.lab.fault.message") is None
    assert page.evaluate(WHOLE) == "done"
    with page.expect_download() as waiting:
        page.evaluate("document.getElementById('share').open = true")
        page.get_by_role("button", name="Save as scene").click()
    file = folder / "saved.toml"
    file.write_bytes(waiting.value.path().read_bytes())
    # All that the engine hands on, before the recorder drops states between impacts at one time.
    job = engine.Job(module.Module(), build(load(file)))
    assert job.run(None) is None
    job.drain()
    owners, knots, _ = map(np.concatenate, zip(*job.knots, strict=True))
    ours = knots.view("<f8").reshape(-1, 9)
    its = page.evaluate(TRACKS)
    for particle, track in enumerate(its):
        found = np.array(track).reshape(-1, 9)
        assert np.array_equal(found, ours[owners == particle])
    return sum(map(len, its))


CLICKED = {"arc", "tie", "ball", "pin", "touched"}
"""Places of parts that are no keys of their own."""


def test_every_part_is_a_row_whose_keys_are_those_of_its_table():
    tables, page = describe(None)["tables"], html(None)
    for part in PARTS:
        assert f'<symbol id="i-{part["part"]}"' in page
        rules = tables[part["table"]]
        # A stream is made with what it consists of.
        rules = tables["particle"] | rules if part["table"] == "stream" else rules
        points = {"center", "radius", "from_deg", "to_deg"} if "arc" in part["places"] else set()
        nested = {f"{key}.{one}" for key, rule in rules.items() for one in rule.get("parts", ())}
        keys = {*part["row"], *part["needs"], *points, *part["places"]} - CLICKED
        assert keys <= {*rules, *nested}, part["part"]
        mains = {key.removeprefix("particle.") for key in part["main"]}
        assert mains <= {*rules, *nested, *tables["particle"]}, part["part"]
    assert len({part["letter"] for part in PARTS}) == len(PARTS)
    # Every table that places something has its part.
    assert {part["table"] for part in PARTS} == {
        "conveyor", "incoming", "plate", "surface", "stream", "sensor", *JOINTS
    }  # fmt: skip


@pytest.mark.slow
def test_each_part_is_drawn_saved_and_runs_to_the_same_bits(empty, tmp_path):
    page = empty()
    for part in PARTS:
        # A ball that falls on it; the pointer sets all points of the part.
        page.click("#part-ball")
        page.mouse.click(*spot(page, 0.52, 0.3))
        # The parts stay where one is drawn.
        page.click(f"#part-{part['part']}")
        shares = [(0.4, 0.5), (0.62, 0.55), (0.5, 0.65)]
        for share in shares[: len(part["places"])]:
            page.mouse.click(*spot(page, *share))
        page.keyboard.press("Escape")
        rows = given(page)[part["table"]]
        row = rows if isinstance(rows, dict) else rows[-1]
        kinds = {kind["name"]: kind for kind in given(page)["particle"] if "name" in kind}
        row = kinds.get(row.get("particle"), {}) | row
        assert {*part["row"], *part["needs"]} <= set(row)
        assert same_bits(page, tmp_path) > 1
        page.evaluate("chutelab.lab.reset()")
        page.evaluate(DONE)


@pytest.mark.slow
def test_everything_that_a_part_can_say_has_a_field_and_is_saved(empty, tmp_path):
    """All keys of each part but those that contradict what it is, from the tables of rules."""
    page = empty()
    page.click("#part-pulley")
    names = ["belt", "plate", "line", "arc", "pegs", "gate", "stream"]
    for name in names:
        if page.locator("#parts").is_hidden():
            page.click("#tool-add")
        page.focus(f"#part-{name}")
        page.keyboard.press("Enter")
    keys = {}
    for name in ["incoming", *(f"{one}1" for one in names)]:
        page.evaluate(f"chutelab.bench.inspector.choose('{name}')")
        keys[name] = shown_keys(page)
    tables = {name: set(rules) for name, rules in describe(None)["tables"].items()}
    arc = {"center", "radius", "from_deg", "to_deg"}
    moves = {*MOTIONS, *HINGED, "starts_when"}
    still = tables["surface"] - moves - {"pivot"} | {"motion"}
    straight, bent = still - arc - {"from", "to"}, still - {"from", "to", "points"}
    assert keys["incoming"] == tables["incoming"]
    assert keys["belt1"] == tables["conveyor"]
    assert keys["plate1"] == tables["plate"] - moves - {"distance", "pivot_height"} | {"motion"}
    assert keys["line1"] == keys["gate1"] == straight
    assert keys["arc1"] == keys["pegs1"] == bent
    # It has a line already, on which it is released: no box, and no height of a bed. What is round
    # begins at no angle.
    grain = tables["particle"] - {"mass", "size", "points"}
    lacks = {"particle", "angle_deg", "bed_height"}
    assert keys["stream1"] == (tables["stream"] | grain) - lacks
    page.evaluate("chutelab.bench.inspector.choose('line1')")
    page.locator("#chosen .more summary").click()

    def typed(key, text):
        page.locator(f"[id='field-own-{key}']").fill(text)
        page.locator(f"[id='field-own-{key}']").press("Enter")

    typed("surface[0].points", "-0.3 0.2; 0 0.1; 0.25 0.15")
    typed("surface[0].repeat", "2 0 -0.15")
    typed("surface[0].closes_at", "0.25")
    page.select_option("[id='field-own-surface[0].material']", "rubber")
    typed("surface[0].name", "ramp")
    line = given(page)["surface"][0]
    assert line["points"] == [[-0.3, 0.2], [0, 0.1], [0.25, 0.15]]
    assert (line["repeat"], line["closes_at"]) == ([[2, 0, -0.15]], 0.25)
    assert (line["material"], line["name"]) == ("rubber", "ramp")
    typed("surface[0].closes_at", "")
    assert "closes_at" not in given(page)["surface"][0]
    # What was opened stays so.
    page.evaluate("chutelab.bench.inspector.choose('stream1')")
    typed("stream[0].rate", "0.4 t/h")
    page.select_option("[id='field-own-particle[0].material']", "wood")
    typed("particle[0].radius", "0.008 0.012")
    stream, kind = given(page)["stream"][0], given(page)["particle"][0]
    assert (stream["rate"], kind["material"], kind["radius"]) == ("0.4 t/h", "wood", [0.008, 0.012])
    typed("stream[0].count", "12")
    assert same_bits(page, tmp_path) >= 24


@pytest.mark.slow
def test_a_line_moves_in_each_way_by_its_card_and_runs_to_the_same_bits(empty, tmp_path):
    """All keys of each motion have a field; those of another motion are gone."""
    page = empty()
    page.click("#part-ball")
    page.mouse.click(*spot(page, 0.52, 0.3))
    page.click("#part-line")
    for share in ((0.4, 0.5), (0.62, 0.55)):
        page.mouse.click(*spot(page, *share))
    page.keyboard.press("Escape")
    page.evaluate("chutelab.bench.inspector.choose('line1')")
    page.locator("#chosen .more summary").click()

    def typed(key, text):
        page.locator(f"[id='field-own-surface[0].{key}']").fill(text)
        page.locator(f"[id='field-own-surface[0].{key}']").press("Enter")

    def fields():
        found = page.evaluate("chutelab.bench.inspector.own.entries.keys().toArray()")
        return {one.partition("].")[2].partition("[")[0] for one in found}

    still = fields()
    wanted = {
        "turns": ({"turn", "pivot"}, {"turn": "-45"}),
        "shakes": ({"turn", "shake.by", "shake.frequency", "shake.phase_deg"},
                   {"shake.frequency": "8"}),
        "travels": ({"turn", "pivot", "travel.to", "travel.at", "travel.in"},
                    {"travel.in": "0.7"}),
        "hinge": ({"pivot", *HINGED}, {"spring": "0.8", "damper": "0.02", "stops_deg": "-40 60"}),
    }  # fmt: skip
    for motion, (keys, texts) in wanted.items():
        page.select_option("[id='field-own-surface[0].motion']", motion)
        assert fields() == still | keys, motion
        for key, text in texts.items():
            typed(key, text)
        assert page.evaluate("chutelab.lab.fault") is None
        assert same_bits(page, tmp_path) > 1
    assert "shake" not in given(page)["surface"][0]
    # A motor, by its switch and its slider, turns what hangs there.
    page.locator("[id='field-own-surface[0].motor']").check()
    assert fields() >= {"motor.speed_deg", "motor.torque"}
    slider = page.get_by_label("motor's speed", exact=True).and_(page.locator("[type=range]"))
    slider.fill("150")
    assert given(page)["surface"][0]["motor"] == {"speed_deg": 150, "torque": 1}
    assert same_bits(page, tmp_path) > 1
    assert page.evaluate("chutelab.lab.recording.breaches") == []
    # The drawing is where the core has it: at the angle of the swing then.
    for t in (0.0, 0.4, 1.1):
        page.evaluate(f"chutelab.lab.seek({t})")
        angle = page.evaluate("[...chutelab.lab.recording.swings.values()][0].at(chutelab.lab.t)")
        shown = page.locator("[data-part=line1]").get_attribute("transform")
        assert float(shown.split("rotate(")[1].split()[0]) == pytest.approx(-np.degrees(angle))
    assert abs(angle) > 0.1
    # Dragged by its body, its hinge goes along, however far it has turned.
    page.keyboard.press("Escape")
    before = given(page)["surface"][0]["points"]
    middle = page.evaluate("""() => {
      const { stage: { view, posed } } = chutelab, [{ ends: [x, y, u, v] }] = posed.segments;
      const { left, top } = document.getElementById("stage").getBoundingClientRect();
      return [left + view.px(0.7 * u + 0.3 * x), top + view.py(0.7 * v + 0.3 * y)];
    }""")
    page.mouse.move(*middle)
    page.mouse.down()
    page.mouse.move(middle[0] + 30, middle[1] + 10, steps=4)
    page.mouse.up()
    moved = np.subtract(given(page)["surface"][0]["points"], before)
    assert moved[0] == pytest.approx(moved[1])
    assert moved[0][0] > 0.0


@pytest.mark.slow
def test_what_waits_for_a_touch_is_made_by_its_card_and_runs_to_the_same_bits(empty, tmp_path):
    """A ball strikes a line: another one goes, comes, or begins to turn, as Python has it."""
    page = empty()
    shares = ((0.52, 0.3), (0.4, 0.5), (0.62, 0.55), (0.42, 0.65), (0.6, 0.7))
    above, *ends = (spot(page, *share) for share in shares)
    page.click("#part-ball")
    page.mouse.click(*above)
    page.click("#part-line")
    for end in ends:
        page.mouse.click(*end)
    page.keyboard.press("Escape")
    # What is opened of one is open of the next, however soon that is chosen.
    page.evaluate("""() => {
      const { inspector } = chutelab.bench;
      inspector.choose("line1");
      document.querySelector("#chosen .more summary").click();
      inspector.choose("line2");
    }""")

    def wait_for(doing, name):
        page.select_option(f"[id='field-own-surface[1].{doing}_when.touched']", name)
        assert page.evaluate("chutelab.lab.fault") is None

    wait_for("opens", "line1")
    assert given(page)["surface"][1]["opens_when"] == {"touched": "line1"}
    assert same_bits(page, tmp_path) > 1
    struck = page.evaluate("chutelab.lab.recording.events.find(({ kind }) => kind === 3).t")
    assert page.evaluate("chutelab.lab.machine.segments[1].vanishes") == struck
    gate = page.locator("[data-part=line2]")
    page.evaluate(f"chutelab.lab.seek({struck} - 0.01)")
    expect(gate).not_to_have_class(re.compile("absent"))
    page.evaluate(f"chutelab.lab.seek({struck} + 0.01)")
    expect(gate).to_have_class(re.compile("absent"))
    # What cannot stand beside it goes.
    wait_for("closes", "line1")
    assert {"opens_when", "opens_at"}.isdisjoint(given(page)["surface"][1])
    assert same_bits(page, tmp_path) > 1
    page.locator("[id='field-own-surface[1].opens_at']").fill("1.2")
    page.keyboard.press("Enter")
    wait_for("closes", "")
    assert {"opens_when", "closes_when"}.isdisjoint(given(page)["surface"][1])
    page.select_option("[id='field-own-surface[1].motion']", "turns")
    wait_for("starts", "line1")
    assert same_bits(page, tmp_path) > 1
    page.evaluate(f"chutelab.lab.seek({struck} + 0.1)")
    shown = page.locator("[data-part=line2]").get_attribute("transform")
    assert float(shown.split("rotate(")[1].split()[0]) == pytest.approx(-9.0)
    # It is meant by its name, and is no longer waited for when it is gone.
    page.evaluate("chutelab.bench.inspector.choose('line1')")
    page.locator("[id='field-own-surface[0].name']").fill("bell")
    page.keyboard.press("Enter")
    assert given(page)["surface"][1]["starts_when"] == {"touched": "bell"}
    page.click("#part-delete")
    assert "starts_when" not in given(page)["surface"][0]


# Where a place of the world is on the screen.
PLACE = """([x, y]) => {
  const { view } = chutelab.stage;
  const { left, top } = document.getElementById("stage").getBoundingClientRect();
  return [left + view.px(x), top + view.py(y)];
}"""


def drag(page, begin, end):
    """Drag from a place of the world to another."""
    (x, y), (u, v) = (page.evaluate(PLACE, place) for place in (begin, end))
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(0.5 * (x + u), 0.5 * (y + v))
    page.mouse.move(u, v)
    page.mouse.up()
    page.evaluate(DONE)


@pytest.mark.slow
def test_joints_are_tied_untied_copied_and_undone_by_hand(shown, tmp_path):
    balls = [
        {"name": name, "at": at, "velocity": [0.0, 0.0], "interact": True}
        for name, at in (("one", [0.2, 0.5]), ("two", [0.6, 0.5]), ("far", [1.0, 0.5]))
    ]
    page = shown(from_dict({
        "particle": {"radius": 0.03, "mass": 0.1}, "run": {"until": 1.5}, "stream": balls,
        "string": [{"from": [0.2, 0.8], "particle": 0}], "rod": [{"particle": 1, "other": 2}],
    }), viewport={"width": 1366, "height": 768})  # fmt: skip

    def tied(table):
        return given(page).get(table)

    # A click on its line chooses it; it is moved by its line, and its ends are dragged.
    page.mouse.click(*page.evaluate(PLACE, [0.2, 0.7]))
    expect(page.locator("#chosen h2")).to_have_text("String 1")
    drag(page, [0.2, 0.8], [0.6, 0.51])
    assert tied("string") == [{"particle": 0, "other": 1}]
    drag(page, [0.6, 0.5], [0.4, 0.8])
    assert tied("string") == [{"particle": 0, "from": pytest.approx([0.4, 0.8], abs=0.01)}]
    drag(page, [0.2, 0.5], [0.6, 0.5])
    assert tied("string")[0]["particle"] == 1
    page.keyboard.press("Control+z")
    assert tied("string")[0]["particle"] == 0
    # A place that is too far is refused where it is typed.
    field = page.locator("[id='field-own-string[0].length']")
    field.fill("0.1")
    field.press("Enter")
    expect(page.locator("#chosen [role=alert]")).to_contain_text("the distance at the release")
    page.keyboard.press("Escape")
    # More particles before it, or fewer, leave it what it holds.
    page.evaluate("chutelab.lab.change({ 'stream[0].count': 2, 'stream[0].to': [0.2, 0.3] })")
    assert (tied("string")[0]["particle"], tied("rod")) == (0, [{"particle": 2, "other": 3}])
    page.keyboard.press("Control+z")
    assert tied("rod") == [{"particle": 1, "other": 2}]
    # A copy of all holds the copies; what holds what is gone goes.
    page.evaluate("chutelab.bench.inspector.choose('two', 'far', 'rod 1')")
    page.click("#part-duplicate")
    assert tied("rod") == [{"particle": 1, "other": 2}, {"particle": 3, "other": 4}]
    page.evaluate("chutelab.bench.inspector.choose('one')")
    page.click("#part-delete")
    assert tied("string") is None
    assert tied("rod") == [{"particle": 0, "other": 1}, {"particle": 2, "other": 3}]
    assert same_bits(page, tmp_path) >= 8
    page.keyboard.press("Control+z")
    page.keyboard.press("Control+z")
    assert tied("string")[0]["particle"] == 0


def pushed_in_python(scene, pushes):
    """Return the recording of the same pushes; a torque T about 0 is a force T at (1, 0)."""
    run = chutelab.start(scene)
    for push in pushes:
        while run.t < push["at"]:
            run.step(push["at"] - run.t)
        assert run.t == push["at"]
        if "surface" in push:
            run.push(run.scene.surfaces[push["surface"]], (0.0, push["torque"]), at=(1.0, 0.0))
        else:
            run.push(push["disk"], push["force"])
        run.step(push["due"] - run.t)
    while not run.done:
        run.step(0.1)
    return run.recording


FALLS = load("belt-landing", ["stream.at=[0.3, 0.8]", "stream.velocity=[0, 0]", "run.until=2.5",
                              "outgoing.drop_from=top"])  # fmt: skip

HANGS = {
    "particle": {"radius": 0.03, "mass": 0.1}, "run": {"until": 2.0},
    "stream": {"at": [0.6, 0.8], "velocity": [0.0, 0.0]},
    "spring": [{"from": [0.3, 1.2], "stiffness": 30.0, "damper": 0.1}],
}  # fmt: skip


@pytest.mark.parametrize(
    "scene", [FALLS, pytest.param(from_dict(HANGS), marks=pytest.mark.slow)], ids=["falls", "hangs"]
)
def test_a_ball_that_is_under_way_is_caught_and_thrown_as_python_does(shown, scene):
    """The work of the hand is a row of the ledger; the same pushes in Python give the same bits."""
    page = shown(scene, viewport={"width": 1366, "height": 768})
    # It is slow while it is caught, and then is faster.
    page.select_option("#rate", "0.02")
    page.click("#play")
    place = """() => {
      const { lab, stage: { view } } = chutelab, { x, y } = lab.recording.tracks[0].state(lab.t);
      const { left, top } = document.getElementById("stage").getBoundingClientRect();
      return [left + view.px(x), top + view.py(y)];
    }"""
    x, y = page.evaluate(place)
    page.mouse.move(x, y)
    page.mouse.down()
    expect(page.locator(".draft .pull")).to_have_count(1)
    expect(page.locator("#energy tr[data-id=push_work]")).to_be_visible()
    expect(page.locator("#energy tr[data-id=belt_work] td")).to_have_text("0 mJ")
    page.evaluate("chutelab.lab.rate = 0.25")
    for n in range(8):
        page.mouse.move(x + 10 * n, y - 12 * n)
        page.wait_for_timeout(40)
    page.mouse.up()
    assert page.evaluate("chutelab.lab.hand") is None
    page.evaluate(DONE)
    page.evaluate(WHOLE)
    pushes = page.evaluate("chutelab.lab.pushes")
    assert len(pushes) > 5
    recording = pushed_in_python(scene, pushes)
    track = np.array(page.evaluate(TRACKS)[0])
    found = recording.track(0)
    assert track[-1, 0] == found["t"][-1]
    assert track[-1, 1:3].tolist() == found["position"][-1].tolist()
    ledger = page.evaluate("chutelab.lab.recording.ledger(chutelab.lab.recording.end)")
    assert ledger["push_work"] == pytest.approx(
        recording.ledger.push_work, rel=0.0 if scene is FALLS else 1e-12, abs=0.0
    )
    assert ledger["push_work"] > 1e-3
    assert ledger["belt_work"] == pytest.approx(recording.ledger.belt_work, abs=1e-12)
    assert abs(ledger["residual"]) < 1e-11 * recording.ledger.turned_over
    assert page.evaluate("chutelab.lab.recording.breaches") == []
    # From the beginning it runs by itself again.
    page.click("#restart")
    page.evaluate(DONE)
    assert page.evaluate("chutelab.lab.pushes.length") == 0
    expect(page.locator("#energy tr[data-id=push_work]")).to_be_hidden()


def test_after_its_end_a_run_takes_a_ball_and_escape_takes_a_refusal_away(shown):
    page = shown("see-saw")  # it ends at 0.3 s
    page.evaluate("chutelab.lab.seek(0.3)")
    page.click("#tool-add")
    page.click("#part-ball")
    page.mouse.click(*spot(page, 0.5, 0.15))
    expect(page.locator("#fault")).to_be_hidden()
    assert [one.get("start", 0) for one in given(page)["stream"]] == [0, 0, 0]
    page.evaluate("chutelab.lab.change({ 'particle.light.radius': -1 })")
    expect(page.locator("#fault")).to_be_visible()
    page.keyboard.press("Escape")
    expect(page.locator("#fault")).to_be_hidden()


@pytest.mark.slow
def test_a_hinge_is_pushed_in_a_running_run_by_hand_and_by_keys_as_python_does(shown):
    """Work and heat of a flap with a ball on it are in the ledger, in the bits of Python's run."""
    flap = {"name": "flap", "from": [0.0, 0.0], "to": [0.4, 0.0], "hinge": [0.0, 0.0],
            "mass": 0.2, "spring": 2.0, "damper": 0.02}  # fmt: skip
    # However late a key comes, the ball is still there: it rolls off the flap into a hollow.
    hollow = {"name": "hollow", "points": [[-0.2, -0.3], [0.3, -0.5], [0.8, -0.3]]}
    scene = from_dict({
        "particle": {"radius": 0.02, "mass": 0.05}, "run": {"until": 4.0},
        "surface": [flap, hollow],
        "stream": {"at": [0.2, 0.1], "velocity": [0.0, 0.0]},
    })  # fmt: skip
    page = shown(scene, viewport={"width": 1366, "height": 768})
    page.select_option("#rate", "0.02")
    page.click("#play")
    x, y = page.evaluate(PLACE, [0.38, 0.0])
    page.mouse.move(x, y)
    page.mouse.down()
    expect(page.locator(".draft .pull")).to_have_count(1)
    page.evaluate("chutelab.lab.rate = 0.25")
    for n in range(8):
        page.mouse.move(x - 2 * n, y - 8 * n)
        page.wait_for_timeout(40)
    page.mouse.up()
    expect(page.locator(".draft .pull")).to_have_count(0)
    expect(page.locator("#energy tr[data-id=push_work]")).to_be_visible()
    by_mouse = page.evaluate("chutelab.lab.pushes.length")
    assert by_mouse > 4
    # The same by keys: what is chosen is caught, moved and let go.
    page.evaluate("chutelab.lab.rate = 0.05; chutelab.bench.inspector.choose('flap')")
    page.focus("#picture")
    page.keyboard.press("Enter")
    expect(page.locator(".draft .pull")).to_have_count(1)
    for _ in range(4):
        page.keyboard.press("ArrowDown")
        page.wait_for_timeout(40)
    page.keyboard.press("Enter")
    expect(page.locator(".draft .pull")).to_have_count(0)
    page.evaluate("chutelab.bench.inspector.choose('stream')")
    page.focus("#picture")
    page.keyboard.press("Enter")
    page.keyboard.press("ArrowUp")
    expect(page.locator(".draft .pull")).to_have_count(1)
    page.wait_for_timeout(100)
    page.keyboard.press("Escape")
    expect(page.locator(".draft .pull")).to_have_count(0)
    assert page.evaluate(WHOLE) == "done"
    pushes = page.evaluate("chutelab.lab.pushes")
    assert len(pushes) > by_mouse
    assert "surface" in pushes[0]
    assert "disk" in pushes[-1]
    recording = pushed_in_python(scene, pushes)
    found, track = recording.track(0), np.array(page.evaluate(TRACKS)[0])
    assert track[-1, 1:3].tolist() == found["position"][-1].tolist()
    swings = page.evaluate("chutelab.lab.recording.swings.get(0).rows")
    assert [row[:3] for row in swings] == [
        [row["t"], row["angle"], row["rate"]] for row in recording.swings
    ]
    ledger = page.evaluate("chutelab.lab.recording.ledger(chutelab.lab.recording.end)")
    assert ledger["push_work"] == pytest.approx(recording.ledger.push_work, rel=1e-12)
    assert abs(ledger["push_work"]) > 1e-3
    assert abs(ledger["residual"]) < 1e-11 * recording.ledger.turned_over
    assert page.evaluate("chutelab.lab.recording.breaches") == []


@pytest.mark.slow
def test_materials_pairs_and_the_run_are_made_saved_and_taken_away(empty, tmp_path):
    page = empty()
    page.click("#begin")
    page.evaluate(DONE)

    def typed(key, text):
        field = page.locator(f"[id='field-own-{key}']")
        field.scroll_into_view_if_needed()
        field.fill(text)
        field.press("Enter")

    def more():
        if page.locator("#chosen .more").get_attribute("open") is None:
            page.locator("#chosen .more summary").click()

    page.click("#make-material")
    assert page.inner_text("#chosen h2") == "Material material1"
    typed("material[0].density", "2100")
    typed("material[0].restitution_rubber", "0.61")
    typed("material[0].name", "brick")
    assert page.inner_text("#chosen h2") == "Material brick"
    page.evaluate("chutelab.bench.inspector.choose('stream')")
    more()
    page.select_option("[id='field-own-particle.material']", "brick")
    page.click("#make-pair")
    assert page.inner_text("#chosen h2") == "Pair 1"
    assert page.locator("[id='field-own-pair[0].between[1]']").input_value() == "incoming"
    typed("pair[0].restitution", "0.35")
    typed("pair[0].cohesion", "0.02")
    # Only two kinds can pass through each other.
    expect(page.locator("[id='field-own-pair[0].meet']")).to_have_count(0)
    # Whatever the pair's partner is, it can be another one.
    page.evaluate("chutelab.bench.inspector.choose('run')")
    typed("run.max_time", "12")
    typed("run.dt", "0.0005")
    typed("run.until", "0.8")
    typed("run.until", "settled")
    assert page.evaluate("chutelab.lab.fault") is None
    scene = given(page)
    assert scene["run"] == {"max_time": 12, "dt": 0.0005, "until": "settled"}
    assert (
        scene["material"][0] | {"density": 2100, "restitution_rubber": 0.61, "name": "brick"}
        == (scene["material"][0])
    )
    (pair,) = scene["pair"]
    assert pair["between"][1] == "incoming"
    assert (pair["restitution"], pair["cohesion"]) == (0.35, 0.02)
    assert same_bits(page, tmp_path) > 1
    # A pair goes by its card; a material that is used cannot, and the page says why.
    page.evaluate("chutelab.bench.inspector.choose('pair 1')")
    page.click("#part-delete")
    assert "pair" not in given(page)
    page.evaluate("chutelab.bench.inspector.choose('material brick')")
    page.click("#part-delete")
    expect(page.locator("#fault")).to_be_visible()
    assert given(page)["material"][0]["name"] == "brick"


def test_parts_and_the_card_of_what_is_chosen_take_turns_and_what_is_on_looks_so(shown):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768})
    page.evaluate("chutelab.bench.inspector.choose('plate')")
    page.click("#tool-add")
    expect(page.locator("#parts")).to_be_visible()
    expect(page.locator("#chosen")).to_be_hidden()
    page.evaluate("chutelab.bench.inspector.choose('plate')")
    expect(page.locator("#parts")).to_be_hidden()
    # Under the pointer, too, a tool that is on can be told from one that is not.
    page.click("#tool-tape")
    ground = "getComputedStyle(document.getElementById('tool-tape')).backgroundColor"
    under = page.evaluate(ground)
    page.mouse.move(600, 300)
    assert under == page.evaluate(ground) == "rgb(0, 100, 157)"


@pytest.mark.slow
def test_the_menu_has_a_new_machine_the_scene_as_it_was_and_light_and_dark(shown):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768})
    ground = "getComputedStyle(document.body).backgroundColor"
    light, dark = "rgb(243, 246, 248)", "rgb(14, 20, 26)"
    menu = page.locator("#menu > summary")
    menu.focus()
    page.keyboard.press("Enter")
    for scheme in ("light", "dark"):
        page.emulate_media(color_scheme=scheme)
        system = {"light": light, "dark": dark}[scheme]
        for choice, colour in (("light", light), ("dark", dark), ("system", system)):
            page.click(f"#theme-{choice}")
            assert page.evaluate(ground) == colour
            assert page.get_attribute(f"#theme-{choice}", "aria-pressed") == "true"
            # Particles and what is drawn on the canvas have the theme's colours, too.
            assert page.evaluate("chutelab.stage.colour('stage')") == {
                light: "#f3f6f8", dark: "#0e141a"}[colour]  # fmt: skip
        assert axe(page) == []
    page.click("#theme-light")
    page.reload()
    page.evaluate(DONE)
    assert page.evaluate(ground) == light
    expect(page.locator("#menu[open]")).to_have_count(0)
    page.evaluate("chutelab.lab.change({ 'plate.angle_deg': 33 })")
    menu.click()
    page.click("#reset")
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 40.0
    expect(page.locator("#menu[open]")).to_have_count(0)
    menu.click()
    page.click("#new-machine")
    assert page.evaluate("chutelab.lab.machine.surfaces") == []
    page.click("#undo")
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 40.0
    # Escape closes it and leaves the focus where it was opened.
    menu.click()
    page.keyboard.press("Tab")
    page.keyboard.press("Escape")
    expect(page.locator("#menu[open]")).to_have_count(0)
    assert page.evaluate("document.activeElement.parentElement.id") == "menu"


@pytest.mark.slow
def test_a_link_and_html_to_embed_open_the_machine_as_it_is(shown, opened, tmp_path):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768}, language="de")
    page.evaluate("""() => {
      globalThis.texts = [];
      const value = { writeText: (text) => texts.push(text) };
      Object.defineProperty(navigator, "clipboard", { value });
    }""")
    title = 'Platte & "Band"'
    page.evaluate("title => chutelab.lab.change({ 'plate.angle_deg': 33, title })", title)
    page.click("#share > summary")
    page.get_by_role("button", name="Link kopieren").click()
    page.get_by_role("button", name="HTML zum Einbetten kopieren").click()
    expect(page.get_by_text("Es ist in der Zwischenablage.")).to_be_visible()
    link, html = page.evaluate("texts")
    assert link.startswith((tmp_path / "page.html").as_uri() + "#")
    (tmp_path / "blog.html").write_text(f"<!doctype html><title>x</title>{html}", encoding="utf-8")
    blog = opened(tmp_path / "blog.html")
    frame = blog.locator("iframe")
    assert frame.get_attribute("title") == title
    frame.content_frame.get_by_role("heading", name=title).wait_for()
    within = frame.element_handle().content_frame()
    assert within.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 33.0


@pytest.mark.slow
def test_the_page_turns_to_the_other_language_as_it_is(shown):
    page = shown("inclined-40", viewport={"width": 1366, "height": 768})
    page.evaluate("chutelab.lab.change({ 'plate.angle_deg': 33 })")
    page.click("#language")
    page.wait_for_load_state()
    page.evaluate(DONE)
    assert page.evaluate("document.documentElement.lang") == "de"
    assert page.locator("#energy summary").inner_text() == "Energie"
    assert page.locator("#language").get_attribute("aria-label") == "English"
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 33.0
    page.click("#language")
    page.wait_for_load_state()
    page.evaluate(DONE)
    assert page.locator("#energy summary").inner_text() == "Energy"
    assert page.evaluate("chutelab.lab.scene.plates[0].angle_deg") == 33.0


@pytest.mark.slow
@pytest.mark.parametrize(
    ("language", "said"),
    [
        ("en", "The trigger of door, flap is deleted, too"),
        ("de", "Der Auslöser von door, Federklappe ist mit gelöscht"),
    ],
)
def test_a_trigger_that_is_deleted_with_what_it_waits_for_is_told(shown, language, said):
    rows = "".join(
        f"[[surface]]\nname = '{name}'\nfrom = [{x}, -1.0]\nto = [{x + 0.2}, -1.0]\n{more}\n"
        for name, x, more in (
            ("bell", 0.0, ""), ("door", 0.4, "opens_when = { touched = 'bell' }"),
            ("flap", 0.8, "turn = 20.0\npivot = [0.8, -1.0]\nstarts_when = { touched = 'bell' }"),
            ("gate", 1.2, "closes_when = { touched = 'door' }"),
        )
    )  # fmt: skip
    page = shown(more=rows, language=language)
    before, freed = given(page), page.locator("#freed")
    page.evaluate("chutelab.bench.inspector.choose('bell')")
    page.click("#part-delete")
    expect(freed).to_contain_text(said)
    left = given(page)["surface"]
    assert [[key for key in one if key.endswith("_when")] for one in left] == [
        [], [], ["closes_when"]
    ]  # fmt: skip
    page.click("#undo")
    expect(freed).to_be_hidden()
    assert given(page) == before
    # What is deleted with the part that it waits for is not told.
    page.evaluate("chutelab.bench.inspector.choose('door', 'gate')")
    page.click("#part-delete")
    assert len(given(page)["surface"]) == 2
    expect(freed).to_be_hidden()


@pytest.mark.slow
def test_on_a_phone_the_turning_handle_of_a_wide_part_is_in_the_picture(shown):
    """Beyond its ends is no room: the handle is before one, and turns the part as there."""
    line = "[[surface]]\nname = 'line'\nfrom = [-1.5, -1.2]\nto = [3.0, -1.2]\n"
    page = shown(more=line, viewport={"width": 390, "height": 844}, has_touch=True, is_mobile=True)
    page.evaluate("chutelab.bench.inspector.choose('line')")
    box = page.locator("[data-id=turn-line] .room").bounding_box()
    assert box["x"] >= 0.0
    assert box["x"] + box["width"] <= 390.0
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    Hand(page, "touch").drag([(x, y), (x, y - 20.0), (x, y - 40.0)])
    (_, low), (_, high) = given(page)["surface"][0]["points"]
    assert high - low > 0.3
    # In a wide picture it is beyond the end.
    page = shown(more=line, viewport={"width": 1920, "height": 1080})
    page.evaluate("chutelab.bench.inspector.choose('line')")
    ((end, turn),) = page.evaluate(
        "[chutelab.stage.handles.find(({ id }) => id === 'turn-line')].map((h) => [h.from[0], h.x])"
    )
    assert turn > end


@pytest.mark.slow
def test_a_machine_of_twelve_parts_is_built_by_keyboard_alone(empty, tmp_path):
    page = empty()

    def part(letter, *moves):
        """Draw a part: each point is moved to by arrow keys, and set."""
        page.keyboard.press(letter)
        for keys in moves:
            for key in keys.split():
                page.keyboard.press(f"Arrow{key}")
            page.keyboard.press("Enter")
        page.keyboard.press("v")

    left, right, up, down = (f"{way} " * 3 for way in ("Left", "Right", "Up", "Down"))
    # The picture has the focus once the page is there.
    assert page.evaluate("document.activeElement.id") == "picture"
    part("b", up * 2)
    part("l", left * 2, right * 2 + down)
    part("l", right, right + up)
    part("e", left * 3 + down * 2, right * 3)
    part("c", right * 4, right * 2, left + down)
    part("p", left * 4)
    part("g", left * 5 + down * 2)
    part("d", right * 3 + down * 2, right)
    part("r", up * 3 + left, right)
    part("b", up * 2 + right)
    part("l", down * 4 + left * 5, right * 8)
    part("e", down * 3 + right * 5, right * 2)
    made = given(page)
    counts = {key: len(made[key]) for key in ("surface", "conveyor", "plate", "stream")}
    assert counts == {"surface": 6, "conveyor": 2, "plate": 1, "stream": 3}
    # The last one is chosen by Tab, moved and turned by arrows.
    for _ in range(200):
        page.keyboard.press("Tab")
        if page.evaluate("document.activeElement.dataset.id") == "turn-belt2":
            break
    before = given(page)["conveyor"][1]
    page.keyboard.press("ArrowUp")
    after = given(page)["conveyor"][1]
    angles = [np.arctan2(*np.subtract(one["to"], one["from"])[::-1]) for one in (before, after)]
    assert np.degrees(angles[1] - angles[0]) == pytest.approx(1.0, abs=1.0)
    assert angles[1] != angles[0]
    page.keyboard.press("Control+z")
    assert given(page) == made
    assert same_bits(page, tmp_path, 0.8) > 100


def test_the_dashed_example_goes_at_the_first_stroke_and_comes_back_if_nothing_is_drawn(empty):
    page = empty()
    example = page.locator("#stage > .sketch")
    expect(example).to_be_visible()
    page.click("#part-line")
    expect(example).to_be_visible()
    box = page.locator("#stage").bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    expect(example).to_be_hidden()
    page.mouse.up()
    page.keyboard.press("Escape")
    expect(example).to_be_visible()
    page.click("#part-line")
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + 80, y + 40)
    page.mouse.up()
    page.evaluate(DONE)
    expect(example).to_be_hidden()
    assert len(given(page)["surface"]) == 1


# Shown elements with text that share a pixel with the line that says which point is next.
COVERED = """() => {
  const box = document.querySelector(".chip").getBoundingClientRect();
  return [...document.querySelectorAll(".hello, .examples, .parts, .transport, header > *")]
    .filter((one) => one.checkVisibility({ visibilityProperty: true }))
    .filter((one) => {
      const its = one.getBoundingClientRect();
      return its.left < box.right && box.left < its.right
        && its.top < box.bottom && box.top < its.bottom;
    }).map((one) => one.className);
}"""


@pytest.mark.parametrize("width", [1366, pytest.param(1920, marks=pytest.mark.slow)])
def test_nothing_lies_under_what_says_which_point_is_next(empty, width):
    page = empty("de", viewport={"width": width, "height": 768})
    for part in ("line", "arc", "belt"):
        page.click(f"#part-{part}")
        expect(page.locator(".chip")).to_be_visible()
        assert page.evaluate(COVERED) == []
        page.keyboard.press("Escape")
    expect(page.locator(".examples")).to_be_visible()
    # The parts of a machine that is there cover neither it nor what plays it.
    page.click("#begin")
    page.click("#tool-add")
    parts = page.locator("#parts").bounding_box()
    assert page.locator(".transport").bounding_box()["x"] > parts["x"] + parts["width"]
    assert page.evaluate("chutelab.stage.view.free.left") > parts["x"] + parts["width"]
    page.click("#part-arc")
    assert page.evaluate(COVERED) == []


@pytest.mark.slow
def test_the_first_machine_and_the_examples_are_one_click_away(empty):
    page = empty("de")
    expect(page.get_by_text("Bau eine Maschine")).to_be_visible()
    assert page.locator(".examples button").count() == len(EXAMPLES)
    expect(page.locator("#panels")).to_be_hidden()
    page.click("#begin")
    page.evaluate(DONE)
    expect(page.locator(".hello")).to_be_hidden()
    assert page.evaluate("chutelab.lab.recording.tracks.length") == 1
    page.click("#undo")
    expect(page.locator(".hello")).to_be_visible()
    page.click("#example-cascade")
    page.evaluate(DONE)
    assert from_dict(given(page)) == from_dict(describe(load("cascade"))["scene"])
    assert page.inner_text("h1") == words("de").say("title-cascade")


@pytest.mark.slow
def test_dominoes_run_whole_and_a_box_is_made_turned_caught_and_saved(shown, tmp_path):
    page = shown("dominoes")
    expect(page.locator("#lacks")).to_have_count(0)
    assert page.evaluate(WHOLE) == "done"
    ours = chutelab.simulate(from_dict(given(page)), engine="contact")
    angles = "chutelab.lab.recording.tracks.map((track) => track.angle({}))"
    for t in (0.1, 0.2501, 0.7):
        mine = ours.at(t).angle[0]
        assert page.evaluate(angles.format(t)) == pytest.approx(mine, abs=1e-12, nan_ok=True)
    assert mine[:20].max() < -0.5
    assert page.evaluate("chutelab.lab.recording.breaches") == []
    # The one that stands under the pointer is another than the one whose centre is nearest.
    page.evaluate("chutelab.lab.seek(0.7)")
    place = """([i, u, v]) => { const { lab, stage: { view } } = chutelab;
      const track = lab.recording.tracks[i], { x, y } = track.state(lab.t), a = track.angle(lab.t);
      return chutelab.bench.ballAt([view.px(x + u * Math.cos(a) - v * Math.sin(a)),
        view.py(y + u * Math.sin(a) + v * Math.cos(a))]); }"""
    for i in (3, 11, 19):
        for v in (-0.0235, 0.0, 0.0235):
            assert page.evaluate(place, [i, 0.0, v]) == i
    page.click("#tool-add")
    page.focus("#part-box")
    page.keyboard.press("Enter")
    expect(page.locator("#chosen h2")).to_have_text("Box 1")
    # One has no rate, width or spread, and what has corners is no disk that rolls.
    tables = describe(None)["tables"]
    single = {"rate", "width", "bed_height", "speed_spread", "seed"}
    cornered = {"shape", "radius", "points", "density", "rolling_friction"}
    every = {*tables["stream"], *tables["particle"]}
    assert shown_keys(page) == every - single - cornered
    box = given(page)["stream"][-1]
    # Those under way go on as they lie.
    assert page.evaluate(WHOLE) == "done"
    for t in (0.7, 0.78):
        now = page.evaluate(angles.format(t))[:20]
        assert now == pytest.approx(ours.at(t).angle[0][:20], abs=0.02), t
    # There are boxes already, and no material was chosen.
    assert box["particle"] == "domino"
    page.locator("[id='field-own-particle[0].size[0]']").fill("0.012")
    page.locator("[id='field-own-particle[0].size[0]']").press("Enter")
    assert given(page)["particle"][0]["size"] == [0.012, 0.048]
    page.locator("[id$='.angle_deg'][id^='field-own-stream']").fill("30")
    page.locator("[id$='.angle_deg'][id^='field-own-stream']").press("Enter")
    assert given(page)["stream"][-1]["angle_deg"] == 30
    # Its slider reaches further than that now.
    slider = page.locator(".entry:has([id$='.angle_deg'][id^='field-own-stream']) [type=range]")
    assert float(slider.get_attribute("max")) > 30 == float(slider.input_value())
    page.evaluate("chutelab.lab.restart()")
    # The dashes round it are turned, before its release and while it falls.
    assert page.evaluate(WHOLE) == "done"
    turned = """([name, t, i]) => { const { bench, lab } = chutelab;
      bench.inspector.choose(name); lab.seek(t);
      const [[x, y], [u, v]] = document.querySelector(".outline polygon").getAttribute("points")
        .split(" ").map((point) => point.split(",").map(Number));
      return [Math.atan2(y - v, u - x), lab.recording.tracks[i].angle(t)]; }"""
    for t in (0.0, 0.75):
        assert page.evaluate(turned, ["box1", t, 21])[0] == pytest.approx(np.radians(30)), t
    shown, own = page.evaluate(turned, ["row", 0.6, 0])
    assert shown == pytest.approx(own, abs=1e-9)
    assert own < -0.5
    page.evaluate("chutelab.lab.restart()")
    assert same_bits(page, tmp_path, 0.9) > 100


@pytest.mark.parametrize("name", some(["perpendicular", "stream"]))
def test_a_box_is_put_into_a_machine_whose_belt_grips(shown, name, tmp_path):
    """Adhesion carries the balls; the box meets them, and the belt, as all else."""
    page = shown(name)
    page.click("#tool-add")
    page.focus("#part-box")
    page.keyboard.press("Enter")
    expect(page.locator("#chosen h2")).to_have_text("Box 1")
    expect(page.locator("#fault")).to_be_hidden()
    assert page.evaluate(WHOLE) == "done"
    assert page.evaluate("chutelab.lab.recording.breaches") == []
    assert given(page).get("incoming", {}).get("friction", "adhesion") == "adhesion"
    assert same_bits(page, tmp_path, 0.9) > 2


ROLLS = ["--set", "particle.domino.rolling_friction=0.1"]
"""With this boxes are left out of a page: what has corners does not roll."""


def test_what_is_left_of_a_scene_without_its_boxes_runs(opened, tmp_path):
    """That particles meet stands in the scene at the dominoes."""
    path = tmp_path / "gate.html"
    call("live", "domino-gate", *ROLLS, "-o", str(path))
    page = opened(path)
    page.evaluate(DONE)
    expect(page.locator("#fault")).to_be_hidden()
    assert page.evaluate("chutelab.lab.recording.tracks.length") == 2


@pytest.mark.slow
def test_a_scene_that_is_not_shown_whole_says_so_and_opens_the_rest(opened, tmp_path):
    path = tmp_path / "dominoes.html"
    call("live", "dominoes", *ROLLS, "-o", str(path))
    page = opened(path)
    page.evaluate(DONE)
    said = page.inner_text("#lacks")
    assert "20 boxes" in said
    assert "chutelab run dominoes" in said
    left = given(page)
    assert [one["name"] for one in left["surface"]] == ["table", "bell"]
    assert [one["particle"] for one in left["stream"]] == ["ball"]
    assert page.evaluate("chutelab.lab.recording.tracks.length") == 1
    # A fault stands below it, on a wide screen and on a phone.
    page.evaluate("chutelab.lab.change({ 'surface[0].points': [[0, 0], [0, 0]] })")
    for width, height in ((1366, 768), (390, 844)):
        page.set_viewport_size({"width": width, "height": height})
        expect(page.locator("#fault")).to_be_visible()
        notice, fault = (page.locator(one).bounding_box() for one in ("#lacks", "#fault"))
        assert notice["y"] + notice["height"] <= fault["y"]
        seen = """([x, y]) => document.elementsFromPoint(x, y)
          .some((one) => one.closest('#lacks'))"""
        assert page.evaluate(seen, [notice["x"] + 20, notice["y"] + notice["height"] / 2])
    page.get_by_role("button", name="Close").click()
    expect(page.locator("#lacks")).to_have_count(0)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("size", "scheme", "touch"),
    [
        ((390, 844), "light", True),
        pytest.param((1366, 768), "dark", False, marks=pytest.mark.slow),
        pytest.param((800, 1100), "dark", True, marks=pytest.mark.slow),
    ],
)
def test_the_empty_page_and_the_card_are_accessible_and_fingers_hit(empty, size, scheme, touch):
    viewport = {"width": size[0], "height": size[1]}
    page = empty("de", viewport=viewport, color_scheme=scheme, has_touch=touch, is_mobile=touch)
    assert axe(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]
    if touch and size[0] < 720:
        head = page.locator("header").bounding_box()
        assert (head["x"], head["width"]) == (0, size[0]), "from edge to edge, as later"
    page.click("#begin")
    page.evaluate(DONE)
    page.evaluate("chutelab.bench.inspector.choose('incoming')")
    speed = page.locator("#chosen input[type=text]").first
    speed.fill("-3")
    speed.press("Enter")
    assert axe(page) == []
    assert page.evaluate("document.documentElement.scrollWidth") == size[0]
    card = page.locator("#chosen").bounding_box()
    assert card["x"] >= 0.0
    assert card["x"] + card["width"] <= size[0] + 0.5
    least = 44.0 if touch else 24.0
    sizes = page.evaluate("""() => [...document.querySelectorAll(".grip.own .room")]
      .map((e) => e.getBoundingClientRect().width)""")
    assert len(sizes) > 2
    assert min(sizes) >= least
    # Of words, however long, no field is pushed out of the card.
    page.evaluate("chutelab.lab.change({ 'stream.at': [0, 1], 'stream.velocity': [0, 0] })")
    page.evaluate("chutelab.bench.inspector.choose('stream')")
    page.locator("#chosen .more summary").click()
    expect(page.locator("[id^=field-own-stream][id*=velocity]")).to_have_count(2)
    room = page.evaluate("""() => {
      const right = (e) => e.getBoundingClientRect().right;
      const fields = [...document.querySelectorAll("#chosen .entry > *")].map(right);
      return right(document.getElementById("chosen")) - Math.max(...fields);
    }""")
    assert room >= 8.0
