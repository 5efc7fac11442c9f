"""What the shipped chutes, the cradle and the dominoes do, by laws written out here."""

from functools import cache
from math import asin, atan2, cos, exp, pi, radians, sin, sqrt

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab.engines.simulation import simulate
from chutelab.results.quantities import measure

G = 9.81


@cache
def run(name, *overrides):
    return simulate(sc.load(name, overrides))


def test_the_spoon_turns_a_particle_as_impact_and_slide_say():
    r, v, alpha, eps, mu, rho = 0.0063, 2.0, radians(10.0), 0.2, 0.5, 0.5 - 0.0063
    face, center = np.array([-cos(alpha), -sin(alpha)]), np.array([1.05, -0.37])

    def fall(place, velocity, t):
        return place + velocity * t - [0.0, 0.5 * G * t * t], velocity - [0.0, G * t]

    # The hood plate, with its pivot at (0.5, 0.1): its line is r away.
    place, velocity = np.array([0.0, 0.1 + r]), np.array([v, 0.0])
    gap = (place - [0.5, 0.1]) @ face - r
    t = min(np.roots([-0.5 * G * face[1], velocity @ face, gap]).real)
    place, velocity = fall(place, velocity, t)
    velocity = velocity - (1.0 + eps) * (velocity @ face) * face
    # The spoon: a parabola meets a circle, below its centre. No rebound, Coulomb friction.
    d = place - center
    quartic = [0.25 * G * G, -G * velocity[1], velocity @ velocity - G * d[1]]
    roots = np.roots([*quartic, 2.0 * d @ velocity, d @ d - rho * rho])
    times = roots.real[(np.abs(roots.imag) < 1e-9) & (roots.real > 0.0)]
    t = min(t for t in times if fall(place, velocity, t)[0][1] < center[1])
    place, velocity = fall(place, velocity, t)
    out = (place - center) / rho
    speed = velocity @ [-out[1], out[0]] - mu * (velocity @ out)
    # Down it, ψ before the lowest point: du/dψ = -2 sin ψ + 2 µ (cos ψ + u), u = v²/(g ρ).
    begin, end = atan2(-out[0], -out[1]), radians(5.0)
    a, b = (2.0 - 4.0 * mu**2) / (1.0 + 4.0 * mu**2), 6.0 * mu / (1.0 + 4.0 * mu**2)
    c = (speed**2 / (G * rho) - a * cos(begin) - b * sin(begin)) * exp(-2.0 * mu * begin)
    u = a * cos(end) + b * sin(end) + c * exp(2.0 * mu * end)
    wanted = sqrt(u * G * rho) * cos(end)
    assert measure(run("spoon"), "particles[0].landing.vx") == pytest.approx(wanted, rel=1e-12)
    name = "particles[0].landing.vx"
    (written,) = [e.value for e in sc.load("spoon").expect if e.quantity == name]
    assert written == pytest.approx(wanted, rel=1e-12)


def test_a_spoon_spares_the_belt_and_loses_less_in_blows_than_a_flat_chute_of_its_ends():
    table = sc.to_dict(sc.load("spoon"))
    (spoon,) = table["surface"]
    values = {key: spoon[key] for key in ("name", "restitution", "friction")}
    table["surface"] = [{**values, "points": [[0.55, -0.37], [1.00642213, -0.86809735]]}]
    table.pop("expect")
    flat = simulate(sc.from_dict(table))
    bare = run("spoon", "surface.spoon.center=[9,0]")
    for recording in (run("spoon"), flat, bare):
        # What the belt pays until nothing slips: m v_b (v_b - v_x) of each.
        v_x = measure(recording, "landing.vx.mean")
        assert measure(recording, "landing.count") == 40
        paid = measure(recording, "ledger.by_surface.outgoing.belt_work")
        assert paid == pytest.approx(40 * 0.008 * 2.0 * (2.0 - v_x), rel=1e-9)
    work = [measure(r, "ledger.belt_work") for r in (run("spoon"), flat, bare)]
    assert abs(work[0]) < 0.01 * work[2]
    blows = [measure(r, "ledger.restitution_loss") for r in (run("spoon"), flat, bare)]
    assert blows[0] < 0.8 * blows[1] < 0.8 * blows[2]


@pytest.mark.slow
def test_the_last_ball_of_the_cradle_rises_as_high_as_the_first_was():
    recording = run("cradle")
    first, middle, last = (recording.track(n)["position"][:, 1] for n in (0, 2, 4))
    height = 0.4 * (1.0 - cos(radians(30.0)))
    assert first.max() + 0.4 == pytest.approx(height, rel=1e-9)
    assert last.max() + 0.4 == pytest.approx(height, rel=5e-3)
    assert middle.max() + 0.4 < 1e-3 * height
    # It turns half a period after the release: agm(1, cos θ/2) is the pendulum's.
    a, b = 1.0, cos(radians(15.0))
    for _ in range(9):
        a, b = 0.5 * (a + b), sqrt(a * b)
    period = 2.0 * pi * sqrt(0.4 / G) / a
    times = np.linspace(0.25 * period, 0.75 * period, 2001)
    turn = times[np.argmax(recording.at(times).position[:, 4, 1])]
    assert turn == pytest.approx(0.5 * period, rel=2e-3)
    assert recording.scene.run.until == pytest.approx(2.0 * period, rel=1e-6)


def struck(rate, count, last, *, h=0.048, d=0.008, pitch=0.025, steps=300):
    """When each of a row of dominoes is struck by the one before, the last one `last` m on; s.

    Van Leeuwen's model, of feet that hold and sides without friction: each leans on the next one
    from when it strikes it, energy is kept until the front one strikes the next, and no rebound.
    The first one has the angular velocity `rate`, rad/s.
    """
    inertia = (h * h + d * d) / 3.0  # about the foot, per mass

    def train(front, n):
        angles, rates = [front], [1.0]
        while len(angles) < n:
            reach = pitch * cos(angles[-1]) - d
            slope = 1.0 - pitch * sin(angles[-1]) / sqrt(h * h - reach * reach)
            rates.append(rates[-1] * slope)
            angles.append(angles[-1] + asin(reach / h))
        high = 0.5 * G * (h * np.cos(angles) + d * np.sin(angles)).sum()
        return (np.array(rates) ** 2).sum(), high

    time, times = 0.0, []
    for n in range(1, count + 1):
        end = asin((last if n == count else pitch - d) / h)
        share, high = train(0.0, n)
        energy = 0.5 * inertia * share * rate**2 + high
        for k in range(steps):
            share, high = train((k + 0.5) * end / steps, n)
            time += end / steps / sqrt(2.0 * (energy - high) / (inertia * share))
        times.append(time)
        share, high = train(end, n)
        rate = sqrt(2.0 * (energy - high) / (inertia * share)) * share / (1.0 + share)
    return np.array(times)


@pytest.mark.slow
def test_dominoes_fall_in_order_at_the_speed_of_van_leeuwens_wave():
    recording = run("dominoes")
    tracks = [recording.track(n) for n in range(20)]
    begins = [track["t"][np.argmax(np.abs(track["omega"]) > 0.3)] for track in tracks]
    assert (np.diff(begins) > 0.0).all()
    assert all(track[-1]["position"][1] < 0.0225 + 2e-4 for track in tracks)
    # An elastic ball of the same mass at 45 mm, m v y (1 + ε) over the inertia of both.
    rate = 2.0 * 1.5 * 0.045 / ((0.048**2 + 0.008**2) / 3.0 + 0.045**2)
    times = struck(rate, 20, 0.025)
    wave = 0.025 * 6 / (times[18] - times[12])
    assert 0.025 * 6 / (begins[19] - begins[13]) == pytest.approx(wave, rel=0.01)
    (written,) = [e.value for e in recording.scene.expect if e.quantity == "impact.bell.t.min"]
    assert written == pytest.approx(0.036 / 1.5 + times[-1], abs=1e-4)
