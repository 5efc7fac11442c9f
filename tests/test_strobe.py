from itertools import pairwise

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from PIL import Image

from chutelab import scene, start
from chutelab.engines.simulation import simulate
from chutelab.pictures.plots import strobe
from chutelab.pictures.plots.scenery import strobe_times
from handmade import BELT_TIME, SHOWN, assert_legible, by_hand, expected


def times_of(figure):
    return [text for text in figure.axes[0].texts if text.get_gid() == "time"]


def test_times_stand_beside_the_dots_they_belong_to():
    figure = strobe(by_hand())
    (dots,) = [line for line in figure.axes[0].lines if line.get_gid() == "strobe"]
    labels = times_of(figure)
    assert len(labels) > 10
    for label in labels:
        t = float(label.get_text())
        assert t == pytest.approx(0.05 * round(t / 0.05), abs=1e-12)
        assert np.abs(np.asarray(dots.get_xydata()) - label.xy).sum(axis=1).min() < 1e-12
        if t > BELT_TIME:
            known = expected(np.array([t - BELT_TIME]))[0][0]
            assert np.asarray(label.xy) == pytest.approx(known, abs=1e-12)
        box, (x, y) = label.get_window_extent(), figure.axes[0].transData.transform(label.xy)
        away = np.hypot(max(box.x0 - x, x - box.x1, 0.0), max(box.y0 - y, y - box.y1, 0.0))
        assert 2.0 < away / figure.dpi * 72.0 < 10.0
        places = figure.axes[0].transData.transform(np.asarray(dots.get_xydata()))
        middle = (0.5 * (box.x0 + box.x1), 0.5 * (box.y0 + box.y1))
        nearest = places[np.hypot(*(places - middle).T).argmin()]
        assert nearest == pytest.approx((x, y), abs=1e-9)
    assert all(float(a.get_text()) < float(b.get_text()) for a, b in pairwise(labels))


@pytest.mark.parametrize("name", SHOWN)
def test_no_text_is_cut_off_overlapping_or_small(name):
    figure = strobe(simulate(scene.load(name)))
    FigureCanvasAgg(figure).draw()
    assert_legible(figure, 4.5)
    track = [line for line in figure.axes[0].lines if line.get_gid() in ("track", "surface plate")]
    for label in times_of(figure):
        for line in track:
            path = line.get_path().transformed(line.get_transform())
            assert not path.intersects_bbox(label.get_window_extent(), filled=False), label


def test_still_is_sharp_enough_for_print(tmp_path):
    strobe(by_hand(), path=tmp_path / "strobe.png")
    with Image.open(tmp_path / "strobe.png") as image:
        assert image.size == (2700, 1680)
        assert image.info["dpi"] == pytest.approx((300.0, 300.0), abs=0.1)
    assert [file.name for file in tmp_path.iterdir()] == ["strobe.png"]
    with pytest.raises(FileNotFoundError):
        strobe(by_hand(), path=tmp_path / "nowhere" / "strobe.png")


def test_a_run_that_ends_as_it_leaves_the_belt_has_as_many_dots_as_any():
    """Ten for the action, which is over at once, or ten for a tenth of the track: 5,001 were."""
    run = start("perpendicular")
    run.step(0.3)
    run.set("plate.angle_deg", 5.0)
    run.step(0.2)
    assert 10 <= len(strobe_times(run.recording)) <= 101
