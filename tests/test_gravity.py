"""Gravity that points anywhere: a scene that is turned as a whole with it does the same, turned."""

from math import cos, radians, sin

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind
from chutelab.results.ledger import energy_at
from chutelab.scene import SceneError, from_dict
from chutelab.studies.sweep.plan import Block, are_family, swept
from shared import some

G, R = 9.81, 0.02


def sound(recording):
    assert not recording.laws
    ledger = recording.ledger
    assert abs(ledger.residual) <= 1e-11 * ledger.turned_over
    return recording


@pytest.mark.parametrize(
    ("engine", "spin", "mu"),
    [
        ("contact", False, 0.2), ("contact", True, 0.5), ("contact", True, 0.1),
        *some([("pymunk", True, 0.5), ("pymunk", True, 0.1), ("pymunk", False, 0.2)]),
    ],
)  # fmt: skip
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
    [("contact", -137.0), *(
        pytest.param(engine, angle, marks=pytest.mark.slow)
        for engine, angle in (("contact", 30.0), ("contact", 90.0), ("pymunk", 30.0))
    )],
)  # fmt: skip
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
    energy = [energy_at(one, times)["potential"] for one in (other, plain)]
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


def lone(angle, *, far=(0.0, 0.0), **run):
    """Disks that do not meet: they bounce, roll, slide round an arc and off ends, turned."""
    c, s = cos(radians(angle)), sin(radians(angle))

    def at(x, y):
        return [c * x - s * y + far[0], s * x + c * y + far[1]]

    return {
        "gravity_deg": angle,
        "particle": {"radius": R, "mass": 0.05, "spin": True},
        "surface": [
            {"name": "slope", "from": at(-0.6, 0.2), "to": at(0.0, -0.1), "restitution": 0.4},
            {"name": "belt", "from": at(0.1, -0.3), "to": at(0.5, -0.3), "speed": 0.8,
             "friction": 0.3},
            {"name": "bowl", "center": at(0.6, -0.2), "radius": 0.4, "friction": 0.05,
             "from_deg": 200.0 + angle, "to_deg": 320.0 + angle},
        ],
        "stream": [
            {"at": at(-0.4, 0.4), "velocity": [c * 0.1, s * 0.1], "count": 6, "rate": 9.0,
             "bed_height": 0.2, "omega": 5.0},
            {"at": at(0.7, 0.3), "velocity": [0.0, 0.0]},
        ],
        "run": {"until": 0.9, **run},
    }  # fmt: skip


@pytest.mark.parametrize("angle", [30.0, 90.0, -137.0])
@pytest.mark.parametrize("far", [(0.0, 0.0), (4096.0, -2048.0)])
def test_closed_forms_turn_with_gravity(angle, far):
    plain, other = (
        sound(chutelab.simulate(lone(a, far=at), engine="exact"))
        for a, at in ((0.0, (0.0, 0.0)), (angle, far))
    )
    c, s = cos(radians(angle)), sin(radians(angle))
    back = np.array([[c, -s], [s, c]])
    # Far off, coordinates in the file are rounded by 5e-13 m, which blows and rims magnify.
    close = {"rtol": 0.0, "atol": 3e-10 if any(far) else 1e-12}
    for field in ("kind", "particle", "surface"):
        assert other.events[field].tolist() == plain.events[field].tolist()
    for field in ("t", "omega_before", "omega_after", "normal_impulse", "tangential_impulse"):
        np.testing.assert_allclose(other.events[field], plain.events[field], rtol=0.0, atol=1e-9)
    times = np.linspace(0.0, 0.85, 60)
    (place, speed), (its_place, its_speed) = other.at(times), plain.at(times)
    np.testing.assert_allclose((place - far) @ back, its_place, **close)
    np.testing.assert_allclose(speed @ back, its_speed, **close)
    for name in ("kinetic", "friction_loss", "restitution_loss", "belt_work"):
        assert getattr(other.ledger, name) == pytest.approx(getattr(plain.ledger, name), rel=1e-11)


def test_variants_of_a_turned_scene_go_at_once_and_have_the_rows_of_the_upright_one():
    """Times, losses and work do not know which way is down; a turn that varies goes one by one."""
    keys, values = ("surface[0].restitution", "surface[1].friction"), np.linspace(0.1, 0.8, 12)
    plain, other = (
        swept(Block(from_dict(lone(a)), keys, np.stack([values, values[::-1]], axis=1)))
        for a in (0.0, -137.0)
    )
    names = [name for name in plain if name.startswith("ledger.") or name == "track.t.mean"]
    assert len(names) > 4
    for name in names:
        np.testing.assert_allclose(other[name], plain[name], rtol=0.0, atol=1e-12, err_msg=name)
    assert np.ptp(other["ledger.restitution_loss"]) > 0.01
    assert are_family(from_dict(lone(-137.0)), keys, None)
    assert not are_family(from_dict(lone(0.0)), ("gravity_deg",), None)


def test_the_exact_engine_bears_and_ends_tracks_where_the_contact_engine_does():
    scene = lone(40.0, until=3.0, loads=0.5)
    del scene["surface"][2]
    exact, contact = (sound(chutelab.simulate(scene, engine=one)) for one in ("exact", "contact"))
    assert chutelab.simulate(scene).engine == "exact"
    gone = exact.select(Kind.EXIT)
    assert len(gone) > 3
    by_particle = contact.select(Kind.EXIT)
    order = np.argsort(by_particle["particle"])[np.argsort(np.argsort(gone["particle"]))]
    np.testing.assert_allclose(gone["position"], by_particle["position"][order], atol=1e-3)
    for field in ("force", "moment", "at"):
        mine, its = (one.impulses[field].sum(axis=0) for one in (exact, contact))
        np.testing.assert_allclose(mine, its, atol=2e-3 * np.abs(its).max())


def test_the_paper_s_machine_needs_gravity_downwards():
    belt = {"incoming": {"speed": 1.0, "pulley_radius": 0.1}}
    scene = {"gravity_deg": 10.0, "stream": {"at": [0.0, 1.0], "velocity": [0.0, 0.0]}, **belt}
    with pytest.raises(SceneError) as caught:
        chutelab.simulate(scene)
    assert [fault.key for fault in caught.value.faults] == ["gravity_deg"]
