"""Two disks, or a disk and a solid, in one impact: pymunk's answer against Newton and Coulomb.

The formulas: J_n = m* (1 + ε) u_n with the reduced mass m*; J_t = -slip / k, clipped to µ J_n, with
k = 1/m1 + 1/m2 + r1²/I1 + r2²/I2.
"""

from __future__ import annotations

from math import asin, cos, hypot, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chutelab.ledger import ledger
from chutelab.recording import Kind
from chutelab.stepper.clash import Clash, Disk, Pair
from chutelab.stepper.meetings import meeting
from machines import two_disks

R, M = 0.004, 0.008

speeds = st.floats(-3.0, 3.0)
decades = st.floats(-3.0, 3.0).map(lambda n: 10.0**n)


def disk(mass, radius, *, spin):
    return Disk(mass, 0.5 * mass * radius**2 if spin else 0.0, radius)


def newton_coulomb(upper, lower, pair, velocity, omega, other, other_omega):
    """The impulse on the upper disk, tangential and normal, N s, of disks that approach."""
    share = 1.0 / upper.mass + (1.0 / lower.mass if lower is not None else 0.0)
    grip = share
    for one in (upper, lower):
        if one is not None and one.inertia > 0.0:
            grip += one.radius**2 / one.inertia
    below = lower.radius if lower is not None else 0.0
    push = (1.0 + pair.restitution) * (other[1] - velocity[1]) / share
    # Rims that face each other move the opposite ways when both turn the same way.
    slip = velocity[0] - other[0] + upper.radius * omega + below * other_omega
    rub = min(max(-slip / grip, -pair.friction * push), pair.friction * push)
    return rub, push


@settings(max_examples=300)
@given(
    masses=st.tuples(decades, decades),
    radii=st.tuples(st.floats(1e-3, 1.0), st.floats(1e-3, 1.0)),
    spin=st.booleans(),
    restitution=st.floats(0.0, 1.0),
    friction=st.floats(0.0, 2.0),
    velocity=st.tuples(speeds, speeds),
    other=st.tuples(speeds, speeds),
    turns=st.tuples(st.floats(-50.0, 50.0), st.floats(-50.0, 50.0)),
)
def test_two_disks_of_any_mass(masses, radii, spin, restitution, friction, velocity, other, turns):
    assume(other[1] - velocity[1] > 0.01)
    upper, lower = (disk(m, r, spin=spin) for m, r in zip(masses, radii, strict=True))
    pair = Pair(restitution, friction)
    turns = turns if spin else (0.0, 0.0)
    impulse, after = Clash(upper, lower, pair).resolve(velocity, turns[0], other, turns[1])
    rub, push = newton_coulomb(upper, lower, pair, velocity, turns[0], other, turns[1])
    # What a velocity's last digit is worth in impulse limits the heavier of the two.
    grain = 1e-14 * upper.mass * (hypot(*velocity) + 50.0 * upper.radius)
    assert impulse[1] == pytest.approx(push, rel=1e-11, abs=grain)
    assert impulse[0] == pytest.approx(rub, rel=1e-11, abs=1e-11 * push + grain)
    spun = upper.radius * rub / upper.inertia if spin else 0.0
    size = abs(turns[0]) + upper.radius * push / (upper.inertia or 1.0)
    assert after == pytest.approx(turns[0] + spun, abs=1e-11 * size)


@pytest.mark.parametrize("ratio", [1e-3, 1.0, 1e3])
@pytest.mark.parametrize("angle", [0.0, 45.0, 80.0, 89.0])
@pytest.mark.parametrize("spin", [False, True])
def test_head_on_oblique_and_grazing_with_one_to_a_thousand(ratio, angle, spin):
    # The upper one comes with 2 m/s at an angle to the normal, turning; the lower one is at rest.
    upper, lower = disk(ratio, 0.03, spin=spin), disk(1.0, 0.05, spin=spin)
    pair, omega = Pair(0.6, 0.4), 7.0 if spin else 0.0
    velocity = 2.0 * sin(radians(angle)), -2.0 * cos(radians(angle))
    (rub, push), after = Clash(upper, lower, pair).resolve(velocity, omega)
    expected = newton_coulomb(upper, lower, pair, velocity, omega, (0.0, 0.0), 0.0)
    assert (rub, push) == pytest.approx(expected, rel=1e-11)
    # What that makes of the two: the normal velocity is turned round, energy is lost, none won.
    first = velocity[0] + rub / upper.mass, velocity[1] + push / upper.mass
    second = -rub / lower.mass, -push / lower.mass
    assert first[1] - second[1] == pytest.approx(-0.6 * velocity[1], rel=1e-11)
    turned = -rub * -lower.radius / lower.inertia if spin else 0.0
    energy = 0.5 * (ratio * hypot(*first) ** 2 + hypot(*second) ** 2)
    energy += 0.5 * (upper.inertia * after**2 + lower.inertia * turned**2)
    assert energy < 0.5 * ratio * 4.0 + 0.5 * upper.inertia * omega**2


@settings(max_examples=100)
@given(
    along=speeds,
    down=st.floats(-3.0, -0.01),
    belt=speeds,
    omega=st.floats(-100.0, 100.0),
    spin=st.booleans(),
    restitution=st.floats(0.0, 1.0),
    friction=st.floats(0.0, 2.0),
)
def test_a_disk_and_a_belt(along, down, belt, omega, spin, restitution, friction):
    upper, pair = disk(M, R, spin=spin), Pair(restitution, friction)
    omega = omega if spin else 0.0
    impulse, _ = Clash(upper, None, pair).resolve((along, down), omega, (belt, 0.0))
    expected = newton_coulomb(upper, None, pair, (along, down), omega, (belt, 0.0), 0.0)
    assert impulse == pytest.approx(expected, rel=1e-11, abs=1e-12 * expected[1])


def test_a_clash_has_no_memory():
    clash = Clash(disk(M, R, spin=True), disk(M, R, spin=True), Pair(0.5, 0.3))
    first = clash.resolve((0.4, -1.0), 3.0, (0.1, 0.2), -2.0)
    clash.resolve((-2.0, -3.0), -70.0)
    assert clash.resolve((0.4, -1.0), 3.0, (0.1, 0.2), -2.0) == first


def test_disks_that_part_are_let_go():
    clash = Clash(disk(M, R, spin=True), disk(M, R, spin=True), Pair(0.5, 0.3))
    assert clash.resolve((0.4, 1.0), 3.0) == ((0.0, 0.0), 3.0)


@settings(max_examples=60)
@given(
    course=st.floats(-170.0, 170.0),
    share=st.floats(-0.999, 0.999),
    speed=st.floats(0.2, 5.0),
    gap=st.floats(1e-6, 0.3),
)
def test_when_and_where_disks_meet(course, share, speed, gap):
    # The other one flies at an offset past, seen from the first; where it touches is a triangle.
    c, s = cos(radians(course)), sin(radians(course))
    reach = 0.01
    offset = share * reach
    leg = sqrt(reach**2 - offset**2)
    start = leg + gap
    x, y = -start * c - offset * s, -start * s + offset * c
    apart = np.array([[x], [y], [speed * c], [speed * s]])
    _, (t,), (approach,) = meeting(apart, reach, 10.0)
    assert t == pytest.approx(gap / speed, rel=1e-9)
    assert approach == pytest.approx(speed * leg / reach, rel=1e-9)


def thrown(position, velocities, **told):
    """The first starts at the origin, the second as told; few steps, so that impacts end them."""
    return two_disks([(0.0, 0.0), position], velocities, dt=1 / 60, **told)


@settings(max_examples=60)
@given(
    share=st.one_of(st.floats(-0.99, 0.99), st.sampled_from([0.0, 0.9999, -0.9999])),
    course=st.floats(-180.0, 180.0),
    drift=st.tuples(speeds, speeds),
    gravity=st.sampled_from([0.0, 9.81]),
    restitution=st.floats(0.1, 1.0),
    friction=st.floats(0.0, 2.0),
    spin=st.booleans(),
)
def test_two_in_flight_head_on_oblique_and_grazing(
    share, course, drift, gravity, restitution, friction, spin
):
    # In free fall together gravity cancels: the meeting is that of straight lines, all falls by
    # ½ g t². The second comes with 2 m/s, seen from the first, at an offset of a share of 2 r.
    ahead = np.array([cos(radians(course)), sin(radians(course))])
    aside = np.array([-ahead[1], ahead[0]])
    offset, start, speed, until = share * 2.0 * R, 0.1, 2.0, 0.2
    drift = np.array(drift)
    place = -start * ahead + offset * aside
    recording = thrown(
        place.tolist(),
        [drift, drift + speed * ahead],
        gravity=gravity,
        restitution=restitution,
        friction=friction,
        spin=spin,
        until=until,
    )
    touch = (start - 2.0 * R * cos(asin(share))) / speed
    c = (place + touch * speed * ahead) / (2.0 * R)  # from the first to the second
    t = np.array([-c[1], c[0]])
    push = 0.5 * M * (1.0 + restitution) * -(speed * ahead @ c)
    mass = 0.5 * M / 3.0 if spin else 0.5 * M
    rub = np.clip(-mass * speed * (ahead @ t), -friction * push, friction * push)
    impulse = (push * c + rub * t) / M  # on the second
    fall = np.array([0.0, -gravity])
    for n, sign, velocity, begin in (
        (0, -1.0, drift, np.zeros(2)),
        (1, 1.0, drift + speed * ahead, place),
    ):
        end = recording.track(n)[-1]
        after = velocity + sign * impulse
        assert end["velocity"] == pytest.approx(after + until * fall, abs=1e-10)
        expected = begin + touch * velocity + (until - touch) * after + 0.5 * until**2 * fall
        assert end["position"] == pytest.approx(expected, abs=1e-10)
        # The rub on the second's near side; on the first's far side the other way round: both
        # get the same turn.
        spun = -rub * R / (0.5 * M * R**2) if spin else 0.0
        assert end["omega"] == pytest.approx(spun, abs=1e-7)
    (hit,) = recording.select(Kind.COLLISION)
    assert hit["t"] == pytest.approx(touch, abs=1e-12)
    assert hit["normal_impulse"] == pytest.approx(push, abs=1e-11 * M)
    assert ledger(recording).relative_residual < 1e-12


@pytest.mark.parametrize("share", [1.0001, -1.0001])
def test_disks_that_pass_each_other_do_not_meet(share):
    recording = thrown([-0.1, share * 2.0 * R], [(0.0, 0.0), (2.0, 0.0)])
    assert not len(recording.select(Kind.COLLISION))
    assert recording.track(1)[-1]["position"] == pytest.approx([0.3, share * 2.0 * R], abs=1e-15)


def test_disks_at_two_hundred_metres_per_second_do_not_pass_through():
    recording = thrown([-1.0, 0.0], [(0.0, 0.0), (200.0, 0.0)], restitution=1.0, until=0.1)
    (hit,) = recording.select(Kind.COLLISION)
    assert hit["t"] == pytest.approx((1.0 - 2.0 * R) / 200.0, rel=1e-12)
    assert recording.track(0)[-1]["velocity"] == pytest.approx([200.0, 0.0], abs=1e-9)
    assert recording.track(1)[-1]["velocity"] == pytest.approx([0.0, 0.0], abs=1e-9)
