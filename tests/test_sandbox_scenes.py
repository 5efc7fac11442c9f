"""The laws that the shipped scenes of piles and crowds show, measured on their recordings."""

from __future__ import annotations

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


# Hopper.

D = 0.006
"""Mean diameter of its grains, m."""


def outflow(opening, count):
    """Return grains per second in the steady middle of a run: when 20 % to 70 % cross y = 0."""
    w, wall = 0.5 * opening, 0.1
    sides = {"left": -1.0, "right": 1.0}
    changes = {
        f"surface.{name}.points": [[s * wall, 1.2], [s * wall, wall - w], [s * w, 0.0]]
        for name, s in sides.items()
    }
    changes |= {"surface.gate.points": [[-w, 0.0], [w, 0.0]], "stream.count": count}
    changes |= {"stream.fill": [[-0.095, 0.13], [0.095, 1.1]], "expect": None}
    recording = simulate(sc.load("hopper").with_values(changes))
    crossed = []
    for i in range(count):
        track = recording.track(i)
        y = track["position"][:, 1]
        below = np.flatnonzero(y < 0.0)
        crossed.append(track["t"][below[0]] if len(below) else np.inf)
    crossed = np.sort(crossed)
    low, high = int(0.2 * count), int(0.7 * count)
    return (high - low) / (crossed[high] - crossed[low])


def test_a_wider_hopper_lets_more_out_and_all_of_it():
    narrow, wide = outflow(8 * D, 200), outflow(12 * D, 200)
    assert wide > 1.2 * narrow


@pytest.mark.slow
def test_the_outflow_of_a_hopper_is_beverloos():
    """In two dimensions the flow is C (W - k d)^1.5, with k = 1.3 (1 to 2 in experiments)."""
    openings = np.array([6.5, 8.0, 10.0, 12.0]) * D
    flows = [outflow(opening, 1000) for opening in openings]
    exponent = np.polyfit(np.log(openings - 1.3 * D), np.log(flows), 1)[0]
    assert exponent == pytest.approx(1.5, abs=0.15)


# Heap.


def repose(rolling, count):
    """Return the flanks' mean slope, degrees: a line through the highest grain of each 12 mm."""
    scene = sc.load("heap", [f"particle.rolling_friction={rolling}", f"stream.count={count}"])
    recording = simulate(scene.with_values({"run.until": count / 60.0 + 2.0}))
    x, y = last_places(recording).T
    x, top = np.abs(x[y > 0.0]), (y + recording.particle.radius)[y > 0.0]
    strip = (x // 0.012).astype(int)
    found = np.unique(strip)
    height = np.array([top[strip == n].max() for n in found])
    flank = (height > 0.2 * height.max()) & (height < 0.8 * height.max())
    slope = np.polyfit(0.012 * found[flank], height[flank], 1)[0]
    return np.degrees(np.arctan(-slope))


@pytest.mark.slow
def test_a_heap_is_steeper_the_more_its_grains_resist_rolling():
    low, middle, high = (repose(rolling, 300) for rolling in (0.1, 0.3, 0.8))
    assert 5.0 < low < middle - 4.0
    assert middle + 4.0 < high < 60.0


def test_without_rolling_friction_no_heap_stands():
    flat, heap = (repose(rolling, 120) for rolling in (0.05, 0.8))
    assert heap > flat + 5.0


# Galton board.


def chi_squared(counts):
    """Return that of 13 bins against the binomial of 12 rows; three bins at each end are one."""
    expected = np.array([comb(12, k) for k in range(13)]) / 2.0**12 * counts.sum()
    pooled = np.add.reduceat([counts, expected], [0, 3, 4, 5, 6, 7, 8, 9, 10], axis=1)
    return ((pooled[0] - pooled[1]) ** 2 / pooled[1]).sum()


def test_the_bins_of_the_galton_board_are_binomial():
    recording = simulate(sc.load("galton"))
    x, y = last_places(recording).T
    bins = np.floor(x / 0.024 + 6.5).astype(int)
    assert (y < -0.2721).all(), "all are in the bins"
    # 9 classes, so 8 degrees of freedom: a fair board is above 20.09 once in a hundred times.
    assert chi_squared(np.bincount(bins, minlength=13)) < 20.09


# Mixture.


@pytest.mark.parametrize(
    ("bar", "small", "large", "share"),
    [
        (0.004, [0.002, 0.003], [0.013, 0.015], 0.8),
        # What is as large as a gap lodges in it, and what is smaller lies on that.
        (0.0055, [0.0015, 0.0035], [0.013, 0.015], 0.3),
        pytest.param(0.0015, [0.002, 0.003], [0.005, 0.0055], 0.8, marks=pytest.mark.slow),
    ],
)
def test_who_falls_through_the_screen_is_smaller_than_its_gap(bar, small, large, share):
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


# Gallery.


def test_the_gallery_page_is_what_its_command_makes(tmp_path):
    root = Path(__file__).parents[1]
    command = [sys.executable, root / "tools" / "gallery.py", tmp_path, "--text"]
    subprocess.run(command, check=True, timeout=60)
    page = (tmp_path / "gallery.md").read_bytes()
    assert page == (root / "docs" / "gallery.md").read_bytes()
    pictures = {path.stem for path in (root / "docs" / "gallery").glob("*.png")}
    assert pictures == set(sc.shipped())
