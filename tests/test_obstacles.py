"""First contacts of a disk with straight and round surfaces, against tracks sampled finely."""

import math

import numpy as np
import pytest

from chains import tables
from chutelab.machine import build
from chutelab.scene import from_dict
from chutelab.theory.obstacles import Flight, Obstacles, first_in_flight
from chutelab.theory.prediction import free_surfaces


def arc_points(center, size, begin, extent):
    turn = np.linspace(begin, begin + extent, 4001)
    return np.asarray(center) + size * np.stack([np.cos(turn), np.sin(turn)], axis=1)


def distance(track, center, size, begin, extent):
    """From each place of a track to an arc, through the nearest of its points or an end."""
    away = track - np.asarray(center)
    turned = np.mod(np.arctan2(away[:, 1], away[:, 0]) - begin, 2.0 * np.pi)
    ends = arc_points(center, size, begin, extent)[[0, -1]]
    to_ends = np.hypot(*(track[:, None] - ends).transpose(2, 0, 1)).min(axis=1)
    return np.where(turned <= extent, np.abs(np.hypot(*away.T) - size), to_ends)


def flown(seed):
    """Up to its first contact the start of a chain flies free; there a gap has fallen to zero."""
    drawn = tables(seed)
    r, until, start = drawn["particle"]["radius"], drawn["run"]["until"], drawn["stream"]
    flight = Flight(np.array(start["at"]), np.array(start["velocity"]), drawn["gravity"])
    obstacles = Obstacles.of(*free_surfaces(from_dict(drawn, "chain")))
    time, index = first_in_flight(flight, obstacles, r, until)
    machine = build(from_dict(drawn, "chain"))
    way = flight.at(np.linspace(0.0, min(time, until), 3001))
    for piece, name in zip(machine.pieces, machine.names, strict=True):
        assert (piece.gap(way, r) > -1e-9).all(), (seed, name)
    if time < math.inf:
        # It touches, and a little earlier was further away, or is nearer a little later.
        near = flight.at(time + np.array([-1e-6, 0.0, 1e-6]))
        gaps = [
            piece.gap(near, r)
            for piece, name in zip(machine.pieces, machine.names, strict=True)
            if name == obstacles.names[index]
        ]
        before, now, after = min(gaps, key=lambda gap: abs(gap[1]))
        assert abs(now) < 1e-9, seed
        assert before > now if time > 1e-6 else after < now, seed


@pytest.mark.parametrize("count", [60, pytest.param(3000, marks=pytest.mark.slow)])
def test_flights_into_chains_and_bowls(count):
    for seed in range(count):
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
def test_a_touch_is_a_contact_and_a_miss_is_none(lines, bends, time):
    """At the top of a throw it has no speed, and goes back: nothing is crossed."""
    for less, met in [(0.0, time), (1e-9, math.inf)]:
        throw = Flight(np.array([0.0, -less]), np.array([0.0, 2.0]), 10.0)
        found, _ = first_in_flight(throw, Obstacles.of(lines, bends), 0.03, 0.35)
        assert found == pytest.approx(met, abs=1e-6)


@pytest.mark.parametrize("turned", [0.0, 0.3, 0.7])
def test_what_is_touched_from_the_beginning_is_no_contact_without_an_approach(turned):
    """A fall along a wall, past its lower end; and a throw along a ceiling, from which it falls."""
    r, down, along = 0.03, np.array([0.0, -1.0]), np.array([math.cos(turned), math.sin(turned)])
    wall = Obstacles.of([("wall", (r, 0.0), (r, 1.0))])
    assert first_in_flight(Flight(np.array([0.0, 0.5]), down, 10.0), wall, r, 1.0) == (math.inf, -1)
    # Below a ceiling that rises at an angle, in the middle of it.
    across = np.array([-along[1], along[0]])
    ceiling = Obstacles.of([("ceiling", tuple(-along), tuple(along))])
    throw = Flight(-r * across, 2.0 * along, 10.0)
    assert first_in_flight(throw, ceiling, r, 0.2) == (math.inf, -1)
