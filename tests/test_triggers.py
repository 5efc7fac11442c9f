"""What waits for a touch: gates that open and shut, motions that begin."""

from math import asin, cos, pi, sin, sqrt

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind, Recording
from chutelab.scene import SceneError

G, R = 9.81, 0.02
BELL = {"touched": "bell"}
SHELF = {"name": "shelf", "from": [-1.0, 1.0], "to": [0.0, 1.0], "restitution": 0.0}
STRUCK = sqrt(2.0 * (0.7 - R) / G)
"""s; when the disk that falls from 1 m strikes the bell, 0.3 m high."""


def scene(*surfaces, **run):
    """A disk that lies 0.5 m from the left end of a shelf 1 m high, and one that strikes a bell."""
    bell = {"name": "bell", "from": [0.5, 0.3], "to": [1.5, 0.3], "restitution": 0.5}
    return {
        "particle": {"radius": R, "mass": 0.1},
        "surface": [bell, *surfaces],
        "stream": [
            {"at": [-0.5, 1.0 + R], "velocity": [0.0, 0.0], "interact": True},
            {"at": [1.0, 1.0], "velocity": [0.0, 0.0]},
        ],
        "run": {"until": 0.7, **run},
    }


def sound(recording):
    assert not recording.laws
    assert abs(recording.ledger.residual) <= 1e-11 * recording.ledger.turned_over
    return recording


def test_a_gate_opens_when_a_bell_is_struck():
    """Struck at sqrt(2 h / g); from then on what lay on it falls 1/2 g t²."""
    recording = sound(chutelab.simulate(scene({**SHELF, "opens_when": BELL})))
    assert recording.triggered == pytest.approx([STRUCK], rel=1e-12)
    times = STRUCK + np.array([0.0, 0.1, 0.25])
    fallen = 1.0 + R - recording.at(times)[0][:, 0, 1]
    # What lies hops by g h²/8.
    assert fallen == pytest.approx(0.5 * G * (times - STRUCK) ** 2, abs=2e-5)


@pytest.mark.parametrize("moving", [0.0, 0.4])
@pytest.mark.parametrize("ends", ["run", "gate"])
def test_a_step_cut_short_before_the_end_or_a_gate_is_no_event_of_what_rests(ends, moving):
    """The bell ends a step at 20 ms. Where a step ends next changes nothing for what lies still or
    slides: it is not parted from its shelf, nor struck by it."""
    gate = {"name": "gate", "from": [3.0, 0.0], "to": [4.0, 0.0], "restitution": 0.0}
    late = {"name": "late", "from": [3.0, 1.0], "to": [4.0, 1.0], "restitution": 0.0}
    for after in np.arange(0.05e-3, 2.1e-3, 0.05e-3):
        until, gate["opens_at"] = (0.02 + after, 9.0) if ends == "run" else (0.03, 0.02 + after)
        tables = scene(SHELF, gate, {**late, "opens_when": BELL}, until=until)
        tables["stream"][0]["velocity"] = [moving, 0.0]
        tables["stream"][1]["at"] = [1.0, 0.3 + R + 0.5 * G * 0.02**2]
        recording = sound(chutelab.simulate(tables))
        assert recording.triggered == pytest.approx([0.02])
        own = recording.events[recording.events["particle"] == 0]
        assert not {Kind.IMPACT, Kind.SEPARATION} & {*own["kind"]}, after


def test_a_gate_shuts_when_a_bell_is_struck():
    """The second disk falls freely past where the lid is from then on, and the third does not."""
    lid = {"name": "lid", "from": [-1.0, 0.8], "to": [0.0, 0.8], "restitution": 0.0}
    tables = scene({**lid, "closes_when": BELL}, until=1.2)
    tables["stream"][0] |= {"at": [-0.5, 1.0], "rate": 2.0, "count": 2}
    recording = sound(chutelab.simulate(tables))
    assert recording.triggered == pytest.approx([STRUCK], rel=1e-12)
    struck = recording.select("impact", surface="lid")
    assert {*struck["particle"].tolist()} == {1}
    assert struck["t"][0] == pytest.approx(0.5 + sqrt(2.0 * (0.2 - R) / G), rel=1e-12)


@pytest.mark.parametrize("motion", ["turn", "shake", "travel", "motor"])
def test_a_motion_begins_when_a_bell_is_struck(motion):
    """Its times count from there: w t; A sin(2 pi f t); 2 d (t/T)²; 1/2 (T/I) t²."""
    keys = {
        "turn": {"turn": 90.0},
        "shake": {"shake": {"by": [0.01, 0.0], "frequency": 3.0}},
        "travel": {"travel": {"to": [3.5, 0.0], "at": 0.1, "in": 0.5}},
        "motor": {
            "hinge": [3.0, 0.0],
            "inertia": 2.0,
            "motor": {"speed_deg": 500.0, "torque": 3.0},
        },
    }[motion]
    arm = {"name": "arm", "from": [3.0, 0.0], "to": [4.0, 0.0], "starts_when": BELL, **keys}
    recording = sound(chutelab.simulate(scene(SHELF, arm)))
    t = 0.2
    expected = {
        "turn": (3.0, 0.5 * pi * t),
        "shake": (3.0 + 0.01 * sin(2.0 * pi * 3.0 * t), 0.0),
        "travel": (3.0 + 0.5 * 2.0 * ((t - 0.1) / 0.5) ** 2, 0.0),
        "motor": (3.0, 0.5 * 3.0 / 2.0 * t**2),
    }[motion]
    before, after = recording.pose("arm", [STRUCK, STRUCK + t])[:, [0, 2]]
    assert before == pytest.approx([3.0, 0.0], abs=1e-12)
    # A motor begins within a step.
    assert after == pytest.approx(expected, abs=2e-3 if motion == "motor" else 1e-12)


def test_a_disk_is_thrown_by_what_begins_to_move():
    """A table that shakes from its lowest speed up: it throws what lies on it at A w from there."""
    table = {**SHELF, "shake": {"by": [0.0, 0.005], "frequency": 10.0}, "starts_when": BELL}
    recording = sound(chutelab.simulate(scene(table)))
    rate = 0.005 * 2.0 * pi * 10.0
    assert recording.at([STRUCK - 1e-3])[1][0, 0] == pytest.approx([0.0, 0.0], abs=1e-9)
    highest = recording.at(np.linspace(STRUCK, 0.7, 2000))[0][:, 0, 1].max() - 1.0 - R
    assert highest > 0.5 * rate**2 / G
    assert recording.ledger.drive_work > 0.0


def test_what_rolls_on_to_a_bell_touches_it():
    """It rolls over the joint of two floors at v: there is no blow."""
    floors = [
        {"name": "floor", "from": [-2.0, 0.0], "to": [-1.0, 0.0]},
        {"name": "bell", "from": [-1.0, 0.0], "to": [0.0, 0.0]},
        {**SHELF, "opens_when": BELL},
    ]
    tables = scene()
    tables["surface"] = floors
    tables["stream"] = {"at": [-1.2, R], "velocity": [1.0, 0.0]}
    tables["particle"]["spin"] = False
    for surface in floors[:2]:
        surface["friction"] = 0.0
    recording = sound(chutelab.simulate(tables))
    # At the end of the step in which it does.
    assert recording.triggered == pytest.approx([0.2], abs=2.1e-3)


def test_pymunk_does_the_same_to_its_step():
    arm = {"name": "arm", "from": [3.0, 0.0], "to": [4.0, 0.0], "turn": 90.0, "starts_when": BELL}
    tables = scene({**SHELF, "opens_when": BELL}, arm)
    contact, pymunk = (chutelab.simulate(tables, engine=name) for name in ("contact", "pymunk"))
    assert not pymunk.laws
    assert pymunk.triggered == pytest.approx(contact.triggered, abs=1e-3)
    where = contact.at([0.6])[0] - pymunk.at([0.6])[0]
    assert np.abs(where).max() < 5e-3
    assert pymunk.pose("arm", 0.6)[0, 2] == pytest.approx(contact.pose("arm", 0.6)[0, 2], abs=2e-3)


def test_what_is_never_touched_waits_and_is_saved(tmp_path):
    tables = scene({**SHELF, "opens_when": {"touched": "lid"}}, {
        "name": "lid", "from": [-1.0, -3.0], "to": [0.0, -3.0], "closes_when": BELL,
    })  # fmt: skip
    recording = sound(chutelab.simulate(tables))
    assert recording.triggered == pytest.approx([np.inf, STRUCK])
    assert recording.at([0.7])[0][0, 0, 1] == pytest.approx(1.0 + R, abs=1e-5)
    loaded = Recording.load(recording.save(tmp_path / "run.npz"))
    assert loaded.triggered.tobytes() == recording.triggered.tobytes()
    assert not loaded.laws


def test_engines_without_it_refuse_it():
    tables = scene({**SHELF, "opens_when": BELL})
    with pytest.raises(SceneError, match="needs contact or pymunk"):
        chutelab.load(tables, {"run.engine": "exact"})
    with pytest.raises(SceneError, match="waits until something is touched"):
        chutelab.simulate(tables, engine="exact")


@pytest.mark.parametrize("height", [0.43, 0.45, 0.48, 0.49, 0.55])
def test_a_marble_stays_in_the_loop_from_five_halves_of_its_radius_up(height):
    """Else it leaves at sin θ = 2 (H - R)/(3 ρ), where v² = g ρ sin θ, and meets the loop at -3 θ.

    A parabola that osculates a circle meets it four times: the sum of those angles, with the axis
    upright, is a multiple of 2π, and three of them are θ.
    """
    loop, rho, ramp = 0.2, 0.19, 0.69
    at = [-0.5 - sqrt(ramp**2 - (0.7 - height) ** 2), height]
    smooth = {"friction": 0.0, "radius": loop, "center": [0.0, loop]}
    tables = {
        "particle": {"radius": 0.01, "mass": 0.02},
        "surface": [
            {"name": "ramp", "center": [-0.5, 0.7], "radius": 0.7, "from_deg": 180.0,
             "to_deg": 270.0, "friction": 0.0},
            {"name": "floor", "from": [-0.5, 0.0], "to": [1.0, 0.0], "friction": 0.0},
            {"name": "right", **smooth, "from_deg": -90.0, "to_deg": 90.0,
             "opens_when": {"touched": "left"}},
            {"name": "left", **smooth, "from_deg": 90.0, "to_deg": 270.0,
             "closes_when": {"touched": "right"}},
        ],
        "stream": {"at": at, "velocity": [0.0, 0.0]},
        "run": {"until": 1.3, "dt": 2.5e-4},
    }  # fmt: skip
    recording = chutelab.simulate(tables)
    assert not recording.laws
    names, events = recording.surfaces, recording.events
    blows = events[(events["kind"] == Kind.IMPACT) & (events["t"] > 0.7)]
    sine = 2.0 * (height - loop) / (3.0 * rho)
    if sine >= 1.0:
        top = recording.select(Kind.SLIP)
        top = top[top["surface"] == names.index("left")][0]
        v = sqrt(2.0 * G * (height - loop - rho))
        assert top["velocity_after"] == pytest.approx([-v, 0.0], abs=2e-4)
        assert recording.track(0)["position"][-1, 0] > 0.1
        return
    theta = asin(sine)
    left = recording.select(Kind.SEPARATION)
    left = left[left["surface"] == names.index("right")][0]
    assert left["position"] == pytest.approx([rho * cos(theta), loop + rho * sine], abs=2e-4)
    there = [rho * cos(3.0 * theta), loop - rho * sin(3.0 * theta)]
    assert blows["position"][0] == pytest.approx(there, abs=5e-5)
