"""The stepped engines, contact and pymunk, by laws written out here: flight, blows, belts, rest."""

from dataclasses import replace
from importlib import import_module
from math import cos, hypot, radians, sin, sqrt

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import chutelab
from chutelab.engines import contact
from chutelab.engines import contact as host
from chutelab.machine import build
from chutelab.results import REASONS, Kind, balance
from chutelab.results.ledger import ledger
from chutelab.results.recorder import StalledError
from chutelab.scene import from_dict, load
from machines import face
from shared import some

G, R, M = 9.81, 0.0063, 0.008

both = pytest.mark.parametrize("engine", ["contact", "pymunk"])
all_three = pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])


def ran(engine, machine, progress=None):
    return import_module(f"chutelab.engines.{engine}").run(machine, progress)


def simulated(engine, *surfaces, at, velocity, until, **tables):
    """Run a lone particle; more tables are named, and keys of `run` and `particle` go into them."""
    run = {"until": until} | {key: tables.pop(key) for key in ("dt", "max_time") if key in tables}
    particle = {key: tables.pop(key) for key in ("radius", "spin") if key in tables}
    stream = {"at": list(at), "velocity": list(velocity)}
    tables |= {"surface": list(surfaces), "stream": stream, "particle": particle, "run": run}
    return ran(engine, build(from_dict(tables)))


def shipped(engine, name, *overrides):
    return ran(engine, build(load(name, overrides)))


def floor(*, height=0.0, ends=(-20.0, 20.0), **values):
    usual = {"restitution": 0.0, "friction": 0.0}
    return face("floor", (ends[0], height), (ends[1], height), **usual | values)


FAR = {"name": "far", "points": [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0]]}


def released(places, velocities, times, *, surface=FAR, until=0.2, dt=1e-3, spin=False, **pair):
    """Machine of particles that meet, each released where and when told."""
    values = {"restitution": 0.7, "friction": 0.4, **pair}
    gravity = values.pop("gravity", 0.0)
    stream = {"count": len(times), "rate": 1.0, "at": [0.0, 1.0], "velocity": [1.0, 0.0],
              "bed_height": 0.01, "interact": True, **values}  # fmt: skip
    machine = build(from_dict({
        "gravity": gravity, "particle": {"spin": spin}, "surface": [surface], "stream": stream,
        "run": {"until": until, "dt": dt},
    }))  # fmt: skip
    releases = replace(
        machine.releases,
        t=np.array(times, dtype=float),
        position=np.array(places, dtype=float),
        velocity=np.array(velocities, dtype=float),
    )
    return replace(machine, releases=releases)


def last(recording, what="position"):
    return np.array([recording.track(n)[-1][what] for n in range(recording.count)])


def same(one, other):
    arrays = ("knots", "offsets", "ended", "events", "by_surface")
    return all(getattr(one, a).tobytes() == getattr(other, a).tobytes() for a in arrays)


# Flight and blows


@both
@settings(max_examples=20)
@given(vx=st.floats(-5.0, 5.0), vy=st.floats(-5.0, 5.0), end=st.floats(0.01, 1.0))
def test_free_flight_is_the_parabola(engine, vx, vy, end):
    recording = simulated(engine, floor(height=-50.0), at=(0.3, 2.0), velocity=(vx, vy), until=end)
    knot = recording.track(0)[-1]
    scale = hypot(0.3, 2.0) + hypot(vx, vy) * end + G * end**2
    x, y = 0.3 + vx * end, 2.0 + vy * end - 0.5 * G * end**2
    assert hypot(knot["position"][0] - x, knot["position"][1] - y) <= 1e-12 * scale
    assert abs(knot["velocity"][1] - (vy - G * end)) <= 1e-12 * scale
    assert len(recording.track(0)) == 2
    # The heights round to some last places of m g y, however little energy is turned over.
    books = ledger(recording)
    assert abs(books.residual) <= 1e-13 * books.turned_over + 8.0 * np.spacing(M * G * 2.0)


@both
@settings(max_examples=40)
@given(
    restitution=st.one_of(st.just(0.0), st.floats(0.05, 1.0)),
    friction=st.floats(0.0, 1.5),
    speed=st.floats(-3.0, 3.0),
    vx=st.floats(-3.0, 3.0),
    spin=st.booleans(),
)
def test_a_bounce_keeps_newtons_and_coulombs_laws(engine, restitution, friction, speed, vx, spin):
    fall = 0.2
    belt = floor(restitution=restitution, friction=friction, speed=speed)
    recording = simulated(
        engine, belt, at=(0.0, R + fall), velocity=(vx, 0.0), until=0.25, spin=spin
    )
    hit = recording.select(Kind.IMPACT)[0]
    approach = sqrt(2.0 * G * fall)
    normal = M * (1.0 + restitution) * approach
    stop = (M / 3.0 if spin else M) * (vx - speed)
    tangential = -np.clip(stop, -friction * normal, friction * normal)
    assert hit["t"] == pytest.approx(approach / G, rel=1e-11)
    assert hit["position"] == pytest.approx([vx * approach / G, R], abs=1e-11)
    assert hit["normal_impulse"] == pytest.approx(normal, rel=1e-10)
    assert hit["tangential_impulse"] == pytest.approx(tangential, abs=1e-10 * normal)
    after = [vx + tangential / M, restitution * approach]
    assert hit["velocity_after"] == pytest.approx(after, abs=1e-9)
    spun = tangential * R / (0.5 * M * R**2) if spin else 0.0
    assert hit["omega_after"] == pytest.approx(spun, abs=1e-6)


@both
@pytest.mark.parametrize("dt", [1 / 60, 1e-3])
@pytest.mark.parametrize(("speed", "lean"), [(20.0, -70.0), (2000.0, 0.0), (2000.0, 40.0)])
def test_nothing_is_too_fast_to_be_stopped(engine, dt, speed, lean):
    # r = 2 mm against a plate 1 m away, whose normal leans by an angle; without gravity.
    r, a = 0.002, radians(lean)
    wall = face("wall", (-sin(a), -cos(a)), (sin(a), cos(a)), restitution=0.5, friction=0.0)
    recording = simulated(
        engine, wall, at=(-1.0, 0.0), velocity=(speed, 0.0), until=1.5 / speed, dt=dt, radius=r,
        gravity=0.0,
    )  # fmt: skip
    (hit,) = recording.select(Kind.IMPACT)
    way = 1.0 - r / cos(a)
    assert hit["t"] == pytest.approx(way / speed, rel=1e-12, abs=0.0)
    assert hit["position"] == pytest.approx([-r / cos(a), 0.0], abs=1e-12)
    # (1 + ε) of the normal velocity is given back along the normal (-cos a, sin a).
    given_back = 1.5 * speed * cos(a)
    after = np.array([speed - given_back * cos(a), given_back * sin(a)])
    assert hit["velocity_after"] == pytest.approx(after, abs=1e-11 * speed)
    far = hit["position"] + after * (1.5 - way) / speed
    assert last(recording)[0] == pytest.approx(far, abs=1e-11)


def test_a_blow_goes_through_a_row_within_one_step():
    # Five at rest in a row, hair by hair; a sixth comes and the blow goes through them all.
    gap, speed, start = 1e-4, 2.0, 0.1
    row = [(5.0 + n * (2.0 * R + gap), 3.0) for n in range(5)]
    places = [*row, (5.0 - 2.0 * R - speed * start, 3.0)]
    velocities = [*[(0.0, 0.0)] * 5, (speed, 0.0)]
    recording = contact.run(released(places, velocities, [0.0] * 6, restitution=1.0))
    hits = recording.select(Kind.COLLISION)
    assert hits["t"] == pytest.approx(start + np.arange(5) * gap / speed, abs=1e-12)
    ends = last(recording, "velocity")
    assert ends[4] == pytest.approx([speed, 0.0], abs=1e-12)
    assert ends[[0, 1, 2, 3, 5]] == pytest.approx(np.zeros((5, 2)), abs=1e-12)


@both
def test_bounces_come_to_rest_in_the_time_of_the_closed_form(engine):
    fall, e = 0.1, 0.5
    recording = simulated(
        engine, floor(restitution=e), at=(0.0, R + fall), velocity=(0.0, 0.0), until="settled"
    )
    # Down once, then 2 ε^n times as long for every further bounce; a few steps of rest at the end.
    total = sqrt(2.0 * fall / G) * (1.0 + 2.0 * e / (1.0 - e))
    assert recording.track(0)[-1]["t"] == pytest.approx(total, abs=5e-3)
    assert ledger(recording).restitution_loss == pytest.approx(M * G * fall, rel=2e-5)


# Belts and what lies on them


@all_three
@pytest.mark.parametrize(
    ("spin", "speed", "work", "heat"),
    # m v_b (v_b - v_x) and half of it as heat, and a third of both for a free disk.
    [
        (False, 2.0, M * 2.0 * 2.0, 0.5 * M * 4.0),
        (False, -1.0, M * 1.0 * 1.0, 0.5 * M * 1.0),
        (True, 2.0, M * 2.0 * 2.0 / 3.0, M * 4.0 / 6.0),
    ],
)
def test_a_belt_pays_for_the_speed_it_gives(engine, spin, speed, work, heat):
    belt = floor(friction=0.3, speed=speed)
    recording = simulated(engine, belt, at=(0.0, R), velocity=(0.0, 0.0), until=1.0, spin=spin)
    books, off = ledger(recording), 1e-14 if engine == "exact" else 1e-10
    assert books.belt_work == pytest.approx(work, rel=off, abs=0.0)
    assert books.friction_loss == pytest.approx(heat, rel=off, abs=0.0)
    end = speed / 3.0 if spin else speed
    assert last(recording, "velocity")[0, 0] == pytest.approx(end, rel=off, abs=0.0)
    assert R * last(recording, "omega")[0] == pytest.approx(speed - end, rel=off, abs=0.0)
    assert books.relative_residual < 1e-10
    if engine == "exact":  # slip fades at µ g, of what turns at 3 µ g
        fades = abs(speed) / ((3.0 if spin else 1.0) * 0.3 * G)
        assert recording.select(Kind.STICK)["t"][0] == pytest.approx(fades, rel=off, abs=0.0)


@pytest.mark.parametrize("until", [0.2, 3.0])
def test_a_slide_leaves_few_knots_and_is_a_parabola_between_them(until):
    recording = simulated(
        "contact", floor(friction=0.2), at=(0.0, R), velocity=(9.0, 0.0), until=until
    )
    assert len(recording.track(0)) < 10
    times = np.linspace(0.0, until, 50)
    position, velocity = recording.at(times)
    assert velocity[:, 0, 0] == pytest.approx(9.0 - 0.2 * G * times, abs=1e-8)
    assert position[:, 0, 0] == pytest.approx(9.0 * times - 0.1 * G * times**2, abs=1e-8)
    assert position[:, 0, 1] == pytest.approx(np.full(50, R), abs=1e-5 * R)


@all_three
@pytest.mark.parametrize("name", ["low-speed", "perpendicular"])
def test_the_ride_stays_on_its_circle_and_is_braked_by_the_belt(engine, name):
    recording = shipped(engine, name)
    machine = build(load(name))
    rho, v = machine.pulley.radius + R, machine.pulley.speed
    cosine = min(1.0, v**2 / (G * rho))
    (away,) = recording.select(Kind.SEPARATION, surface="incoming")
    off = 1e-14 if engine == "exact" else 1e-12
    assert away["t"] == pytest.approx((1.0 + rho * np.arccos(cosine)) / v, rel=off, abs=0.0)
    assert away["position"][1] == pytest.approx(rho * cosine, rel=off, abs=0.0)
    assert hypot(*away["velocity_after"]) == pytest.approx(v, rel=off, abs=0.0)
    books = ledger(recording).by_surface["incoming"]
    assert books["belt_work"] == pytest.approx(-M * G * rho * (1.0 - cosine), abs=1e-14)
    times = np.linspace(0.5, away["t"], 500)
    position, _ = recording.at(times)
    assert np.abs(np.hypot(*position[:, 0].T) / rho - 1.0).max() < 1e-9


def in_the_way(place, end):
    """Machine with one dropped in the way of a carried one."""
    machine = build(load("stream", ["stream.count=2", "stream.rate=1.0", f"run.max_time={end}"]))
    releases = replace(
        machine.releases,
        t=np.array([0.0, 0.01]),
        position=np.array([[-1.0, 0.104], place]),
        velocity=np.array([[2.0, 0.0], [0.0, 0.0]]),
        carried=np.array([True, False]),
        omega=np.zeros(2),
    )
    return replace(machine, releases=releases)


@both
def test_a_carried_particle_pushes_and_is_not_pushed(engine):
    recording = ran(engine, in_the_way([-0.9, 0.115], 1.0))
    away = recording.first(recording.select(Kind.SEPARATION, surface="incoming"))[0]
    assert away["t"] == pytest.approx(0.5, rel=1e-12, abs=0.0)
    assert away["velocity_after"] == pytest.approx([2.0, 0.0])
    assert len(recording.select(Kind.COLLISION)) >= 1


def test_what_a_carried_partner_gives_is_booked_when_it_is_given():
    recording = contact.run(in_the_way([-0.78, 0.16], 0.3))
    assert len(recording.select(Kind.COLLISION)) >= 1
    track = recording.track(1)
    energy = np.sum(recording.energies(track), axis=0)
    unbooked = energy - energy[0] - balance(track["entries"])
    # m (g dt)²/8 is what a hop has; the blow, m v²/2, is ten thousand times as much.
    assert np.abs(unbooked).max() < 2.0 * M * (G * 1e-3) ** 2 / 8.0
    assert np.ptp(track["entries"][:, 0]) > 1e-3


def belts(places, **values):
    """Belts that run from the first place to the second, and their mirror image."""
    return [
        face(name, *([side * x, y] for x, y in places), friction=0.6, **values)
        for name, side in (("left", -1.0), ("right", 1.0))
    ]


@pytest.mark.parametrize(
    ("until", "spin", "restitution"),
    [
        (3.0, True, 0.3),
        pytest.param(3.0, False, 0.8, marks=pytest.mark.slow),
        ("settled", False, 0.0),
    ],
)
def test_a_disk_that_belts_wedge_rests_where_it_touches_both(until, spin, restitution):
    # tan 20° < µ: friction holds it against any push. Both belts slip past it: it has not settled.
    recording = simulated(
        "contact", *belts([(0.37, 1.0), (0.01, 0.0)], speed=0.7, restitution=restitution),
        at=(0.0, 1.2), velocity=(0.0, 0.0), until=until, max_time=3.0, radius=0.05, spin=spin,
    )  # fmt: skip
    end = recording.track(0)[-1]
    # From the lower end (-0.01, 0) of a face along (0.36, -1), its normal (1, 0.36): r away.
    height = (0.05 * hypot(1.0, 0.36) - 0.01) / 0.36
    assert end["t"] == 3.0
    assert REASONS[recording.ended[0]] == "time"
    assert not len(recording.select(Kind.SETTLE))
    assert end["position"] == pytest.approx([0.0, height], abs=1e-3 * 0.05)
    assert end["velocity"] == pytest.approx([0.0, 0.0], abs=1e-6)
    # Both belts slip past it, with forces that have no bound: what it turns with is open.
    assert 0.05 * abs(end["omega"]) < 0.7
    assert ledger(recording).relative_residual < 1e-10


@pytest.mark.parametrize(("speed", "degrees"), some([(0.1, 2.0), (2.0, 0.5), (2.0, 8.0)]))
def test_a_narrow_wedge_of_belts_is_no_way_through(speed, degrees):
    # Both faces touch a disk at the origin, and go on below it.
    r, c, s = 0.02, cos(radians(degrees)), sin(radians(degrees))
    places = (r * c + s, c - r * s), (r * c - 0.1 * s, -r * s - 0.1 * c)
    recording = simulated(
        "contact", *belts(places, speed=speed),
        at=(0.0, 0.1), velocity=(0.0, 0.0), until=1.0, radius=r,
    )  # fmt: skip
    end = recording.track(0)[-1]
    assert end["velocity"] == pytest.approx([0.0, 0.0], abs=1e-6)
    # Half a percent of the radius in each face at most.
    assert -end["position"][1] * s < 0.005 * r
    assert end["position"][1] < 1e-3 * r


def test_no_belt_wedges_a_disk_that_it_rolls_out_of_a_corner():
    # The belt under it runs away from the wall: it rests there only as long as it does not grip.
    wall = face("wall", (0.0, 1.0), (0.0, -0.1))
    belt = face("belt", (-0.1, 0.0), (3.0, 0.0), friction=0.6, speed=0.7)
    end = simulated(
        "contact", wall, belt, at=(0.06, 0.3), velocity=(-0.5, 0.0), until=1.0, radius=0.05
    ).track(0)[-1]
    assert end["velocity"] == pytest.approx([0.7, 0.0], abs=1e-6)
    assert end["position"][1] == pytest.approx(0.05, abs=1e-3 * 0.05)


# Ends, hosts


@pytest.mark.parametrize("until", ["settled", 6.0])
@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk", "reference"])
def test_what_misses_everything_leaves_a_metre_below(engine, until):
    vx, vy, begin, lowest = 0.75, 1.5, 1.0, -0.25
    step = face("step", (-1.0, lowest), (0.5, lowest))
    recording = simulated(engine, floor(), step, at=(30.0, begin), velocity=(vx, vy), until=until)
    (gone,) = recording.select(Kind.EXIT)
    fall = begin - (lowest - 1.0)
    time = (vy + sqrt(vy**2 + 2.0 * G * fall)) / G
    assert gone["t"] == pytest.approx(time, rel=1e-12, abs=0.0)
    assert gone["position"] == pytest.approx([30.0 + vx * time, lowest - 1.0], rel=1e-12, abs=0.0)
    assert gone["velocity_after"] == pytest.approx([vx, vy - G * time], rel=1e-12, abs=0.0)
    assert REASONS[recording.ended[0]] == "exit"
    assert recording.track(0)[-1]["t"] == gone["t"]
    # What it had and what it fell is all that the ledger knows.
    books = ledger(recording)
    thrown = 0.5 * M * (vx**2 + vy**2)
    assert books.kinetic == pytest.approx((thrown, thrown + M * G * fall), rel=1e-12)
    assert books.potential == pytest.approx((M * G * begin, M * G * (begin - fall)), rel=1e-12)
    assert abs(books.residual) <= 1e-13 * books.turned_over
    assert books.belt_work == books.restitution_loss == books.friction_loss == 0.0


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk", "reference"])
def test_without_gravity_it_leaves_a_metre_outside_the_box_of_all(engine):
    step = face("step", (-1.0, -0.25), (0.5, 0.75))
    recording = simulated(
        engine, step, at=(0.0, 2.0), velocity=(0.5, -0.125), until=6.0, gravity=0.0
    )
    (gone,) = recording.select(Kind.EXIT)
    assert gone["t"] == pytest.approx((0.5 + 1.0) / 0.5, rel=1e-12, abs=0.0)
    assert gone["position"] == pytest.approx([1.5, 2.0 - 0.125 * 3.0], rel=1e-12, abs=0.0)


@both
def test_of_a_crowd_each_leaves_where_it_falls_off(engine):
    # Two meet above the table's end and go apart; a third stays on it, far from both.
    table = floor(friction=0.0, ends=(-1.0, 0.3))
    places, velocities = [(0.32, 1.0), (0.38, 1.0), (-0.9, R)], [(1.0, 0.0), (0.0, 0.0), (0.0, 0.0)]
    machine = released(
        places, velocities, (0.0, 0.0, 0.0), surface=table, until=1.0, gravity=G, friction=0.0
    )
    recording = ran(engine, machine)
    assert [REASONS[n] for n in recording.ended] == ["exit", "exit", "time"]
    out = recording.select(Kind.EXIT)
    # A blow along x leaves the fall as it is.
    height = pytest.approx([-1.0, -1.0], abs=1e-9)
    assert out["position"][:, 1] == height
    assert out["t"] == pytest.approx(np.full(2, sqrt(2.0 * 2.0 / G)), abs=1e-3)
    books = ledger(recording)
    assert books.potential[1] == pytest.approx(M * G * (-2.0 + R), rel=1e-9)


@both
def test_independent_particles_pass_through_each_other(engine):
    together = shipped(engine, "stream", "stream.interact=false", "stream.count=3", "run.until=0.9")
    assert not len(together.select(Kind.COLLISION))
    alone = shipped(engine, "perpendicular", "run.until=0.9")
    assert together.track(0).tobytes() == alone.track(0).tobytes()


def test_what_stalls_is_named_and_what_was_recorded_is_kept(monkeypatch):
    # The core's word for it, when it comes back for the third time.
    statuses = iter([None, None, host.Status.STALLED])
    really = host.Module.run

    def run(module, name, _steps, lacking):
        status = really(module, name, 64, lacking)
        module.world.stalled = 1
        return next(statuses) or status

    monkeypatch.setattr(host.Module, "run", run)
    with pytest.raises(StalledError) as caught:
        shipped("contact", "stream", "stream.count=5", "stream.rate=50")
    stalled, recording = caught.value, caught.value.recording
    assert stalled.particle == 1
    assert 0.1 < stalled.t < 0.2
    # On the belt since 0.02 s: (-1 + 2 (t - 0.02)) m, to a step.
    assert stalled.position[0] == pytest.approx(-1.0 + 2.0 * (stalled.t - 0.02), abs=3e-3)
    assert f"particle 1 is stuck at t = {stalled.t:.6g} s" in str(stalled)
    assert len(recording.select(Kind.RELEASE)) == 5
    assert {REASONS[k] for k in recording.ended} == {"time"}
    monkeypatch.undo()
    again = shipped("contact", "stream", "stream.count=5", "stream.rate=50")
    assert {REASONS[k] for k in again.ended} == {"settled"}


def test_an_interrupt_leaves_nothing_behind_for_the_next_run():
    machine = build(load("stream", ["stream.count=20"]))
    whole = contact.run(machine)

    def interrupt(_share):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        contact.run(machine, interrupt)
    assert same(contact.run(machine), whole)


@both
def test_a_crowd_on_a_gate_that_is_still_to_open_has_not_settled(engine):
    gate = {"name": "gate", "from": [-0.2, 0.0], "to": [0.2, 0.0], "restitution": 0.0}
    row = {"count": 5, "at": [-0.06, 0.01], "to": [0.06, 0.01], "velocity": [0.0, 0.0]}
    found = chutelab.simulate(from_dict({
        "particle": {"radius": 0.01},
        "stream": {**row, "interact": True, "restitution": 0.0},
        "surface": [{**gate, "opens_at": 0.5}],
        "run": {"engine": engine, "until": "settled"},
    }))  # fmt: skip
    assert (found.ended == REASONS.index("exit")).all()
    # From rest at y = r down to 1 m below the gate.
    fall = sqrt(2.0 * (1.0 + 0.01) / 9.81)
    assert found.ends()[1]["t"] == pytest.approx(0.5 + fall, rel=0.0, abs=2e-3)


@pytest.mark.parametrize("align", [True, pytest.param(False, marks=pytest.mark.slow)])
@all_three
def test_without_gravity_each_particle_that_meets_no_other_has_a_box_of_its_own(engine, align):
    """It starts up to 50 m from the surface, and ends 1 m beyond that or beyond its start."""
    found = chutelab.simulate(from_dict({
        "gravity": 0.0,
        "particle": {"radius": 0.01},
        "surface": [{"name": "wall", "from": [0.0, 1.0], "to": [0.0, 2.0]}],
        "stream": {"count": 6, "at": [-50.0, 0.0], "to": [50.0, 0.0], "velocity": [2.0, 0.0]},
        "run": {"engine": engine, "align": align, "until": 100.0, "dt": 0.01},
    }))  # fmt: skip
    assert (found.ended == REASONS.index("exit")).all()
    first, last = found.ends()
    right = np.maximum(first["position"][:, 0], 0.0) + 1.0
    np.testing.assert_allclose(last["position"][:, 0], right, rtol=0.0, atol=1e-9)
