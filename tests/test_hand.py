"""Runs by hand: steps, pushes, plates that are turned, belts and motors whose speeds are set."""

import re
from math import asin, atan2, cos, hypot, inf, nan, radians, sin
from pathlib import Path

import numpy as np
import pytest

import chutelab
import sandbox
from chutelab.results import Recording
from chutelab.results.recorder import StalledError
from chutelab.scene import SceneError
from chutelab.util.errors import InputError
from shared import seeds

G, R, M, MU = 9.81, 0.02, 0.1, 0.3

FLOOR = {"name": "floor", "from": [-1.0, 0.0], "to": [3.0, 0.0], "friction": MU, "restitution": 0.0}


def scene(at=(0.0, 1.0), surface=(), stream=None, **keys):
    return {
        "particle": {"radius": R, "mass": M, "spin": False},
        "surface": list(surface),
        "stream": {"at": list(at), "velocity": [0.0, 0.0], **(stream or {})},
        "run": {"until": 1.0},
        **keys,
    }


def closes(recording):
    """Keeps all laws; what is in motion at the end is what was given and not lost."""
    ledger = recording.ledger
    assert not recording.laws
    change = sum(b - a for a, b in (ledger.kinetic, ledger.potential, ledger.spring))
    given = ledger.belt_work + ledger.drive_work + ledger.push_work
    given -= ledger.restitution_loss + ledger.friction_loss + ledger.damper_loss
    assert change == pytest.approx(given, abs=1e-11 * ledger.turned_over)
    assert abs(ledger.residual) <= 1e-11 * ledger.turned_over
    return ledger


def test_it_tells_how_far_it_is():
    run = chutelab.start(scene())
    assert re.fullmatch(r"<Run of \S+: t = 0 s, 0 particles under way, 0 steps>", repr(run))
    run.step(0.1)
    assert re.search(r": t = 0\.1\d* s, 1 particle under way, \d+ steps>$", repr(run))
    while not run.done:
        run.step(1.0)
    assert re.search(r": t = 1 s, 0 particles under way, \d+ steps, done>$", repr(run))


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("heap", {"stream.count": 30, "run.until": 0.8}),
        ("hopper", {"stream.count": 30, "run.until": 0.6}),
        ("see-saw", {"run.until": 0.6}),
    ],
)
def test_what_is_only_stepped_has_the_bits_of_a_run(name, changes):
    expected = chutelab.simulate(name, changes, engine="contact")
    run = chutelab.start(name, changes)
    for seconds in (0.013, 0.2, 0.0307):
        run.step(seconds)
        # To look at a run does not change it.
        assert run.recording.ended_by("stopped").any() or run.done
    while not run.done:
        run.step(0.1)
    for field in ("knots", "events", "by_surface", "swings", "totals"):
        assert getattr(run.recording, field).tobytes() == getattr(expected, field).tobytes()


def test_a_push_is_a_force_and_its_work_is_force_times_way():
    """In flight v = F/m t and s = F/2m t²; W = F s, to second order in the step."""
    run, force, span = chutelab.start(scene(gravity=0.0)), (0.7, -0.4), 0.4
    way = [0.5 * f / M * span**2 for f in force]
    for _ in range(20):
        run.push(0, force)
        run.step(span / 20)
    assert run.t == pytest.approx(span, abs=1e-12)
    assert run.positions[0] - [0.0, 1.0] == pytest.approx(way, abs=1e-5)
    assert run.velocities[0] == pytest.approx([f / M * span for f in force], rel=1e-12)
    run.step(0.1)
    ledger = closes(run.recording)
    kinetic = 0.5 * M * sum((f / M * span) ** 2 for f in force)
    assert ledger.push_work == pytest.approx(kinetic, rel=1e-12)
    assert ledger.push_work == pytest.approx(np.dot(force, way), rel=1e-12)
    assert run.recording.measure("ledger.push_work") == ledger.push_work


def test_a_push_along_a_floor_is_opposed_by_its_friction():
    """m a = F_x - mu (m g - F_y); on the floor N = m g - F_y; work F_x s."""
    push, span = (0.5, -0.2), 0.4
    run = chutelab.start(scene((0.0, R), [FLOOR]))
    run.step(0.05)
    for _ in range(20):
        run.push(0, push)
        run.step(span / 20)
    normal = M * G - push[1]
    slip = (push[0] - MU * normal) / M * span
    (touch,) = run.contacts
    assert (touch.surface, touch.other, touch.normal) == ("floor", -1, (0.0, 1.0))
    assert touch.pressed == pytest.approx(normal, rel=1e-9)
    assert touch.rubbed == pytest.approx(-MU * normal, rel=1e-9)
    assert run.velocities[0] == pytest.approx([slip, 0.0], rel=1e-2, abs=1e-12)
    run.step(1.0)
    ledger = closes(run.recording)
    # It slides 1/2 v t, and on by v²/(2 mu g): all that is given is heat.
    stops = 0.5 * slip * span
    assert ledger.push_work == pytest.approx(push[0] * stops, rel=1e-2)
    assert ledger.friction_loss == pytest.approx(ledger.push_work, rel=1e-9)


@pytest.mark.parametrize("air", [0.0, 1.2])
def test_pushes_of_a_crowd_close_the_ledger(air):
    run = chutelab.start("heap", {"stream.count": 40, "run.until": 0.6, "air_density": air})
    draw = np.random.default_rng(1)
    while not run.done:
        for particle in range(40):
            run.push(particle, 0.1 * draw.normal(size=2))
        run.step(0.01)
    assert closes(run.recording).push_work > 0.1


@pytest.mark.parametrize("kind", ["rod", "string", "spring"])
def test_a_push_along_a_floor_takes_along_what_is_tied_to_it(kind):
    """2 m a = F_x - mu N with N = 2 m g - F_y, which never stops pressing; work F_x s."""
    push, span, away = (0.9, 0.2), 0.4, 0.2
    stream = [{"at": [x, R], "velocity": [0.0, 0.0], "interact": True} for x in (0.0, away)]
    joint = {"particle": 0, "other": 1, **({"stiffness": 1e4} if kind == "spring" else {})}
    run = chutelab.start({**scene(surface=[FLOOR], **{kind: [joint]}), "stream": stream})
    run.step(0.05)
    pressed = []
    for _ in range(40):
        run.push(1, push)
        run.step(span / 40)
        pressed.append(sum(touch.pressed for touch in run.contacts))
    normal = 2.0 * M * G - push[1]
    assert pressed == pytest.approx(np.full(40, normal), rel=1e-2)
    pace = (push[0] - MU * normal) / (2.0 * M) * span
    assert run.velocities[:, 0].mean() == pytest.approx(pace, rel=1e-2)
    run.step(1.0)
    assert closes(run.recording).push_work == pytest.approx(push[0] * 0.5 * pace * span, rel=2e-2)


def test_a_push_is_force_times_time_although_impacts_cut_the_steps_of_joints():
    """Smooth walls give nothing along them: m1 v1 + m2 v2 = F t."""
    push = 0.3
    walls = [
        {
            **FLOOR,
            "name": f"wall{n}",
            "from": [x, -9.0 * side],
            "to": [x, 9.0 * side],
            "friction": 0.0,
            "restitution": 0.9,
        }
        for n, x, side in ((0, -0.2, -1), (1, 0.2, 1))
    ]
    stream = [
        {"at": [x, y], "velocity": [3.0, 0.0], "interact": True}
        for x, y in ((-0.1, 0.0), (0.0, 0.1))
    ]
    tied = scene(surface=walls, gravity=0.0, rod=[{"particle": 0, "other": 1}])
    run = chutelab.start({**tied, "stream": stream})
    run.step(0.01)
    begin = run.t
    while not run.done:
        run.push(1, (0.0, push))
        run.step(0.0137)
        given = M * run.velocities[:, 1].sum()
        assert given == pytest.approx(push * (run.t - begin), rel=1e-9) or run.done
    assert len(run.recording.select("impact")) > 5
    closes(run.recording)


@pytest.mark.parametrize("seed", seeds(9, 300))
def test_what_is_done_to_random_machines_by_hand_keeps_all_laws(seed):
    """Crowds with belts and gates, or bodies with joints on what moves: pushed and set."""
    random = np.random.default_rng(seed)
    drawn = sandbox.bodies(seed, both=seed % 3 == 2) if seed % 3 else sandbox.draw(seed)
    run = chutelab.start(drawn)
    hung = [name for name, mover in run.scene.movers.items() if mover.hinge]
    keys = {f"surface.{one.name}.speed": 2.0 for one in run.scene.surface}
    keys |= {f"conveyor.{one.name}.speed": 2.0 for one in run.scene.conveyor}
    for one in run.scene.surface:
        if one.motor:
            keys |= {f"surface.{one.name}.motor.{key}": 300.0 for key in ("torque", "speed_deg")}
    poses = []
    while not run.done:
        for _ in range(random.integers(3)):
            force = 10.0 ** random.uniform(-3.0, 0.5) * random.normal(size=2)
            if hung and random.random() < 0.3:
                run.push(str(random.choice(hung)), force, at=random.normal(size=2))
            elif keys and random.random() < 0.3:
                key = str(random.choice(list(keys)))
                run.set(key, keys[key] * random.uniform(0.0 if "torque" in key else -1.0, 1.0))
            else:
                run.push(int(random.integers(len(run.positions))), force)
        run.step(10.0 ** random.uniform(-4.0, -1.0))
        poses.append((run.t, [run.pose(name) for name in run.scene.movers]))
    closes(run.recording)
    for n, name in enumerate(run.scene.movers):
        times, known = [t for t, _ in poses], np.array([found[n] for _, found in poses])
        assert run.recording.pose(name, times) == pytest.approx(known, abs=1e-12)


def test_what_hangs_is_pushed_by_a_torque_whose_work_is_torque_times_angle():
    """I w' = r x F: w = r F t / I, angle = 1/2 w t, W = r F angle; on through a rest of its own."""
    pivot, inertia, force, span = (0.2, 0.1), 0.02, (0.3, 0.5), 0.4
    arm = {"name": "arm", "from": list(pivot), "to": [0.7, 0.1], "hinge": "pivot"}
    run = chutelab.start(scene((3.0, 3.0), [{**arm, "inertia": inertia}], gravity=0.0))
    at = (0.5, 0.2)
    torque = (at[0] - pivot[0]) * force[1] - (at[1] - pivot[1]) * force[0]
    run.step(0.1)
    begin = run.t
    run.push("arm", force, at=at)
    run.step(span)
    span = run.t - begin
    rate = torque * span / inertia
    assert run.pose("arm")[2] == pytest.approx(0.5 * rate * span, rel=1e-12)
    run.step(0.1)
    assert run.pose("arm")[2] == pytest.approx(
        rate * (0.5 * span + run.t - begin - span), rel=1e-12
    )
    ledger = closes(run.recording)
    assert ledger.push_work == pytest.approx(0.5 * inertia * rate**2, rel=1e-12)
    assert ledger.push_work == pytest.approx(torque * 0.5 * rate * span, rel=1e-12)
    assert ledger.by_surface["arm"]["push_work"] == ledger.push_work
    for body, place in (("arm", None), ("arm", (nan, 0.0)), ("floor", at), (0, at)):
        with pytest.raises(InputError):
            run.push(body, force, at=place)


def test_pushes_of_hinges_under_a_load_close_the_ledger(tmp_path):
    run, draw = chutelab.start("see-saw", {"run.until": 1.0}), np.random.default_rng(2)
    (name,) = (one for one, mover in run.scene.movers.items() if mover.hinge)
    while not run.done:
        run.push(name, 0.2 * draw.normal(size=2), at=draw.normal(size=2))
        run.push(0, 0.02 * draw.normal(size=2))
        run.step(0.01)
    recording = run.recording
    ledger = closes(recording)
    hung = ledger.by_surface[name]["push_work"]
    assert abs(hung) > 1e-4
    assert ledger.push_work == pytest.approx(hung + ledger.by_surface["particles"]["push_work"])
    assert Recording.load(recording.save(tmp_path / "run.npz")).ledger == ledger


def test_a_plate_that_is_turned_strikes_as_a_paddle_does():
    """v' = V + e (V - v) with V = w r where it strikes; the drive's work is J V."""
    e, away, rate = 0.5, 0.3, radians(20.0) / 0.2
    plate = {
        "name": "paddle",
        "pivot": [0.0, 0.0],
        "angle_deg": 0.0,
        "above": 0.0,
        "below": 0.5,
        "restitution": e,
    }
    # It hangs down, and turns counterclockwise: to the right.
    stream = {"at": [R + 0.02, -away], "velocity": [0.0, 0.0]}
    run = chutelab.start(scene(plate={**plate, "friction": 0.0}, stream=stream, gravity=0.0))
    run.set("plate.angle_deg", 20.0)
    run.step(0.2)
    assert run.pose("paddle") == pytest.approx([0.0, 0.0, radians(20.0)])
    run.step(0.2)
    assert run.pose("paddle")[2] == pytest.approx(radians(20.0))
    (blow,) = run.recording.select("impact")
    x, y = blow["position"]
    turned = rate * blow["t"]
    normal, foot = (cos(turned), sin(turned)), x * sin(turned) - y * cos(turned)
    impulse = M * (1.0 + e) * rate * foot
    assert blow["velocity_after"] == pytest.approx(np.array(normal) * impulse / M, rel=1e-9)
    ledger = closes(run.recording)
    assert ledger.drive_work == pytest.approx(impulse * rate * foot, rel=1e-9)
    assert ledger.by_surface["paddle"]["drive_work"] == pytest.approx(ledger.drive_work)


@pytest.mark.parametrize("pegs", [0, 20])
def test_a_plate_that_is_turned_meets_what_sleeps_where_it_comes_by(pegs):
    """It is R away from a disk at d from its pivot at an angle of atan(x/y) - asin(R/|d|)."""
    x, y, angle, span = 0.3, 0.22, radians(80.0), 0.3
    plate = {"name": "paddle", "pivot": [0.0, 0.0], "angle_deg": 0.0, "above": 0.5, "below": 0.0}
    shelf = {**FLOOR, "from": [0.2, y - R], "to": [2.0, y - R]}
    # With many surfaces a disk checks those near it only, and none of these ever is.
    far = {"name": "pegs", "from": [5.0, 0.0], "to": [5.1, 0.0]}
    far["repeat"] = [[max(pegs, 1), 1.0, 0.0]]
    plate |= {"restitution": 0.0, "friction": 0.0}
    run = chutelab.start(scene((x, y), [shelf, far], plate=plate))
    run.step(0.1)
    begin, met = run.t, atan2(x, y) - asin(R / hypot(x, y))
    run.set("plate.angle_deg", -80.0)
    run.step(span)
    blows = run.recording.select("impact", surface="paddle")
    assert blows["t"][0] == pytest.approx(begin + met / angle * span, abs=1e-6)
    assert run.positions[0, 0] > x + 0.1
    closes(run.recording)


def test_a_plate_that_is_turned_leaves_the_load_of_a_hinge_as_it_is():
    """All disks lie on the hinge, so that all of them and both surfaces are solved together."""
    sides = [[-0.3, 0.6], [-0.3, 0.0], [0.3, 0.0], [0.3, 0.6]]
    tray = {"name": "tray", "points": sides, "hinge": [0.0, 0.0], "inertia": 0.05, "friction": 0.5}
    tray |= {"stops_deg": [-5.0, 5.0], "spring": 50.0, "damper": 1.0, "restitution": 0.1}
    far = {"name": "far", "pivot": [2.0, 0.5], "angle_deg": 0.0, "above": 0.1, "below": 0.1}
    stream = {"fill": [[-0.28, R], [0.28, 0.5]], "count": 24, "interact": True}
    run = chutelab.start({
        "particle": {"radius": R, "mass": M}, "surface": [tray], "plate": [far],
        "stream": stream, "run": {"until": 1.0},
    })  # fmt: skip
    run.set("plate.angle_deg", 10.0)
    while not run.done:
        run.step(0.1)
    assert np.hypot(*run.recording.at([0.9])[0][0].T).max() < 0.7
    assert len(run.recording.swings) > 100
    closes(run.recording)


def test_belts_and_motors_are_set():
    """A disk that grips a belt goes with it; a motor is as fast as it is told to be."""
    belt = {**FLOOR, "speed": 0.5, "friction": 0.8}
    run = chutelab.start(scene((0.0, R), [belt]))
    run.step(0.4)
    run.set("surface.floor.speed", 1.0)
    assert run.velocities[0] == pytest.approx([0.5, 0.0], abs=1e-9)
    run.step(0.4)
    assert run.velocities[0] == pytest.approx([1.0, 0.0], abs=1e-9)
    closes(run.recording)
    motor = {"speed_deg": 90.0, "torque": 5.0}
    arm = {
        "name": "arm",
        "from": [0.0, 0.0],
        "to": [0.3, 0.0],
        "hinge": [0.0, 0.0],
        "inertia": 0.01,
    }
    run = chutelab.start(scene((3.0, 3.0), [{**arm, "motor": motor}], gravity=0.0))
    run.step(0.2)
    run.set("surface.arm.motor.speed_deg", -45.0)
    run.step(0.2)
    run.step(0.2)
    turned = run.recording.pose("arm", [0.1, 0.2, 0.4, 0.6])[:, 2]
    # Its torque brakes it first: by 1/2 dw² / (T / I) more.
    braking = 0.5 * radians(135.0) ** 2 / (5.0 / 0.01)
    expected = [radians(9.0), radians(-9.0) + braking, radians(-9.0)]
    assert np.diff(turned) == pytest.approx(expected, abs=1.5e-3)
    closes(run.recording)


def test_a_motor_that_is_set_stronger_does_more_work(tmp_path):
    """Against a damper d it ends at the rate T/d; its work is T times the angle."""
    damper, torque = 0.05, 2.0
    motor = {"speed_deg": 5000.0, "torque": 0.1}
    arm = {"name": "arm", "from": [0.0, 0.0], "to": [0.3, 0.0], "hinge": "pivot", "damper": damper}
    run = chutelab.start(scene((3.0, 3.0), [{**arm, "inertia": 1e-3, "motor": motor}], gravity=0.0))
    run.step(0.5)
    run.set("surface.arm.motor.torque", torque)
    while not run.done:
        run.step(0.1)
    recording = Recording.load(run.recording.save(tmp_path / "run.npz"))
    before, late, end = recording.pose("arm", [0.5, 0.9, 1.0])[:, 2]
    assert (end - late) / 0.1 == pytest.approx(torque / damper, rel=1e-3)
    work = motor["torque"] * before + torque * (end - before)
    assert closes(recording).drive_work == pytest.approx(work, rel=1e-3)


def test_a_run_that_was_steered_is_saved(tmp_path):
    run = chutelab.start("perpendicular", {"run.until": 0.6})
    while not run.done:
        run.set("plate.angle_deg", 10.0 * sin(5.0 * run.t))
        run.step(0.02)
    recording = run.recording
    loaded = Recording.load(recording.save(tmp_path / "run.npz"))
    assert loaded.pose("plate", [0.3]).tobytes() == recording.pose("plate", [0.3]).tobytes()
    assert not loaded.laws
    assert loaded.ledger == recording.ledger


def test_lone_particles_go_on_together_and_do_not_meet():
    stream = {"at": [0.0, 1.0], "velocity": [0.0, 0.0], "count": 3, "start": 0.0, "rate": 100.0}
    run = chutelab.start(scene(stream=stream))
    run.step(0.015)
    x, y = run.positions.T
    assert y[:2] == pytest.approx([1.0 - 0.5 * G * 0.015**2, 1.0 - 0.5 * G * 0.005**2], abs=1e-15)
    assert np.isnan([x[2], y[2], run.angles[2]]).all()
    assert run.angles[0] == 0.0
    assert len(run.contacts) == 0


@pytest.mark.parametrize("shape", [{}, {"shape": "box", "size": [0.04, 0.03], "radius": None}])
def test_what_goes_through_each_other_keeps_all_laws_when_it_is_loaded(tmp_path, shape):
    stream = {"at": [0.0, 0.3], "velocity": [0.3, 0.0], "count": 3, "rate": 100.0}
    tables = scene(surface=[FLOOR], stream=stream)
    tables["particle"] = {k: v for k, v in (tables["particle"] | shape).items() if v is not None}
    run = chutelab.start(tables)
    run.step(1.0)
    for whole in (run.recording, chutelab.simulate(tables, engine="contact")):
        x = whole.at([0.05])[0][0, :, 0]
        assert np.abs(np.diff(x)).max() < R
        assert not whole.laws
        assert not Recording.load(whole.save(tmp_path / "run.npz")).laws


@pytest.mark.parametrize(
    ("key", "value", "what"),
    [
        ("plate.friction", 0.3, "can be set"),
        ("particle.radius", 0.01, "can be set"),
        ("incoming.speed", 3.0, "can be set"),
        ("plate.angle_deg", 120.0, "90"),
        ("plate.angel_deg", 20.0, "angle_deg"),
        ("plate.angle_deg", "steep", "number"),
    ],
)
def test_what_cannot_be_set_is_told(key, value, what):
    run = chutelab.start("perpendicular")
    with pytest.raises(SceneError, match=what):
        run.set(key, value)
    run.step(0.01)


def test_bad_calls_are_told():
    run = chutelab.start("perpendicular")
    for seconds in (0.0, -1.0, nan, inf):
        with pytest.raises(InputError, match="above 0 s"):
            run.step(seconds)
    for particle, force in ((1, (0.0, 0.0)), (-1, (0.0, 0.0)), (0, (nan, 0.0)), (0, (1.0,))):
        with pytest.raises(InputError):
            run.push(particle, force)
    with pytest.raises(SceneError, match=r"particle\.radius"):
        chutelab.start("perpendicular", {"particle.radius": 0.0})


@pytest.mark.slow
def test_the_example_of_the_docs_lands_particles_at_the_mark():
    text = (Path(__file__).parents[1] / "docs" / "engineers.md").read_text(encoding="utf-8")
    (example,) = re.findall(r"^```python\n(.*?)^```", text, re.MULTILINE | re.DOTALL)
    found = {}
    exec(example, found)
    places = found["landings"]["position"][:, 0]
    assert abs(places[0] - 0.4) > 0.1
    assert places[-10:] == pytest.approx(0.4, abs=2e-5)
    closes(found["run"].recording)


def test_what_becomes_too_fast_for_any_step_is_told():
    """A stone that turns so fast passes all others in less than a rounding of the time."""
    run = chutelab.start("arch")
    run.step(0.01)
    run._disks["spin"][1] = 1e22
    with pytest.raises(StalledError, match=r"particle 1 .*too fast for any step"):
        run.step(0.01)
