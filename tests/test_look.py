"""The light and the dark colours of pictures and films."""

import matplotlib as mpl
import numpy as np
import pytest
from click.testing import CliRunner
from matplotlib.colors import to_rgb
from matplotlib.text import Text
from PIL import Image

from chutelab import scene
from chutelab.cli import main
from chutelab.engines.simulation import simulate
from chutelab.pictures import plots
from chutelab.pictures.animation import Stage, animate, film, lay_out
from chutelab.pictures.plots import look, style
from chutelab.pictures.plots.measures import sensors
from chutelab.results import Recording
from handmade import by_hand

NAMES = ("slip", "stream-independent")
STAGE = (0x0E, 0x14, 0x1A)


@pytest.fixture(scope="module")
def runs():
    few = {"stream-independent": ["stream.count=60"]}
    return {name: simulate(scene.load(name, few.get(name, ()))) for name in NAMES}


def luminance(colour):
    """Relative luminance as WCAG 2.1 defines it."""
    linear = [c / 12.92 if c <= 0.03928 else ((c + 0.055) / 1.055) ** 2.4 for c in to_rgb(colour)]
    return float(np.dot((0.2126, 0.7152, 0.0722), linear))


def contrast(one, other):
    low, high = sorted((luminance(one), luminance(other)))
    return (high + 0.05) / (low + 0.05)


def drawn(recording):
    """All figures of a recording, and a film's stage at its first moment."""
    yield plots.overlay(recording)
    yield plots.overlay(recording, details=True)
    yield plots.strobe(recording)
    yield sensors(recording)
    for question in ("", "Where does it land?"):
        moments = film(recording, 0.3, 0.4, fps=10, slow=1.0)
        layout = lay_out(recording, width=800, height=450, question=question)
        yield Stage(recording, layout, moments, slow=1.0).figure


@pytest.mark.parametrize(
    ("name", "dark"),
    [
        pytest.param(name, dark, marks=() if dark and n == 0 else pytest.mark.slow)
        for n, name in enumerate(NAMES)
        for dark in (False, True)
    ],
)
def test_all_that_is_written_stands_out(name, dark, runs):
    ground = STAGE if dark else (255, 255, 255)
    ground = tuple(value / 255 for value in ground)
    with look(dark=dark):
        for figure in drawn(runs[name]):
            figure.canvas.draw()
            grounds = [figure, *figure.axes]
            assert all(to_rgb(one.get_facecolor()) == ground for one in grounds)
            for text in figure.findobj(Text):
                if text.get_text():
                    assert contrast(text.get_color(), ground) >= 4.5, text
        for colour in (style.TRACK, style.STRIKE, style.BELT, style.WALL, style.STEEL):
            assert contrast(colour, ground) >= 3.0 - 0.01 * (not dark), colour


def test_a_dark_film_is_dark_in_each_frame_and_so_is_what_is_written_on_it(tmp_path):
    with look(dark=True):
        path = animate(by_hand(), tmp_path / "lesson.gif", fps=5, width=480, height=270)
    with Image.open(path) as gif:
        for index in range(gif.n_frames):
            gif.seek(index)
            pixels = np.asarray(gif.convert("RGB")).reshape(-1, 3)
            assert (pixels == STAGE).all(axis=1).mean() > 0.5
            assert not (pixels == 255).all(axis=1).any()
        # The caption, at the lower left, is as light as the ink.
        caption = np.asarray(gif.convert("RGB"))[-27:, :240]
    assert (caption.reshape(-1, 3) == (0xED, 0xF2, 0xF6)).all(axis=1).any()


def test_the_look_ends_with_its_block():
    before, light = dict(mpl.rcParams), style.TRACK
    with look(dark=True):
        assert light != style.TRACK
    assert (dict(mpl.rcParams), style.TRACK) == (before, light)
    with pytest.raises(AttributeError, match="'COLOUR'"):
        _ = style.COLOUR


def test_the_option_is_for_pictures(tmp_path):
    def run(*args):
        return CliRunner().invoke(main, [*map(str, args)])

    done = run("run", "perpendicular", "--dark", "--out", tmp_path / "a", "--only", "png,npz", "-q")
    assert done.exit_code == 0, done.output
    again = run(
        "show", tmp_path / "a" / "recording.npz", "--out", tmp_path / "b", "--only", "png", "--dark"
    )
    assert again.exit_code == 0, again.output
    for folder in "ab":
        with Image.open(tmp_path / folder / "overlay.png") as picture:
            assert picture.convert("RGB").getpixel((2, 2)) == STAGE
    # What was recorded has no colours.
    assert Recording.load(tmp_path / "a" / "recording.npz").count == 1
    for rest in ([], ["--out", tmp_path / "c", "--only", "csv"]):
        refused = run("run", "perpendicular", "--dark", *rest)
        assert refused.exit_code == 2
        assert "--dark is for pictures" in refused.output
    assert not (tmp_path / "c").exists()
