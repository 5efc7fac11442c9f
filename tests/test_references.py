"""The references against closed forms, and against the exact engine where that has an answer."""

from dataclasses import replace
from math import pi, sqrt

import numpy as np
import pytest

from chutelab.engines import exact
from machines import (
    box,
    scene_of,
    thrown,
)
from references import (
    Impact,
    first_impacts,
    henderson,
    inside_surfaces,
    likeness,
    overlaps,
    virial,
    wall_pressure,
)

G = 9.81


# First impacts


def test_likeness_counts_what_is_alike_and_names_what_is_not():
    """Twenty disks that do not meet, in a box: the exact engine knows what each strikes."""
    built = box(20, 3, 2.0, radius=1e-4, friction=0.3, spin=True, end=1.5)
    built = replace(built, interact=False, gravity=G)
    walls = replace(built.segments, friction=np.full(4, 0.2))
    built = replace(built, segments=walls)
    recording = exact.run(built)
    found = first_impacts(built, 1.5)
    both = likeness(found, recording)
    assert both.alike > 20
    assert both.unlike == []
    assert both.off < 1e-13
    assert both.approach < 1e-11
    late = found[3][0]._replace(t=found[3][0].t + 1e-9)
    found[3][0] = late
    found[5].insert(0, Impact(0.01, "box", 1.0))
    (mine, its), (missed, _) = (one[1:] for one in likeness(found, recording).unlike)
    assert mine == late
    assert its.t == pytest.approx(late.t - 1e-9, abs=1e-12)
    assert missed.partner == "box"


def test_a_pair_meets_when_and_as_fast_as_written_here():
    # Two falling disks: g cancels. d = (0.3, 0.04) apart, u = 2 m/s towards each other.
    built = box(2, 0, 1.0)
    releases = replace(
        built.releases,
        position=np.array([[0.3, 0.5], [0.6, 0.54]]),
        velocity=np.array([[1.0, 0.0], [-1.0, 0.0]]),
    )
    found = first_impacts(replace(built, releases=releases, gravity=1.0), 0.3)
    normal = sqrt(0.04**2 - 0.04**2)  # 0.04 m off the centre line: they only touch
    assert normal == 0.0
    assert [one.partner for one in found[0]] != [1]
    releases = replace(releases, position=np.array([[0.3, 0.5], [0.6, 0.52]]))
    found = first_impacts(replace(built, releases=releases, gravity=1.0), 0.3)
    reach = sqrt(0.04**2 - 0.02**2)
    assert found[0][0].t == pytest.approx((0.3 - reach) / 2.0, rel=1e-14, abs=0.0)
    assert found[0][0].approach == pytest.approx(2.0 * reach / 0.04, rel=1e-14, abs=0.0)
    assert (found[0][0].partner, found[1][0].partner) == (1, 0)


@pytest.mark.parametrize("end", [0.75, pytest.param(8.0, marks=pytest.mark.slow)])
def test_a_gas_presses_on_its_walls_as_the_virial_theorem_says(end):
    # d/dt Σ m x·v = 2 K + Σ σ J (pairs) - (walls) ½ a J, with x from the middle and a = side - 2 r.
    count, side, r = 64, 1.0, 0.02
    built = box(count, 1, side)
    found = first_impacts(built, end)
    mass = built.particle.mass
    kinetic = 0.5 * mass * (built.releases.velocity**2).sum()
    every = [one for own in found for one in own]
    pairs = mass * np.array([one.approach for one in every if one.partner != "box"]) / 2.0
    walls = 2.0 * mass * np.array([one.approach for one in every if one.partner == "box"])
    assert len(pairs) > 375 * end
    inside = (2.0 * kinetic * end + 2.0 * r * pairs.sum()) / (2.0 * kinetic * end)
    assert virial(pairs, diameter=2.0 * r, time=end, kinetic=kinetic) == pytest.approx(inside)
    outside = 0.5 * (side - 2.0 * r) * walls.sum() / (2.0 * kinetic * end)
    # Of N disks all over the box Σ m x·v spreads by m √(N <x²> <v²>/2), <x²> = side²/6; at both
    # ends of the time.
    spread = mass * sqrt(2.0 * count * side**2 / 6.0 * kinetic / (mass * count))
    assert abs(inside - outside) < 4.0 * spread / (2.0 * kinetic * end) < 0.16 / end
    pressure = wall_pressure(walls, perimeter=4.0 * side, time=end)
    assert pressure == pytest.approx(walls.sum() / (4.0 * side * end), rel=1e-15, abs=0.0)


# Gas


def test_henderson_has_the_virial_coefficients_of_hard_disks():
    # Z = 1 + 2 η + (16/3 - 4 √3/π) η² + ..., the first two exact, the third 3.12802.
    h = 1e-3
    assert (henderson(h) - henderson(-h)) / (2.0 * h) == pytest.approx(2.0, rel=1e-5)
    third = (henderson(h) - 2.0 + henderson(-h)) / (2.0 * h**2)
    assert third == pytest.approx(16.0 / 3.0 - 4.0 * sqrt(3.0) / pi, rel=1e-3)


# Overlaps


def held(positions, surface):
    """A recording of disks of radius 1 cm that lie where told, gravity 0."""
    built = thrown(scene_of(gravity=0.0, surface=[surface]), positions)
    built = replace(built, interact=False)
    return exact.run(built), built


def test_overlaps_are_those_of_what_touches_in_radii():
    far = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}
    recording, built = held(
        [[0.0, 0.5], [0.019, 0.5], [0.3, 0.5], [0.3, 0.5198], [0.6, 0.5], [0.7, 0.009]], far
    )
    depth = overlaps(recording, [0.0, 0.5])
    assert depth.worst == pytest.approx(0.1, rel=1e-12, abs=0.0)
    assert depth.count == 4
    assert depth.percentile_99 == pytest.approx(0.1, rel=1e-12, abs=0.0)
    depth = inside_surfaces(recording, built, [0.0])
    assert (depth.worst, depth.count) == (pytest.approx(0.1, rel=1e-12, abs=0.0), 1)
