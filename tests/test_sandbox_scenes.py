"""The laws that the shipped scenes of piles and crowds show, measured on their recordings."""

import re
import subprocess
import sys
from math import comb, hypot
from pathlib import Path

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.engines.simulation import simulate


def last_places(recording):
    return recording.knots["position"][recording.offsets[1:] - 1]


def chi_squared(counts):
    """Return that of 13 bins against the binomial of 12 rows; three bins at each end are one."""
    expected = np.array([comb(12, k) for k in range(13)]) / 2.0**12 * counts.sum()
    pooled = np.add.reduceat([counts, expected], [0, 3, 4, 5, 6, 7, 8, 9, 10], axis=1)
    return ((pooled[0] - pooled[1]) ** 2 / pooled[1]).sum()


@pytest.mark.parametrize("count", [150, pytest.param(500, marks=pytest.mark.slow)])
def test_the_bins_of_the_galton_board_are_binomial(count):
    recording = simulate(sc.load("galton", [f"stream.count={count}"]))
    x, y = last_places(recording).T
    bins = np.floor(x / 0.024 + 6.5).astype(int)
    assert (y < -0.2721).all(), "all are in the bins"
    # 9 classes, so 8 degrees of freedom: a fair board is above 20.09 once in a hundred times.
    assert chi_squared(np.bincount(bins, minlength=13)) < 20.09


@pytest.mark.parametrize(
    ("bar", "small", "large", "share"),
    [
        (0.004, [0.002, 0.003], [0.013, 0.015], 0.8),
        # What is as large as a gap lodges in it, and what is smaller lies on that.
        (0.0055, [0.0015, 0.0035], [0.013, 0.015], 0.3),
        (0.0015, [0.002, 0.003], [0.005, 0.0055], 0.8),
    ],
)
@pytest.mark.slow
def test_what_falls_through_the_screen_is_smaller_than_its_gap(bar, small, large, share):
    changes = {"surface.bars.radius": bar, "stream.fines.count": 100, "stream.lumps.count": 20}
    changes |= {"particle.small.radius": small, "particle.large.radius": large, "expect": None}
    recording = simulate(sc.load("mixture").with_values(changes))
    gap = hypot(0.013, 0.0093) - 2.0 * bar
    size = 2.0 * recording.particle.radius
    # The engine lets disks sink in by up to 3 % of their radius.
    fits, never = size < 0.8 * gap, 0.97 * size > gap
    through = (last_places(recording) < [0.465, -0.333]).all(axis=1)
    assert fits.any()
    assert not through[never].any()
    assert through[fits].mean() > share


@pytest.mark.slow
def test_the_gallery_page_is_what_its_command_makes(tmp_path):
    root = Path(__file__).parents[1]
    command = [sys.executable, root / "tools" / "gallery.py", tmp_path, "--text"]
    subprocess.run(command, check=True, timeout=60)
    page = (tmp_path / "gallery.md").read_bytes()
    assert page == (root / "docs" / "gallery.md").read_bytes()
    pictures = {path.stem for path in (root / "docs" / "gallery").glob("*.png")}
    assert pictures == set(sc.shipped())


@pytest.mark.parametrize("page", ["first-machine", "engineers"])
def test_machines_of_the_docs_run_keep_the_laws_and_arrive(page):
    text = (Path(__file__).parents[1] / "docs" / f"{page}.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```toml\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    assert blocks
    for block in blocks:
        recording = simulate(sc.parse(block))
        assert recording.laws == ()
        assert recording.summary()["fates"] == {"on outgoing": recording.count}
