"""The contact engine in the core, through its arrays: what no scene file can ask for."""

import hashlib
import subprocess
import sys
from dataclasses import replace
from math import hypot
from pathlib import Path

import numpy as np
import pytest

from chutelab import simulate
from chutelab.core import Status, constants
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.results.laws import SOLVED, judge
from chutelab.scene import from_dict
from cores import Core, modes
from machines import boxed, face, of_sizes, scene_of, thrown

G = 9.81
FAR = face("far", (-50.0, -90.0), (50.0, -90.0))
FLOOR = face("floor", (-20.0, 0.0), (20.0, 0.0), restitution=0.0, friction=0.5)


def crowd_scene(**tables):
    stream = {"count": 2, "interact": True, "rate": 1.0, "bed_height": 1.0,
              **tables.pop("stream", {})}  # fmt: skip
    return scene_of(stream=stream, **tables)


# Masses and radii


REST, RUB = np.array([[0.9, 0.7], [0.7, 1.0]]), np.array([[0.3, 0.6], [0.6, 0.0]])
"""Restitution and friction of pairs of two kinds."""


def mixed(seed, *, turning=True, count=40, end=1.5):
    """Disks of all sizes, masses and inertias that fly to the middle and through each other."""
    rng = np.random.default_rng(seed)
    machine = crowd_scene(gravity=0.0, surface=[FAR], run={"until": end})
    place = np.stack(np.divmod(np.arange(count), 7), axis=1) - 3.0
    place = 0.12 * place + rng.uniform(-0.03, 0.03, (count, 2))
    machine = thrown(machine, place, -place + rng.normal(0.0, 0.2, (count, 2)))
    radius, mass = rng.uniform(0.005, 0.02, count), 10.0 ** rng.uniform(-2.0, 1.0, count)
    share = rng.choice([0.4, 0.5] if turning else [0.0, 0.4, 0.5], count)
    spin = np.where(share > 0.0, rng.normal(0.0, 5.0, count), 0.0)
    machine = of_sizes(
        machine, radius, mass, share, rng.integers(0, 2, count), pair_restitution=REST,
        pair_friction=RUB, rolling=np.zeros(2), falls=np.zeros(2),
        cohesion=np.zeros((2, 2 + len(machine.surfaces))),
    )  # fmt: skip
    core = Core(machine)
    core.disks["spin"] = spin
    return core, core.disks.copy()


@pytest.mark.parametrize("turning", [True, False])
@pytest.mark.parametrize("seed", range(2))
def test_all_sizes_and_masses_conserve_momentum_and_close_the_ledger(seed, turning):
    # Σ m v is kept, and Σ m (x × v) + I ω where all can turn; ΔK = -(restitution + friction loss).
    core, start = mixed(seed, turning=turning)
    recording = core.run()
    first, last = recording.ends()
    assert len(recording.select(Kind.COLLISION)) > 20

    def sums(knots):
        m, (x, y), (u, v) = start["mass"], knots["position"].T, knots["velocity"].T
        spin = start["inertia"] * knots["omega"]
        kinetic = 0.5 * m * (u * u + v * v) + 0.5 * spin * knots["omega"]
        angular = (m * (x * v - y * u) + spin).sum() if turning else 0.0
        return np.array([(m * u).sum(), (m * v).sum(), angular]), kinetic.sum()

    before, energy = sums(first)
    after, left = sums(last)
    momentum = (start["mass"] * np.hypot(start["vx"], start["vy"])).sum()
    np.testing.assert_allclose(after, before, rtol=0.0, atol=1e-13 * momentum)
    loss = last["entries"][:, 1:].sum()
    assert last["entries"][:, 0].sum() == 0.0
    assert loss > 0.02 * energy
    assert left - energy == pytest.approx(-loss, abs=1e-13 * energy)


def test_each_pair_of_kinds_has_its_own_restitution_and_friction():
    # Newton: u_n' = -e u_n; Coulomb: the slip ends, or J_t = µ J_n against it.
    rest, rub = REST, RUB
    checked = np.zeros((2, 2), dtype=int)
    for seed in range(3):
        core, start = mixed(seed)
        recording = core.run()
        for event in recording.select(Kind.COLLISION):
            i, j, t = int(event["particle"]), int(event["other"]), event["t"]
            kinds, r = (start["kind"][i], start["kind"][j]), start["radius"][[i, j]]
            track = recording.track(j)
            before, after = track[track["t"] == t]
            away = event["position"] - before["position"]
            assert hypot(*away) == pytest.approx(r.sum(), rel=1e-12, abs=0.0)
            n = away / hypot(*away)
            along = np.array([n[1], -n[0]])
            u = event["velocity_before"] - before["velocity"]
            v = event["velocity_after"] - after["velocity"]
            assert v @ n == pytest.approx(-rest[kinds] * (u @ n), rel=1e-9)
            for one, which in ((event["velocity_after"] - event["velocity_before"], i),
                               (before["velocity"] - after["velocity"], j)):  # fmt: skip
                change = start["mass"][which] * one
                assert change @ n == pytest.approx(event["normal_impulse"], rel=1e-9)
                assert change @ along == pytest.approx(
                    event["tangential_impulse"], abs=1e-9 * event["normal_impulse"]
                )
            slip = v @ along + r @ (event["omega_after"], after["omega"])
            most = rub[kinds] * event["normal_impulse"]
            if abs(event["tangential_impulse"]) < most * (1.0 - 1e-9):
                assert slip == pytest.approx(0.0, abs=1e-12)
            else:
                assert abs(event["tangential_impulse"]) == pytest.approx(most, rel=1e-12, abs=0.0)
                assert most == 0.0 or slip * event["tangential_impulse"] <= 0.0
            checked[kinds] += 1
    assert (checked > 3).all(), checked


def test_a_sphere_takes_two_sevenths_of_its_slip_from_the_floor():
    # I = 2/5 m r²: a blow that grips has m* = 1/(1/m + r²/I) = 2/7 m, so v' = 5/7 v, r ω' = -5/7 v.
    floor = {**FLOOR, "restitution": 0.5, "friction": 10.0}
    core = Core(thrown(scene_of(surface=[floor], run={"until": 0.2}), [0.0, 0.11], [2.0, 0.0]))
    core.disks["inertia"] = 0.4 * core.disks["mass"] * core.disks["radius"] ** 2
    event = core.run().select(Kind.IMPACT)[0]
    assert event["velocity_after"][0] == pytest.approx(10.0 / 7.0, rel=1e-14, abs=0.0)
    assert 0.01 * event["omega_after"] == pytest.approx(-10.0 / 7.0, rel=1e-14, abs=0.0)


# Sleep


def heap_of(count=12, **run):
    box = {"name": "box", "points": [[-0.06, 0.6], [-0.06, 0.0], [0.06, 0.0], [0.06, 0.6]],
           "restitution": 0.2, "friction": 0.5}  # fmt: skip
    machine = crowd_scene(surface=[box], run={"until": 3.0, **run})
    k = np.arange(count)
    place = np.stack([0.021 * (k % 4) - 0.032 + 0.002 * (k // 4), 0.03 + 0.025 * (k // 4)], axis=1)
    return thrown(machine, place, [0.05, 0.0])


def test_a_heap_falls_asleep_and_costs_nothing_until_it_is_hit():
    machine = heap_of()
    late = replace(
        machine.releases,
        t=np.append(machine.releases.t, 2.0),
        position=np.vstack([machine.releases.position, [0.0, 0.5]]),
        velocity=np.vstack([machine.releases.velocity, [0.0, 0.0]]),
        carried=np.zeros(13, dtype=bool),
        omega=np.zeros(13),
        angle=np.zeros(13),
        stream=np.zeros(13, dtype=np.int64),
        kind=np.zeros(13, dtype=np.int64),
    )
    core = Core(boxed(replace(machine, releases=late)))
    asleep_at = None
    while core.world.t < 1.99:
        core.step()
        if asleep_at is None and modes(core)["ASLEEP"] == 12:
            asleep_at = core.world.step_count, core.world.solve_count
    assert asleep_at is not None
    assert modes(core) == {"WAITING": 1, "RIDING": 0, "FREE": 0, "ASLEEP": 12, "GONE": 0}
    # A solve begins with the impulses of the one before and takes 11 sweeps; from none it takes 37.
    assert core.world.sweep_count < 20 * core.world.solve_count
    # From then on until the late one comes no step was taken and nothing solved.
    assert core.world.solve_count == asleep_at[1]
    assert core.world.step_count <= asleep_at[0] + 2
    lay = core.disks["x"].copy(), core.disks["y"].copy()
    woke = 0
    while not core.step():
        woke = max(woke, 12 - modes(core)["ASLEEP"])
    assert woke >= 4
    recording = core.recording()
    before = recording.at([1.9])[0][0]
    np.testing.assert_allclose(before[:12], np.stack(lay, axis=1)[:12], rtol=0, atol=1e-5)
    hit = recording.select(Kind.COLLISION, Kind.IMPACT)
    hit = hit[(hit["particle"] == 12) | (hit["other"] == 12)]
    # It falls 0.5 m less what lies there, and meets a sleeper when the parabola says.
    y = recording.at([hit["t"][0]])[0][0][12, 1]
    assert 0.5 - y == pytest.approx(0.5 * G * (hit["t"][0] - 2.0) ** 2, rel=1e-9)


def test_a_load_that_is_laid_on_sleepers_wakes_them_from_the_top_down():
    """A column of six between smooth walls; from 1 s on a seventh lies on it, laid down gently.

    Each sleeper wakes by what the one above it passes on, and is at rest again in 0.01 s: so the
    sixth goes first, and the lowest is reached after five times that, and not much later.
    """
    sides = [face(name, (x, 1.0), (x, 0.0), restitution=0.0, friction=0.0)
             for name, x in (("left", -0.0100001), ("right", 0.0100001))]  # fmt: skip
    resting = {"velocity": [0.0, 0.0], "interact": True, "restitution": 0.0, "friction": 0.0}
    streams = [{"at": [0.0, 0.01 + 0.02 * n], **resting} for n in range(6)]
    streams.append({"at": [0.0, 0.13001], "start": 1.0, **resting})
    told = {"particle": {"radius": 0.01, "mass": 0.1, "spin": False}, "surface": [FLOOR, *sides],
            "stream": streams, "run": {"until": 1.5, "loads": 0.05}, "title": "column"}  # fmt: skip
    core = Core(build(from_dict(told)))
    asleep = constants("Mode")["ASLEEP"]
    woke = np.full(7, np.inf)
    while not core.step():
        t, sleeps = core.world.t, core.disks["mode"] == asleep
        if 0.4 < t < 1.0:
            assert sleeps[:6].all()
        if t > 1.0:
            woke[~sleeps] = np.minimum(woke[~sleeps], t)
        if 1.005 < t < 1.01:
            assert sleeps[:4].all()
        if t > 1.2:
            assert sleeps.all()
    assert (np.diff(woke[:6]) < 0.0).all(), woke
    assert 0.02 < woke[0] - woke[5] < 0.12
    assert judge(core.recording()) == ()
    floor = simulate(told).loads("floor").normal
    assert floor[2:19] == pytest.approx(6 * 0.1 * G, rel=1e-9)
    # While it settles down, what is passed on is told of as it comes.
    assert floor[20:23].mean() == pytest.approx(7 * 0.1 * G, rel=2e-3)
    assert floor[24:29] == pytest.approx(7 * 0.1 * G, rel=1e-9)


def struck_pile(apart=0.0205):
    """Return a pile of three rows on two floors, on whose right end a disk falls at 1 s."""
    places = [[apart * (k - 0.5 * (19 - row)), 0.01 + 0.0178 * row]
              for row in range(3) for k in range(20 - row)]  # fmt: skip
    resting = {"velocity": [0.0, 0.0], "interact": True, "restitution": 0.1, "friction": 0.5}
    floors = [face(name, (a, 0.0), (a + 0.5, 0.0), restitution=0.1, friction=0.5)
              for name, a in (("left", -0.5), ("right", 0.0))]  # fmt: skip
    streams = [{"at": place, **resting} for place in [*places, [0.16, 0.1]]]
    streams[-1]["start"] = 1.0
    return {"particle": {"radius": 0.01, "mass": 0.1, "spin": True, "rolling_friction": 0.2},
            "surface": floors, "stream": streams, "run": {"until": 1.6, "loads": 0.05},
            "title": "pile"}  # fmt: skip


def test_a_blow_wakes_a_part_of_a_pile():
    """How many wake depends on how the pile came to rest; in most the left floor sleeps on."""
    asleep, all_, left = constants("Mode")["ASLEEP"], [], []
    for apart in 0.0205 + 1e-6 * np.arange(-7, 8):
        core, woke = Core(build(from_dict(struck_pile(apart)))), np.zeros(58, dtype=bool)
        while not core.step():
            if core.world.t > 1.02:
                woke |= core.disks["mode"] != asleep
        all_.append(woke[:57].sum())
        left.append(woke[:57][core.recording().at([0.9])[0][0][:57, 0] < 0.0].sum())
    assert 8 <= np.median(all_) <= 57 / 2
    assert np.mean(np.array(left) == 0) > 0.5


def test_a_pile_of_which_a_part_woke_bears_what_it_would_bear_awake():
    """In the end the two floors together bear 58 weights.

    Each bears what it bears in a run in which none may sleep, and all lie where they lie there.
    """
    last, forces, told = [], [], struck_pile()
    for sleeps in (True, False):
        core = Core(build(from_dict(told)))
        core.world.sleeps = sleeps
        while not core.step():
            if core.world.t > 1.5 and not sleeps:
                on = core.contacts[core.contacts["j"] < 0]
                force = on["impulse"][:, 0] / core.world.length
                forces.append(np.bincount(on["owner"], force, minlength=2)[:2])
        recording = core.recording()
        assert judge(recording) == ()
        last.append(recording.at([1.6])[0][0])
    weight = 0.1 * G
    run = simulate(told)
    borne = np.array([run.loads(name).normal for name in ("left", "right")])
    assert borne[:, 5:19].sum(axis=0) == pytest.approx(57 * weight, rel=1e-9)
    assert borne[:, -4:].sum(axis=0) == pytest.approx(58 * weight, rel=1e-9)
    assert borne[:, -1] == pytest.approx(np.mean(forces, axis=0), rel=0.01)
    np.testing.assert_allclose(last[0], last[1], rtol=0, atol=1e-4)


def test_what_is_woken_is_held_as_before():
    """A gate far away wakes 130 grains between rough walls: nothing falls, no force jumps.

    A contact that is missed in the step after lets grains fall: then the floor bears nothing in
    the first millisecond, and three times as much in the next one.
    """
    rough = {"restitution": 0.0, "friction": 0.4}
    walls = [face("left", (-0.025, 0.3), (-0.025, 0.0), **rough),
             face("right", (0.025, 0.0), (0.025, 0.3), **rough),
             face("floor", (-0.025, 0.0), (0.025, 0.0), **rough),
             {**face("far", (1.0, 0.0), (1.1, 0.0)), "opens_at": 0.6}]  # fmt: skip
    run = simulate({
        "particle": {"radius": [0.0025, 0.0035], "density": 2500, "spin": True}, "surface": walls,
        "stream": {"count": 130, "fill": [[-0.021, 0.004], [0.021, 0.19]], "interact": True,
                   **rough},
        "run": {"until": 0.75, "loads": 0.001},
    })  # fmt: skip
    floor = run.loads("floor").normal
    assert np.ptp(floor[595:599]) < 1e-9 * floor[598]
    assert floor[599:615] == pytest.approx(floor[598], rel=0.2)
    before, after = run.at([0.59, 0.74]).position
    np.testing.assert_allclose(after, before, rtol=0, atol=1e-2 * 0.0025)


def test_sleepers_on_a_belt_ride_it_and_fall_off_its_end():
    # They ride at the belt's speed; off its end they go with it: a parabola from there, v (t - t0).
    speed, length = 0.5, 1.2
    belt = face("belt", (-0.2, 0.0), (length, 0.0), speed=speed, restitution=0.0, friction=1.0)
    machine = crowd_scene(particle={"spin": False}, surface=[belt, FAR], run={"until": 4.0})
    core = Core(thrown(machine, [[0.0, 0.01], [0.05, 0.01], [0.1, 0.01]], [0.4, 0.0]))
    slept = 0
    while not core.step():
        slept = max(slept, modes(core)["ASLEEP"])
    assert slept == 3
    recording = core.recording()
    for n in range(3):
        track = recording.track(n)
        assert track[-1]["position"][1] < -1.0
        riding = track[(track["t"] > 0.5) & (track["position"][:, 0] < length)]
        np.testing.assert_allclose(riding["velocity"][:, 0], speed, rtol=0, atol=1e-6)
        x = recording.at([1.0, 1.5])[0][:, n, 0]
        assert x[1] - x[0] == pytest.approx(0.5 * speed, abs=1e-6)


@pytest.mark.parametrize("change", ["gate", "travel"])
@pytest.mark.parametrize("steps", [1, 2, 1000])
def test_a_run_may_be_paused_anywhere(change, steps):
    """All sleep until a floor goes, or sets off upwards, at 1.5 s; they settle after that."""
    keys = {"gate": {"opens_at": 1.5},
            "travel": {"travel": {"to": [-1.0, 0.5], "at": 1.5, "in": 0.5}}}[change]  # fmt: skip
    shelf = face("shelf", (-1.0, 0.3), (1.0, 0.3), restitution=0.0, friction=0.5, **keys)
    stream = {"at": [0.0, 0.35], "to": [0.5, 0.35], "velocity": [0.0, 0.0], "count": 2,
              "interact": True}  # fmt: skip
    tables = {"surface": [FLOOR, shelf], "run": {"until": "settled"}, "stream": stream}
    core = Core(build(from_dict(tables)))
    slept = 0
    while not core.step(steps):
        slept = max(slept, modes(core)["ASLEEP"])
    assert slept == 2 or steps > 2
    end = core.recording().ends()[1]["position"][:, 1]
    level = {"gate": 0.0, "travel": 0.5}[change]
    assert end == pytest.approx(level + core.disks["radius"], abs=1e-3)
    assert core.world.t > 1.5 + (0.5 if change == "travel" else 0.2)


def test_the_host_knows_the_statuses_of_the_core():
    assert {status.name: status.value for status in Status} == constants("Status")


START = """
import os, sys
from pathlib import Path
from chutelab import simulate
from chutelab import core as module
for cache in sys.argv[1:]:
    os.environ["XDG_CACHE_HOME"] = cache
    module._compiled.cache_clear()
    module._idle.clear()
    result = float(simulate("perpendicular", engine="contact").knots["position"].sum()).hex()
    print(next(Path(cache).rglob("*.core"), ""), result)
"""


def started(*caches):
    """Start a process that runs with a cache after the other; where the core is kept, results."""
    done = subprocess.run(
        [sys.executable, "-c", START, *map(str, caches)], capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stderr) == (0, "")
    kept, results = zip(*(line.rsplit(" ", 1) for line in done.stdout.splitlines()), strict=True)
    return [Path(one) for one in kept], results


@pytest.mark.slow
def test_a_compiled_core_that_is_kept_costs_only_time(tmp_path):
    """What is loaded is machine code: a wrong byte in it once ended Python with a crash."""
    (whole,), (result,) = started(tmp_path / "whole")
    assert whole.parent.parent == tmp_path / "whole"
    good = whole.read_bytes()
    foreign = good[32:].replace(b"wasmtime", b"wastetim")
    spoilt = {
        "cut off": good[:1000],
        "damaged": good[:150_000] + bytes([good[150_000] ^ 255]) + good[150_001:],
        "foreign": hashlib.sha256(foreign).digest() + foreign, "another's": good,
    }  # fmt: skip
    for name, found in spoilt.items():
        kept = tmp_path / name / whole.relative_to(tmp_path / "whole")
        kept.parent.mkdir(parents=True, mode=0o700)
        kept.write_bytes(found)
        if name == "another's":
            kept.chmod(0o666)
    (tmp_path / "no folder").write_text("a file")
    kept, results = started(*(tmp_path / name for name in (*spoilt, "no folder")))
    assert set(results) == {result}
    for one in kept[:-1]:
        assert one.read_bytes() == good
        assert not one.stat().st_mode & 0o022


# How well a step is solved


@pytest.mark.parametrize("sweeps", [1, 3, 100])
def test_what_a_solve_leaves_is_by_how_much_overlaps_grow_in_its_step(sweeps):
    # Ten disks on each other. They fall for a step; the next one is asked to leave overlaps, which
    # are below 0.1 % of the radius, as they are: what it leaves is by how much one grows.
    r, n = 0.01, 10
    machine = crowd_scene(particle={"radius": r}, stream={"count": n}, surface=[FLOOR])
    core = Core(thrown(machine, [(0.0, r + 2.0 * r * k) for k in range(n)], np.zeros((n, 2))))
    core.world.sweeps = sweeps

    def overlaps():
        return 2.0 * r - np.diff(np.concatenate([[-r], np.sort(core.disks["y"])]))

    core.step()
    before = overlaps()
    core.step()
    grown = (overlaps() - before).max() / r
    core.step()
    assert core.recording().unsolved[1] == pytest.approx(grown, abs=1e-12)
    assert (grown > 1e-4) == (sweeps < 100)


def test_a_step_that_is_not_solved_breaks_a_law():
    recording = mixed(0)[0].run()
    assert judge(recording) == ()
    left = recording.unsolved.copy()
    left[3] = 0.11
    assert [broken.law for broken in judge(replace(recording, unsolved=left))] == [SOLVED]
