"""Texts from users, titles, names, paths: shown as they are, and never obeyed."""

import re
from functools import cache

import pytest
from click.testing import CliRunner
from matplotlib.cbook import is_math_text
from matplotlib.text import Text

import chutelab
from chutelab.cli import main
from chutelab.engines.simulation import simulate
from chutelab.pictures import plots
from chutelab.pictures.animation import animate
from chutelab.pictures.plots.measures import measured
from chutelab.pictures.plots.studies import scan, spread, sweep_figure
from chutelab.scene import SceneError, from_dict, parse, to_dict, to_toml
from chutelab.studies.measured import read, residuals
from typed import solve, sweep, uncertainty

NAME = "$x_{1$\x1b\N{RIGHT-TO-LEFT OVERRIDE}</b>漢"
TITLE = f"Cost \\$5 or $\\frac{{\n\t\x9b2J {NAME} <script>alert(1)</script> & $y$ 🎈"
HOSTILE = re.compile(r"[\x00-\x09\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]")


@cache
def scene(name="perpendicular"):
    told = to_dict(chutelab.load(name))
    told["title"] = TITLE
    # Below the first quarter of the way from plate to belt.
    told["surface"] = [{"name": NAME, "from": [0.4, -0.6], "to": [0.7, -0.6], "speed": -1.0}]
    return from_dict(told, "evil.toml")


@cache
def run():
    return simulate(scene())


def figures():
    yield "overlay", lambda: plots.overlay(run())
    yield "strobe", lambda: plots.strobe(run())
    key = f"surface.{NAME}.speed"
    yield "sweep", lambda: sweep_figure(sweep(scene(), [f"{key}=0:1:3"]), "landing.x.mean")
    two = [f"{key}=0:1:3", "plate.restitution=0,1"]
    yield "sweep over two", lambda: sweep_figure(sweep(scene(), two), "landing.x.mean")
    struck = f"impact.{NAME}.vx"
    yield "scan", lambda: scan(solve(scene(), "plate.restitution=0.3:0.6", f"{struck}=-1"))
    doubt = ["plate.restitution=0.5±0.1", f"{key}=0±0.1"]
    yield "spread", lambda: spread(uncertainty(scene(), doubt, [struck], samples=64))
    yield "measured", lambda: measured(residuals(scene(), read("perpendicular-track")))


@pytest.mark.parametrize(
    ("name", "draw"),
    [
        # SciPy's sampling takes seconds.
        pytest.param(*one, id=one[0], marks=[pytest.mark.slow] if one[0] == "spread" else [])
        for one in figures()
    ],
)
def test_pictures_write_texts_as_they_are(tmp_path, name, draw):
    # Warnings of missing glyphs are errors here, as is mathematics that cannot be parsed.
    figure = draw()
    figure.write(tmp_path / f"{name}.png")
    said = [text.get_text() for text in figure.findobj(Text)]
    theirs = [text for text in said if "Cost" in text or "x_{1" in text]
    assert any("Cost" in text for text in theirs)
    for text in theirs:
        assert not is_math_text(text)
        assert not HOSTILE.search(text)
    assert any(r"\$x_{1\$" in text for text in theirs)


def test_a_film_writes_texts_as_they_are(tmp_path):
    path = tmp_path / "lesson.gif"
    animate(run(), path, width=320, height=180, fps=10, slow=1.0, question=TITLE)
    assert path.stat().st_size > 1000


@pytest.fixture
def evil(tmp_path):
    path = tmp_path / "evil\x1b]0;t\x07.toml"
    path.write_text(to_toml(scene()), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    "args",
    [
        ["run"],
        ["check"],
        ["verify"],
        ["stress"],
        ["sweep", "--vary", "plate.restitution=0,1"],
        ["solve", "--vary", "plate.restitution=0.3:0.6", "--target", f"impact.{NAME}.vx=-1"],
        ["run", "--set", f"surface.{NAME}.colour=1"],
        ["run", "--out", "/dev/null/\x9b31m"],
        ["compare", "--data", "no\x1b[2Jne"],
        ["show"],
    ],
    ids=lambda args: args[0],
)
@pytest.mark.parametrize("colour", [False, True])
def test_a_terminal_is_told_nothing_to_obey(monkeypatch, evil, args, colour):
    if colour:
        monkeypatch.setenv("FORCE_COLOR", "1")
    ran = CliRunner().invoke(main, [args[0], str(evil), *args[1:]], color=True)
    assert ran.exit_code in (0, 2), ran.output
    # What rich colours with is all there is.
    said = re.sub(r"\x1b\[[\d;]*m", "", ran.output) if colour else ran.output
    assert not HOSTILE.search(said)
    assert r"\x1b" in said or r"\x9b" in said


def test_a_scene_that_is_written_can_be_read_whatever_is_said_of_it():
    again = parse(to_toml(scene(), f"{NAME}: \0\x1b\x7f\r\n\N{LINE SEPARATOR}x = 1"))
    assert again == scene().model_copy(update={"expect": ()})


@pytest.mark.parametrize(
    ("told", "key"),
    [
        ({"surface": [{"name": "n\udcff", "from": [-1, -9], "to": [1, -9]}]}, "surface[0].name"),
        ({"title": "\ud83c"}, "title"),
        ({"run": {"x\udcff": 1}}, 'run."x\\udcff"'),
        ({"\udcff": {}}, '"\\udcff"'),
    ],
)
def test_half_a_character_is_refused_with_its_place(told, key):
    with pytest.raises(SceneError) as raised:
        from_dict({**to_dict(chutelab.load("free-fall")), **told})
    assert raised.value.key == key
    assert "must be Unicode" in str(raised.value)


def test_a_scene_without_a_title_has_that_of_its_file_whatever_that_is(tmp_path):
    told = to_dict(chutelab.load("free-fall"))
    del told["title"]
    assert from_dict(told, "a/b\x1b\udcff.toml").title == r"b\x1b\udcff"
    assert len(from_dict(told, "\udcff" * 250 + ".toml").title) == 200
