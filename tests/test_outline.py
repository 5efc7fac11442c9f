"""When a flying disk first touches the outline of the solids: against formulas and brute force."""

from __future__ import annotations

from collections import Counter
from math import acos, cos, hypot, inf, sin, sqrt

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from chutelab.machine import build
from chutelab.scene import parse
from chutelab.stepper.outline import Outline
from chutelab.stepper.solids import HALF_THICKNESS, solids

R, G = 0.01, 9.81
FLOOR = ((-1.0, 0.0), (1.0, 0.0))
THICK = 2.0 * HALF_THICKNESS


LONG = 1e3
"""s; longer than any flight here."""


def outline(*lines, gravity=G, at=(0.3, 5.0)):
    """Outline of lines; their struck faces look to `at`."""
    text = f"gravity = {gravity}\n[particle]\nradius = {R}\n"
    text += f"[stream]\nat = [{at[0]}, {at[1]}]\nvelocity = [0.0, 0.0]\n[run]\nuntil = 1.0\n"
    for n, ((ax, ay), (bx, by)) in enumerate(lines):
        text += f'[[surface]]\nname = "s{n}"\nfrom = [{ax}, {ay}]\nto = [{bx}, {by}]\n'
    machine = build(parse(text))
    return Outline(solids(machine), 0.0, R, gravity)


def drum(radius, gravity=G):
    """Outline of an incoming belt, far behind, and its pulley; no plate."""
    text = f"gravity = {gravity}\n[particle]\nradius = {R}\n"
    text += f"[incoming]\nspeed = 1.0\npulley_radius = {radius}\n[run]\nuntil = 1.0\n"
    return Outline(solids(build(parse(text))), radius, R, gravity)


def gap_to_slab(line, at, x, y):
    """Distance between disks around (x, y) and a slab, negative inside: the textbook box."""
    (ax, ay), (bx, by) = line
    length = hypot(bx - ax, by - ay)
    tx, ty = (bx - ax) / length, (by - ay) / length
    nx, ny = -ty, tx
    if (at[0] - ax) * nx + (at[1] - ay) * ny < 0.0:
        nx, ny = -nx, -ny
    u = np.abs((x - ax) * tx + (y - ay) * ty - 0.5 * length) - 0.5 * length
    w = np.abs((x - ax) * nx + (y - ay) * ny + 0.5 * THICK) - 0.5 * THICK
    out = np.hypot(np.maximum(u, 0.0), np.maximum(w, 0.0)) + np.minimum(np.maximum(u, w), 0.0)
    return out - R


def brute_force(gap, until, samples=20001):
    """The first time a gap falls to zero: sampled finely, then bisected; inf if it never does."""
    t = np.linspace(0.0, until, samples)
    inside = np.flatnonzero(gap(t) <= 0.0)
    if not len(inside):
        return inf
    low, high = t[inside[0] - 1], t[inside[0]]
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if gap(middle) <= 0.0 else (middle, high)
    return high


@settings(max_examples=100)
@given(
    height=st.floats(0.02, 3.0),
    vx=st.floats(-0.3, 0.3),
    vy=st.floats(-3.0, 3.0),
    gravity=st.floats(0.1, 20.0),
)
def test_a_parabola_meets_a_floor_at_the_root_of_a_quadratic(height, vx, vy, gravity):
    t = (vy + sqrt(vy**2 + 2.0 * gravity * (height - R))) / gravity
    assume(abs(vx) * t < 0.99)
    touch = outline(FLOOR, gravity=gravity).first(0.0, height, vx, vy, LONG)
    assert touch.t == pytest.approx(t, rel=1e-13)
    assert (touch.solid, touch.normal, touch.curvature) == (0, (0.0, 1.0), 0.0)


def test_a_floor_beyond_the_horizon_is_not_met():
    t = sqrt(2.0 * (1.0 - R) / G)
    floor = outline(FLOOR)
    assert floor.first(0.0, 1.0, 0.0, 0.0, 0.999 * t).t == inf
    assert floor.first(0.0, 1.0, 0.0, 0.0, 1.001 * t).t == pytest.approx(t, rel=1e-14)
    assert floor.first(1.0 + R + 1e-9, 1.0, 0.0, 0.0, LONG).t == inf


def test_struck_from_behind_a_floor_is_its_thickness_lower():
    touch = outline(FLOOR).first(0.0, -0.5, 0.0, 4.0, LONG)
    way = 0.5 - THICK - R
    assert touch.t == pytest.approx((4.0 - sqrt(16.0 - 2.0 * G * way)) / G, rel=1e-13)
    assert touch.normal == (0.0, -1.0)


def test_a_floor_met_end_on():
    # Half as deep as it is thick, without gravity: its edge is 4 mm high.
    touch = outline(FLOOR, gravity=0.0).first(2.0, -HALF_THICKNESS, -3.0, 0.0, LONG)
    assert touch.t == pytest.approx((1.0 - R) / 3.0, rel=1e-14)
    assert touch.normal == (1.0, 0.0)


@settings(max_examples=60)
@given(over=st.floats(0.01, 0.99), fall=st.floats(0.1, 2.0))
def test_the_end_of_a_floor_is_round(over, fall):
    # Straight down beside the end: over R is the sine of the normal's angle.
    touch = outline(FLOOR).first(1.0 + over * R, fall, 0.0, 0.0, LONG)
    depth = sqrt(1.0 - over**2) * R
    assert touch.t == pytest.approx(sqrt(2.0 * (fall - depth) / G), rel=1e-11)
    assert touch.normal == pytest.approx((over, sqrt(1.0 - over**2)), abs=1e-9)
    assert touch.curvature == pytest.approx(1.0 / R)


@settings(max_examples=60)
@given(side=st.floats(0.01, 0.95), drop=st.floats(0.05, 1.0), radius=st.floats(0.02, 0.5))
def test_the_pulley_is_a_circle(side, drop, radius):
    # Falling on it from above, right of the belt's end.
    rho = radius + R
    x = side * rho
    touch = drum(radius).first(x, rho + drop, 0.0, 0.0, LONG)
    y = sqrt(rho**2 - x**2)
    assert touch.t == pytest.approx(sqrt(2.0 * (rho + drop - y) / G), rel=1e-11)
    assert touch.normal == pytest.approx((x / rho, y / rho), abs=1e-9)
    assert touch.curvature == pytest.approx(1.0 / rho)


def test_any_flight_against_brute_force():
    tally = Counter()
    at, until = (0.3, 5.0), 0.5

    @settings(max_examples=300, suppress_health_check=list(HealthCheck), phases=[Phase.generate])
    @given(
        start=st.tuples(st.floats(-0.2, 0.4), st.floats(-0.3, 0.5)),
        velocity=st.tuples(st.floats(-3.0, 3.0), st.floats(-4.0, 2.0)),
        end=st.tuples(st.floats(0.05, 0.4), st.floats(-0.4, 0.4)),
        gravity=st.sampled_from([0.0, 1.0, 9.81]),
    )
    def one(start, velocity, end, gravity):
        line, (x, y), (vx, vy) = ((-0.1, 0.05), end), start, velocity

        def gap(t):
            return gap_to_slab(line, at, x + vx * t, y + vy * t - 0.5 * gravity * t**2)

        assume(gap(0.0) > 1e-6)
        found = outline(line, gravity=gravity, at=at).first(x, y, vx, vy, until)
        expected = brute_force(gap, until)
        # What only just touches, or only just does not, is another test's.
        t = np.linspace(0.0, min(expected - 1e-4, until), 2001)
        assume(t[-1] > 0.0 and gap(t).min() > 1e-6)
        tally["missed" if expected == inf else "met"] += 1
        if expected == inf:
            assert found.t == inf
            return
        assert found.t == pytest.approx(expected, abs=1e-9)
        # The normal is the slope of the gap.
        px, py, h = x + vx * expected, y + vy * expected - 0.5 * gravity * expected**2, 1e-7
        slope = [
            (gap_to_slab(line, at, px + h, py) - gap_to_slab(line, at, px - h, py)) / (2.0 * h),
            (gap_to_slab(line, at, px, py + h) - gap_to_slab(line, at, px, py - h)) / (2.0 * h),
        ]
        assert found.normal == pytest.approx(slope, abs=2e-5)
        assert hypot(*found.normal) == pytest.approx(1.0, abs=1e-14)

    one()
    assert min(tally["met"], tally["missed"]) >= 25, tally


@settings(max_examples=60)
@given(
    low=st.floats(0.05, 0.4),
    high=st.floats(0.41, 0.9),
    velocity=st.tuples(st.floats(-1.0, 1.0), st.floats(-3.0, 3.0)),
    until=st.floats(0.01, 1.0),
)
def test_the_first_of_two_is_the_sooner_of_both(low, high, velocity, until):
    lines = ((-0.5, low), (0.0, low)), ((0.0, -high), (0.6, -high))
    flight = (-0.02, 0.5 * (low - high) + low, *velocity, until)
    both = outline(*lines).first(*flight)
    each = [outline(line).first(*flight) for line in lines]
    assert both.t == min(touch.t for touch in each)
    if both.t < inf:
        assert each[both.solid].t == both.t


@settings(max_examples=60)
@given(
    depth=st.floats(1e-9, 0.99),
    vx=st.floats(-1.0, 1.0),
    vy=st.floats(0.01, 3.0),
    gravity=st.sampled_from([0.0, 9.81]),
)
def test_an_overlap_counts_inwards_only(depth, vx, vy, gravity):
    floor = outline(FLOOR, gravity=gravity)
    y = R * (1.0 - depth)
    inwards = floor.first(0.0, y, vx, -vy, LONG)
    assert (inwards.t, inwards.normal) == (0.0, (0.0, 1.0))
    # Outwards it is let go, and caught when it has sunk as deep again.
    outwards = floor.first(0.0, y, 0.1 * vx, vy, LONG)
    back = 2.0 * vy / gravity if gravity > 0.0 else inf
    assert outwards.t == pytest.approx(back, rel=1e-9)


@pytest.mark.parametrize("vy", [-1.0, 0.0, 1.0])
def test_in_contact_with_the_floor(vy):
    touch = outline(FLOOR).first(0.0, R, 0.3, vy, LONG)
    assert touch.t == pytest.approx(max(2.0 * vy / G, 0.0), rel=1e-14)


def test_at_rest_on_a_floor_without_gravity_nothing_happens():
    assert outline(FLOOR, gravity=0.0).first(0.0, R, 3.0, 0.0, LONG).t == inf


@pytest.mark.parametrize(("miss", "meets"), [(1e-9, False), (-1e-9, True)])
def test_grazing_an_end_without_gravity(miss, meets):
    # Along a line that passes the corner at a distance of r (1 ± 1e-9).
    touch = outline(FLOOR, gravity=0.0).first(1.5, R * (1.0 + miss), -1.0, 0.0, 0.6)
    assert (touch.t < inf) == meets
    if meets:
        # Sunk by 1e-9 r, the leg of the triangle is r √(2e-9).
        assert touch.t == pytest.approx(0.5 - R * sqrt(2e-9), abs=1e-8)


@settings(max_examples=150)
@given(cosine=st.floats(0.05, 0.99), radius=st.floats(0.03, 0.6))
def test_leaving_the_pulley_along_its_tangent_does_not_meet_it_again(cosine, radius):
    # Where g cos φ = v²/ρ: from then on gravity curves the path less than the pulley its rim.
    rho = radius + R
    speed = sqrt(cosine * G * rho)
    phi = acos(speed**2 / (G * rho))
    c, s = cos(phi), sin(phi)
    touch = drum(radius).first(rho * s, rho * c, speed * c, -speed * s, 1.0)
    assert touch.t == inf


def test_leaving_at_the_very_top_meets_neither_the_pulley_nor_the_belt():
    # The belt ends there, to a rounding of either coordinate.
    touches = [
        drum(radius).first(x, radius + R, 1.01 * sqrt(G * (radius + R)), 0.0, 1.0).t
        for radius in np.linspace(0.03, 0.6, 20).tolist()
        for x in (0.0, -1e-16, 1e-16)
    ]
    assert min(touches) == inf


def test_too_slow_for_the_top_of_the_pulley_it_sinks_in_at_once():
    radius = 0.5
    rho = radius + R
    phi = 0.1
    touch = drum(radius).first(
        rho * np.sin(phi), rho * np.cos(phi), 0.5 * np.cos(phi), -0.5 * np.sin(phi), 1.0
    )
    assert touch.t == pytest.approx(0.0, abs=1e-6)
    assert touch.normal == pytest.approx((np.sin(phi), np.cos(phi)), abs=1e-6)


@settings(max_examples=60)
@given(
    x=st.floats(-1.5, 1.5),
    y=st.floats(-0.5, 0.5),
    velocity=st.tuples(st.floats(-2.0, 2.0), st.floats(-2.0, 2.0)),
    growth=st.floats(-9.0, 9.0),
)
def test_the_gaps_around_a_disk_and_how_fast_they_close(x, y, velocity, growth):
    lines = FLOOR, ((-1.2, -0.3), (0.4, 0.4))
    along = (growth * velocity[0], growth * velocity[1])
    found = outline(*lines).around(x, y, velocity, along)
    step = 1e-7
    for line, (gap, closing, pull) in zip(lines, found, strict=True):
        here, before, after = (
            float(gap_to_slab(line, (0.3, 5.0), x + s * velocity[0], y + s * velocity[1]))
            for s in (0.0, -step, step)
        )
        assume(here > 1e-3 - R)  # with the centre inside, there is no distance to speak of
        assert gap == pytest.approx(here, abs=1e-12)
        assert closing == pytest.approx((before - after) / (2.0 * step), abs=1e-3)
        assert pull == pytest.approx(growth * closing, rel=1e-9, abs=1e-12)
        # However far it goes on, on a straight way.
        way = 0.2 + 0.5 * growth * 0.2**2
        later = float(gap_to_slab(line, (0.3, 5.0), x + way * velocity[0], y + way * velocity[1]))
        assert later > gap - 0.2 * closing - 0.5 * pull * 0.2**2 - 1e-12 or later <= -R
