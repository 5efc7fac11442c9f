"""Tracks between knots, the books at any time, and how a recording is collected."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.special import ellipj

from chutelab import machine, scene
from chutelab.engines import contact, exact
from chutelab.engines.simulation import choose, simulate
from chutelab.machine import Particle
from chutelab.results import ENTRIES, KNOT, Kind, record
from chutelab.results.ledger import energy_at, ledger
from chutelab.results.recorder import Recorder
from chutelab.util.errors import InputError
from cores import Core

EPS = 2.0**-52
G = 9.81
M = 0.008
EXACT = [
    name
    for name in scene.shipped()
    if name != "stream-independent" and choose(machine.build(scene.load(name))) == "exact"
]


@cache
def shipped(name, *overrides):
    return exact.run(machine.build(scene.load(scene.find(name), overrides)))


def made(mapping):
    return exact.run(machine.build(scene.from_dict(mapping)))


def recorder_of(count, *, surfaces=(), gravity=G, inertia=0.0):
    """What particles of the mass M would be recorded with, none of which has done anything yet."""
    tables = {
        "gravity": gravity,
        "particle": {"radius": 0.0, "mass": M},
        "stream": {"count": count, "at": [0.0, 1.0], "velocity": [1.0, 0.0]},
        "surface": [{"name": name, "from": [0.0, 0.0], "to": [1.0, 0.0]} for name in surfaces],
    }
    built = machine.build(scene.from_dict(tables))
    return Recorder(replace(built, particle=Particle(0.0, M, inertia)))


def finish(recorder):
    return recorder.finish(engine="exact", steps=0)


def parabola(p0, v0, s):
    s = np.asarray(s)[:, None]
    pull = np.array([0.0, -G])
    return np.array(p0) + np.array(v0) * s + 0.5 * pull * s * s, np.array(v0) + pull * s


def thrown(p0, v0, begin, end):
    recorder = recorder_of(1)
    position, velocity = parabola(p0, v0, [0.0, end - begin])
    recorder.knots([0, 0], [begin, end], position, velocity, 0.0)
    return finish(recorder)


coordinate = st.floats(-10.0, 10.0)


def between(run):
    """Times at eighths of the way from each knot to the next."""
    t = np.unique(run.track(0)["t"])
    return (t[:-1, None] + np.diff(t)[:, None] * np.arange(8) / 8.0).ravel()


@pytest.mark.parametrize("highest", [0.5, 5.0, 80.0, 89.9])
@pytest.mark.parametrize("rho", [0.5, 0.05, 5e-4])
def test_between_knots_in_a_bowl_it_is_on_its_way_to_1e_9_of_the_radius(highest, rho):
    """From rest at φ0 a pendulum is at sin(φ/2) = sin(φ0/2) cd(t sqrt(g/ρ)), Jacobi's function."""
    k = np.sin(np.radians(highest) / 2.0)
    run = made(
        {
            "gravity": G,
            "particle": {"radius": 0.02, "mass": M, "spin": False},
            "surface": [{"name": "bowl", "center": [0.0, 0.0], "radius": rho + 0.02,
                         "from_deg": 180, "to_deg": 360, "friction": 0.0, "restitution": 0.0}],
            "stream": {"at": [rho * np.sin(2.0 * np.arcsin(k)), -rho * (1.0 - 2.0 * k * k)],
                       "velocity": [0.0, 0.0]},
            "run": {"until": 9.0 * (rho / G) ** 0.5},
        }
    )  # fmt: skip
    t = between(run)
    _, cn, dn, _ = ellipj(t * (G / rho) ** 0.5, k * k)
    phi = 2.0 * np.arcsin(k * cn / dn)
    there = rho * np.stack([np.sin(phi), -np.cos(phi)], axis=1)
    assert len(t) > 8 * 60
    assert np.hypot(*(run.at(t)[0][:, 0] - there).T).max() <= 1e-9 * rho


def test_between_knots_on_the_pulley_it_is_on_its_way_to_1e_9_of_the_radius():
    """It slips from sin φ = µ (cos φ - u0) on, u = v²/(g ρ); then u is as written below."""
    mu, v, rho = 0.5, 2.0, 0.504
    run = made(
        {
            "gravity": G,
            "particle": {"radius": 0.004, "mass": M, "spin": False},
            "incoming": {"pulley_radius": 0.5, "speed": v, "friction": mu, "length": 0.2},
            "stream": {"at": [-0.1, rho], "velocity": [v, 0.0]},
            "run": {"until": 0.2},
        }
    )
    u0 = v * v / (G * rho)

    def forced(phi):
        return ((4.0 * mu**2 - 2.0) * np.cos(phi) - 6.0 * mu * np.sin(phi)) / (1.0 + 4.0 * mu**2)

    onset = brentq(lambda phi: np.sin(phi) - mu * (np.cos(phi) - u0), 0.0, 1.0, xtol=1e-15)
    grown = (u0 - forced(onset)) * np.exp(-2.0 * mu * onset)

    def pace(phi):
        return (G * rho * (forced(phi) + grown * np.exp(2.0 * mu * phi))) ** 0.5

    leaves = brentq(lambda phi: pace(phi) ** 2 - G * rho * np.cos(phi), onset, 1.0, xtol=1e-15)
    t = between(run)
    x, y = run.at(t)[0][:, 0].T
    phi = np.arctan2(x, y)
    on = (x > 0.0) & (phi < leaves)
    assert np.count_nonzero(on & (phi > onset)) > 50
    assert np.abs(np.hypot(x, y) - rho)[on].max() <= 1e-9 * rho
    for when, angle in zip(t[on], phi[on], strict=True):
        if angle <= onset:
            late, fast = when - (0.1 + rho * angle) / v, v
        else:
            slipping = quad(lambda phi: rho / pace(phi), onset, angle, epsabs=1e-13)[0]
            late, fast = when - (0.1 + rho * onset) / v - slipping, pace(angle)
        assert abs(late * fast) <= 1e-9 * rho


@given(
    p0=st.tuples(coordinate, coordinate),
    v0=st.tuples(coordinate, coordinate),
    begin=st.floats(0.0, 100.0),
    duration=st.floats(0.01, 1000.0),
)
def test_two_knots_are_the_whole_parabola(p0, v0, begin, duration):
    end = begin + duration
    recording = thrown(p0, v0, begin, end)
    times = np.clip(begin + np.linspace(0.0, 1.0, 41) * (end - begin), begin, end)
    position, velocity = recording.at(times)
    where, pace = parabola(p0, v0, times - begin)
    span = end - begin
    length = np.hypot(*p0) + np.hypot(*v0) * span + G * span**2
    assert np.abs(position[:, 0] - where).max() <= 3.0 * EPS * length
    for knot, row in zip(recording.knots, (0, -1), strict=True):
        assert (position[row, 0] == knot["position"]).all()
        assert (velocity[row, 0] == knot["velocity"]).all()
    assert np.abs(velocity[:, 0] - pace).max() <= 5.0 * EPS * length / span


def test_before_its_first_knot_and_after_its_last_a_particle_is_nowhere():
    recording = thrown((0.3, 0.7), (1.1, 2.3), 0.1, 0.9)
    begin, end = recording.knots["t"]
    outside = [np.nextafter(begin, 0.0), np.nextafter(end, 1.0), -np.inf, np.inf, np.nan]
    for values in recording.at(outside):
        assert np.isnan(values).all()
    assert np.isfinite(recording.at([end, begin])).all()


def test_an_impact_is_two_knots_at_one_time_and_at_gives_the_state_after():
    recording = shipped("perpendicular")
    hit = recording.select(Kind.IMPACT, surface="plate")[0]
    t = hit["t"]
    assert np.count_nonzero(recording.track(0)["t"] == t) == 2
    position, velocity = recording.at([np.nextafter(t, 0.0), t])
    assert (position[1, 0] == hit["position"]).all()
    assert (velocity[1, 0] == hit["velocity_after"]).all()
    assert np.abs(velocity[0, 0] - hit["velocity_before"]).max() < 1e-14
    assert hit["velocity_before"][0] > 0.0 > hit["velocity_after"][0]
    landing = recording.select(Kind.LANDING)[0]
    assert (recording.at([landing["t"]])[1][0, 0] == landing["velocity_after"]).all()


def crowd():
    """Three particles: the second never released, the third later than the first."""
    recorder = recorder_of(3)
    for particle, begin, end in ((2, 0.25, 1.0), (0, 0.0, 0.5)):
        position, velocity = parabola((particle, 1.0), (1.0, 0.0), [0.0, end - begin])
        recorder.knots([particle] * 2, [begin, end], position, velocity, 0.0)
    return finish(recorder)


def test_particles_keep_their_own_times_in_any_order():
    times = np.array([0.75, 0.1, 0.3, 2.0])
    position, velocity = crowd().at(times)
    assert position.shape == velocity.shape == (4, 3, 2)
    there = np.isfinite(position[..., 0])
    assert there.tolist() == [[0, 0, 1], [1, 0, 0], [1, 0, 1], [0, 0, 0]]
    assert (np.isfinite(velocity).all(axis=-1) == there).all()
    assert position[0, 2] == pytest.approx([2.5, 1.0 - 0.5 * G * 0.25], abs=2.0 * EPS)
    assert position[2, 0] == pytest.approx([0.3, 1.0 - 0.5 * G * 0.09], abs=2.0 * EPS)
    assert crowd().at(0.1)[0].shape == (1, 3, 2)
    assert crowd().at([])[0].shape == (0, 3, 2)


def test_a_recording_cannot_be_changed():
    recording = shipped("perpendicular")
    for name in ("knots", "offsets", "ended", "events", "by_surface"):
        with pytest.raises(ValueError, match="read-only"):
            getattr(recording, name)[0] = 0


@pytest.mark.parametrize("name", [*EXACT, "stream-independent"])
def test_the_books_add_up_at_any_time(name):
    recording = shipped(name, "stream.count=300") if "stream" in name else shipped(name)
    books, p = ledger(recording), recording.particle
    first, last = recording.ends()
    end = last["t"].max()
    times = np.random.default_rng(1).uniform(0.0, 1.1 * end, 500)
    now = energy_at(recording, times)
    at_release = 0.5 * p.mass * (first["velocity"] ** 2).sum(axis=1)
    at_release = at_release + 0.5 * p.inertia * first["omega"] ** 2
    at_release = at_release + p.mass * recording.gravity * first["position"][:, 1]
    start = (at_release * (times[:, None] >= first["t"])).sum(axis=1)
    change = now["kinetic"] + now["potential"] - start
    brought = now["belt_work"] - now["restitution_loss"] - now["friction_loss"] + now["residual"]
    assert np.abs(change - brought).max() <= 3e-15 * books.turned_over
    assert np.abs(now["residual"]).max() <= 3e-15 * books.turned_over
    finally_ = {name: float(value[0]) for name, value in energy_at(recording, [end]).items()}
    for name in (*ENTRIES, "residual"):
        assert finally_[name] == pytest.approx(getattr(books, name), abs=3e-15 * books.turned_over)
    for name in ("kinetic", "potential"):
        assert finally_[name] == pytest.approx(getattr(books, name)[1], rel=1e-13, abs=1e-16)


@pytest.mark.parametrize("count", [1, 40])
@pytest.mark.parametrize("belt", [0.0, -0.5])
def test_a_slide_heats_quadratically_and_costs_the_belt_linearly(count, belt):
    friction, fall, thrown_at, radius = 0.3, 0.2, 2.0, 0.004
    recording = made(
        {
            "stream": {"at": [0.0, radius + fall], "velocity": [thrown_at, 0.0], "count": count,
             "rate": 100.0},
            "surface": [{"name": "floor", "from": [-5.0, 0.0], "to": [5.0, 0.0], "restitution": 0.0,
             "friction": friction, "speed": belt}],
            "run": {"until": "settled"},
        }
    )  # fmt: skip
    down, approach = np.sqrt(2.0 * fall / G), np.sqrt(2.0 * G * fall)
    impulse = friction * M * approach
    slip = thrown_at - friction * approach - belt
    struck = impulse * (thrown_at - belt) - 0.5 * impulse**2 / M
    times = np.linspace(0.0, 1.0, 301)
    # since its impact, until no slip is left
    s = np.clip(times[:, None] - np.arange(count) / 100.0 - down, 0.0, slip / (friction * G))
    met = times[:, None] - np.arange(count) / 100.0 >= down
    heat = met * (struck + M * friction * G * (slip * s - 0.5 * friction * G * s**2))
    work = met * (impulse + M * friction * G * s) * -belt
    now = energy_at(recording, times)
    size = ledger(recording).turned_over
    assert np.abs(now["friction_loss"] - heat.sum(axis=1)).max() < 1e-15 * size
    assert np.abs(now["belt_work"] - work.sum(axis=1)).max() < 1e-15 * size


def test_events_are_found_by_kind_and_surface():
    recording = shipped("free-fall")
    kinds = [Kind.IMPACT, Kind.SETTLE]
    found = recording.select(*kinds, surface="ramp")
    ramp = recording.surface_index("ramp")
    wanted = [e for e in recording.events if e["kind"] in kinds and e["surface"] == ramp]
    assert [e.tobytes() for e in found] == [e.tobytes() for e in wanted] != []
    assert np.array_equal(recording.select("impact", "SETTLE", surface="ramp"), found)
    with pytest.raises(InputError, match=r'surface = "rmp": did you mean ramp\?'):
        recording.select(surface="rmp")
    with pytest.raises(InputError, match=r'kind = "impacts": did you mean impact\?'):
        recording.select("impacts")
    first = recording.first(recording.select(Kind.IMPACT))
    assert first["particle"].tolist() == [0, 1, 2, 3, 4]
    for event in first:
        own = recording.events[recording.events["particle"] == event["particle"]]
        assert event["t"] == own["t"][own["kind"] == Kind.IMPACT].min()


def test_a_turning_disk_carries_energy_of_rotation():
    recorder = recorder_of(1, gravity=0.0, inertia=0.5)
    recorder.knots([0, 0], [0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]], [1.0, 0.0], [2.0, 4.0])
    now = energy_at(finish(recorder), [0.0, 0.5, 1.0])
    spin = 0.5 * 0.5 * np.array([2.0, 3.0, 4.0]) ** 2
    assert now["kinetic"] == pytest.approx(0.5 * M + spin, rel=1e-15, abs=0.0)
    assert now["residual"] == pytest.approx(spin - spin[0], rel=1e-15, abs=0.0)


def test_of_several_blows_at_one_instant_the_first_and_the_last_state_are_kept():
    """What meets others has two knots at one time at most: those between cannot be asked for."""
    crowd = scene.from_dict({
        "stream": {"count": 2, "rate": 10.0, "at": [0.0, 1.0], "velocity": [0.0, 0.0],
                   "interact": True},
        "run": {"until": 1.0},
    })  # fmt: skip
    recorder = Recorder(machine.build(crowd))
    # The other one's track ends at the time at which the first one's begins.
    recorder.knots([1, 1], [0.0, 0.1], [0.0, 0.0], [0.0, 0.0], 0.0)
    t, vx = [0.1, 0.2, 0.2, 0.2, 0.2, 0.3, 0.3], [1.0, 1.0, 2.0, 3.0, 4.0, 4.0, 5.0]
    velocity = np.stack([vx, np.zeros(7)], axis=-1)
    recorder.knots(np.zeros(7, dtype=int), t, [0.0, 0.0], velocity, 0.0)
    found = recorder.finish(engine="contact", steps=1)
    assert found.track(0)["t"].tolist() == [0.1, 0.2, 0.2, 0.3, 0.3]
    assert found.track(0)["velocity"][:, 0].tolist() == [1.0, 1.0, 4.0, 4.0, 5.0]
    assert found.track(1)["t"].tolist() == [0.0, 0.1]


def test_single_knots_and_events_are_written_as_several_are():
    """One by one and in arrays, in turn, they have the same bits and stay in their order."""
    one, several = recorder_of(1, surfaces=["floor"]), recorder_of(1, surfaces=["floor"])
    for n in range(6):
        t, x, v, omega = 0.1 * n, (0.3 + n, -1e-7 * n), (2.0 / 3.0, n - 0.5), 1.0 / (n + 1.0)
        blow = {"velocity_before": (0.1, -v[1]), "omega_before": 2.0 * omega, "surface": n % 2 - 1,
                "normal_impulse": 0.01 / 3.0, "tangential_impulse": -1e-5 * n}  # fmt: skip
        for recorder in (one, several):
            recorder.book(0, 0, 0.1 * n, 1e-3 / 3.0, 7e-9)
            single = recorder is one and n % 3
            (recorder.knot if single else recorder.knots)(0, t, x, v, omega)
        one.event(Kind.IMPACT, 0, t, x, v, omega, **blow)
        several.events(Kind.IMPACT, 0, t, x, v, omega, **blow)
    found, expected = finish(one), finish(several)
    assert found.knots.tobytes() == expected.knots.tobytes()
    assert found.events.tobytes() == expected.events.tobytes()
    assert np.diff(found.knots["t"]).min() > 0.0


DRUM = {
    "particle": {"radius": 0.005, "mass": 0.002, "spin": True},
    "surface": [{"name": "drum", "center": [0.0, 0.0], "radius": 0.06, "speed": 0.3,
                 "friction": 0.5, "restitution": 0.3}],
    "stream": {"count": 40, "fill": [[-0.035, -0.035], [0.035, 0.035]], "velocity": [0.0, 0.0],
               "interact": True, "friction": 0.4, "restitution": 0.4},
    "run": {"until": 0.6},
}  # fmt: skip
CROWDS = {
    "hopper": ("hopper", "stream.count=80"),
    "galton": ("galton", "stream.count=12"),
    "stream": ("stream", "stream.count=30"),
    # Of what rolls on the belt for seconds hardly a state is kept.
    "rides": ("stream", "stream.count=100", "particle.spin=true"),
    "dominoes": ("dominoes", "run.until=0.25"),
    "drum": (DRUM,),
}
FEW_CROWDS = [
    pytest.param(name, marks=pytest.mark.slow if name in ("hopper", "stream") else ())
    for name in CROWDS
]
"""What runs down in the hopper also does in the Galton board, and on the belt in `rides`."""


def crowded(name, **left_out):
    """Run a crowd by the contact engine; `left_out`: what tracks may leave out, 0 is nothing."""
    of, *values = CROWDS[name]
    core = Core(machine.build(scene.load(of, values) if values else scene.from_dict(of)))
    for field, value in left_out.items():
        setattr(core.world, field, value)
    return core.run()


@pytest.mark.parametrize("name", FEW_CROWDS)
def test_a_track_is_off_by_less_than_a_hop_and_the_run_stays_as_it_is(name):
    """Beside the same run with a knot before and after each blow, and at each step in contact.

    What lies hops from step to step, g dt²/8 high and g dt/2 fast, and its track leaves that out.
    """
    short, full = crowded(name), crowded(name, smooth_x=0.0, smooth_v=0.0, hops=0.0)
    for array in ("events", "by_surface", "ended", "totals"):
        assert getattr(short, array).tobytes() == getattr(full, array).tobytes()
    for one, other in zip(short.ends(), full.ends(), strict=True):
        assert one.tobytes() == other.tobytes()
    assert len(short.knots) < 0.6 * len(full.knots)
    rng = np.random.default_rng(3)
    times = np.concatenate([full.totals["t"], rng.uniform(*full.totals["t"][[0, -1]], 500)])
    places, paces = full.at(times)
    g, dt = short.gravity, short.machine.dt
    hop = np.maximum(g * dt**2 / 8.0, 1e-4 * short.radius)

    def far(run):
        off = np.hypot(*np.moveaxis(run.at(times)[0] - places, -1, 0)) / hop
        return np.nanmax(off)

    assert far(short) <= 2.0
    assert np.nanmax(np.hypot(*np.moveaxis(short.at(times)[1] - paces, -1, 0))) <= 2.0 * g * dt
    assert far(crowded(name, hops=30.0)) > 4.0


@pytest.mark.parametrize("name", ["see-saw", "cradle"])
def test_what_a_step_of_no_length_releases_leaves_nothing_over_then(name):
    run = simulate(name)
    assert (run.totals["t"][:2] == 0.0).all()
    now = energy_at(run, [0.0])
    assert abs(now["residual"][0]) <= 1e-12 * (1e-3 + abs(now["potential"][0]))


TWO = [{"at": [0.0, 0.5], "start": 0.1}, {"at": [0.2, 0.6], "start": 0.05}]
BOX = {"shape": "box", "size": [0.03, 0.03]}
LATE = {
    "boxes": (BOX, {"at": [0.0, 0.5], "count": 3, "rate": 20}, {}),
    "off the steps": (BOX, [{"at": [0.0, 0.5], "start": t} for t in (0.0, 0.0503)], {}),
    "a disk and a box": (
        [{"name": "disk", "radius": 0.02}, {"name": "box", **BOX}],
        [{"at": [0.0, 0.5], "start": t, "particle": one}
         for t, one in ((0.0, "disk"), (0.1, "disk"), (0.1, "box"), (0.1, "disk"))], {},
    ),
    "tied": ({"radius": 0.02}, TWO, {"rod": [{"from": [0.3, 0.5], "particle": 0}]}),
}  # fmt: skip


@pytest.mark.parametrize("name", LATE)
def test_what_is_released_during_a_run_counts_once_from_its_release_on(name):
    """Nothing is struck: K + U of all is that at their releases, at each step and between them."""
    kinds, streams, more = LATE[name]
    alike = {"velocity": [0.0, -1.0], "interact": True}
    kinds = [one | {"mass": 0.05} for one in np.ravel(kinds)]
    streams = [one | alike for one in np.ravel(streams)]
    for n, one in enumerate(streams):
        one["at"] = [one["at"][0] + 0.1 * n, one["at"][1]]
    tables = {"particle": kinds, "stream": streams, "run": {"until": 0.2}, **more}
    run = simulate(scene.from_dict(tables), engine="contact")
    first = run.ends()[0]
    brought = 0.05 * (0.5 + 9.81 * first["position"][:, 1])
    spots = np.unique(np.concatenate([run.totals["t"], first["t"]]))
    times = np.concatenate([spots, spots[:-1] + 0.4 * np.diff(spots)])
    times = times[(times >= first["t"].min()) & (times < 0.2)]
    now = energy_at(run, times)
    there = (brought * (first["t"] <= times[:, None])).sum(axis=1)
    assert now["kinetic"] + now["potential"] == pytest.approx(there, abs=1e-6)


@pytest.mark.parametrize("name", FEW_CROWDS)
def test_the_energy_of_a_crowd_is_that_of_its_steps_and_closes_at_any_time(name):
    """K + U of all, less that at their releases, less what they got, is 0 at each step."""
    run = crowded(name)
    totals, size = run.totals, ledger(run).turned_over
    first = run.ends()[0]
    start = sum(run.energies(first, np.flatnonzero(run.released)))
    start = (start * (first["t"] < totals["t"][:, None])).sum(axis=1)
    belt, restitution, friction = totals["entries"].T
    left = totals["kinetic"] + totals["potential"] - start - (belt - restitution - friction)
    assert np.abs(left).max() <= 1e-12 * size
    now = energy_at(run, totals["t"][1:])
    late = ~np.isin(totals["t"][1:], first["t"])
    for name in ("kinetic", "potential"):
        assert np.abs(now[name] - totals[name][1:])[late].max() <= 1e-13 * size
    for name, entry in zip(ENTRIES, (belt, restitution, friction), strict=True):
        assert np.abs(now[name] - entry[1:])[late].max() <= 1e-13 * size
    times = np.random.default_rng(4).uniform(0.0, 1.1 * totals["t"][-1], 500)
    assert np.abs(energy_at(run, times)["residual"]).max() <= 1e-6 * size
    # Tracks alone, as in a file of before, are less near.
    tracks = energy_at(replace(run, totals=totals[:0]), times)["residual"]
    assert np.abs(tracks).max() > 1e-8 * size


@pytest.mark.parametrize("apart", [1e-17, 3e-17, 1e-13, 0.1])
def test_a_velocity_between_two_knots_is_between_theirs_however_near_they_are(apart):
    """In 3e-17 s nothing goes further than a place at 1 m is rounded: 2e-16 m, or 7 m/s."""
    knots = np.zeros(2, KNOT)
    knots["t"], knots["position"][:, 0] = [0.0, apart], [1.0, 1.0 + 2.0 * apart]
    knots["velocity"][:, 0] = [2.0, 2.0]
    share = np.linspace(0.1, 0.9, 5)
    _, found = record.hermite(knots, np.zeros(5, dtype=int), share)
    assert np.abs(found - [2.0, 0.0]).max() <= 1e-2


def test_energy_of_a_crowd_far_from_the_origin_is_counted_from_y_0():
    """Engines count places from an origin of their own there; potential energy is m g y."""
    far = scene.from_dict({
        "particle": {"radius": 0.01, "mass": M},
        "stream": {"count": 2, "rate": 10.0, "at": [0.0, 1e5], "velocity": [0.0, 0.0],
                   "interact": True},
        "run": {"until": 0.3},
    })  # fmt: skip
    run = contact.run(machine.build(far))
    t = run.totals["t"]
    released = np.array([0.0, 0.1])
    height = 1e5 - 0.5 * G * np.clip(t[:, None] - released, 0.0, None) ** 2
    expected = (M * G * height * (released < t[:, None])).sum(axis=1)
    assert run.totals["potential"] == pytest.approx(expected, rel=1e-12, abs=1e-9)
