"""The contact engine against answers from outside: impacts, a gas, rides, a heap, crowds."""

import faulthandler
import sys
from dataclasses import replace
from math import hypot, sqrt
from time import process_time

import numpy as np
import pytest
from scipy.optimize import brentq

from chutelab import scene
from chutelab.checks.stress import Evidence, judge
from chutelab.engines import exact
from chutelab.engines.contact import run
from chutelab.machine import build
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.laws import LOSSES, examine
from chutelab.results.laws import judge as broken_laws
from chutelab.results.ledger import energy_at, ledger
from cores import Core
from crowds import crowd, hop_step
from machines import SLIDES, box, over_the_pulley, ramp, scene_of
from packings import WIDTHS, packed
from references import (
    first_impacts,
    henderson,
    inside_surfaces,
    likeness,
    maxwell_boltzmann,
    overlaps,
    virial,
    wall_pressure,
)
from shared import seeds

G = 9.81


# First impacts


def dilute(seed, count, *, spin, gravity):
    """Disks in a box of eight times what they would fill; they lose at each other, not at walls."""
    machine = box(count, seed, sqrt(8.0 * count * np.pi) * 0.02, spin=spin, friction=0.3, end=0.2)
    walls = replace(machine.segments, friction=np.full(len(machine.segments.length), 0.2))
    return replace(
        machine, gravity=gravity, segments=walls, pair_restitution=np.full((1, 1), 0.95)
    )  # fmt: skip


@pytest.mark.parametrize(
    ("seed", "count", "spin", "gravity"),
    [
        (0, 60, True, G), (1, 60, False, 0.0),
        *(pytest.param(seed, 200, spin, g, marks=pytest.mark.slow)
          for seed in range(3) for spin in (True, False) for g in (0.0, G)),
    ],
)  # fmt: skip
def test_first_impacts_are_those_of_brute_force(seed, count, spin, gravity):
    machine = dilute(seed, count, spin=spin, gravity=gravity)
    both = likeness(first_impacts(machine, machine.end_time), run(machine))
    assert not both.unlike, both.unlike[:3]
    assert both.off <= 1e-11
    assert both.approach <= 1e-10
    assert both.alike > count, both


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


R = 0.02
"""m; of the disks that ride."""


PULLEYS = [
    # friction, turning, speed at the start
    (0.5, False, 0.8),
    (0.5, True, 0.8),
    (0.15, False, 2.0),
    (2.0, True, 2.0),
]
RIDES = [(over_the_pulley(R, *case, until=1.0), 60.0) for case in PULLEYS]
# Off a belt at v² > g ρ, and over the end of a floor at v² > g r, slipping still or rolling.
FLAT = {"name": "floor", "from": [-1.0, 0.0], "to": [0.3, 0.0], "restitution": 0.0}
START = {"at": [0.0, R], "velocity": [1.0, 0.0]}
RIDES.append((over_the_pulley(R, 0.5, False, 2.5, until=0.5), 60.0))
RIDES += [
    (scene_of(particle={"radius": R}, surface=[{**FLAT, "friction": mu}], stream=START,
              run={"until": 0.74}), 20.0)
    for mu in (0.0, 0.3)
]  # fmt: skip
# It drops on a pulley of endless friction, and leaves where gravity takes it.
DROP = {"at": [0.03, 0.5], "velocity": [0.5, 0.0]}
RIDES.append((scene_of(particle={"radius": R, "spin": False}, stream=DROP, run={"until": 0.6},
                       incoming={"speed": 1.0, "pulley_radius": 0.3}), 60.0))  # fmt: skip
# Where acceleration is constant a step is exact: errors come from the step in which slip ends.
RIDES += [(ramp(**options, until=2.0), 1.0) for options in SLIDES]


@pytest.mark.parametrize(("machine", "most"), RIDES)
def test_rides_and_slides_come_to_what_exact_says_in_second_order(machine, most):
    """Errors of place, and of the time it leaves, stay below so many dt² (m, s)."""
    known = exact.run(machine)
    left = known.select(Kind.SEPARATION)
    times = np.linspace(0.0, 0.999 * min([*left["t"], machine.end_time]), 300)
    for dt in np.outer([4e-3, 1e-3, 2.5e-4], [1.0, 0.91, 0.83, 0.69]).ravel():
        found = run(replace(machine, dt=dt))
        place = np.abs(found.at(times)[0] - known.at(times)[0]).max()
        assert place < most * dt**2, (dt, place)
        told = found.select(Kind.SEPARATION)
        assert len(told) == len(left)
        for name, factor in (("t", 100.0), ("velocity_after", 1000.0)):
            off = np.abs(told[name] - left[name]).max(initial=0.0)
            assert off < factor * dt**2, (dt, name, off)


# Crowds


LAWS = (
    "nothing through", "nothing inside", "released into room", "no overlap", "pressed for a step",
    "nothing through another", "ledger closes",
)  # fmt: skip


def faults(recording):
    """Return what a run did that no crowd may do."""
    found = judge(Evidence(Recording.of(recording)))
    assert {"no overlap", "ledger closes"} <= {verdict.law for verdict in found}
    return [verdict for verdict in found if verdict.law in LAWS and not verdict.holds]


LIMIT = 20.0
"""s of processor time that no crowd may take."""


@pytest.mark.parametrize(
    ("seed", "count"),
    [(230, None), *(pytest.param(n, 60, marks=pytest.mark.slow) for n in range(3)),
     *(pytest.param(n, None, marks=pytest.mark.slow) for n in range(300) if n != 230)],
)  # fmt: skip
def test_crowds_obey_the_laws(seed, count):
    """In 230 a wedge opens: one step changes velocities by 13 m/s, which must bend no track."""
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
    assert not faults(recording)


def feeder(count=60, gates=()):
    """Three hundred times as many as can pass, released in one place above a tray."""
    return scene_of(
        surface=[{"name": "tray", "points": [[-0.1, 0.3], [-0.1, 0.0], [0.1, 0.0], [0.1, 0.3]],
                  "restitution": 0.3, "friction": 0.5}, *gates],
        stream={"count": count, "rate": 1e4, "at": [-0.05, 0.5], "velocity": [0.4, -0.5],
                "interact": True, "restitution": 0.3},
        run={"until": 3.0},
    )  # fmt: skip


@pytest.mark.slow
def test_what_has_its_place_taken_waits_for_it():
    # One leaves the place free for the next when it is 2 r away: |v t + g t²/2| = 2 r.
    machine = feeder()
    recording = run(machine)
    assert not faults(recording)
    started = recording.select(Kind.RELEASE)
    assert len(started) == machine.count
    late = started["t"] - machine.releases.t[started["particle"]]
    assert (late >= 0.0).all()
    clear = brentq(lambda t: hypot(0.4 * t, 0.5 * t + 0.5 * G * t * t) - 0.02, 0.0, 1.0)
    gaps = np.diff(np.sort(started["t"]))
    assert gaps.min() >= clear * (1.0 - 1e-9)
    # It looks once a step.
    assert np.median(gaps) <= clear + 1.01 * hop_step(machine, machine.dt)


def test_what_finds_no_place_to_the_end_is_never_released():
    machine = scene_of(
        surface=[{"name": "cup", "points": [[-0.03, 0.08], [-0.03, 0.0], [0.03, 0.0],
                                            [0.03, 0.08]], "restitution": 0.0}],
        stream={"count": 30, "rate": 1000.0, "at": [0.0, 0.07], "velocity": [0.0, 0.0],
                "interact": True},
        run={"until": 2.0},
    )  # fmt: skip
    recording = run(machine)
    assert not faults(recording)
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


def test_run_in_slices_or_in_rooms_that_have_to_grow_it_is_the_same():
    machine = feeder(30)
    whole = Core(machine).run()
    least = 8 * machine.count + 64
    small = {"knot": least + 1, "event": 4 * machine.count + 64, "contact": 1, "near": 1}
    core = Core(machine, small)
    assert same(core.run(), whole)
    assert min(core.world.contact_room, core.world.near_room) > 1
    for slices in (1, 7):
        core = Core(machine)
        while not core.step(slices):
            pass
        assert same(core.recording(), whole)


@pytest.mark.parametrize(("name", "near"), [("gates", 1), ("gates", 3), ("flap-gate", 1)])
def test_a_step_that_has_to_make_room_is_the_same(name, near):
    """Also where steps differ in length, by gates that open, and where bounds on hinges matter."""
    times = np.random.default_rng(1).uniform(0.02, 0.9, 200)
    gates = [{"name": f"gate {n}", "from": [3.0 + n, 0.0], "to": [3.5 + n, 0.0], "opens_at": t}
             for n, t in enumerate(times.tolist())]  # fmt: skip
    loaded = {"gates": lambda: feeder(30, gates), "flap-gate": lambda: build(scene.load(name))}
    machine = loaded[name]()
    assert same(Core(machine, {"near": near}).run(), Core(machine).run())


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


@pytest.mark.parametrize("seed", [6, 16, 23])
def test_friction_of_a_blow_in_a_corner_stays_within_its_bound(seed):
    """|J_t| <= µ J_n, where a wall and the floor are solved together."""
    width, µ = 0.3, 0.3
    thrown = {
        "particle": {"radius": 0.01, "spin": True},
        "surface": [
            {"name": "box", "points": [[-width / 2, 4.0], [-width / 2, 0.0],
                                       [width / 2, 0.0], [width / 2, 4.0]],
             "restitution": 0.5, "friction": µ},
        ],
        "stream": {"count": 100, "rate": 500.0 * width, "at": [-0.4 * width, 1.5],
                   "velocity": [2.5 * width, 0.0], "interact": True, "bed_height": 0.5,
                   "seed": seed},
        "run": {"until": 1.0, "dt": 1e-3},
    }  # fmt: skip
    blows = run(build(scene.from_dict(thrown))).select(Kind.IMPACT)
    assert len(blows) > 1000
    assert np.all(
        np.abs(blows["tangential_impulse"]) <= (1.0 + 1e-12) * µ * blows["normal_impulse"]
    )


@pytest.mark.parametrize("seed", seeds(1, 2))
def test_piles_of_smooth_disks_come_to_rest_and_do_not_live_on_their_overlaps(seed):
    """A fall makes an overlap, and its removal lifts what falls next: losses must not fall for it.

    They may be below their maxima by 1 % of the energy turned over, and 5 % of the radius for each
    disk.
    """
    walls = {"name": "box", "points": [[-0.045, 2.0], [-0.045, 0.0], [0.045, 0.0], [0.045, 2.0]],
             "restitution": 0.36, "friction": 1.0}  # fmt: skip
    radius, count = 0.004, 400
    weight = count * 1000.0 * 4.0 / 3.0 * np.pi * radius**3 * G
    poured = {
        "particle": {"radius": radius, "density": 1000.0, "spin": True},
        "surface": [walls],
        "stream": {"count": count, "fill": [[-0.041, 0.01], [0.041, 1.5]], "interact": True,
                   "restitution": 1.0, "friction": 0.02, "seed": seed},
        "run": {"until": 2.0},
    }  # fmt: skip
    found = run(build(scene.from_dict(poured)))
    assert energy_at(found, 1.999)["kinetic"] == 0.0, seed
    lost = found.totals["entries"][:, 1:]
    most = 0.01 * examine(found).figures.energy + 0.05 * weight * radius
    assert (np.maximum.accumulate(lost) - lost).sum(axis=1).max() < most, seed
    assert not broken_laws(found)
    for fall, told in ((0.99 * most, False), (1.01 * most, True)):
        totals = found.totals.copy()
        totals["entries"][-1, 1:] = lost.max(axis=0) - 0.5 * fall
        broken = broken_laws(replace(found, totals=totals))
        assert [law.law for law in broken] == [LOSSES] * told


def test_a_gas_gets_no_energy_back_and_a_law_of_the_run_tells_it():
    """Without gravity losses may be below their maxima by 1 % of the energy turned over."""
    gas = box(60, 0, 0.4, friction=0.3, spin=True, end=0.3)
    found = run(replace(gas, pair_restitution=np.full((1, 1), 0.9)))
    assert not broken_laws(found)
    lost = found.totals["entries"][:, 1:]
    most = 0.01 * examine(found).figures.energy
    assert most > 0.0
    assert (np.maximum.accumulate(lost) - lost).sum(axis=1).max() < 1e-3 * most
    for fall, told in ((0.99 * most, False), (1.01 * most, True)):
        totals = found.totals.copy()
        totals["entries"][-1, 1:] = lost[:-1].max(axis=0) - 0.5 * fall
        broken = broken_laws(replace(found, totals=totals))
        assert [law.law for law in broken] == [LOSSES] * told


def test_of_what_is_poured_one_overlap_in_a_hundred_is_deeper_than_half_a_percent():
    """Of the radius; the deepest is no more than three times that: pairs and walls."""
    drawn = {
        "particle": {"radius": 0.004, "mass": 0.0021},
        "surface": [
            {"name": "box", "points": [[-0.15, 3.0], [-0.15, 0.0], [0.15, 0.0], [0.15, 3.0]],
             "restitution": 0.5, "friction": 0.3},
        ],
        "stream": {"count": 300, "rate": 1000.0, "at": [-0.1, 1.0], "velocity": [2.0, 0.0],
                   "bed_height": 0.1, "interact": True},
        "run": {"until": 1.0},
    }  # fmt: skip
    machine = build(scene.from_dict(drawn))
    recording, times = run(machine), np.arange(0.0, 1.0, 5e-3)
    for depth in (overlaps(recording, times), inside_surfaces(recording, machine, times)):
        assert depth.percentile_99 <= 0.005, depth
        assert 0.0 < depth.worst <= 0.015, depth
    # Steps are long in flight, shorter in the throng, and long again at rest.
    begin, steps = recording.totals["t"][:-1], np.diff(recording.totals["t"])
    steps /= sqrt(0.008 * 0.004 / G)
    assert steps[begin < 0.1] == pytest.approx(0.7, rel=1e-9)
    assert 0.5 <= np.median(steps[abs(begin - 0.7) < 0.1]) < 0.65
    assert steps[begin > 0.97].max() > 0.68


@pytest.mark.parametrize(
    ("count", "r", "run_", "gravity", "longest"),
    [
        (100, 0.012, {}, G, 2e-3),
        (100, 0.006, {}, G, 0.7 * sqrt(0.008 * 0.006 / G)),
        (100, 0.002, {}, G, 1e-3),
        (100, 0.001, {}, G, sqrt(0.008 * 0.001 / G)),
        (99, 0.006, {}, G, 1e-3),
        (100, 0.006, {"dt": 5e-4}, G, 5e-4),
        (100, 0.006, {"dt": 0.1}, G, sqrt(0.008 * 0.006 / G)),
        (100, 0.012, {}, 4.0 * G, 1e-3),  # times go with 1 / √g
    ],
)
def test_a_hundred_disks_that_roll_take_longer_steps_than_fewer(count, r, run_, gravity, longest):
    """Up to 2 ms and 0.7 √(0.008 r / g), never shorter than fewer; Pymunk's stay at 1 ms."""
    rolling = {
        "gravity": gravity,
        "particle": {"radius": r, "mass": 0.01, "spin": True},
        "surface": [{"name": "floor", "points": [[-1.0, 0.0], [5.0, 0.0]], "restitution": 0.0}],
        "stream": {"count": count, "at": [0.0, r], "to": [2.5, r], "velocity": [1.0, 0.0],
                   "omega": -1.0 / r, "interact": True},
        "run": {"until": 0.1, **run_},
    }  # fmt: skip
    machine = build(scene.from_dict(rolling))
    steps = np.diff(run(machine).totals["t"])
    assert np.median(steps) == pytest.approx(longest, rel=1e-9)
    assert steps.max() <= longest * (1.0 + 1e-9)
    assert machine.step_of("pymunk") == run_.get("dt", 1e-3)


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 2])
def test_one_disk_among_thousands_does_not_end_the_step_of_all(seed):
    """They land in a drum; steps are 0.7 to 0.5 of that whose hops are g h^2 / 8 = 1e-3 r high."""
    r, end = 0.004, 0.2
    drawn = {
        "particle": {"radius": r, "mass": 0.0021, "spin": True},
        "surface": [
            {"name": "drum", "center": [0.0, 0.0], "radius": 0.31, "from_deg": -180.0,
             "to_deg": 180.0, "speed": 0.5, "restitution": 0.5, "friction": 0.5},
        ],
        "stream": {"count": 2000, "fill": [[-0.21, -0.21], [0.21, 0.21]], "velocity": [0.0, 0.0],
                   "interact": True, "restitution": 0.5, "friction": 0.3, "seed": seed},
        "run": {"until": end},
    }  # fmt: skip
    machine = build(scene.from_dict(drawn))
    recording, times = run(machine), np.arange(0.0, end, 5e-3)
    h = sqrt(8e-3 * r / G)
    assert end / (0.7 * h) < len(recording.totals) < end / (0.5 * h)
    assert overlaps(recording, times).percentile_99 <= 0.005
    assert inside_surfaces(recording, machine, times).worst <= 0.015
    assert ledger(recording).relative_residual <= 1e-11


@pytest.mark.slow
@pytest.mark.parametrize("width", np.linspace(0.15, 0.3, 20).round(4))
def test_boxes_are_asleep_within_four_seconds(width):
    """A row that is jammed between the walls rattles in its place: it keeps nothing awake."""
    walls = {"name": "box", "points": [[-width, 3.0], [-width, 0.0], [width, 0.0], [width, 3.0]]}
    poured = scene.from_dict({
        "particle": {"radius": 0.004, "mass": 0.0021},
        "surface": [{**walls, "restitution": 0.5, "friction": 0.3}],
        "stream": {"count": 1000, "rate": 1000.0, "at": [-0.8 * width, 1.0],
                   "velocity": [2.0, 0.0], "bed_height": 0.1, "interact": True},
        "run": {"until": "settled", "max_time": 4.0},
    })  # fmt: skip
    recording = run(build(poured))
    assert {REASONS[k] for k in recording.ended} == {"settled"}


@pytest.mark.parametrize("friction", [0.2, 0.5])
def test_none_settles_on_the_belt_that_throws(friction):
    # At the belt's speed on the incoming belt it has no slip, and will still be thrown off.
    machine = build(scene.load("stream", [f"incoming.friction={friction}", "stream.count=50"]))
    recording = run(machine)
    assert recording.select(Kind.SETTLE, surface="incoming").size == 0
    # Thrown over the belt's end, all of them; some come to rest on others and never touch the belt:
    # 39 to 44 of them land, over five seeds each.
    assert len(np.unique(recording.select(Kind.LANDING)["particle"])) > 35
    assert recording.ends()[1]["position"][:, 0].min() > 0.6
    assert {REASONS[k] for k in recording.ended} == {"settled"}


@pytest.mark.parametrize("name", ["galton", "rock-box"])
def test_in_a_crowd_what_parts_from_a_surface_does_so_on_its_track(name):
    recording = run(build(scene.load(name, ["stream.count=40"])))
    events = recording.events[recording.events["kind"] == Kind.SEPARATION]
    assert len(events) > 40
    places = np.stack([recording.at([e["t"]])[0][0, e["particle"]] for e in events])
    # NaN, before the release, is no place.
    assert np.hypot(*(places - events["position"]).T).max() < 1e-3 * 0.003


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_disks_pack_as_with_the_solver_run_to_convergence_at_a_quarter_of_the_step(width):
    """Mean height, share covered and contacts per disk of ten runs, as shipped of twenty.

    All are asleep in the end.
    """
    shipped, finest = (
        np.array([packed(width, seed, level) for seed in range(draws)])
        for level, draws in (("shipped", 20), ("solved, dt/4", 10))
    )
    error = np.sqrt(sum(rows[:, :3].var(axis=0, ddof=1) / len(rows) for rows in (shipped, finest)))
    off = shipped[:, :3].mean(axis=0) - finest[:, :3].mean(axis=0)
    assert (np.abs(off) <= 3.0 * error).all(), off / error
    assert error[0] <= 0.01 * finest[:, 0].mean(), "heights are told to a hundredth"
    assert shipped[:, 5].min() == finest[:, 5].min() == 1.0
