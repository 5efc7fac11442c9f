"""Gravity that points anywhere: a scene that is turned as a whole with it does the same, turned."""

from itertools import product
from math import cos, radians, sin

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind
from chutelab.scene import SceneError

G, R = 9.81, 0.02


def sound(recording):
    assert not recording.laws
    ledger = recording.ledger
    assert abs(ledger.residual) <= 1e-11 * ledger.turned_over
    return recording


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
@pytest.mark.parametrize(("spin", "mu"), [(False, 0.2), (True, 0.5), (True, 0.1)])
def test_a_level_floor_is_an_incline_where_gravity_is_turned(engine, spin, mu):
    # Sliding a = g (sin α - µ cos α); a disk rolls with a = g sin α/(1 + 1/2) where µ holds it.
    alpha = radians(35.0)
    rolls = spin and mu >= (1.0 / 3.0) * sin(alpha) / cos(alpha)
    a = G * sin(alpha) / 1.5 if rolls else G * (sin(alpha) - mu * cos(alpha))
    scene = {
        "gravity_deg": 35.0,
        "particle": {"radius": R, "spin": spin},
        "surface": [{"name": "floor", "from": [-1.0, 0.0], "to": [9.0, 0.0], "friction": mu}],
        "stream": {"at": [0.0, R], "velocity": [0.0, 0.0]},
        "run": {"until": 1.0},
    }
    last = sound(chutelab.simulate(scene, engine=engine)).track(0)[-1]
    assert last["position"] == pytest.approx([0.5 * a, R], rel=1e-9)
    assert last["velocity"] == pytest.approx([a, 0.0], rel=1e-9, abs=1e-12)


def turned(angle):
    """Balls that bounce in a bin with a shaken floor, on to a weighted flap, turned by an angle."""
    c, s = cos(radians(angle)), sin(radians(angle))

    def at(x, y):
        return [c * x - s * y, s * x + c * y]

    hinge = {"hinge": at(0.3, 0.0), "mass": 0.4, "spring": 0.8, "damper": 0.01}
    shake = {"by": at(0.0, 0.004), "frequency": 7.0}
    return {
        "gravity_deg": angle,
        "particle": {"radius": R, "mass": 0.05, "spin": True},
        "surface": [
            {"name": "floor", "from": at(-0.5, -0.4), "to": at(0.5, -0.3), "shake": shake},
            {"name": "flap", "from": at(0.3, 0.0), "to": at(0.0, 0.0), **hinge},
            {"name": "bowl", "center": at(-0.6, 0.0), "radius": 0.3,
             "from_deg": 190.0 + angle, "to_deg": 300.0 + angle},
        ],
        "stream": [
            {"at": at(0.1, 0.3), "velocity": at(0.0, 0.0), "omega": 3.0, "interact": True},
            {"at": at(-0.7, 0.2), "velocity": at(0.4, 0.0), "count": 2, "rate": 4.0,
             "bed_height": 0.05, "seed": 3},
        ],
        "run": {"until": 0.9},
    }  # fmt: skip


@pytest.mark.parametrize(
    ("engine", "angle"),
    [*product(["contact"], [30.0, 90.0, -137.0]), ("pymunk", 30.0)],
)
def test_a_scene_turned_with_its_gravity_does_the_same_turned(engine, angle):
    plain, other = (chutelab.simulate(turned(a), engine=engine) for a in (0.0, angle))
    assert not plain.laws
    assert not other.laws
    c, s = cos(radians(angle)), sin(radians(angle))
    back = np.array([[c, -s], [s, c]])
    for field in ("t", "kind", "particle", "surface"):
        close = 1e-9 if field == "t" else 0
        np.testing.assert_allclose(other.events[field], plain.events[field], atol=close)
    for mine, its in ((other.events, plain.events), (other.ends()[1], plain.ends()[1])):
        np.testing.assert_allclose(mine["position"] @ back, its["position"], atol=1e-9)
    for name in ("kinetic", "potential", "spring", "friction_loss", "restitution_loss",
                 "drive_work", "damper_loss"):  # fmt: skip
        mine, its = (getattr(one.ledger, name) for one in (other, plain))
        assert mine == pytest.approx(its, rel=1e-8, abs=1e-10), name
    # Between knots a track of a crowd is off by up to 1e-4 of a radius.
    times = np.linspace(0.0, 0.9, 40)
    np.testing.assert_allclose(other.at(times)[0] @ back, plain.at(times)[0], atol=4e-6)
    energy = [one.energy_at(times)["potential"] for one in (other, plain)]
    np.testing.assert_allclose(*energy, atol=4e-6)


def test_what_falls_sideways_ends_there_and_loads_bear_its_weight():
    scene = turned(90.0) | {"run": {"until": 9.0, "loads": 0.1}}
    recording = sound(chutelab.simulate(scene, engine="contact"))
    gone = recording.select(Kind.EXIT)
    # Turned so, the lowest is the shaken floor at y = -0.4 - 0.004, now at x = 0.404.
    assert gone["position"][:, 0] == pytest.approx(1.404, abs=1e-9)
    assert len(gone)
    first, last = recording.ends()
    weight = 0.05 * G * (last["t"] - first["t"]).sum()
    borne = recording.impulses["force"].sum(axis=(0, 1))
    change = 0.05 * (last["velocity"] - first["velocity"]).sum(axis=0)
    assert change + borne == pytest.approx([weight, 0.0], abs=1e-9)


@pytest.mark.parametrize(("more", "key"), [
    ({"incoming": {"speed": 1.0, "pulley_radius": 0.1}}, "gravity_deg"),
    ({"run": {"engine": "exact"}}, "gravity_deg"),
])  # fmt: skip
def test_what_needs_gravity_downwards_refuses_another(more, key):
    scene = {"gravity_deg": 10.0, "stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, **more}
    with pytest.raises(SceneError) as caught:
        chutelab.simulate(scene)
    assert [fault.key for fault in caught.value.faults] == [key]
