"""Which disks can meet, and when: against all pairs, and against lines stepped finely."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chutelab.stepper.meetings import candidates, encounter, meeting, neighbours

LONG = 1e250
"""s; longer than it takes any of these to meet."""


def meetings(x, y, u, v, reach, span=LONG):
    """When disks meet, inf if not within the span, and how fast they approach then, else 0."""
    apart = np.array([x, y, u, v])
    which, when, speed = meeting(apart, reach, span)
    t, approach = np.full(apart.shape[1:], inf), np.zeros(apart.shape[1:])
    soon = when <= np.broadcast_to(span, t.shape).ravel()[which]
    t.ravel()[which[soon]], approach.ravel()[which[soon]] = when[soon], speed[soon]
    assert (t.ravel().tolist(), approach.ravel().tolist()) == one_by_one(apart, reach, span)
    return t, approach


def one_by_one(apart, reach, span):
    """The same, each of the candidates asked alone."""
    t, approach = [inf] * apart[0].size, [0.0] * apart[0].size
    spans, paths = np.broadcast_to(span, apart.shape[1:]).ravel(), apart.reshape(4, -1).T.tolist()
    for n in candidates(apart, reach, span).tolist():
        when, speed = encounter(paths[n], reach)
        if when <= spans[n]:
            t[n], approach[n] = when, speed
    return t, approach


def pairs(first, second):
    return {(min(a, b), max(a, b)) for a, b in zip(first.tolist(), second.tolist(), strict=True)}


def all_pairs(low, high):
    """Every two boxes, compared one by one; sides that touch overlap."""
    found = set()
    for a in range(len(low)):
        for b in range(a + 1, len(low)):
            if np.all(low[a] <= high[b]) and np.all(low[b] <= high[a]):
                found.add((a, b))
    return found


@settings(max_examples=100)
@given(
    seed=st.integers(0, 2**31),
    count=st.integers(0, 40),
    size=st.floats(0.0, 0.5),
    grid=st.booleans(),
)
def test_neighbours_are_all_boxes_that_overlap(seed, count, size, grid):
    rng = np.random.default_rng(seed)
    low = rng.uniform(-1.0, 1.0, (count, 2))
    sides = rng.uniform(0.0, size, (count, 2))
    if grid:
        # Many sides that coincide.
        low, sides = np.round(4.0 * low) / 4.0, np.round(4.0 * sides) / 4.0
    first, second = neighbours(low.T, (low + sides).T)
    assert len(first) == len(pairs(first, second))  # each pair once
    assert not np.any(first == second)
    assert pairs(first, second) == all_pairs(low, low + sides)


def test_neighbours_of_a_thousand_in_a_heap():
    rng = np.random.default_rng(1)
    low = rng.uniform(0.0, 1.0, (1000, 2))
    first, second = neighbours(low.T, low.T + 0.02)
    gap = np.abs(low[:, None] - low).max(axis=2)
    expected = np.argwhere(np.triu(gap <= 0.02, 1))
    assert len(first) == len(expected) > 100
    assert pairs(first, second) == set(map(tuple, expected.tolist()))


def test_a_wide_box_is_the_neighbour_of_all_below_it():
    low = np.array([[-10.0, 0.0], *([float(x), 0.5] for x in range(5)), [0.0, 2.0]])
    high = low + 0.1
    high[0] = [10.0, 1.0]
    assert pairs(*neighbours(low.T, high.T)) == {(0, n) for n in range(1, 6)}


@settings(max_examples=200)
@given(
    place=st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    velocity=st.tuples(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0)),
    reach=st.floats(0.01, 0.2),
)
def test_at_the_meeting_the_distance_is_the_reach_and_before_it_is_more(place, velocity, reach):
    (x, y), (u, v) = place, velocity
    apart, speed = np.hypot(x, y), np.hypot(u, v)
    assume(apart > reach * (1.0 + 1e-6))
    (t,), (approach,) = meetings(*(np.array([a]) for a in (x, y, u, v)), reach)
    nearest = abs(x * v - y * u) / speed if speed > 0.0 else apart
    if 0.0 < speed < 1e-150:
        # Its square is no number; that they meet at all is beyond all time.
        assert t > 1e100
        return
    if x * u + y * v >= 0.0 or nearest >= reach:
        assert t == inf
        assert approach == 0.0
        return
    assume(nearest < reach * (1.0 - 1e-9))
    dx, dy = x + t * u, y + t * v
    assert np.hypot(dx, dy) == pytest.approx(reach, abs=1e-13 * (apart + speed * t))
    assert approach == pytest.approx(-(dx * u + dy * v) / reach, rel=1e-6, abs=1e-12)
    earlier = np.linspace(0.0, t, 200)[:-1]
    assert np.all(np.hypot(x + earlier * u, y + earlier * v) > reach * (1.0 - 1e-12))


@pytest.mark.parametrize("below", [1e-4, 1e-8, 1e-12, 1e-14])
def test_grazing_loses_no_digits(below):
    # Past at (1 - below) of the reach: the approach is speed √(2 below - below²).
    reach, speed = 0.008, 2.0
    miss = reach * (1.0 - below)
    (t,), (approach,) = meetings(
        np.array([-0.1]), np.array([miss]), np.array([speed]), np.array([0.0]), reach
    )
    part = 1.0 - miss / reach  # what of `below` a float keeps
    leg = sqrt(part * (2.0 - part))
    assert approach == pytest.approx(speed * leg, rel=1e-16 / part + 1e-14)
    assert t == pytest.approx((0.1 - reach * leg) / speed, rel=1e-13 + 1e-16 / leg)


@pytest.mark.parametrize(("u", "t", "approach"), [(-2.0, 0.0, 2.0), (2.0, inf, 0.0)])
@pytest.mark.parametrize("share", [1.0, 0.9, 0.5])
def test_disks_that_overlap_meet_at_once_or_never(u, t, approach, share):
    x = np.array([0.008 * share])
    found = meetings(x, np.zeros(1), np.array([u]), np.zeros(1), 0.008)
    assert found[0] == pytest.approx([t], abs=1e-16)
    assert found[1] == pytest.approx([approach], rel=1e-14)


def test_disks_at_rest_to_each_other_never_meet():
    t, approach = meetings(np.array([0.1, 0.008]), np.zeros(2), np.zeros(2), np.zeros(2), 0.008)
    assert t.tolist() == [inf, inf]
    assert approach.tolist() == [0.0, 0.0]


@settings(max_examples=200)
@given(
    seed=st.integers(0, 2**31),
    scale=st.sampled_from([1e-6, 1.0, 1e6]),
    share=st.sampled_from([0.5, 1.0 - 1e-12, 1.0, 1.0 + 1e-12, 2.0]),
)
def test_asked_within_a_span_it_finds_what_meets_within_it(seed, scale, share):
    # Rows with a span each; some spans end when, or a rounding before or after, two meet.
    rng = np.random.default_rng(seed)
    apart = rng.uniform(-1.0, 1.0, (4, 3, 20))
    apart[:2] *= scale
    reach = 0.2 * scale
    whole, approach = meetings(*apart, reach)
    first = np.minimum(whole.min(axis=1), LONG)
    span = share * first[:, None]
    t, speed = meetings(*apart, reach, span)
    assert np.array_equal(t, np.where(whole <= span, whole, inf))
    assert np.array_equal(speed, np.where(whole <= span, approach, 0.0))
