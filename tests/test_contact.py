"""The contact engine against answers from outside: impacts, a gas, rides, a heap, crowds."""

from __future__ import annotations

import faulthandler
import sys
from dataclasses import replace
from math import atan2, degrees, hypot, sqrt
from time import process_time

import numpy as np
import pytest
from scipy.optimize import brentq

from chutelab import scene
from chutelab.engines.contact import run
from chutelab.machine import build
from chutelab.results import REASONS, Kind
from chutelab.results.ledger import ledger
from cores import Core
from crowds import crowd, faults, step_of
from machines import (
    BELT,
    LENGTH,
    SLIDES,
    WHEEL,
    box,
    over_the_pulley,
    ramp,
    round_the_wheel,
    scene_of,
)
from references import (
    first_impacts,
    henderson,
    inside_surfaces,
    likeness,
    maxwell_boltzmann,
    overlaps,
    round_the_pulley,
    slide,
    virial,
    wall_pressure,
)

G = 9.81


# First impacts


def dilute(seed, rate, spin, count):
    return build(
        scene.load(
            "stream",
            [f"stream.seed={seed}", f"stream.rate={rate}", f"stream.count={count}",
             f"particle.spin={str(spin).lower()}"],
        )
    )  # fmt: skip


def check_first_impacts(machine, least):
    end = float(machine.releases.t[-1]) + 3.0
    both = likeness(first_impacts(machine, end), run(machine))
    assert not both.unlike, both.unlike[:3]
    assert both.time <= 1e-11
    assert both.approach <= 1e-10
    assert both.alike >= least, both


@pytest.mark.parametrize(("seed", "rate", "spin"), [(0, 100, True), (1, 50, False)])
def test_first_impacts_as_brute_force_says(seed, rate, spin):
    check_first_impacts(dilute(seed, rate, spin, 60), 80)


@pytest.mark.slow
@pytest.mark.parametrize("rate", [50, 100, 200])
@pytest.mark.parametrize("spin", [False, True])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_first_impacts_of_two_hundred_as_brute_force_says(seed, rate, spin):
    check_first_impacts(dilute(seed, rate, spin, 200), 200)


# A gas of hard disks


def gas(collisions, *, count=200, packing=0.3, seed=0):
    """Return a machine of elastic disks in a closed box, with time for about so many collisions.

    After Enskog a disk has 2 √π σ n χ √(kT/m) collisions a second, n a number per area and χ the
    pair distribution at contact, (Z - 1)/(2 η); two share each.
    """
    r = 0.01
    side = sqrt(count * np.pi * r**2 / packing)
    chi = (henderson(packing) - 1.0) / (2.0 * packing)
    # Each component of velocity has variance kT/m = 1 m²/s².
    rate = 0.5 * count * 2.0 * sqrt(np.pi) * (2.0 * r) * (count / side**2) * chi
    end = collisions / rate
    return box(count, seed, side, radius=r, end=end), side


def check_gas(collisions, within):
    """Run a gas; check its energy, and that it presses on its walls as it does inside."""
    machine, side = gas(collisions)
    recording = run(machine)
    first, last = (recording.energies(knots)[0].sum() for knots in recording.ends())
    assert last == pytest.approx(first, rel=1e-12, abs=0.0)
    met, walls = recording.select(Kind.COLLISION), recording.select(Kind.IMPACT)
    assert len(met) == pytest.approx(collisions, rel=0.1)
    # Virial theorem: p a² = N kT + ½ Σ σ J/t, where a = side - 2 r is the box of the centres.
    diameter, end = 2.0 * machine.particle.radius, machine.end_time
    span = side - diameter
    pressure = wall_pressure(walls["normal_impulse"], perimeter=4.0 * span, time=end)
    inside = virial(met["normal_impulse"], diameter=diameter, time=end, kinetic=first)
    assert pressure * span**2 / first == pytest.approx(inside, rel=within)
    return machine, recording, side


def test_a_gas_keeps_its_energy_and_has_one_pressure_inside_and_on_its_walls():
    check_gas(3000, 0.06)


@pytest.mark.slow
def test_a_gas_of_hard_disks_has_hendersons_pressure_and_maxwells_velocities():
    machine, recording, side = check_gas(30_000, 0.01)
    # Near walls it is denser. Within three diameters of them nothing counts: of disks in the rest
    # the number and the kinetic energy, of collisions those whose contact point is there.
    r, end, mass = machine.particle.radius, machine.end_time, machine.particle.mass
    edge = 6.0 * r
    times = np.linspace(0.001 * end, 0.999 * end, 4000)
    number, kinetic, sample = [], [], []
    for some in np.array_split(times, 25):
        place, velocity = recording.at(some)
        inner = ((place > edge) & (place < side - edge)).all(axis=2)
        number.append(inner.sum(axis=1).mean())
        kinetic.append((0.5 * mass * (velocity**2).sum(axis=2) * inner).sum(axis=1).mean())
        sample.append(velocity[0])
    met = recording.select(Kind.COLLISION)
    # Without friction the impulse is along the normal.
    normal = met["velocity_after"] - met["velocity_before"]
    contact = met["position"] - r * normal / np.hypot(*normal.T)[:, None]
    inner = ((contact > edge) & (contact < side - edge)).all(axis=1)
    packing = np.mean(number) * np.pi * r**2 / (side - 2.0 * edge) ** 2
    found = virial(
        met["normal_impulse"][inner], diameter=2.0 * r, time=end, kinetic=np.mean(kinetic)
    )
    assert found == pytest.approx(henderson(packing), rel=0.01)
    # The looks are twelve collisions of each disk apart.
    assert maxwell_boltzmann(np.concatenate(sample[1:])) > 0.01


# Rides, slides


PULLEYS = [
    # friction, turning, speed at the start
    (0.5, 0.0, 0.8),
    (0.5, 2.0, 0.8),
    (0.15, 0.0, 2.0),
    (2.0, 2.0, 2.0),
]
R = 0.02
"""m; of the disks that ride."""

STEPS = (4e-3, 1e-3, 2.5e-4)
WITHIN = 1e-4
"""m; of positions at dt = 1e-3 s."""

PHASES = (1.0, 0.91, 0.83, 0.69)
"""Shares of each step that are run as well: errors depend on where in a step a phase begins."""


def ride(friction, turning, speed, found, dt):
    """Return errors of position (m) and of the time of separation (s), and how often it is told."""
    times = np.linspace(0.0, 0.999 * found.t, 300)
    place = round_the_wheel(found.state(times)[0], R)
    recording = run(over_the_pulley(R, friction, turning, speed, until=found.t + 0.05, dt=dt))
    left = recording.select(Kind.SEPARATION)
    error = np.abs(recording.at(times)[0][:, 0] - place).max()
    return error, abs(left["t"][-1] - found.t), len(left)


@pytest.mark.parametrize(("friction", "turning", "speed"), PULLEYS)
def test_round_the_pulley_in_second_order(friction, turning, speed):
    # Errors of place stay below 60 dt² (m, s), of the time it leaves below 100 dt²/s.
    found = round_the_pulley(
        belt=BELT, ride=WHEEL + R, friction=friction, turning=turning, way=-LENGTH, speed=speed
    )
    for dt in STEPS:
        runs = [ride(friction, turning, speed, found, share * dt) for share in PHASES]
        place, time, told = map(max, zip(*runs, strict=True))
        assert place < 60.0 * dt**2, (dt, place)
        assert time < 100.0 * dt**2, (dt, time)
        assert told == 1, dt
        if dt == 1e-3:
            assert place < WITHIN


def sliding(options, dt):
    """Return the error of position, m."""
    machine, start, along = ramp(options, dt=dt)
    times = np.linspace(0.0, 1.99, 200)
    way, _, _ = slide(times, **options)
    place = run(machine).at(times)[0][:, 0]
    return np.abs(place - (start + way[:, None] * along)).max()


@pytest.mark.parametrize("options", SLIDES)
def test_slides_and_rolls_as_the_closed_form_says(options):
    # Where acceleration is constant a step is exact: errors, below dt² (m, s), come from the step
    # in which the slip ends.
    for dt in STEPS:
        error = max(sliding(options, share * dt) for share in PHASES)
        assert error < dt**2, (dt, error)


WITHIN_A_STEP = np.linspace(0.7, 1.0, 25)
"""Shares of a step, so that phases end everywhere within one."""


@pytest.mark.parametrize("friction", [0.0, 0.3])
def test_over_the_end_of_a_face_in_second_order(friction):
    # A disk that rolls over an edge at v² > g r leaves it at once: y - r = -g t²/2 from there on.
    r, v, edge = 0.02, 1.0, 0.3
    machine = scene_of(
        particle={"radius": r, "spin": True},
        surface=[{"name": "floor", "from": [-1.0, 0.0], "to": [edge, 0.0], "friction": friction,
                  "restitution": 0.0}],
        stream={"at": [0.0, r], "velocity": [v, 0.0]},
        run={"until": 0.74},
    )  # fmt: skip
    # Without friction it slides on, else it slips until it rolls, at 2 v/3 after v/(3 µ g).
    slip = v / (3.0 * friction * G) if friction else 0.0
    way = v * slip - 0.5 * friction * G * slip**2
    speed = 2.0 / 3.0 * v if friction else v
    leaves = slip + (edge - way) / speed
    for share in WITHIN_A_STEP:
        dt = share * 1e-3
        left = run(replace(machine, dt=dt))
        told = left.select(Kind.SEPARATION)["t"]
        assert abs(told - leaves).max() < 0.1 * dt
        fall = left.at([0.73])[0][0, 0, 1] - r
        assert abs(fall + 0.5 * G * (0.73 - leaves) ** 2) < 20.0 * dt**2, dt


def test_carried_by_endless_friction_after_a_blow_it_leaves_where_gravity_takes_it():
    # It drops on the pulley, has the belt's speed from there on, and leaves at cos φ = v²/(g ρ).
    r, wheel, v = 0.02, 0.3, 1.0
    machine = scene_of(
        particle={"radius": r, "spin": False},
        incoming={"speed": v, "pulley_radius": wheel},
        stream={"at": [0.03, wheel + 0.2], "velocity": [0.5, 0.0]},
        run={"until": 0.6},
    )
    rho = wheel + r
    for share in WITHIN_A_STEP:
        dt = share * 1e-3
        recording = run(replace(machine, dt=dt))
        met, left = (recording.select(kind) for kind in (Kind.IMPACT, Kind.SEPARATION))
        from_, to = np.arctan2(*met["position"][0]), np.arccos(v**2 / (G * rho))
        assert left["t"][-1] == pytest.approx(met["t"][0] + rho * (to - from_) / v, abs=0.1 * dt)


def test_a_separation_tells_the_velocity_without_the_hop():
    # A belt at v² > g ρ throws at the end of its level part.
    machine = scene_of(
        particle={"radius": R, "spin": False},
        incoming={"speed": 2.5, "pulley_radius": WHEEL, "friction": 0.5},
        stream={"at": [-0.3, WHEEL + R], "velocity": [2.5, 0.0]},
        run={"until": 0.4},
    )
    for share in WITHIN_A_STEP:
        dt = share * 1e-3
        left = run(replace(machine, dt=dt)).select(Kind.SEPARATION)[0]
        assert abs(left["velocity_after"][1]) < 100.0 * dt**2, dt


# A heap


def heap(count, end, rolling, seed=2):
    """Pour spinning disks on a rough floor, from a spout that is a few radii wide."""
    r = 0.005
    machine = scene_of(
        particle={"radius": r, "spin": True},
        surface=[{"name": "floor", "from": [-2.0, 0.0], "to": [2.0, 0.0], "restitution": 0.1,
                  "friction": 1.0}],
        stream={"count": count, "rate": 60.0, "at": [0.0, 0.25], "velocity": [0.0, -0.3],
                "interact": True, "restitution": 0.1, "friction": 0.6, "seed": 1},
        run={"until": end, "max_time": 100.0},
    )  # fmt: skip
    rng = np.random.default_rng(seed)
    place = machine.releases.position.copy()
    place[:, 0] = rng.uniform(-2.0 * r, 2.0 * r, count)
    machine = replace(machine, releases=replace(machine.releases, position=place))
    core = Core(machine)
    core.pairs["rolling"] = rolling
    return machine, core.run()


def repose(place, r):
    """Return the angle of repose, degrees: of lines fitted to both flanks of the highest disks."""
    edges = np.arange(place[:, 0].min(), place[:, 0].max() + 3.0 * r, 3.0 * r)
    which = np.digitize(place[:, 0], edges)
    top = np.array([[place[which == k, 0].mean(), place[which == k, 1].max()]
                    for k in np.unique(which)])  # fmt: skip
    peak = top[top[:, 1].argmax(), 0]
    slopes = []
    for side in (-1.0, 1.0):
        # Not the tip, and not single disks that rolled out on the floor.
        flank = top[(side * (top[:, 0] - peak) >= 0.0) & (top[:, 1] > 2.5 * r)]
        slopes.append(abs(np.polyfit(flank[:, 0], flank[:, 1], 1)[0]))
    return degrees(atan2(np.mean(slopes), 1.0))


def check_heaps(count, calm, seeds):
    """Pour heaps, which must lie still; angles scatter by 5°, so their mean counts."""
    poured, angles = count / 60.0 + 3.0, []
    for seed in seeds:
        machine, recording = heap(count, poured + calm, 0.3, seed)
        r = machine.particle.radius
        before, after = recording.at([poured, poured + 0.999 * calm])[0]
        assert np.isfinite(after).all()
        assert np.hypot(*(after - before).T).max() < 0.01 * r
        angles.append(repose(after, r))
    assert 20.0 < np.mean(angles) < 40.0, angles


def test_a_heap_keeps_an_angle_and_lies_still():
    check_heaps(100, 1.0, [2, 3])


@pytest.mark.slow
def test_larger_heaps_keep_an_angle_and_lie_still_for_ten_seconds():
    check_heaps(400, 10.0, [2, 3, 4])


def test_without_rolling_friction_on_a_smooth_floor_there_is_no_heap():
    # The counterpart, or an angle would show nothing.
    r = 0.005
    machine = scene_of(
        particle={"radius": r, "spin": True},
        surface=[{"name": "floor", "from": [-9.0, 0.0], "to": [9.0, 0.0], "restitution": 0.1,
                  "friction": 0.0}],
        stream={"count": 60, "rate": 60.0, "at": [0.0, 0.25], "velocity": [0.0, -0.3],
                "interact": True, "restitution": 0.1, "friction": 0.0},
        run={"until": 4.0},
    )  # fmt: skip
    place = machine.releases.position.copy()
    place[:, 0] = np.random.default_rng(2).uniform(-2.0 * r, 2.0 * r, 60)
    machine = replace(machine, releases=replace(machine.releases, position=place))
    after = run(machine).at([3.99])[0][0]
    assert after[:, 1].max() < 2.5 * r


# Crowds


LIMIT = 20.0
"""s of processor time that no crowd may take."""


def check_crowd(seed, count=None):
    _, machine = crowd(seed, count=count)
    begin = process_time()

    def progress(share):
        assert process_time() - begin < LIMIT, f"{share:.0%} of the run after {LIMIT} s"

    # A step that never ends reports no progress: then the process ends, and says where.
    faulthandler.dump_traceback_later(10.0 * LIMIT, exit=True, file=sys.__stderr__)
    try:
        recording = run(machine, progress)
    finally:
        faulthandler.cancel_dump_traceback_later()
    assert not faults(machine, recording)


@pytest.mark.parametrize("seed", range(3))
def test_small_crowds_obey_the_laws(seed):
    check_crowd(seed, 60)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(300))
def test_crowds_obey_the_laws(seed):
    check_crowd(seed)


def test_faults_sees_what_no_crowd_may_do():
    # Of a run that is fine: press one into another for three steps, through a wall, out of step.
    _, machine = crowd(14, count=50)
    recording = run(machine)
    assert not faults(machine, recording)
    knots = recording.knots.copy()
    middle = int(recording.offsets[1] - recording.offsets[0]) // 2
    knots["position"][middle] += 200.0 * machine.particle.radius
    broken = faults(machine, replace(recording, knots=knots))
    assert any("through" in one for one in broken), broken
    knots = recording.knots.copy()
    knots["velocity"][recording.offsets[1] - 1] *= 1.001
    broken = faults(machine, replace(recording, knots=knots))
    assert [one.split(":")[0] for one in broken] == ["ledger"]
    early = replace(machine, releases=replace(machine.releases, t=machine.releases.t + 1.0))
    assert any("release" in one for one in faults(early, recording))


def feeder(count=60):
    """Three hundred times as many as can pass, released in one place above a tray."""
    return scene_of(
        surface=[{"name": "tray", "points": [[-0.1, 0.3], [-0.1, 0.0], [0.1, 0.0], [0.1, 0.3]],
                  "restitution": 0.3, "friction": 0.5}],
        stream={"count": count, "rate": 1e4, "at": [-0.05, 0.5], "velocity": [0.4, -0.5],
                "interact": True, "restitution": 0.3},
        run={"until": 3.0},
    )  # fmt: skip


def test_whose_place_is_taken_waits_for_it():
    # One leaves the place free for the next when it is 2 r away: |v t + g t²/2| = 2 r.
    machine = feeder()
    recording = run(machine)
    assert not faults(machine, recording)
    started = recording.select(Kind.RELEASE)
    assert len(started) == machine.count
    late = started["t"] - machine.releases.t[started["particle"]]
    assert (late >= 0.0).all()
    clear = brentq(lambda t: hypot(0.4 * t, 0.5 * t + 0.5 * G * t * t) - 0.02, 0.0, 1.0)
    gaps = np.diff(np.sort(started["t"]))
    assert gaps.min() >= clear * (1.0 - 1e-9)
    # It looks once a step.
    assert np.median(gaps) <= clear + 1.01 * step_of(machine)


def test_who_finds_no_place_to_the_end_is_never_released():
    machine = scene_of(
        surface=[{"name": "cup", "points": [[-0.03, 0.08], [-0.03, 0.0], [0.03, 0.0],
                                            [0.03, 0.08]], "restitution": 0.0}],
        stream={"count": 30, "rate": 1000.0, "at": [0.0, 0.07], "velocity": [0.0, 0.0],
                "interact": True},
        run={"until": 2.0},
    )  # fmt: skip
    recording = run(machine)
    assert not faults(machine, recording)
    started = len(recording.select(Kind.RELEASE))
    assert 3 <= started < 12
    assert (np.diff(recording.offsets) > 0).sum() == started
    assert {REASONS[k] for k in recording.ended} == {"time", "unreleased"}


# The same bits


def same(one, other):
    return (
        one.knots.tobytes() == other.knots.tobytes()
        and one.events.tobytes() == other.events.tobytes()
        and one.by_surface.tobytes() == other.by_surface.tobytes()
        and one.ended.tobytes() == other.ended.tobytes()
    )


def test_two_runs_are_the_same_to_the_bit():
    _, machine = crowd(1, count=60)
    assert same(run(machine), run(machine))


def test_run_in_slices_it_is_the_same():
    machine = feeder(30)
    whole = Core(machine).run()
    for slices in (1, 7):
        core = Core(machine)
        while not core.step(slices):
            pass
        assert same(core.recording(), whole)


def test_rooms_that_have_to_grow_change_nothing():
    machine = feeder(30)
    whole = Core(machine).run()
    least = 8 * machine.count + 64
    small = {"knot": least + 1, "event": 4 * machine.count + 64, "contact": 1, "near": 1}
    core = Core(machine, small)
    assert same(core.run(), whole)
    assert core.world.contact_room > 1
    assert core.world.near_room > 1


# The scene `stream`


def test_stream_presses_nobody_and_loses_no_joule():
    machine = build(scene.load("stream"))
    recording = run(machine)
    assert ledger(recording).relative_residual <= 1e-11
    _, last = recording.ends()
    times = np.arange(0.0, float(last["t"].max()), 2.5e-3)
    for depth in (overlaps(recording, times), inside_surfaces(recording, machine, times)):
        assert depth.worst <= 0.01, depth
        assert depth.percentile_99 <= 0.002, depth
    assert {REASONS[k] for k in recording.ended} == {"settled"}


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_nobody_settles_on_the_belt_that_throws(friction):
    # At the belt's speed on the incoming belt it has no slip, and will still be thrown off.
    machine = build(scene.load("stream", [f"incoming.friction={friction}", "stream.count=50"]))
    recording = run(machine)
    assert recording.select(Kind.SETTLE, surface="incoming").size == 0
    # Thrown over the belt's end, all of them; some come to rest on others and never touch the belt:
    # 39 to 44 of them land, over five seeds each.
    assert len(np.unique(recording.select(Kind.LANDING)["particle"])) > 35
    assert recording.ends()[1]["position"][:, 0].min() > 0.6
    assert {REASONS[k] for k in recording.ended} == {"settled"}


def test_a_lone_disk_does_not_settle_on_the_belt_that_throws_either():
    recording = run(build(scene.load("perpendicular", ["incoming.friction=0.5",
                                                       'run.until="settled"'])))  # fmt: skip
    assert recording.select(Kind.LANDING).size == 1
    assert recording.select(Kind.SETTLE, surface="outgoing").size == 1


def test_a_ride_by_adhesion_ends_where_gravity_takes_it():
    # cos φ = v²/(g ρ); the belt does the work by which gravity would change the speed, m g Δy.
    machine = build(scene.load("low-speed"))
    recording = run(machine)
    left = recording.select(Kind.SEPARATION)[0]
    v, rho = machine.releases.velocity[0, 0], machine.pulley.radius + machine.particle.radius
    cosine = v**2 / (machine.gravity * rho)
    assert cosine < 1.0
    assert left["position"][1] == pytest.approx(rho * cosine, rel=1e-12, abs=0.0)
    assert np.hypot(*left["velocity_after"]) == pytest.approx(v, rel=1e-12, abs=0.0)
    angle = np.arccos(cosine)
    start = machine.releases.position[0, 0]
    assert left["t"] == pytest.approx((rho * angle - start) / v, rel=1e-12, abs=0.0)
    track = recording.track(0)
    work = track["entries"][track["t"] <= left["t"]][-1, 0]
    lift = machine.particle.mass * machine.gravity * rho * (cosine - 1.0)
    assert work == pytest.approx(lift, rel=1e-12)
