"""What the theory says of scenes with inclines, spheres, arcs, conveyors, gates and kinds."""

import math

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from chutelab.engines.simulation import simulate
from chutelab.results.quantities import compare, each
from chutelab.scene import from_dict
from chutelab.theory import STAGES, Reason, drag, predict, transfer

G = 9.81


def scene(**tables):
    base = {
        "particle": {"radius": 0.004, "mass": 0.008},
        "incoming": {"speed": 2.0, "pulley_radius": 0.1},
        "plate": {"distance": 0.5},
        "outgoing": {"drop": 0.9, "drop_from": "top"},
    }
    for name, table in tables.items():
        base[name] = {**base.get(name, {}), **table} if isinstance(table, dict) else table
    return from_dict(base, "test")


def same(found, known):
    assert found.reason == ""
    names = [name for stage in STAGES.values() for name in stage]
    assert {n: float(getattr(found, n)) for n in names} == pytest.approx(
        {n: float(getattr(known, n)) for n in names}, rel=1e-13, abs=1e-14
    )


@pytest.mark.parametrize(
    ("engine", "grip", "ball", "off"),
    [
        ("exact", "adhesion", {}, 1e-13),
        ("exact", 0.3, {}, 1e-13),
        ("exact", 0.3, {"spin": True, "shape": "sphere"}, 1e-13),
        ("contact", "adhesion", {}, 1e-12),
        ("pymunk", "adhesion", {}, 1e-11),
        ("pymunk", 0.3, {"spin": True, "shape": "sphere"}, 1e-5),
    ],
)
@pytest.mark.parametrize(
    ("degrees", "speed", "way"), [(-14.0, 1.0, 0.4), (-14.0, 2.0, 0.2), (8.0, 2.5, 0.4)]
)
def test_a_lone_rider_of_an_inclined_belt_on_the_engines(
    degrees, speed, way, engine, grip, ball, off
):
    """Put on the belt 0.4 m from its end, where it begins, or 0.2 m."""
    cos, sin = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    place = {"at": [-way * cos - 0.104 * sin, -way * sin + 0.104 * cos]} if way < 0.4 else {}
    one = scene(
        particle=ball,
        stream=place,
        incoming={"incline_deg": degrees, "speed": speed, "friction": grip, "length": 0.4},
        plate={"distance": 0.2, "friction": 0.2, "below": 9.0},
        outgoing={"drop": 0.5, "drop_from": "impact"},
    )
    compared = compare(simulate(one, engine=engine))
    assert compared.reason == ""
    assert compared.max is not None
    assert compared.max < off


def wall(**changes):
    return [{"name": "wall", **changes}]


CIRCLE = {"radius": 0.05}
GATE = "outside the model: wall: it is a gate"


@pytest.mark.parametrize(
    ("tables", "reason"),
    [
        ({}, ""),
        ({"surface": wall(center=[0.3, 0.05], **CIRCLE)}, "early contact: wall: it is touched"),
        ({"surface": wall(center=[0.3, 0.3], **CIRCLE)}, ""),
        # Only a part of the circle is there, and not the one that the flight goes through.
        ({"surface": wall(center=[0.3, 0.0], from_deg=200, to_deg=300, radius=0.3)}, ""),
        ({"surface": wall(center=[-0.5, 0.13], **CIRCLE)}, "early contact: wall: it is in the way"),
        ({"surface": wall(center=[0.3, 0.0], from_deg=200, to_deg=330, radius=0.3)},
         "early contact"),
        ({"surface": wall(center=[0.5, -0.65], **CIRCLE)}, "second contact: wall: 0.0"),
        ({"surface": wall(center=[0.3, 0.05], opens_at=0.1, **CIRCLE)}, GATE),
        ({"surface": wall(center=[0.5, -0.65], closes_at=9.0, **CIRCLE)}, GATE),
        ({"surface": wall(center=[0.3, 0.3], repeat=[[4, 0.0, -0.1]], **CIRCLE)}, "early contact"),
        ({"conveyor": wall(**{"from": [0.3, -0.05], "to": [0.4, -0.1], "speed": 1.0})},
         "early contact: wall"),
        ({"conveyor": wall(**{"from": [0.3, 0.32], "to": [0.5, 0.4], "speed": 1.0})}, ""),
        ({"plate": [{"distance": 0.5}, {"name": "wall", "pivot": [0.3, 0.2]}]}, "early contact"),
        ({"plate": [{"distance": 0.5}, {"name": "wall", "pivot": [0.3, 0.2], "below": 0.02}]}, ""),
        ({"particle": {"shape": "box", "size": [0.01, 0.01], "radius": None}},
         "outside the model: it is about disks"),
        ({"particle": {"spin": True, "rolling_friction": 0.02}}, "outside the model: rolling"),
        ({"string": [{"from": [-1.0, 2.0]}]}, "outside the model: the particle hangs"),
        ({"stream": {"at": [-0.5, 0.104], "to": [-0.4, 0.104]}}, "outside the model: the stream"),
        ({"stream": {"fill": [[-0.5, 0.2], [-0.3, 0.3]], "count": 5}},
         "outside the model: the stream"),
        ({"stream": [{}, {"at": [0.3, 1.0], "velocity": [0.0, 0.0]}]}, ""),
        ({"stream": [{}, {"at": [0.3, 1.0], "velocity": [0.0, 0.0], "interact": True}]},
         "outside the model: particles interact"),
        ({"incoming": {"incline_deg": 12.0, "pulley_radius": 0.4}},
         "early contact: pulley: the flight comes down"),
        ({"incoming": {"incline_deg": 12.0, "pulley_radius": 0.4}, "surface": wall(center=[-0.05,
         0.413], radius=0.01)}, "early contact: wall: it is"),
        ({"incoming": {"incline_deg": 30.0, "pulley_radius": 0.4, "speed": 1.0, "friction": 0.3}},
         "outside the model: it does not get up"),
        ({"incoming": {"incline_deg": 10.0, "speed": 2.5}, "surface": wall(center=[-0.6, 0.04],
         radius=0.05)}, "early contact: wall: it is in the"),
        ({"incoming": {"incline_deg": 10.0}, "stream": {"at": [-0.5, 0.104]}},
         "outside the model: the release point"),
    ],
)  # fmt: skip
def test_reasons(tables, reason):
    for name in list(tables):
        if isinstance(tables[name], dict):
            kept = {key: value for key, value in tables[name].items() if value is not None}
            tables = {**tables, name: kept}
    if "box" in str(tables):
        one = from_dict(
            {"particle": tables["particle"], "incoming": {"speed": 2.0, "pulley_radius": 0.1},
             "plate": {"distance": 0.5}}, "test",
        )  # fmt: skip
    else:
        one = scene(**tables)
    found = str(predict(one).reason)
    assert found.startswith(reason)
    assert bool(found) == bool(reason)


def test_the_first_particle_of_the_first_stream_is_of_its_own_kind():
    one = from_dict(
        {
            "particle": [{"name": "large", "radius": 0.03, "mass": 0.3}, {"name": "small",
             "radius": [0.002, 0.006], "mass": 0.01, "shape": "sphere", "spin": True}],
            "pair": [{"between": ["small", "plate"], "restitution": 0.25, "friction": 0.1}],
            "incoming": {"speed": 2.0, "pulley_radius": 0.1},
            "plate": {"distance": 0.5},
            "outgoing": {"drop": 0.9, "drop_from": "top"},
            "stream": [{"particle": "small"}, {"particle": "large", "start": 5.0}],
        },
        "test",
    )  # fmt: skip
    shared = {
        "speed": 2.0, "pulley_radius": 0.1, "distance": 0.5, "particle_radius": 0.004,
        "mass": 0.01, "restitution": 0.25, "plate_friction": 0.1, "spin": True, "inertia": 0.4,
        "interval": 0.005,
    }  # fmt: skip
    sunk = float(transfer(**shared, drop=0.0).y2)
    found = predict(one)
    same(found, transfer(**shared, drop=0.9 - sunk))
    told = drag(one, found, 0.0)
    assert told is not None
    assert told.reynolds == pytest.approx(2 * 0.004 * float(found.v3) * 1.2 / 1.8e-5)


@settings(max_examples=60)
@given(
    st.floats(-25.0, 25.0), st.floats(0.8, 4.0), st.floats(0.05, 0.4), st.floats(-0.3, 1.2),
    st.floats(-1.0, 0.8), st.floats(0.02, 0.3), st.floats(-180.0, 180.0), st.floats(20.0, 360.0),
)  # fmt: skip
def test_sampled_tracks_touch_no_arc_unless_told(
    incline, v, R, x, y, size, first,  # noqa: N803
    extent,
):  # fmt: skip
    r = 0.01
    one = scene(
        particle={"radius": r},
        incoming={"speed": v, "pulley_radius": R, "incline_deg": incline, "length": 0.8},
        surface=wall(center=[x, y], radius=size, from_deg=first, to_deg=first + extent),
        outgoing={"drop": 1.0 + R, "drop_from": "top"},
    )
    found = predict(one)
    free = predict(one.with_values({"surface": None}))
    assume(free.reason == "" or Reason.of(free.reason) is Reason.SECOND)
    beta, rho = math.radians(incline), R + r
    u, n = (np.array([math.cos(beta), math.sin(beta)]), np.array([-math.sin(beta), math.cos(beta)]))
    belt = rho * n + np.linspace(-0.8, 0.0, 2000)[:, None] * u
    phi = np.linspace(-beta, float(free.phi1), 500)
    round_ = rho * np.stack([np.sin(phi), np.cos(phi)], axis=1)
    t = np.linspace(0.0, float(free.t2), 2000)[:, None]
    velocity = float(free.v1) * np.array([math.cos(free.phi1), -math.sin(free.phi1)])
    fall = np.array([0.0, -0.5 * G])
    flight = round_[-1] + velocity * t + fall * t**2
    legs = [belt, round_, flight]
    if free.reason == "":
        t = np.linspace(0.0, float(free.t3), 2000)[:, None]
        legs.append(flight[-1] + np.array([-free.v3x, -free.v3y + G * free.t3]) * t + fall * t**2)
    track = np.concatenate(legs)
    away = track - [x, y]
    turned = np.mod(np.degrees(np.arctan2(away[:, 1], away[:, 0])) - first, 360.0)
    ends = [
        (x + size * math.cos(a), y + size * math.sin(a))
        for a in np.radians([first, first + extent])
    ]
    near = np.min([np.hypot(*(track - end).T) for end in ends], axis=0)
    far = np.where(turned <= extent, np.abs(np.hypot(*away.T) - size), near)
    assume(abs(far.min() - r) > 2e-3)
    stage = np.searchsorted(np.cumsum([len(leg) for leg in legs]), np.argmax(far < r), side="right")
    if far.min() > r:
        assert found.reason == free.reason
    elif stage == 3:
        assert str(found.reason).startswith("second contact: ")
    else:
        assert str(found.reason).startswith("early contact: wall")
        assert np.isnan(found.phi1) == (stage < 2)


def test_quantities_of_mixed_particles_are_each_particles_own():
    one = scene(
        particle=[{"name": "a", "radius": 0.03, "mass": 0.3}, {"name": "b", "mass": 0.01}],
        stream=[{"particle": "b"}, {"particle": "a"}],
    )
    run = simulate(one, engine="contact")
    compared = compare(run)
    assert compared.max is not None
    assert compared.max < 1e-12
    energy = [0.5 * m * (vx**2 + 4.0) for m, vx in zip((0.01, 0.3), each(run, "v3x"), strict=True)]
    assert each(run, "dEk") == pytest.approx(energy, rel=1e-13)
    assert each(run, "d3") == pytest.approx([0.9, 0.9], rel=1e-12)
