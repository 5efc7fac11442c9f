"""The core of the contact engine through its arrays: what no scene file can ask for."""

from __future__ import annotations

import hashlib
import os
import shutil
import subprocess
import sys
from dataclasses import replace
from importlib.resources import files
from math import acos, cos, hypot, inf, pi, sin, sqrt
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.special import ellipk

from chutelab.core.module import Status, constants, dtype
from chutelab.engines.contact import run
from chutelab.machine import build
from chutelab.results import REASONS, Kind
from chutelab.scene import from_dict, load
from cores import Core, modes
from machines import bent, boxed, face, gated, of_sizes, scene_of, thrown

G = 9.81
FAR = face("far", (-50.0, -90.0), (50.0, -90.0))
FLOOR = face("floor", (-20.0, 0.0), (20.0, 0.0), restitution=0.0, friction=0.5)


def crowd_scene(**tables):
    stream = {"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0,
              **tables.pop("stream", {})}  # fmt: skip
    return scene_of(stream=stream, **tables)


# Masses and radii


REST, RUB = np.array([[0.9, 0.7], [0.7, 1.0]]), np.array([[0.3, 0.6], [0.6, 0.0]])
"""Restitution and friction of pairs of two kinds."""


def mixed(seed, *, turning=True, count=40, end=1.5):
    """Disks of all sizes, masses and inertias that fly to the middle and through each other."""
    rng = np.random.default_rng(seed)
    machine = crowd_scene(gravity=0.0, surface=[FAR], run={"until": end})
    place = np.stack(np.divmod(np.arange(count), 7), axis=1) - 3.0
    place = 0.12 * place + rng.uniform(-0.03, 0.03, (count, 2))
    machine = thrown(machine, place, -place + rng.normal(0.0, 0.2, (count, 2)))
    radius, mass = rng.uniform(0.005, 0.02, count), 10.0 ** rng.uniform(-2.0, 1.0, count)
    share = rng.choice([0.4, 0.5] if turning else [0.0, 0.4, 0.5], count)
    spin = np.where(share > 0.0, rng.normal(0.0, 5.0, count), 0.0)
    machine = of_sizes(
        machine, radius, mass, share, rng.integers(0, 2, count), pair_restitution=REST,
        pair_friction=RUB, rolling=np.zeros(2),
    )  # fmt: skip
    core = Core(machine)
    core.disks["spin"] = spin
    return core, core.disks.copy()


@pytest.mark.parametrize("turning", [True, False])
@pytest.mark.parametrize("seed", range(3))
def test_all_sizes_and_masses_conserve_momentum_and_close_the_ledger(seed, turning):
    # Σ m v is kept, and Σ m (x × v) + I ω where all can turn; ΔK = -(restitution + friction loss).
    core, start = mixed(seed, turning=turning)
    recording = core.run()
    first, last = recording.ends()
    assert len(recording.select(Kind.COLLISION)) > 20

    def sums(knots):
        m, (x, y), (u, v) = start["mass"], knots["position"].T, knots["velocity"].T
        spin = start["inertia"] * knots["omega"]
        kinetic = 0.5 * m * (u * u + v * v) + 0.5 * spin * knots["omega"]
        angular = (m * (x * v - y * u) + spin).sum() if turning else 0.0
        return np.array([(m * u).sum(), (m * v).sum(), angular]), kinetic.sum()

    before, energy = sums(first)
    after, left = sums(last)
    momentum = (start["mass"] * np.hypot(start["vx"], start["vy"])).sum()
    np.testing.assert_allclose(after, before, rtol=0.0, atol=1e-13 * momentum)
    loss = last["entries"][:, 1:].sum()
    assert last["entries"][:, 0].sum() == 0.0
    assert loss > 0.02 * energy
    assert left - energy == pytest.approx(-loss, abs=1e-13 * energy)


def test_each_pair_of_kinds_has_its_own_restitution_and_friction():
    # Newton: u_n' = -e u_n; Coulomb: the slip ends, or J_t = µ J_n against it.
    rest, rub = REST, RUB
    checked = np.zeros((2, 2), dtype=int)
    for seed in range(3):
        core, start = mixed(seed)
        recording = core.run()
        for event in recording.select(Kind.COLLISION):
            i, j, t = int(event["particle"]), int(event["other"]), event["t"]
            kinds, r = (start["kind"][i], start["kind"][j]), start["radius"][[i, j]]
            track = recording.track(j)
            before, after = track[track["t"] == t]
            away = event["position"] - before["position"]
            assert hypot(*away) == pytest.approx(r.sum(), rel=1e-12, abs=0.0)
            n = away / hypot(*away)
            along = np.array([n[1], -n[0]])
            u = event["velocity_before"] - before["velocity"]
            v = event["velocity_after"] - after["velocity"]
            assert v @ n == pytest.approx(-rest[kinds] * (u @ n), rel=1e-9)
            for one, which in ((event["velocity_after"] - event["velocity_before"], i),
                               (before["velocity"] - after["velocity"], j)):  # fmt: skip
                change = start["mass"][which] * one
                assert change @ n == pytest.approx(event["normal_impulse"], rel=1e-9)
                assert change @ along == pytest.approx(
                    event["tangential_impulse"], abs=1e-9 * event["normal_impulse"]
                )
            slip = v @ along + r @ (event["omega_after"], after["omega"])
            most = rub[kinds] * event["normal_impulse"]
            if abs(event["tangential_impulse"]) < most * (1.0 - 1e-9):
                assert slip == pytest.approx(0.0, abs=1e-12)
            else:
                assert abs(event["tangential_impulse"]) == pytest.approx(most, rel=1e-12, abs=0.0)
                assert most == 0.0 or slip * event["tangential_impulse"] <= 0.0
            checked[kinds] += 1
    assert (checked > 3).all(), checked


def test_a_sphere_takes_two_sevenths_of_its_slip_from_the_floor():
    # I = 2/5 m r²: a blow that grips has m* = 1/(1/m + r²/I) = 2/7 m, so v' = 5/7 v, r ω' = -5/7 v.
    floor = {**FLOOR, "restitution": 0.5, "friction": 10.0}
    core = Core(thrown(scene_of(surface=[floor], run={"until": 0.2}), [0.0, 0.11], [2.0, 0.0]))
    core.disks["inertia"] = 0.4 * core.disks["mass"] * core.disks["radius"] ** 2
    event = core.run().select(Kind.IMPACT)[0]
    assert event["velocity_after"][0] == pytest.approx(10.0 / 7.0, rel=1e-14, abs=0.0)
    assert 0.01 * event["omega_after"] == pytest.approx(-10.0 / 7.0, rel=1e-14, abs=0.0)


# Gravity as a vector


@pytest.mark.parametrize("crowded", [False, True])
def test_a_tilted_world_is_a_turned_scene(crowded):
    # All is turned by an angle, gravity too: positions are turned, nothing else changes.
    angle = 0.7
    turn = np.array([[cos(angle), -sin(angle)], [sin(angle), cos(angle)]])
    walls = np.array([[-0.2, 0.5], [-0.2, 0.0], [0.2, 0.0], [0.2, 0.5]])
    place = np.array([[0.0, 0.1], [0.005, 0.2], [-0.08, 0.15], [0.1, 0.12]])
    velocity = np.array([[0.3, 0.0], [0.0, -0.2], [0.5, 0.1], [-0.4, 0.0]])
    if not crowded:
        place, velocity = place[:1], velocity[:1]
    found = []
    for matrix, tilt in ((np.eye(2), 0.0), (turn, angle)):
        box = {"name": "box", "points": (walls @ matrix.T).tolist(), "restitution": 0.4,
               "friction": 0.3}  # fmt: skip
        machine = crowd_scene(surface=[box], run={"until": 0.6})
        core = Core(thrown(machine, place @ matrix.T, velocity @ matrix.T))
        core.tilt(tilt)
        core.disks["exit_box"][:] = -inf, -inf, inf, inf
        found.append(core.run())
    # Rounding may move a knot of what lasts: a track leaves out 1e-4 of the radius there.
    times, close = np.linspace(0.0, 0.599, 200), 2e-6 if crowded else 1e-12
    place, turned = (one.at(times)[0] for one in found)
    np.testing.assert_allclose(turned, place @ turn.T, rtol=0.0, atol=close)
    last, turned_last = (one.ends()[1] for one in found)
    np.testing.assert_allclose(
        turned_last["position"], last["position"] @ turn.T, rtol=0, atol=1e-9
    )
    impacts, turned_impacts = (one.select(Kind.IMPACT, Kind.COLLISION) for one in found)
    assert len(impacts) == len(turned_impacts) > (8 if crowded else 1)
    np.testing.assert_allclose(turned_impacts["t"], impacts["t"], rtol=0.0, atol=1e-9)


# Arcs


def pendulum(angle, dt, *, end=1.2):
    """A disk that does not turn in a half pipe, let go at rest at an angle from the bottom."""
    radius, r = 0.51, 0.01
    machine = scene_of(particle={"spin": False}, surface=[FAR], run={"until": end, "dt": dt})
    machine = bent(machine, {"center": (0.0, 0.0), "radius": radius, "begin": -pi, "extent": pi})
    return thrown(machine, (radius - r) * np.array([sin(angle), -cos(angle)]), [0.0, 0.0])


def swing(angle, times, length=0.5):
    """Angle and its rate: θ'' = -(g/l) sin θ."""
    return solve_ivp(
        lambda _, y: [y[1], -G / length * sin(y[0])], [0.0, times[-1]], [angle, 0.0], "DOP853",
        t_eval=times, rtol=1e-12, atol=1e-13,
    ).y  # fmt: skip


def test_a_ball_in_a_half_pipe_is_a_pendulum_of_large_amplitude():
    # l = R - r; T = 4 √(l/g) K(sin²(θ/2)); K + U is kept. Errors shrink with dt².
    angle, length = 1.4, 0.5
    period = 4.0 * sqrt(length / G) * ellipk(sin(0.5 * angle) ** 2)
    times = np.linspace(0.0, 1.2, 400)
    theta, _ = swing(angle, times)
    assert np.interp(0.0, -theta[:150], times[:150]) == pytest.approx(0.25 * period, abs=1e-4)
    expected = length * np.stack([np.sin(theta), -np.cos(theta)], axis=1)
    steps, errors = [2e-3, 1e-3, 5e-4, 2.5e-4], []
    for dt in steps:
        place, _ = run(pendulum(angle, dt)).at(times)
        errors.append(np.abs(place[:-1, 0] - expected[:-1]).max())
    assert errors[1] < 1e-4, errors
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert order == pytest.approx(2.0, abs=0.2), (order, errors)


def test_energy_in_a_half_pipe_is_kept_to_second_order():
    worst = []
    for dt in (2e-3, 1e-3):
        recording = run(pendulum(1.4, dt))
        track = recording.track(0)
        kinetic, potential = recording.energies(track)
        whole = kinetic + potential
        worst.append(np.ptp(whole) / (0.1 * G * 0.5 * (1.0 - cos(1.4))))
        assert worst[-1] < 2e-3 * (dt / 1e-3) ** 2, worst
    assert worst[1] < worst[0] / 3.0, worst


@pytest.mark.parametrize("dt", [1e-3])
def test_a_ball_leaves_the_outside_of_an_arc_where_its_load_ends(dt):
    # u = v²/(g ρ): u = u0 + 2 (1 - cos φ), and it leaves at u = cos φ: cos φ = (u0 + 2)/3.
    radius, r, speed = 0.49, 0.01, 0.5
    machine = scene_of(particle={"spin": False}, surface=[FAR], run={"until": 0.8, "dt": dt})
    machine = bent(machine, {"center": (0.0, 0.0), "radius": radius, "begin": 0.0, "extent": pi})
    left = run(thrown(machine, [0.0, radius + r], [speed, 0.0])).select(Kind.SEPARATION)[0]
    rho = radius + r
    u0 = speed**2 / (G * rho)
    assert atan_of(left["position"]) == pytest.approx(acos((u0 + 2.0) / 3.0), abs=2e-3)
    assert hypot(*left["position"]) == pytest.approx(rho, abs=1e-5)
    expected = sqrt(G * rho * (u0 + 2.0) / 3.0)
    assert hypot(*left["velocity_after"]) == pytest.approx(expected, rel=2e-3)


def atan_of(place):
    return float(np.arctan2(place[0], place[1]))


@pytest.mark.parametrize("inside", [True, False])
def test_a_ball_meets_an_arc_when_the_parabola_does(inside):
    # Thrown at an arc: |x0 + v t + g t²/2 - c| = R ∓ r, by the quartic.
    radius, r = 0.5, 0.01
    machine = scene_of(particle={"spin": False}, surface=[FAR], run={"until": 0.6})
    machine = bent(
        machine,
        {"center": (0.0, 0.0), "radius": radius, "begin": (-0.5 if inside else 2.6) - 0.9,
         "extent": 1.8, "restitution": 1.0},
    )  # fmt: skip
    place, velocity = ((0.1, 0.0), (1.3, 0.4)) if inside else ((-0.9, 0.3), (1.5, 1.0))
    event = run(thrown(machine, place, velocity)).select(Kind.IMPACT)[0]
    x, v, g = np.array(place), np.array(velocity), np.array([0.0, -G])
    reach = radius - r if inside else radius + r
    roots = np.roots([0.25 * g @ g, v @ g, v @ v + x @ g, 2.0 * x @ v, x @ x - reach**2])
    t = min(root.real for root in roots if abs(root.imag) < 1e-9 and root.real > 0.0)
    assert event["t"] == pytest.approx(t, rel=1e-12, abs=0.0)
    # Elastic and without friction: the normal velocity is turned round, nothing else.
    n = event["position"] / hypot(*event["position"])
    before, after = event["velocity_before"], event["velocity_after"]
    np.testing.assert_allclose(after, before - 2.0 * (before @ n) * n, rtol=0, atol=1e-12)


# Joints


def joined_pieces(rng):
    """Repeated lines, arcs and circles in cells of 0.1 m; ends meet to 1e-13 m, or to 1e-5 m."""
    rows = []
    for n in range(rng.integers(3, 9)):
        x, y = 0.1 * rng.integers(0, 4, 2) + rng.normal(size=2) * 10.0 ** rng.uniform(-13.0, -5.0)
        begin, shape = 90.0 * rng.integers(0, 4), rng.integers(0, 4)
        row = [
            {"from": [x, y], "to": [x + 0.1, y]},
            {"from": [x, y], "to": [x, y + 0.1]},
            {"center": [x, y], "radius": 0.1, "from_deg": begin, "to_deg": begin + 90.0},
            {"center": [x, y], "radius": 0.05},
        ][shape]
        times = [[int(rng.integers(1, 9)), 0.1, 0.0], [int(rng.integers(1, 5)), 0.0, 0.1]]
        rows.append({"name": f"p{n}", "repeat": times, **row})
    stream = {"at": [50.0, 50.0], "velocity": [0.0, 0.0]}
    particle = {"radius": 0.004, "mass": 0.01}
    return from_dict({"particle": particle, "surface": rows, "stream": stream})


def mates_by_pairs(rows, r):
    """Return which piece goes on smoothly beyond each end (K, 2), by asking all pairs; -1: none.

    They do within 1e-3 r and 1e-2 rad, of several the first, circles last. Ends within 1e-9 r are
    in one place.
    """
    circle = constants("Shape")["CIRCLE"]
    ends = rows["end"].reshape(-1, 2, 2)
    off = ends - np.stack([rows["x"], rows["y"]], axis=1)[:, None]
    straight = (rows["shape"] == constants("Shape")["SEGMENT"])[:, None, None]
    along = np.stack([rows["tx"], rows["ty"]], axis=1)[:, None]
    round_ = (
        np.stack([-off[..., 1], off[..., 0]], axis=2)
        / np.maximum(rows["radius"], 1e-9)[:, None, None]
    )
    onward = np.where(straight, along, round_) * np.array([-1.0, 1.0])[:, None]
    joints = np.full((len(rows), 2), -1)
    ended = rows["shape"] != circle
    for k, n in np.argwhere(ended[:, None] & [True, True]):
        apart = np.hypot(*np.moveaxis(ends - ends[k, n], 2, 0))
        same = (apart > 0.0) & (np.abs(ends - ends[k, n]).max(axis=2) <= 1e-9 * r)
        assert not same[ended].any()
        bend = np.hypot(*np.moveaxis(onward + onward[k, n], 2, 0))
        fits = ((apart <= 1e-3 * r) & (bend <= 1e-2)).any(axis=1) & ended
        fits &= ~(straight[:, 0, 0] & straight[k, 0, 0]) & (np.arange(len(rows)) != k)
        away = ends[k, n] - np.stack([rows["x"], rows["y"]], axis=1)
        far = np.hypot(*away.T)
        touches = ~ended & (np.abs(far - rows["radius"]) <= 1e-3 * r)
        touches &= np.abs(away @ onward[k, n]) <= 1e-2 * far
        joints[k, n] = next((m[0] for m in map(np.flatnonzero, (fits, touches)) if len(m)), -1)
    return joints, ended


def test_joints_are_those_of_all_pairs_of_ends():
    rng, found = np.random.default_rng(3), 0
    for _ in range(20):
        core = Core(build(joined_pieces(rng)))
        joints, ended = mates_by_pairs(core.surfaces, 0.004)
        np.testing.assert_array_equal(core.surfaces["mates"][ended], joints[ended])
        found += (joints >= 0).sum()
    assert found > 200


# Gates


@pytest.mark.parametrize("count", [1, 3])
def test_what_lies_on_a_gate_falls_when_it_opens(count):
    # Free fall from the opening time on: y = r - g (t - t0)²/2, v = -g (t - t0).
    opened = 0.4321
    machine = crowd_scene(surface=[FLOOR, FAR], run={"until": 0.7})
    machine = thrown(machine, [[0.1 * n, 0.01] for n in range(count)], [0.0, 0.0])
    recording = run(gated(machine, 0, vanishes=opened))
    times = np.linspace(opened, 0.699, 50)
    place, velocity = recording.at(times)
    for n in range(count):
        np.testing.assert_allclose(
            place[:, n, 1], 0.01 - 0.5 * G * (times - opened) ** 2, rtol=0, atol=2e-5
        )
        np.testing.assert_allclose(velocity[:, n, 1], -G * (times - opened), rtol=0, atol=2e-3)
    np.testing.assert_allclose(recording.at([0.1, 0.4])[0][..., 1], 0.01, rtol=0, atol=1e-9)


def test_a_gate_that_shuts_later_lets_pass_who_comes_before():
    # Two fall from 0.3 m, one 0.2 s later: at √(2 h/g) = 0.243 s the first passes.
    machine = crowd_scene(surface=[FLOOR, FAR], run={"until": 0.8})
    machine = thrown(machine, [[0.0, 0.3], [0.5, 0.3]], [0.0, 0.0])
    releases = replace(machine.releases, t=np.array([0.0, 0.2]))
    recording = run(gated(replace(machine, releases=releases), 0, appears=0.3))
    met = recording.select(Kind.IMPACT)
    assert met["particle"][0] == 1
    assert set(met["particle"].tolist()) == {1}
    assert met["t"][0] == pytest.approx(0.2 + sqrt(2.0 * 0.29 / G), rel=1e-12, abs=0.0)
    assert recording.at([0.79])[0][0, 0, 1] == pytest.approx(0.3 - 0.5 * G * 0.79**2, rel=1e-9)


# Rolling friction


def test_rolling_friction_slows_a_rolling_disk_as_its_arm_says():
    # The load acts b = ρ r ahead: I ω' = r F + b N, m v' = F, v = -r ω, so
    # v' = -(b/r) g/(1 + I/(m r²)) = -ρ g · 2/3 for a disk; it stops after v²/(2 |v'|) and stays.
    rolling, speed = 0.05, 0.6
    slow = rolling * G / 1.5
    stop, way = speed / slow, 0.5 * speed**2 / slow
    errors, steps = [], [4e-3, 2e-3, 1e-3]
    for dt in steps:
        machine = scene_of(surface=[FLOOR], run={"until": 2.5, "dt": dt})
        machine = replace(thrown(machine, [0.0, 0.01], [speed, 0.0]), rolling=np.array([rolling]))
        core = Core(machine)
        core.disks["spin"] = -speed / 0.01
        recording = core.run()
        times = np.linspace(0.0, 2.49, 100)
        one = np.minimum(times, stop)
        expected = speed * one - 0.5 * slow * one**2
        errors.append(np.abs(recording.at(times)[0][:, 0, 0] - expected).max())
        last = recording.track(0)[-1]
        assert last["position"][0] == pytest.approx(way, abs=1e-4)
        assert hypot(*last["velocity"]) < 1e-9
        assert abs(last["omega"]) * 0.01 < 1e-9
        # All kinetic energy, ¾ m v², became friction loss.
        assert last["entries"][2] == pytest.approx(0.75 * 0.1 * speed**2, rel=1e-3)
    assert errors[-1] < 1e-4, errors


def test_rolling_friction_holds_a_disk_on_a_slope_up_to_its_arm():
    # m g sin β r against b N = ρ r m g cos β: it rolls where tan β > ρ.
    for rolling, rolls in ((0.11, False), (0.09, True)):
        slope = np.arctan(0.1)
        floor = face("ramp", (-2.0 * cos(slope), 2.0 * sin(slope)),
                     (2.0 * cos(slope), -2.0 * sin(slope)), friction=0.8)  # fmt: skip
        machine = scene_of(surface=[floor], run={"until": 1.0})
        machine = thrown(machine, 0.01 * np.array([sin(slope), cos(slope)]), [0.0, 0.0])
        last = run(replace(machine, rolling=np.array([rolling]))).track(0)[-1]
        # a = g (sin β - ρ cos β)/(1 + I/(m r²))
        expected = 0.5 * G * (sin(slope) - rolling * cos(slope)) / 1.5 if rolls else 0.0
        way = hypot(*(last["position"] - 0.01 * np.array([sin(slope), cos(slope)])))
        assert way == pytest.approx(expected, abs=1e-5)


# End rollers


@pytest.mark.parametrize("end", [-1.0, 1.0])
@pytest.mark.parametrize("speed", [2.0, -1.5])
@pytest.mark.parametrize("angle", [0.5, 2.0, -0.9, -2.4])
def test_round_an_end_the_belt_runs_along_the_rim(end, speed, angle):
    # With n from the end to the disk and L = (0, 1) the left normal of the belt, the surface moves
    # with v s (n_y, -n_x), s = sign(n · L), and a gripping blow brings the slip there to zero.
    n = np.array([cos(angle), sin(angle)])
    if end * n[0] <= 0.0:
        n[0] = -n[0]  # only what is beyond the end meets it
    belt = face("belt", (-1.0, 0.0), (1.0, 0.0), speed=speed, restitution=0.5, friction=1e3)
    machine = scene_of(gravity=0.0, surface=[belt], run={"until": 0.2})
    start = np.array([end, 0.0]) + 0.06 * n
    event = Core(thrown(machine, start, -n)).run().select(Kind.IMPACT)[0]
    assert event["t"] == pytest.approx(0.05, rel=1e-12, abs=0.0)
    surface = speed * (1.0 if n[1] >= 0.0 else -1.0)
    along = np.array([n[1], -n[0]])
    # m* = m/3: the disk was not sliding, so it gets a third of the surface's speed.
    assert event["velocity_after"] @ along == pytest.approx(surface / 3.0, rel=1e-12, abs=0.0)
    slip = event["velocity_after"] @ along + 0.01 * event["omega_after"] - surface
    assert slip == pytest.approx(0.0, abs=1e-12)
    assert event["velocity_after"] @ n == pytest.approx(0.5, rel=1e-12, abs=0.0)


# Sleep


def heap_of(count=12, **run):
    box = {"name": "box", "points": [[-0.06, 0.6], [-0.06, 0.0], [0.06, 0.0], [0.06, 0.6]],
           "restitution": 0.2, "friction": 0.5}  # fmt: skip
    machine = crowd_scene(surface=[box], run={"until": 3.0, **run})
    k = np.arange(count)
    place = np.stack([0.021 * (k % 4) - 0.032 + 0.002 * (k // 4), 0.03 + 0.025 * (k // 4)], axis=1)
    return thrown(machine, place, [0.05, 0.0])


def test_a_heap_falls_asleep_and_costs_nothing_until_it_is_hit():
    machine = heap_of()
    late = replace(
        machine.releases,
        t=np.append(machine.releases.t, 2.0),
        position=np.vstack([machine.releases.position, [0.0, 0.5]]),
        velocity=np.vstack([machine.releases.velocity, [0.0, 0.0]]),
        carried=np.zeros(13, dtype=bool),
        stream=np.zeros(13, dtype=np.int64),
        kind=np.zeros(13, dtype=np.int64),
    )
    core = Core(boxed(replace(machine, releases=late)))
    asleep_at = None
    while core.world.t < 1.99:
        core.step()
        if asleep_at is None and modes(core)["ASLEEP"] == 12:
            asleep_at = core.world.step_count, core.world.solve_count
    assert asleep_at is not None
    assert modes(core) == {"WAITING": 1, "RIDING": 0, "FREE": 0, "ASLEEP": 12, "GONE": 0}
    # From then on until the late one comes no step was taken and nothing solved.
    assert core.world.solve_count == asleep_at[1]
    assert core.world.step_count <= asleep_at[0] + 2
    lay = core.disks["x"].copy(), core.disks["y"].copy()
    woke = 0
    while not core.step():
        woke = max(woke, 12 - modes(core)["ASLEEP"])
    assert woke >= 12
    recording = core.recording()
    before = recording.at([1.9])[0][0]
    np.testing.assert_allclose(before[:12], np.stack(lay, axis=1)[:12], rtol=0, atol=1e-5)
    hit = recording.select(Kind.COLLISION, Kind.IMPACT)
    hit = hit[(hit["particle"] == 12) | (hit["other"] == 12)]
    # It falls 0.5 m less what lies there, and meets a sleeper when the parabola says.
    y = recording.at([hit["t"][0]])[0][0][12, 1]
    assert 0.5 - y == pytest.approx(0.5 * G * (hit["t"][0] - 2.0) ** 2, rel=1e-9)


def test_sleepers_on_a_belt_ride_it_and_fall_off_its_end():
    # They ride at the belt's speed; off its end they go with it: a parabola from there, v (t - t0).
    speed, length = 0.5, 1.2
    belt = face("belt", (-0.2, 0.0), (length, 0.0), speed=speed, restitution=0.0, friction=1.0)
    machine = crowd_scene(particle={"spin": False}, surface=[belt, FAR], run={"until": 4.0})
    core = Core(thrown(machine, [[0.0, 0.01], [0.05, 0.01], [0.1, 0.01]], [0.4, 0.0]))
    slept = 0
    while not core.step():
        slept = max(slept, modes(core)["ASLEEP"])
    assert slept == 3
    recording = core.recording()
    for n in range(3):
        track = recording.track(n)
        assert track[-1]["position"][1] < -1.0
        riding = track[(track["t"] > 0.5) & (track["position"][:, 0] < length)]
        np.testing.assert_allclose(riding["velocity"][:, 0], speed, rtol=0, atol=1e-6)
        x = recording.at([1.0, 1.5])[0][:, n, 0]
        assert x[1] - x[0] == pytest.approx(0.5 * speed, abs=1e-6)


# Books


def test_the_ledger_closes_by_surface():
    machine = heap_of(until="settled", max_time=5.0)
    recording = Core(machine).run()
    _, last = recording.ends()
    np.testing.assert_allclose(
        recording.by_surface.sum(axis=0), last["entries"].sum(axis=0), rtol=1e-12, atol=1e-15
    )
    assert {REASONS[k] for k in recording.ended} == {"settled"}
    assert recording.by_surface[0, 0] == 0.0


def test_pushed_by_a_belt_all_its_work_is_on_its_account():
    # From rest to the belt's speed without turning: the belt does m v², half of it slip heat.
    speed = 0.7
    belt = face("belt", (-1.0, 0.0), (5.0, 0.0), speed=speed, restitution=0.0, friction=0.4)
    machine = scene_of(particle={"spin": False}, surface=[belt], run={"until": 1.0})
    recording = Core(thrown(machine, [0.0, 0.01], [0.0, 0.0])).run()
    work, bounce, heat = recording.by_surface[0]
    assert work == pytest.approx(0.1 * speed**2, rel=1e-9)
    assert heat == pytest.approx(0.05 * speed**2, rel=1e-9)
    assert bounce == pytest.approx(0.0, abs=1e-12)


# The same bits elsewhere


def memory_of(module):
    """Return all bytes of a module's memory, from 0 on."""
    return module._bytes.tobytes()


def all_bytes(core):
    """Run in slices of 64 steps, as the other host does, and return knots, events and ledger."""
    drained, status = {"knot": [], "event": []}, None
    while True:
        status = core.module.run(64)
        for what, kept in drained.items():
            count = getattr(core.world, f"{what}_count")
            kept.append(core.module.array(f"{what}s", dtype(what.title()), count).tobytes())
            setattr(core.world, f"{what}_count", 0)
        if status is Status.DONE:
            break
        assert status in (Status.PAUSED, Status.FULL)
    books = core.module.array("books", np.dtype("<f8"), 3 * (core.job.owners + 1)).tobytes()
    return b"".join(drained["knot"] + drained["event"]) + books


@pytest.mark.skipif(shutil.which("node") is None, reason="node is not installed")
@pytest.mark.parametrize("crowded", [False, True])
def test_in_node_it_does_the_same_to_the_bit(tmp_path, crowded):
    if crowded:
        machine = build(load("stream", ["stream.count=60", "particle.spin=true"]))
    else:
        machine = build(load("perpendicular", ["incoming.friction=0.5", 'run.until="settled"']))
    core = Core(machine)
    # All of the memory: the core's own data are as `_initialize` left them in both.
    (tmp_path / "memory").write_bytes(memory_of(core.module))
    here = files("chutelab.core")
    script = Path(__file__).with_name("contact_in_node.mjs")
    command = ["node", str(script), str(here / "core.wasm"), str(here / "layout.json")]
    subprocess.run(
        [*command, str(tmp_path / "memory"), str(tmp_path / "out")], check=True, timeout=60
    )
    mine, its = all_bytes(core), (tmp_path / "out").read_bytes()
    assert len(mine) == len(its) > 1000
    assert mine == its


def test_the_host_knows_the_statuses_of_the_core():
    assert {status.name: status.value for status in Status} == constants("Status")


START = """
from chutelab import simulate
from chutelab.core import module
kept = module._kept((module.files("chutelab.core") / "core.wasm").read_bytes())
print(kept, float(simulate("perpendicular", engine="contact").knots["position"].sum()).hex())
"""


@pytest.mark.parametrize(
    "spoil", ["missing", "cut off", "damaged", "foreign", "another's", "no folder"]
)
def test_a_compiled_core_that_is_kept_costs_only_time(tmp_path, spoil):
    """What is loaded is machine code: a wrong byte in it once ended Python with a crash."""

    def start():
        env = {**os.environ, "XDG_CACHE_HOME": str(tmp_path / "cache")}
        done = subprocess.run(
            [sys.executable, "-c", START], env=env, capture_output=True, text=True, timeout=60
        )
        assert (done.returncode, done.stderr) == (0, "")
        kept, result = done.stdout.split()
        return Path(kept), result

    kept, result = start()
    assert kept.parent.parent == tmp_path / "cache"
    good = kept.read_bytes()
    if spoil == "missing":
        kept.unlink()
    elif spoil == "cut off":
        kept.write_bytes(good[:1000])
    elif spoil == "damaged":
        kept.write_bytes(good[:150_000] + bytes([good[150_000] ^ 255]) + good[150_001:])
    elif spoil == "foreign":
        code = good[32:].replace(b"wasmtime", b"wastetim")
        kept.write_bytes(hashlib.sha256(code).digest() + code)
    elif spoil == "another's":
        kept.chmod(0o666)
    else:
        shutil.rmtree(tmp_path / "cache")
        (tmp_path / "cache").write_text("a file")
    assert start()[1] == result
    if spoil not in ("another's", "no folder"):
        assert kept.read_bytes() == good
