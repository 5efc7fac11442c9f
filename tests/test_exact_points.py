"""Mass points at corners, which no size keeps on their side, and pieces that stand on an arc."""

from math import cos, radians, sin

import numpy as np
import pytest

import chains
from chutelab import simulate
from chutelab.engines import exact
from chutelab.machine import build
from chutelab.scene import SceneError, from_dict


def ran(tables, *, radius=0.0, aside=0.0):
    """Return the run of a chain's tables for another radius, m, from a place so far aside, m."""
    x, y = tables["stream"]["at"]
    changed = {
        "particle": {**tables["particle"], "radius": radius, "spin": False},
        "stream": {**tables["stream"], "at": [x + aside, y]},
        "run": {"until": min(tables["run"]["until"], 1.0)},
    }
    return exact.run(build(from_dict({**tables, **changed})))


def parted(one, other):
    """Return how far two runs come apart within the time of both, m."""
    until = min(run.track(0)["t"][-1] for run in (one, other))
    places = [run.at(np.linspace(0.0, until, 300))[0][:, 0] for run in (one, other)]
    return np.hypot(*(places[0] - places[1]).T).max()


def is_decided(tables):
    """Tell whether a point and two small disks that start 1 nm aside go the same way.

    A point that falls exactly on an edge may go either way; so may a disk there.
    """
    points = [ran(tables, aside=aside) for aside in (-1e-9, 1e-9)]
    disks = [ran(tables, radius=radius) for radius in (1e-7, 3e-7)]
    return max(parted(*points), parted(*disks)) < 1e-4


RIMS = [146, 270]
"""Chains on which a point falls back vertically, onto the very rim of the bowl that it left,
from wherever it starts; the edge of another piece, which a disk in the bowl passes, strikes it."""

GAP = 2872
"""A chain whose ends are 0.18 µm apart, by the rounding of its numbers: a point falls between them,
disks of 0.1 µm and more rest on both."""


def off_the_limit(seeds):
    """Return where a point goes another way than a disk of 0.1 µm, and the share decided."""
    drawn = [(seed, chains.tables(seed)) for seed in seeds]
    decided = [(seed, tables) for seed, tables in drawn if is_decided(tables)]
    off = [seed for seed, tables in decided if parted(ran(tables), ran(tables, radius=1e-7)) > 1e-3]
    return off, len(decided) / len(drawn)


def test_a_point_is_the_limit_of_small_disks():
    off, decided = off_the_limit(range(300, 325))
    assert off == []
    assert decided > 0.8


@pytest.mark.slow
def test_a_point_is_the_limit_of_small_disks_on_thousands():
    off, decided = off_the_limit(range(3000))
    assert off == [*RIMS, GAP]
    assert decided > 0.8


RIDES = [(120, -3.0), (100, 0.0), (100, -1.0), (80, 1.0), (60, 3.0), (85, 0.5)]
"""Where on the arc a disk begins, degrees, and how fast, m/s, > 0 counterclockwise."""


@pytest.mark.parametrize("tilt", [5, 10, 30, 90, 150, 172])
def test_a_disk_rides_over_an_arc_up_to_what_stands_on_it(tilt):
    """A spoke on the top of a smooth arc only stops what comes against it."""
    arc = {"name": "arc", "center": [0.0, 0.0], "radius": 1.0, "from_deg": 0.0, "to_deg": 180.0}
    x, y = 0.5 * cos(radians(tilt)), 1.0 + 0.5 * sin(radians(tilt))
    spoke = {"name": "spoke", "from": [0.0, 1.0], "to": [x, y]}
    smooth = {"friction": 0.0, "restitution": 0.0}
    met = 0
    for degrees, speed in RIDES:
        across, up = cos(radians(degrees)), sin(radians(degrees))
        drawn = {
            "gravity": 9.81,
            "particle": {"radius": 0.1, "mass": 0.01, "spin": False},
            "surface": [arc | smooth, spoke | smooth],
            "stream": {
                "at": [1.1 * across * (1.0 + 1e-12), 1.1 * up * (1.0 + 1e-12)],
                "velocity": [-speed * up, speed * across],
            },
            "run": {"until": 0.5, "dt": 1e-4},
        }
        try:
            build(from_dict(drawn))
        except SceneError:
            # The disk would begin in the spoke.
            continue
        run = simulate(from_dict(drawn), engine="exact")
        assert not run.laws
        other = simulate(from_dict(drawn), engine="contact")
        times = np.linspace(0.0, 0.49, 50)
        np.testing.assert_allclose(run.at(times)[0], other.at(times)[0], rtol=0, atol=5e-4)
        met += len(run.select("impact", surface="spoke"))
    assert met
