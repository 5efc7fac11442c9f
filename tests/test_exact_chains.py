"""The event-driven engine on chains and in bowls: rims met again, joints of three pieces."""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from chutelab.engines import exact
from chutelab.machine import build
from chutelab.results.laws import judge
from chutelab.scene import from_dict

G = 9.81
SMOOTH = {"friction": 0.0, "restitution": 0.0}


def ran(particle, surfaces, at, velocity=(0.0, 0.0), until=1.0):
    """Return the run of a scene with the exact engine."""
    tables = {
        "gravity": G,
        "particle": {"mass": 0.01, **particle},
        "surface": [{"name": f"p{n}", **row} for n, row in enumerate(surfaces)],
        "stream": {"at": list(at), "velocity": list(velocity)},
        "run": {"until": until},
    }
    return exact.run(build(from_dict(tables)))


def arc(center, radius, first, last, **values):
    return {"center": center, "radius": radius, "from_deg": first, "to_deg": last, **values}


def line(start, end, **values):
    return {"from": start, "to": end, **values}


PIPE = arc([0.0, 0.0], 1.0, 180, 360, **SMOOTH)


@pytest.mark.parametrize("share", [0.05, 0.1, 0.3, 0.8, 0.999])
def test_a_ball_that_rises_over_the_rim_of_a_half_pipe_comes_back_into_it(share):
    """Each crossing takes Q = ∫ L dθ / sqrt(2 g (h + L sin θ)), θ from 0 to π, each rise 2 V/g."""
    length, height = 1.0 - share, 0.5
    speed = sqrt(2.0 * G * height)

    def crossing(end):
        return quad(lambda a: length / sqrt(2.0 * G * (height + length * np.sin(a))), 0.0, end)[0]

    until = 3.0
    run = ran({"radius": share}, [PIPE], (-length, height), until=until)
    assert judge(run) == ()
    across, rise = crossing(pi), 2.0 * speed / G
    turns, left = divmod(until - speed / G, across + rise)
    side = -1.0 if turns % 2 == 0 else 1.0
    if left < across:
        angle = brentq(lambda a: crossing(a) - left, 0.0, pi, xtol=1e-14)
        place = side * length * np.cos(angle), -length * np.sin(angle)
    else:
        left -= across
        place = -side * length, speed * left - 0.5 * G * left**2
    np.testing.assert_allclose(run.track(0)[-1]["position"], place, rtol=0, atol=1e-9)


def test_where_a_wall_stands_on_the_rim_it_comes_back_along_the_wall():
    walls = [line([-1.0, 0.0], [-1.0, 0.2], **SMOOTH), line([1.0, 0.3], [1.0, 0.0], **SMOOTH)]
    run = ran({"radius": 0.1}, [PIPE, *walls], (-0.9, 0.5), until=2.5)
    alone = ran({"radius": 0.1}, [PIPE], (-0.9, 0.5), until=2.5)
    assert judge(run) == ()
    last = [track.track(0)[-1]["position"] for track in (run, alone)]
    np.testing.assert_allclose(*last, rtol=0, atol=1e-9)


def test_a_ball_that_nearly_fills_its_bowl_stays_in_it():
    run = ran(
        {"radius": 0.04995, "spin": True},
        [arc([0.0, 0.0], 0.05, 180, 360, restitution=0.0)],
        (0.004, 0.3),
        until=0.3,
    )
    assert judge(run) == ()
    assert np.abs(run.track(0)["position"][:, 0])[1:].max() < 0.004 + 1e-12
    assert abs(run.track(0)[-1]["position"][0]) <= 0.05 - 0.04995 + 1e-12


FLOOR = line([-0.6, 0.0], [-0.1, 0.0])
LEAVE = arc([-0.1, 0.2], 0.2, 270, 340)
JOINTS = {
    "end": [FLOOR, LEAVE, line([-0.1, 0.0], [0.6, 0.0])],
    "middle": [line([-0.6, 0.0], [0.6, 0.0]), LEAVE],
    "other order": [line([0.6, 0.0], [-0.1, 0.0]), arc([-0.1, 0.2], 0.2, 340, 270), FLOOR],
    "a kink down": [FLOOR, LEAVE, line([-0.1, 0.0], [0.6, -0.3])],
    "two arcs": [FLOOR, arc([-0.1, 0.7], 0.7, 270, 300), LEAVE],
}


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("spin", [False, True])
def test_a_ball_takes_the_piece_that_bounds_its_side_of_a_joint(joint, spin):
    """It rides up the arc, whatever else begins where the floor ends: as on floor and arc alone."""
    particle = {"radius": 0.008, "spin": spin}
    run = ran(particle, JOINTS[joint], (-0.5, 0.0081), (2.0, 0.0))
    alone = ran(particle, [FLOOR, LEAVE], (-0.5, 0.0081), (2.0, 0.0))
    assert judge(run) == ()
    times = np.linspace(0.0, 0.45, 40)
    np.testing.assert_allclose(run.at(times)[0], alone.at(times)[0], rtol=0, atol=1e-9)


def test_below_a_joint_of_three_pieces_it_goes_straight_on():
    """Gravity points up for what slides under the floor: there neither arc nor joint is met."""
    run = ran({"radius": 0.008}, JOINTS["end"], (-0.5, -0.0081), (2.0, 0.3), until=0.03)
    assert judge(run) == ()
    flat = line([-0.6, 0.0], [0.6, 0.0])
    alone = ran({"radius": 0.008}, [flat], (-0.5, -0.0081), (2.0, 0.3), until=0.03)
    np.testing.assert_allclose(run.track(0)[-1]["position"], alone.track(0)[-1]["position"])
