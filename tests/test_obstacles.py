"""First contacts of a disk with straight and round surfaces, against tracks sampled finely."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import judge
from chains import tables
from chutelab.scene import from_dict
from chutelab.theory.obstacles import Flight, Obstacles, first_in_flight, first_on_pulley
from chutelab.theory.prediction import free_surfaces

G = 9.81
ANGLE = st.floats(-math.pi, math.pi)
EXTENT = st.one_of(st.floats(0.05, 6.2), st.just(2.0 * math.pi))


def arc_points(center: Any, size: float, begin: float, extent: float) -> Any:
    turn = np.linspace(begin, begin + extent, 4001)
    return np.asarray(center) + size * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def distance(track: Any, center: Any, size: float, begin: float, extent: float) -> Any:
    """From each place of a track to an arc, through the nearest of its points or an end."""
    away = track - np.asarray(center)
    turned = np.mod(np.arctan2(away[:, 1], away[:, 0]) - begin, 2.0 * np.pi)
    ends = arc_points(center, size, begin, extent)[[0, -1]]
    to_ends = np.hypot(*(track[:, None] - ends).transpose(2, 0, 1)).min(axis=1)
    return np.where(turned <= extent, np.abs(np.hypot(*away.T) - size), to_ends)


def passed(track: Any, center: Any, size: float, begin: float, extent: float) -> Any:
    """Numbers of the places of a point's track just behind an arc that it has gone through."""
    away = track - np.asarray(center)
    height = np.hypot(*away.T) - size
    side = height < 0.0
    turns = np.flatnonzero(np.diff(height)[1:] * np.diff(height)[:-1] <= 0.0) + 1
    assume((np.abs(height[turns]) > 1e-3).all() and abs(height[-1]) > 1e-2)  # no graze
    turned = np.mod(np.arctan2(away[:, 1], away[:, 0]) - begin, 2.0 * np.pi)
    through = 1 + np.flatnonzero(side[1:] != side[:-1])
    # Which side of an end it passes is as sharp as the samples.
    assume((np.abs(turned[through] - extent) > 0.01).all() and (turned[through] > 0.01).all())
    return through[turned[through] <= extent]


@settings(max_examples=120)
@given(
    st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(0.05, 1.0), ANGLE, EXTENT,
    st.floats(0.0, 5.0), ANGLE, st.one_of(st.just(0.0), st.floats(0.005, 0.2)),
    st.sampled_from([0.0, G]),
)  # fmt: skip
def test_flights_and_arcs(
    x: float, y: float, size: float, begin: float, extent: float, v: float, heading: float,
    r: float, gravity: float,
) -> None:  # fmt: skip
    flight = Flight(
        np.array([0.0, 0.0]), v * np.array([math.cos(heading), math.sin(heading)]), gravity
    )
    bend = ("bend", (x, y), size, begin, extent)
    horizon = 1.0
    track = flight.at(np.linspace(0.0, horizon, 8001))
    far = distance(track, (x, y), size, begin, extent)
    assume(far[0] > r + 1e-3)
    time, index = first_in_flight(flight, Obstacles.of([], [bend]), r, horizon)
    step = float(np.hypot(*np.diff(track, axis=0).T).max())
    assume(not r or abs(far.min() - r) > step)  # not a graze
    inside = np.flatnonzero(far < r) if r else passed(track, (x, y), size, begin, extent)
    if not inside.size:
        assert (time, index) == (math.inf, -1)
        return
    assert index == 0
    assert horizon * (inside[0] - 1) / 8000 - 1e-12 <= time <= horizon * inside[0] / 8000 + 1e-12
    at = flight.at(np.array(time))
    assert distance(at[None], (x, y), size, begin, extent)[0] == pytest.approx(r, abs=1e-9)


@settings(max_examples=120)
@given(
    st.floats(-0.6, 0.6), st.floats(-0.6, 0.6), st.floats(0.02, 0.5), ANGLE, EXTENT,
    st.floats(-0.8, 0.3), st.floats(0.3, 1.2), st.sampled_from([0.0, 0.01, 0.04]),
)  # fmt: skip
def test_rides_and_arcs(
    x: float, y: float, size: float, begin: float, extent: float, start: float, last: float,
    r: float,
) -> None:  # fmt: skip
    ride = 0.3 + r
    turn = np.linspace(start, last, 8001)
    track = ride * np.stack([np.sin(turn), np.cos(turn)], axis=1)
    far = distance(track, (x, y), size, begin, extent)
    bend = ("bend", (x, y), size, begin, extent)
    assume(far[0] > r + 1e-3)
    assume(not r or abs(far.min() - r) > 1e-3)
    angle, index = first_on_pulley(ride, start, last, Obstacles.of([], [bend]), r)
    inside = np.flatnonzero(far < r) if r else passed(track, (x, y), size, begin, extent)
    if not inside.size:
        assert index == -1
        return
    assert index == 0
    low, high = (turn[inside[0] - 1] - start, turn[inside[0]] - start)
    assert low - 1e-9 <= angle <= high + 1e-9


def test_the_first_of_straight_and_round_ones_wins_and_has_its_number() -> None:
    lines = [("floor", (-5.0, -1.0), (5.0, -1.0)), ("far", (-5.0, -9.0), (5.0, -9.0))]
    falls = Flight(np.zeros(2), np.zeros(2), G)
    for height, name in [(-0.5, "peg"), (-1.5, "floor")]:
        both = Obstacles.of(lines, [("peg", (0.0, height), 0.1, 0.0, 2.0 * math.pi)])
        _, index = first_in_flight(falls, both, 0.02, 2.0)
        assert both.names[index] == name
    both = Obstacles.of(lines, [("peg", (0.0, 0.0), 0.1, 0.0, 2.0 * math.pi)])
    assert both.overlapped(np.array([0.0, 0.11]), 0.02) == 2
    assert both.overlapped(np.array([0.0, -0.99]), 0.02) == 0
    assert both.overlapped(np.array([0.0, 0.0]), 0.02) == -1


def flown(seed: int) -> None:
    """Up to its first contact the start of a chain flies free; there a gap has fallen to zero."""
    drawn = tables(seed)
    r, until, start = drawn["particle"]["radius"], drawn["run"]["until"], drawn["stream"]
    flight = Flight(np.array(start["at"]), np.array(start["velocity"]), drawn["gravity"])
    obstacles = Obstacles.of(*free_surfaces(from_dict(drawn, "chain")))
    time, index = first_in_flight(flight, obstacles, r, until)
    pieces = judge.pieces(drawn)
    way = flight.at(np.linspace(0.0, min(time, until), 3001))
    for piece in pieces:
        assert (piece.distance(way) > r - 1e-9).all(), (seed, piece.name)
        assert not piece.crossed(way[:-1], way[1:]).any(), (seed, piece.name)
    if time < math.inf:
        # It touches, and a little earlier was further away, or is nearer a little later.
        (piece,) = (p for p in pieces if p.name == obstacles.names[index])
        before, now, after = piece.distance(flight.at(time + np.array([-1e-6, 0.0, 1e-6]))) - r
        assert abs(now) < 1e-9, seed
        assert before > now if time > 1e-6 else after < now, seed


def test_flights_into_chains_and_bowls() -> None:
    for seed in range(120):
        flown(seed)


@pytest.mark.slow
def test_thousands_of_flights_into_chains_and_bowls() -> None:
    for seed in range(3000):
        flown(seed)


HIGH = 0.2
"""m; a throw upwards at 2 m/s against 10 m/s² turns there, after 0.2 s."""


@pytest.mark.parametrize(
    ("lines", "bends", "time"),
    [
        ([("ceiling", (-1.0, HIGH + 0.03), (1.0, HIGH + 0.03))], [], 0.2),
        ([("wall", (0.0, HIGH + 0.03), (0.0, 1.0))], [], 0.2),
        ([], [("peg", (0.0, HIGH + 0.13), 0.1, 0.0, 2.0 * math.pi)], 0.2),
        ([], [("dome", (0.0, HIGH - 0.07), 0.1, 0.0, math.pi)], 0.2),
    ],
)  # fmt: skip
def test_a_touch_is_a_contact_and_a_miss_is_none(lines: Any, bends: Any, time: float) -> None:
    """At the top of a throw it has no speed, and goes back: nothing is crossed."""
    for less, met in [(0.0, time), (1e-9, math.inf)]:
        throw = Flight(np.array([0.0, -less]), np.array([0.0, 2.0]), 10.0)
        found, _ = first_in_flight(throw, Obstacles.of(lines, bends), 0.03, 0.35)
        assert found == pytest.approx(met, abs=1e-6)
