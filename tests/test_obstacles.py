"""First contacts of a disk with straight and round surfaces, against tracks sampled finely."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chutelab.theory.obstacles import Flight, Obstacles, first_in_flight, first_on_pulley

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


def test_a_point_is_caught_in_the_hollow_of_an_arc_and_on_its_back() -> None:
    hollow = ("hollow", (0.0, 0.0), 1.0, -math.pi, math.pi)
    falls = Flight(np.array([0.5, 0.5]), np.zeros(2), G)
    time, index = first_in_flight(falls, Obstacles.of([], [hollow]), 0.0, 2.0)
    assert index == 0
    assert time == pytest.approx(math.sqrt(2.0 * (0.5 + math.sqrt(0.75)) / G), rel=1e-14)
    back = ("back", (0.0, 0.0), 1.0, 0.0, math.pi)
    time, _ = first_in_flight(
        Flight(np.array([0.5, 2.0]), np.zeros(2), G), Obstacles.of([], [back]), 0.1, 2.0
    )
    assert time == pytest.approx(math.sqrt(2.0 * (2.0 - math.sqrt(1.1**2 - 0.25)) / G), rel=1e-14)


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
