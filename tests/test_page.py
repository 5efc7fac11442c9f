"""The page as a file: what is in it, what is refused, and that it is all there or not at all."""

from __future__ import annotations

import base64
import hashlib
import json
import re

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab import scene as scenes
from chutelab.cli import main
from chutelab.pictures.live import page, runs
from chutelab.results import Kind
from chutelab.scene.variants import Vary
from chutelab.util.errors import InputError

ANGLES = "plate.angle_deg=-20:70:46"
FEW = "plate.angle_deg=0,20,40"


def data_of(html):
    text = re.search(r'<script type="application/json" id="data">(.*?)</script>', html, re.DOTALL)[
        1
    ]
    return json.loads(text)


def doubles(text):
    return np.frombuffer(base64.b64decode(text), dtype="<f8")


@pytest.fixture(scope="module")
def inclined():
    return scenes.load("inclined-40", ["plate.distance=0.07"])  # missed from 66° on


@pytest.fixture(scope="module")
def html(inclined):
    return page.html(inclined, [ANGLES])


def test_one_particle_in_46_variants_is_a_small_file(html):
    assert len(html.encode()) < 200_000
    data = data_of(html)
    assert [len(s["values"]) for s in data["sliders"]] == [46]
    assert len(data["variants"]) == 46


def test_even_one_that_bounces_to_rest_stays_under_half_a_megabyte():
    scene = scenes.load("belt-landing")
    assert len(page.html(scene, ["plate.restitution=0:1:46"]).encode()) < 500_000


def test_the_knots_in_the_file_are_the_recording_s_to_the_bit(inclined, html):
    data = data_of(html)
    columns = {name: doubles(text) for name, text in data["columns"].items()}
    base = 0
    for angle, variant in zip(data["sliders"][0]["values"], data["variants"], strict=True):
        count = variant["offsets"][-1]
        if not variant["fault"]:
            scene = scenes.from_dict(
                {**scenes.to_dict(inclined)}, "x", [f"plate.angle_deg={angle}"]
            )
            knots = chutelab.simulate(scene).knots
            assert len(knots) == count
            mine = {name: values[base : base + count] for name, values in columns.items()}
            np.testing.assert_array_equal(mine["t"], knots["t"])
            np.testing.assert_array_equal(mine["x"], knots["position"][:, 0])
            np.testing.assert_array_equal(mine["vy"], knots["velocity"][:, 1])
            np.testing.assert_array_equal(mine["belt_work"], knots["entries"][:, 0])
        base += count
    assert base == data["knots"]
    assert "omega" not in columns, "nothing turns, so there is no column of zeros"


def test_surfaces_turn_with_the_plate(html):
    data = data_of(html)
    rows = doubles(data["segments"]).reshape(-1, 7)
    plates, base = [], 0
    for variant in data["variants"]:
        names = [variant["surfaces"][i] for i in variant["owner"]]
        plates.append(rows[base + names.index("plate")])
        base += len(names)
    assert base == len(rows)
    x0, y0, x1, y1 = np.array(plates)[:, :4].T
    turned = np.degrees(np.arctan2(x0 - x1, y1 - y0))
    np.testing.assert_allclose(turned, np.linspace(-20.0, 70.0, 46), rtol=0, atol=1e-9)


def test_figures_agree_with_the_recording_and_with_the_parabola(inclined, html):
    figures = {f["name"]: f for f in data_of(html)["figures"]}
    landing = figures["landing.x"]
    index = 30  # 40 degrees, the scene itself
    recording = chutelab.simulate(inclined)
    event = recording.select(Kind.LANDING)[0]
    assert landing["simulated"][index] == event["position"][0]
    assert landing["analytic"][index] == pytest.approx(event["position"][0], abs=1e-12)
    assert figures["v2"]["analytic"][index] == pytest.approx(
        figures["v2"]["simulated"][index], rel=1e-12, abs=0.0
    )
    books = chutelab.results.Recording.energy_at(recording, [recording.knots["t"].max()])
    assert figures["ledger.belt_work"]["simulated"][index] == pytest.approx(books["belt_work"][0])
    assert landing["unit"] == "m"


def test_what_cannot_be_run_is_there_with_its_reason_and_the_flight_past_the_plate(html):
    data = data_of(html)
    last = data["variants"][-1]
    assert "never meets the plate" in last["fault"]
    assert "outgoing" not in last["surfaces"]
    assert "plate" in last["surfaces"]
    assert all(f["simulated"][-1] is None for f in data["figures"])


def test_values_that_make_no_scene_are_there_with_their_reason(inclined):
    data = data_of(page.html(inclined, ["plate.restitution=0.5,1.5"]))
    good, bad = data["variants"]
    assert good["fault"] == ""
    assert bad == {"fault": bad["fault"]}
    assert "must be a number from 0 to 1" in bad["fault"]


def test_sliders_begin_near_the_scene_s_own_values(html):
    slider = data_of(html)["sliders"][0]
    assert slider["values"][slider["start"]] == 40.0
    assert slider["unit"] == "°"
    assert slider["label"] == "Angle α from the vertical"


def test_two_sliders_give_all_combinations_the_last_one_fastest(inclined):
    text = page.html(inclined, [Vary("incoming.speed", (1.0, 2.0)), "plate.restitution=0,0.5,1"])
    data = data_of(text)
    assert len(data["variants"]) == 6
    landings = next(f for f in data["figures"] if f["name"] == "landing.x")["simulated"]
    for index, (speed, restitution) in enumerate((s, e) for s in (1, 2) for e in (0, 0.5, 1)):
        changes = ["plate.distance=0.07", f"incoming.speed={speed}"]
        changes.append(f"plate.restitution={restitution}")
        try:
            recording = chutelab.simulate(scenes.load("inclined-40", changes))
        except scenes.SceneError:
            assert landings[index] is None
            continue
        assert landings[index] == recording.select(Kind.LANDING)[0]["position"][0]


def test_a_stream_has_all_its_particles_and_means():
    scene = scenes.load("stream-independent", ["stream.count=40", "stream.bed_height=0.05"])
    data = data_of(page.html(scene, ["plate.angle_deg=0,5"]))
    assert [len(v["offsets"]) for v in data["variants"]] == [41, 41]
    figures = {f["name"]: f["simulated"] for f in data["figures"]}
    landed = chutelab.simulate(scene).select(Kind.LANDING)["position"][:, 0]
    assert figures["landing.x.mean"][0] == pytest.approx(landed.mean())
    assert figures["landing.x.spread"][0] == pytest.approx(landed.std())


def test_particles_that_interact_are_stepped():
    scene = scenes.load("stream", ["stream.count=3"])
    data = data_of(page.html(scene))
    assert data["engine"] == ["contact"]
    assert data["sliders"] == []


def test_the_same_input_gives_the_same_bytes(inclined, tmp_path):
    first = page.write(inclined, [FEW], tmp_path / "a.html")
    second = page.write(inclined, [FEW], tmp_path / "b.html")
    assert first.path.read_bytes() == second.path.read_bytes()
    assert first.size == len(first.path.read_bytes())
    assert (first.variants, first.faults) == (3, {})


def test_nothing_is_fetched_and_only_this_script_and_style_may_run(html):
    for text in re.findall(
        r'(?:src|href|url)\s*[=(]\s*"?([^"\s>)]*)', html.partition("<script")[0]
    ):
        assert text == "data:,"
    policy = re.search(r'Content-Security-Policy" content="([^"]*)"', html)[1]
    assert policy.startswith("default-src 'none';")
    for tag in ("script", "style"):
        inside = re.findall(rf"<{tag}>(.*?)</{tag}>", html, re.DOTALL)
        assert len(inside) == 1
        digest = base64.b64encode(hashlib.sha256(inside[0].encode()).digest()).decode()
        assert f"{tag}-src 'sha256-{digest}'" in policy


def test_titles_cannot_break_out():
    title = '</script><script>alert(1)</script> "&'
    scene = scenes.load("inclined-40", [f"title={json.dumps(title)}"])
    text = page.html(scene, home=("<All>", 'x".html'))
    assert "alert(1)</script>" not in text.replace("&lt;", "")
    assert "&lt;/script&gt;" in text
    assert '<a class="home" href="x&quot;.html">&lt;All&gt;</a>' in text
    assert data_of(text)["variants"]


@pytest.mark.parametrize(
    ("name", "changes", "varies", "said"),
    [
        ("stream-independent", [], [], "stream.count = 10000: a page shows at most 200 particles"),
        ("stream", ["stream.count=2"], ["plate.angle_deg=0:12:25"], "25 variants are stepped"),
        ("inclined-40", [], ["plate.restitution=2,3"], "no variant can be run"),
    ],
)
def test_too_much_for_a_page_is_refused(name, changes, varies, said):
    with pytest.raises(InputError, match=re.escape(said)):
        page.html(scenes.load(name, changes), varies)


def test_too_many_knots_are_refused_before_all_is_run(inclined, monkeypatch):
    monkeypatch.setattr(runs, "MOST_KNOTS", 15)
    done = []
    with pytest.raises(InputError, match=r"3 of 46 variants have .* at most 15 fit"):
        runs.study(inclined, ["plate.angle_deg=20:65:46"], done.append)
    assert done == [1 / 46, 2 / 46]


def test_too_many_variants_are_refused(inclined):
    with pytest.raises(InputError, match="40 × 40 variants, at most 1000 are allowed"):
        page.html(inclined, ["gravity=1:2:40", "plate.angle_deg=0:1:40"])


def call(*arguments, code=0):
    result = CliRunner().invoke(main, ["page", *map(str, arguments)])
    assert result.exit_code == code, result.output
    return result


def test_the_command_writes_beside_one_and_says_what(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    far = "--set", "plate.distance=0.07"
    told = call("inclined-40", *far, "--vary", "plate.angle_deg=60,70").stdout
    assert re.match(r"wrote inclined-40\.html, \d+ kB: 2 variants\n1 of them cannot be run", told)
    assert "at 70: outgoing.drop_from" in told
    assert [path.name for path in tmp_path.iterdir()] == ["inclined-40.html"]


def test_the_command_takes_overrides_and_a_name_and_can_be_quiet(tmp_path):
    file = tmp_path / "mine.html"
    file.write_text("old")
    assert call("inclined-40", "--set", "plate.angle_deg=20", "-o", file, "-q").output == ""
    (landing,) = (f for f in data_of(file.read_text())["figures"] if f["name"] == "landing.x")
    recording = chutelab.simulate(scenes.load("inclined-40", ["plate.angle_deg=20"]))
    assert landing["simulated"] == [recording.select(Kind.LANDING)[0]["position"][0]]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["--vary", "plate.angel_deg=1,2"], "unknown key; did you mean plate.angle_deg?"),
        (["--vary", "plate.angle_deg=1:1:9"], "the range is empty: from 1 to 1"),
        (["--vary", "plate.angle_deg=1:2:0"], "COUNT = 0; it must be a whole number from 1"),
        (["--vary", "plate.angle_deg=a:2:3"], "a is not a number"),
        (["--vary", "plate.angle_deg"], "must be KEY=FROM:TO:COUNT"),
        (["--vary", "run.engine=1,2"], "run.engine is no number"),
        (["--vary", "gravity=1,2", "--vary", "gravity=3,4"], "gravity is varied already"),
        (["--vary", "a=1", "--vary", "b=1", "--vary", "c=1"], "at most 2 keys can be varied"),
        (["--vary", "gravity=0:9:2000"], "2000 variants, at most 1000 are allowed"),
        (["--vary", "plate.restitution=2"], "no variant can be run"),
        (["-o", "."], ". is a folder"),
        (["-o", "no/where.html"], "there is no folder no"),
        (["--set", "plate.angle_deg=100"], "plate.angle_deg = 100"),
    ],
)
def test_what_cannot_be_used_is_refused_and_nothing_is_written(
    tmp_path, monkeypatch, arguments, said
):
    monkeypatch.chdir(tmp_path)
    result = call("inclined-40", *arguments, code=2)
    assert said in result.stderr
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []
