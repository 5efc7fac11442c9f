"""The laws that every run is judged by: sound runs keep them, and a planted fault breaks one.

Faults are planted in recordings, so that no engine has to be at fault.
"""

import ctypes
import json
import warnings
from contextlib import suppress
from dataclasses import replace
from functools import partial
from math import hypot, isnan, nan, sqrt

import numpy as np
import pytest

import chains
import chutelab
import columns
import crowds
import drawn
import sandbox
from chutelab import core as module
from chutelab import scene
from chutelab.checks.stress.barriers import Evidence
from chutelab.engines import contact, exact, simulation
from chutelab.engines.simulation import judged, simulate
from chutelab.machine import build
from chutelab.results import Recording, laws
from chutelab.results.ledger import ledger
from chutelab.results.record import hermite
from chutelab.results.recorder import Recorder, StalledError
from chutelab.scene import SceneError
from chutelab.studies.sweep import sweep
from shared import call, seeds
from stress.case import TRANSFER, merged, surface, thrown
from transformed import resized

FLOOR = surface("floor", (-1.0, 0.0), (2.0, 0.0), restitution=0.5, friction=0.3)
HOP = {**thrown((0.0, 0.3), (0.5, 0.0)), "surface": [FLOOR], "run": {"until": 1.0}}
ARC = {"center": [0.0, 0.0], "radius": 0.1, "from_deg": 180.0, "to_deg": 360.0,
       "restitution": 0.5, "friction": 0.0}  # fmt: skip
BOWL = {"particle": {"radius": 0.01}, "surface": [{"name": "bowl", **ARC}],
        **thrown((0.03, 0.0), (0.0, 0.0)), "run": {"until": 0.3}}  # fmt: skip
CROWD = {
    "particle": {"radius": 0.01, "mass": 0.01},
    "surface": [surface("box", (-0.1, 0.5), (-0.1, 0.0), (0.1, 0.0), (0.1, 0.5))],
    "stream": {"count": 20, "fill": [[-0.09, 0.02], [0.09, 0.3]], "interact": True},
    "run": {"until": 0.6},
}


def recorded(tables, engine="exact"):
    return judged(scene.from_dict({"particle": {"radius": 0.01}, **tables}, "test"), engine=engine)


def spoilt(recording, **changes):
    """Return a recording whose arrays some functions have changed."""
    arrays = {name: getattr(recording, name).copy() for name in changes}
    for name, change in changes.items():
        change(arrays[name])
    return replace(recording, **arrays)


def names(recording):
    return [broken.law for broken in recording.laws]


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
@pytest.mark.parametrize("tables", [HOP, BOWL, TRANSFER])
def test_a_sound_run_breaks_none(tables, engine):
    assert recorded(tables, engine).laws == ()


def in_memory(tables, engine, change):
    """Run to the end, change the knots that the core has, and have it judge them where they are."""
    machine = build(scene.from_dict({"particle": {"radius": 0.01}, **tables}))
    core = module.Module()
    if engine == "exact":
        recorder, world = Recorder(machine), "Exact"
        exact.fill(core, machine, 1.0, apart=False)
        exact.follow(core, recorder, None)
    else:
        job, world = contact.Job(core, machine, whole=False), "World"
        job.run(None)
    assert not core.structs["Laws"].breaches
    subject = core.structs[world]
    change(core.array("knots", module.dtype("Knot"), subject.knot_count, of=world))
    subject.is_whole = True
    if engine == "exact":
        exact.follow(core, recorder, None)
        exact.collect(core, recorder)
        rounds = core.structs["Exact"].rounds
        recording = Recording.of(recorder.finish(engine="exact", steps=rounds))
    else:
        job.proceed(1)
        recorder = Recorder(machine)
        job.write(recorder)
        steps = subject.step_count
        recording = Recording.of(recorder.finish(engine="contact", steps=steps))
    laws.take(core, recording)
    return recording


@pytest.mark.parametrize("tables", [HOP, BOWL, TRANSFER])
@pytest.mark.parametrize(("sunk", "wrong"), [(0.0, ""), (2.0, laws.ENERGY), (nan, laws.FINITE)])
def test_a_lone_run_is_judged_by_its_scene_as_by_the_parts_of_its_machine(tables, sunk, wrong):
    def sink(knots):
        knots["position"][-1, 1] -= sunk

    told = spoilt(recorded(tables, "pymunk"), knots=sink)
    passed = replace(told, machine=replace(told.machine))
    assert told.machine.is_told
    assert not passed.machine.is_told
    here, handed = laws.examine(told), laws.examine(passed)
    assert here.breaches.tobytes() == handed.breaches.tobytes()
    assert here.hits.tobytes() == handed.hits.tobytes()
    for name, kind in here.figures._fields_:
        if kind is not ctypes.c_uint32:  # those are addresses
            assert getattr(here.figures, name) == getattr(handed.figures, name), name
    assert (wrong in names(told)) == bool(wrong)


@pytest.mark.parametrize("engine", ["exact", "contact"])
@pytest.mark.parametrize("tables", [HOP, BOWL, TRANSFER])
@pytest.mark.parametrize(("sunk", "wrong"), [(0.0, ""), (2.0, laws.ENERGY), (nan, laws.FINITE)])
def test_what_is_judged_in_the_cores_memory_is_the_recording(tables, engine, sunk, wrong):
    def sink(knots):
        knots["y"][-1] -= sunk

    run = in_memory(tables, engine, sink)
    assert (wrong in names(run)) == bool(wrong)
    here, handed = laws.examine(run), laws.examine(replace(run))
    assert here is not handed
    assert here.breaches.tobytes() == handed.breaches.tobytes()
    assert here.hits.tobytes() == handed.hits.tobytes()
    # Where arrays lie differs, how far it is from knot to knot, and whether a knot tells its disk.
    for name, kind in here.figures._fields_:
        if kind is not ctypes.c_uint32 and name not in ("row", "owned"):
            one, other = (getattr(found.figures, name) for found in (here, handed))
            assert one == other or (isnan(one) and isnan(other)), name


@pytest.mark.parametrize("engine", ["exact", "contact"])
def test_a_flight_through_the_floor_is_no_event_and_is_seen(engine):
    """All but the first knot is forgotten, and the last lies where a free fall gets in 1 s."""
    whole = recorded(HOP, engine)
    knots = whole.knots[[0, -1]].copy()
    knots["position"][1] = [0.5, 0.3 - 0.5 * 9.81]
    knots["velocity"][1] = [0.5, -9.81]
    through = replace(whole, knots=knots, offsets=np.array([0, 2]))
    found = {broken.law: broken for broken in through.laws}
    one = found[laws.THROUGH]
    assert (one.particle, one.particles, one.surface) == (0, 1, "floor")
    # The centre is at the floor after sqrt(2 h / g), and has moved on by 0.5 m/s.
    t = (2.0 * 0.3 / 9.81) ** 0.5
    assert one.t == pytest.approx(t, abs=1e-3)
    assert one.position == pytest.approx((0.5 * t, 0.0), abs=1e-2)
    assert "particle 0, floor at t = 0.2" in str(one)
    assert "do not trust" in str(one)


@pytest.mark.parametrize("seed", [711, 2311])
def test_a_path_inside_an_arc_that_ends_short_of_the_disks_centre_is_bent_by_it(seed):
    """A first chord may give m (v² dt / 2 (R - r))² / 2, also if no knot is in the arc's box."""
    assert laws.judge(contact.run(build(chains.draw(seed)))) == ()


def test_a_blow_that_is_left_to_a_solve_is_one_on_the_track():
    """A cubic from the velocity before it, w dt into a wall, would be in the wall by 4/27 w dt."""
    run = contact.run(build(chains.draw(2405)))
    assert laws.judge(run) == ()


@pytest.mark.parametrize(("side", "seen"), [(0.99, True), (1.01, False)])
def test_a_disk_that_clips_an_end_between_knots_is_seen(side, seen):
    """It flies past the end of a wall at ever the same distance of 0.99 or 1.01 radii."""
    wall = surface("wall", (0.5, -1.0), (0.5, 0.0))
    tables = {"gravity": 0.0, "surface": [wall], **thrown((0.0, 0.5), (1.0, 0.0)),
              "run": {"until": 1.0}}  # fmt: skip

    def low(knots):
        knots["position"][:, 1] = side * 0.01

    passing = spoilt(recorded(tables), knots=low)
    assert len(passing.knots) == 2
    assert names(passing) == ([laws.INSIDE] if seen else [])
    for broken in passing.laws:
        assert broken.amount == pytest.approx(0.01 - 0.0099, rel=1e-2)


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
def test_a_crowd_that_makes_energy_is_seen(engine):
    """One ball gets 12 m/s from nowhere, of a fall of 0.3 m at most; its books say so or do not."""
    whole = recorded(CROWD, engine)
    assert whole.laws == ()
    row = int(whole.offsets[8] - 3)
    given = 0.5 * 0.01 * 12.0**2

    def booked(knots):
        knots["entries"][row : whole.offsets[8], 1] -= given

    def fast(knots):
        knots["velocity"][row : whole.offsets[8]] = [0.0, 12.0]

    seen = spoilt(whole, knots=booked).laws[0]
    assert (seen.law, seen.particle) == (laws.LOSSES, 7)
    assert seen.amount == pytest.approx(-given, rel=0.1)
    assert laws.LEDGER in names(spoilt(whole, knots=fast))
    both = names(spoilt(spoilt(whole, knots=booked), knots=fast))
    assert laws.LOSSES in both


@pytest.mark.parametrize(("share", "seen"), [(0.5, []), (2.0, [laws.LEDGER])])
def test_a_crowd_may_misbook_a_billionth_of_what_it_turns_over(share, seen):
    whole = recorded(CROWD, "contact")

    def misbook(knots):
        knots["entries"][-1, 2] += share * 1e-9 * ledger(whole).turned_over

    assert names(spoilt(whole, knots=misbook)) == seen


@pytest.mark.parametrize(("share", "seen"), [(0.5, []), (2.0, [laws.ENERGY])])
def test_energy_that_all_have_at_a_step_is_judged_to_a_billionth(share, seen):
    whole = recorded(CROWD, "contact")

    def rise(totals):
        totals["kinetic"][len(totals) // 2] += share * 1e-9 * ledger(whole).turned_over

    assert names(spoilt(whole, totals=rise)) == seen


@pytest.mark.parametrize(("share", "seen"), [(0.9, []), (1.1, [laws.ENERGY])])
@pytest.mark.parametrize("g", [9.81, 98.1])
def test_what_tracks_leave_out_is_no_gain(g, share, seen):
    """They leave out hops, g h of a velocity with h² = 8e-3 r/g at most, by which m v g h is off.

    Beside that removed overlaps may lift all by 5 % of r.
    """
    whole = recorded(CROWD | {"gravity": g}, "contact")
    mass, r, step = 20 * 0.01, 0.01, min(whole.machine.step_of("contact"), sqrt(8e-3 * 0.01 / g))
    fast = np.hypot(*whole.knots["velocity"].T).max()
    bound = mass * (fast * g * step + 0.05 * g * r)

    def leave_out(knots):
        knots["entries"][whole.offsets[8] + 1 : whole.offsets[9] - 1, 0] -= share * bound

    assert names(spoilt(whole, knots=leave_out)) == seen


@pytest.mark.parametrize(("share", "seen"), [(0.9, False), (1.1, True)])
def test_a_lower_hop_by_rotation_gives_back_what_a_higher_one_took(share, seen):
    """A square that spins without gravity presses a disk along, with a velocity w <= a h / 2.

    (a h)² <= 9.81 8e-3 r, with r its inner radius, so m w² / 2 <= m 9.81 8e-3 r / 8.
    """
    m, side = 0.01, 0.0278
    pair = {"interact": True, "restitution": 0.3, "friction": 1.0}
    tables = {
        "gravity": 0.0,
        "particle": [{"name": "square", "shape": "box", "size": [side, side], "mass": m},
                     {"name": "disk", "radius": 0.0148, "mass": m}],
        "surface": [{"name": "far", "from": [-9.0, -9.0], "to": [9.0, -9.0]}],
        "stream": [{"particle": "square", "at": [0.0, 0.0], "velocity": [0.0, 0.0],
                    "omega": -75.9, "angle_deg": 38.0, **pair},
                   {"particle": "disk", "at": [-0.0222, -0.0184], "velocity": [-0.533, 0.668],
                    "omega": 15.6, **pair}],
        "run": {"until": 0.02},
    }  # fmt: skip
    for kind in tables["particle"]:
        kind["spin"] = True
    whole = judged(scene.from_dict(tables, "test"), engine="contact")
    bound = m * 9.81 * 8e-3 * 0.5 * side / 8.0
    assert whole.laws == ()
    assert 0.0 < np.diff(whole.totals["kinetic"][1:]).max() < bound

    def give(knots):
        knots["entries"][-1, 1] -= share * bound

    assert (laws.LOSSES in names(spoilt(whole, knots=give))) == seen


@pytest.mark.parametrize(("share", "seen"), [(0.9, False), (1.1, True)])
@pytest.mark.parametrize("angle", [None, 0.0, 45.0])
def test_overlaps_give_back_what_parting_them_may(angle, share, seen):
    """Two disks or squares overlap by 2 % of the inner radius, faces or a face and a corner.

    (p d / h)² M / 0.012, p d = (2/3) (0.02 - 0.001) r, at most 1 %.
    """
    round_, square = {"radius": 0.01}, {"shape": "box", "size": [0.02, 0.02], "spin": True}
    turned = {} if angle is None else {"angle_deg": angle}
    rows = [{"at": [x, 0.0], "velocity": [0.0, 0.0], "interact": True, **more}
            for x, more in ((0.0, {}), (0.5, turned))]  # fmt: skip
    tables = {"gravity": 0.0, "particle": {"mass": 0.01, **(square if turned else round_)},
              "stream": [{"name": f"one-{n}", **row} for n, row in enumerate(rows)],
              "run": {"until": 0.5, "dt": 1e-3}}  # fmt: skip
    part = min(2.0 / 3.0 * (0.02 - 0.001), 0.01) * 0.01 / 1e-3
    away = 0.0198 if not angle else 0.01 * (1.0 + sqrt(2.0)) - 2e-4

    def give(knots):
        knots["position"][:, 0] = np.repeat([0.0, away], len(knots) // 2)
        knots["entries"][-1, 1] -= share * part**2 * 0.01 / 0.012

    whole = judged(scene.from_dict(tables, "test"), engine="contact")
    assert (laws.LOSSES in names(spoilt(whole, knots=give))) == seen


@pytest.mark.parametrize(("shuts", "seen"), [(0.5, False), (0.7, True)])
def test_what_lies_in_a_gate_a_little_as_it_shuts_is_spared(shuts, seen):
    """A disk is 3 % of its radius deep where the gate shuts, and goes on; or it comes later."""
    gate = {**surface("gate", (-1.0, 0.0), (1.0, 0.0)), "opens_at": 0.0, "closes_at": shuts}
    one = {"name": "one", "at": [0.0, 0.0597], "velocity": [0.0, -0.1], "interact": True}
    tables = {"gravity": 0.0, "surface": [gate], "run": {"until": 1.5},
              "stream": [one, {**one, "name": "other", "at": [0.5, 0.0597]}]}  # fmt: skip
    late = 0.021 if seen else 0.0

    def through(knots):
        knots["position"][:, 1] = late + 0.0597 - 0.1 * knots["t"]
        knots["velocity"][:, 1] = -0.1

    found = names(spoilt(recorded(tables, "contact"), knots=through))
    assert (laws.THROUGH in found) == seen


def test_steps_longer_than_the_radius_are_told_where_something_may_be_passed():
    """7 mm a step are too far for a radius of 4 mm beside the floor, but not where nothing is."""
    fast = {"particle": {"radius": 0.004}, **thrown((0.0, 0.3), (7.0, 0.0)), "surface": [FLOOR],
            "run": {"until": 0.3, "align": False, "dt": 1e-3}}  # fmt: skip
    (broken,) = recorded(fast, "pymunk").laws
    assert broken.law == laws.STEP
    # v dt: the speed of the knot at the floor, sqrt(v² + 2 g h) at most.
    assert broken.bound == 0.004
    assert 0.007 <= broken.amount <= 1e-3 * hypot(7.0, (2.0 * 9.81 * 0.3) ** 0.5)
    assert "(--dt), or --engine contact" in broken.advice
    past = merged(fast, {"stream": {"at": [5.0, 0.3]}})
    assert recorded(past, "pymunk").laws == ()


def report(run):
    from chutelab.results.summary import sheets

    return sheets(run)


# What is done with a broken law


def ghost(recording):
    """Return a recording that falls through all there is."""

    def sink(knots):
        knots["position"][-1, 1] -= 2.0

    return spoilt(recording, knots=sink)


@pytest.fixture
def faulty(monkeypatch):
    """Have engines of some names return recordings with a planted fault."""

    def plant(*engines):
        def follow(machine, engine, progress, honest=simulation.follow):
            run = honest(machine, engine, progress)
            return ghost(run) if run.engine in engines else run

        monkeypatch.setattr(simulation, "follow", follow)

    return plant


def test_simulate_warns_and_the_recording_holds_the_laws(faulty):
    faulty("exact")
    with pytest.warns(chutelab.LawWarning) as told:
        run = simulate(scene.from_dict(HOP), engine="exact")
    assert [str(one.message) for one in told] == list(map(str, run.laws))
    assert run.laws[0].law == laws.THROUGH
    with warnings.catch_warnings():
        warnings.simplefilter("error", chutelab.LawWarning)
        with pytest.raises(chutelab.LawWarning, match="LAW BROKEN, nothing through a surface"):
            simulate(scene.from_dict(HOP), engine="exact")


def test_auto_takes_another_engine_and_says_so(faulty, tmp_path):
    faulty("exact")
    run = simulate(scene.from_dict(HOP))
    assert (run.engine, run.laws) == ("contact", ())
    assert run.instead.startswith("exact did not keep the laws of every run (nothing through")
    assert chutelab.Recording.load(run.save(tmp_path / "run.npz")).instead == run.instead
    told = " ".join(" ".join(sheet.notes) for sheet in report(run))
    assert "contact ran instead, and keeps them" in told
    faulty("exact", "contact")
    assert simulate(scene.from_dict(HOP)).engine == "pymunk"
    faulty("exact", "contact", "pymunk")
    with pytest.warns(chutelab.LawWarning) as told:
        run = simulate(scene.from_dict(HOP))
    assert len(told) == len(run.laws)
    assert (run.engine, run.instead) == ("exact", "")


def test_the_command_says_it_ends_with_1_and_writes_marked_files(faulty, tmp_path, monkeypatch):
    faulty("exact")
    monkeypatch.chdir(tmp_path)
    arguments = ["run", "perpendicular", "--engine", "exact"]
    plain = call(*arguments, code=1)
    assert "LAW BROKEN, nothing through a surface" in " ".join(plain.stdout.split())
    asked = call(*arguments, "--json", "--out", "out", "--only", "npz,json", code=1)
    assert "LAW BROKEN" in asked.stderr
    for text in (asked.stdout, (tmp_path / "out" / "summary.json").read_text()):
        first = json.loads(text)["laws"][0]
        assert set(first) == {
            "law", "particles", "particle", "t", "position", "surface", "amount", "bound", "unit",
            "advice",
        }  # fmt: skip
    shown = call("show", "out/recording.npz", code=1)
    assert "LAW BROKEN" in shown.stdout
    sound = call("run", "perpendicular", "--json")
    told = json.loads(sound.stdout)
    assert (told["laws"], told["engine"]) == ([], "contact")
    assert "exact did not keep" in told["instead"]


def test_a_row_of_a_sweep_whose_run_breaks_a_law_has_no_numbers_but_a_reason(faulty):
    faulty("contact")
    found = sweep(scene.load("perpendicular"), {"plate.angle_deg": [0.0, 5.0]}, engine="contact")
    assert all("LAW BROKEN" in reason for reason in found.columns["reason"])
    assert np.isnan(found.columns["landing.x.mean"]).all()


# No false alarms, and none missed


def by_looking(e):
    """Tell whether some place on a path, of 400 between each two knots, is in a surface."""
    knots = e.recording.knots
    own = np.diff(e.recording.owner) == 0
    parts = [*e.machine.parts, *([e.machine.pulley.rim] if e.machine.pulley else [])]
    pieces = [part.of(n) for part in parts for n in range(part.surface.size)]
    left = np.flatnonzero(own & (np.diff(knots["t"]) > 0.0))
    for share in np.linspace(0.0, 1.0, 401):
        shares = np.full(len(left), share)
        place, _ = hermite(knots, left, shares)
        for piece in pieces:
            gap = piece.gap(place, e.radii[e.recording.owner[left]])
            if (gap[piece.there(knots["t"][left])] < -e.bounds.allowed).any():
                return True
    return False


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(12))
def test_what_is_proven_clear_is_clear(seed):
    """Machines without gates, with knots moved by some mm: a brute search finds the same."""
    tables = sandbox.tables(2 * seed)
    if any(key in row for row in tables.get("surface", ()) for key in ("opens_at", "closes_at")):
        pytest.skip("what a gate shuts on is forgiven")
    whole = judged(scene.from_dict(tables))
    rng = np.random.default_rng(seed)

    def shake(knots):
        knots["position"] += rng.normal(0.0, 2e-3, knots["position"].shape)

    for run in (whole, spoilt(whole, knots=shake)):
        e = Evidence(run)
        assert bool(len(e.found.hits)) >= by_looking(e)
        assert run is not whole or not len(e.found.hits)


def in_steps(tables):
    """Return a machine whose crowd Chipmunk can follow: its fastest go 0.9 of the least radius.

    From the highest release to the end of all tracks, 1 m below the lowest surface, a free fall has
    v² = v0² + 2 g h; belts give what they have.
    """
    m = build(scene.from_dict(tables))
    y, v0 = m.releases.position[:, 1], np.hypot(*m.releases.velocity.T).max()
    low = min(m.corners[:, 1].min(initial=np.inf), y.min()) - 1.0
    belts = np.abs(np.concatenate([m.segments.speed, m.arcs.speed])).max(initial=0.0)
    v = max(hypot(v0, (2.0 * m.gravity * (y.max() - low)) ** 0.5), belts)
    return replace(m, dt=min(m.dt, 0.9 * float(np.min(m.particle.radius)) / v))


def of_points(n):
    """Return a random machine of chains and bowls, met by a mass point."""
    tables = chains.tables(n)
    return build(scene.from_dict({**tables, "particle": {"radius": 0.0, "mass": 0.01}}))


def of_millimetres(n):
    """Return a random machine of chains and bowls, a hundredth as large as they are drawn."""
    return build(scene.from_dict(resized(chains.tables(n), 1e-2)[0]))


LONE = "exact", "contact", "pymunk"
SOUND = {
    "sandbox, apart": (220, lambda n: build(sandbox.draw(2 * n)), ("exact", "contact")),
    "sandbox, meeting": (120, lambda n: build(sandbox.draw(2 * n + 1)), ("contact",)),
    "sandbox, Pymunk": (20, lambda n: in_steps(sandbox.tables(2 * n + 1)), ("pymunk",)),
    "chains and bowls": (60, lambda n: build(chains.draw(n)), LONE),
    "mass points": (60, of_points, ("exact",)),
    "some mm": (400, of_millimetres, ("exact",)),
    "all of a scene file": (40, lambda n: build(drawn.draw(n, points=False)), LONE),
    "crowds of all sizes": (20, lambda n: crowds.crowd(n, count=40)[1], ("contact",)),
    "columns": (20, lambda n: build(scene.from_dict(columns.column(n, 40))), ("contact",)),
}
"""How many sound machines of each generator, 960 in all, and the engines that they run on."""

MADE = "Chipmunk makes 0.1 % of the energy turned over in one step where a heap is struck at g = 0"

WRONG = {("sandbox, Pymunk", 14): MADE}
"""Runs that are wrong, and say so, and why: at 1, 0.4 and 0.2 ms; the contact engine's is not."""


def alarms(name, seeds):
    """Return what is told of random sound machines, by each engine that does not refuse.

    The exact engine refuses disks that get gripped in a nip: rigid bodies have no finite impulse
    there. A run that says that it is stuck says that it is not right.
    """
    _, draw, engines = SOUND[name]
    found = []
    for seed in seeds:
        machine = draw(seed)
        for engine in engines:
            with suppress(SceneError, StalledError):
                run = simulation.follow(machine, engine, None)
                found += [f"{name} {seed} {engine}: {broken}" for broken in run.laws]
    return found


@pytest.mark.parametrize("name", SOUND)
def test_random_sound_scenes_raise_no_alarm(name):
    assert alarms(name, range(1)) == []


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "first"),
    [(name, first) for name, (count, *_) in SOUND.items() for first in range(0, count, 20)],
)
def test_hundreds_of_random_sound_scenes_raise_no_alarm(name, first):
    seeds = range(first, min(first + 20, SOUND[name][0]))
    assert alarms(name, [seed for seed in seeds if (name, seed) not in WRONG]) == []


@pytest.mark.parametrize("share", [1.0, 1e-2, 1e-4])
def test_where_heights_are_small_beside_other_lengths_rounding_is_no_alarm(share):
    """Hollows a little wider than the disk, and slides and blows on long slopes near y = 0."""
    for seed in (78, 139, 330, 420, 726, 932):
        machine = build(scene.from_dict(resized(chains.tables(seed), share)[0]))
        assert simulation.follow(machine, "exact", None).laws == (), seed


@pytest.mark.parametrize(("share", "seen"), [(0.9, []), (1.1, [laws.ENERGY, laws.LEDGER])])
@pytest.mark.parametrize("size", [1.0, 1e-3])
def test_what_rounding_may_do_to_a_ledger(size, share, seen):
    """500 ulps, and 2 for each contact, of the energy in play and of m g times the largest length.

    The floor reaches from x = -1 to 2, 3 long: a coordinate and a length are 4 at most. In play is
    what the disk had and what was booked; its height is 0.3 at most.
    """
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [2.0, 0.0], "restitution": 0.5}
    tables = resized(
        {"gravity": 9.81, "particle": {"radius": 0.01, "mass": 0.01}, "surface": [floor],
         "stream": {"at": [0.0, 0.3], "velocity": [0.5, 0.0]}, "run": {"until": 1.0}}, size,
    )[0]  # fmt: skip
    whole = recorded(tables)
    v2 = (whole.knots["velocity"] ** 2).sum(axis=1)
    booked = np.abs(whole.knots["entries"]).sum(axis=1)
    in_play = (0.5 * 0.01 * v2 + booked).max() + 0.01 * 9.81 * (0.3 + 4.0) * size
    bound = (500 + 2 * whole.contacts) * np.finfo(float).eps * in_play

    def misbook(knots):
        knots["entries"][-1, 2] += share * bound

    assert names(whole) == []
    assert names(spoilt(whole, knots=misbook)) == seen


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "seed"),
    [pytest.param(*one, marks=pytest.mark.xfail(reason=why)) for one, why in WRONG.items()],
)
def test_runs_that_are_wrong_say_so(name, seed):
    assert alarms(name, [seed]) == []


@pytest.mark.parametrize("name", ["perpendicular", "low-speed", "inclined-conveyor", "spoon"])
def test_a_mass_point_lies_on_what_carries_it(name):
    recording = recorded(scene.to_dict(scene.load(name, {"particle.radius": 0.0})))
    assert not recording.laws


@pytest.mark.parametrize("piece", [HOP, BOWL])
def test_a_mass_point_that_a_blow_does_not_turn_back_is_seen(piece):
    """From its first blow on, its track is the mirror image of what it was."""
    whole = recorded({**piece, "particle": {"radius": 0.0, "mass": 0.01}})
    assert not whole.laws
    blow = whole.select("impact")[0]
    later = whole.knots["t"] >= blow["t"]
    later[np.flatnonzero(later)[0]] = False  # the state before the blow

    def mirrored(knots):
        for part in ("position", "velocity"):
            knots[part][later, 1] *= -1.0
        knots["position"][later, 1] += 2.0 * blow["position"][1]

    assert laws.THROUGH in names(spoilt(whole, knots=mirrored))


SIDE_BY_SIDE = {
    "particle": [{"name": "a", "radius": 0.01}, {"name": "b", "radius": 0.02}],
    "surface": [surface("floor", (-1.0, 0.0), (1.0, 0.0))],
    "stream": [
        {"at": [0.0, 0.01], "velocity": [0.0, 0.0], "interact": True, "particle": "a"},
        {"at": [0.04, 0.02], "velocity": [0.0, 0.0], "particle": "b"},
    ],
    "run": {"until": 0.5},
}
"""Two disks that lie beside each other and do not touch."""


@pytest.mark.parametrize("engine", ["contact", "pymunk"])
@pytest.mark.parametrize("deep", [0.049, 0.2])
@pytest.mark.parametrize("passing", [False, True])
def test_a_particle_inside_another_one_breaks_a_law(engine, deep, passing):
    """Deeper than 5 % of the smaller radius, unless the two kinds pass through each other."""
    pair = {"pair": [{"between": ["a", "b"], "meet": False}]} if passing else {}
    run = chutelab.simulate({**SIDE_BY_SIDE, **pair}, engine=engine)
    apart = 0.03 - deep * 0.01

    def closer(knots):
        first, last = run.offsets[1:3]
        across = run.track(1)["position"][0] - run.track(0)["position"][0]
        knots["position"][first:last, 0] += np.sqrt(apart**2 - across[1] ** 2) - across[0]

    told = [one for one in spoilt(run, knots=closer).laws if one.law == laws.APART]
    assert bool(told) == (deep > 0.05 and not passing)
    for one in told:
        assert (one.particles, one.particle) == (2, 0)
        assert one.amount == pytest.approx(deep, abs=2e-3)
    assert not run.laws


def depth_of(shapes, places, angles):
    """By how much two shapes are in each other, m: the least way that parts them, of 1,800 ways.

    Along a way w a shape reaches from -s(-w) to s(w), the largest w · corner, or its radius.
    """
    ways = np.linspace(0.0, 2.0 * np.pi, 1801)
    ways = np.stack([np.cos(ways), np.sin(ways)])
    reach = []
    for shape, place, angle, side in zip(shapes, places, angles, (1.0, -1.0), strict=True):
        c, s = np.cos(angle), np.sin(angle)
        corners = np.atleast_2d(shape.get("points", (0.0, 0.0))) @ np.array([[c, s], [-s, c]])
        most = ((place + corners) @ (side * ways)).max(axis=0) + shape.get("radius", 0.0)
        reach.append(most)
    return (reach[0] + reach[1]).min()


def inside(shape):
    """The radius of a shape, or of the circle inside it about its centroid, m."""
    if "radius" in shape:
        return shape["radius"]
    corners = np.array(shape["points"])
    (x, y), (u, v) = corners.T, np.roll(corners, -1, axis=0).T
    return ((x * v - y * u) / np.hypot(u - x, v - y)).min()


def stone(random):
    """Return a disk, or a polygon that may be thin, its centroid at the origin."""
    count = int(random.integers(2, 9))
    if count == 2:
        return {"radius": float(random.uniform(0.01, 0.03))}
    turns = (np.arange(count) + random.uniform(-0.3, 0.3, count)) * 2.0 * np.pi / count
    points = 0.03 * np.stack([np.cos(turns), np.sin(turns) * random.uniform(0.1, 1.0)], axis=1)
    x, y = points.T
    u, v = np.roll(points, -1, axis=0).T
    area = x * v - y * u
    centre = np.array([((x + u) * area).sum(), ((y + v) * area).sum()]) / (3.0 * area.sum())
    return {"shape": "polygon", "points": (points - centre).tolist()}


@pytest.mark.parametrize("seed", seeds(6, 60))
def test_how_deep_particles_are_in_each_other_is_known_at_all_times(seed):
    """Disks and polygons that turn and fly through each other, however short they overlap.

    Judged as if they met. An overlap may be found a hundredth of the radius late.
    """
    random = np.random.default_rng(seed)
    shapes = [stone(random), stone(random)]
    least = min(map(inside, shapes))
    # At t = 0.05 their centres are beside each other, near where they touch.
    aside = random.uniform(0.8, 1.8) * sum(map(inside, shapes))
    way = random.uniform(0.0, 2.0 * np.pi)
    along, across = (np.array([np.cos(a), np.sin(a)]) for a in (way, way + 0.5 * np.pi))
    velocity = random.uniform(0.5, 10.0) * along
    streams = [
        {"at": at.tolist(), "velocity": v.tolist(), "particle": name, "interact": True,
         "omega": float(random.uniform(-20.0, 20.0))}
        for name, at, v in (("a", aside * across - 0.05 * velocity, velocity),
                            ("b", np.zeros(2), np.zeros(2)))
    ]  # fmt: skip
    run = chutelab.simulate({
        "gravity": 0.0,
        "particle": [{"name": n, "mass": 0.1, "spin": True, **one}
                     for n, one in zip("ab", shapes, strict=True)],
        "surface": [surface("far", (-5.0, -5.0), (5.0, -5.0))],
        "pair": [{"between": ["a", "b"], "meet": False}],
        "stream": streams, "run": {"until": 0.1},
    }, engine="contact")  # fmt: skip
    assert not run.laws
    span = min(0.0499, 0.07 / np.hypot(*velocity))
    times = np.linspace(0.05 - span, 0.05 + span, 500)
    now = run.at(times)
    deep = [depth_of(shapes, *both) for both in zip(now.position, now.angle, strict=True)]
    deepest = max(deep) / least
    machine = replace(run.machine, pair_restitution=np.abs(run.machine.pair_restitution))
    found = [one for one in replace(run, machine=machine).laws if one.law == laws.APART]
    assert bool(found) == (deepest > 0.05) or abs(deepest - 0.05) < 0.01
    for one in found:
        assert one.amount == pytest.approx(deepest, rel=0.01, abs=0.02)
        first = times[np.argmax(np.array(deep) > 0.05 * least)]
        assert one.t == pytest.approx(first, abs=0.03 * least / np.hypot(*velocity) + 1e-4)


def test_what_a_rod_joins_may_be_in_one_place():
    """Particles that a rod joins do not meet."""
    rod = {"particle": {"radius": 0.02}, "rod": [{"particle": 0, "other": 1}],
           "stream": [{"at": [0.0, 0.0], "velocity": [0.0, 0.0], "interact": True},
                      {"at": [0.03, 0.0], "velocity": [0.0, 0.0]}],
           "run": {"until": 0.3}}  # fmt: skip
    assert not chutelab.simulate(rod, engine="contact").laws


def test_what_a_crowd_gets_back_at_an_instant_is_told_as_one_sum():
    run = chutelab.simulate("hopper", {"stream.count": 40}, engine="contact")
    times, counts = np.unique(run.knots["t"], return_counts=True)
    at, each = times[counts.argmax()], 1e-2 * run.ledger.turned_over

    def give_back(knots):
        for first, end in zip(run.offsets, run.offsets[1:], strict=False):
            if at in knots["t"][first + 1 : end]:
                now = first + 1 + np.flatnonzero(knots["t"][first + 1 : end] == at)[0]
                knots["entries"][now:end, 1] -= each

    (told,) = (one for one in spoilt(run, knots=give_back).laws if one.law == laws.LOSSES)
    assert told.t == at
    assert told.amount == pytest.approx(-each * told.particles, rel=0.05)
    assert told.amount < told.bound < 0.0


@pytest.mark.parametrize("way", [0.0, 0.05, 0.2])
def test_what_a_drive_gives_and_takes_back_is_turned_over(way):
    """A box rides a board that starts and stops: its work adds up to m g `way`, and was 0.1 J."""
    board = {"name": "board", "from": [-0.3, 0.0], "to": [0.3, 0.0], "restitution": 0.0}
    travel = {"to": [0.0, way], "at": 0.2, "in": 0.5}
    box = {"shape": "box", "size": [0.04, 0.04], "mass": 0.2, "spin": True}
    recording = recorded({
        "particle": box, "surface": [board | {"friction": 0.9, "travel": travel}],
        **thrown((0.0, 0.02), (0.0, 0.0)), "run": {"until": 1.0},
    }, "contact")  # fmt: skip
    assert recording.ledger.drive_work == pytest.approx(0.2 * 9.81 * way, abs=1e-13)
    assert not recording.laws
    # A billionth of what it did on the way may be wrong.
    done = np.abs(recording.knots["entries"][:, 0]).max()
    for share, seen in ((0.5, []), (3.0, [laws.LEDGER])):
        wrong = spoilt(recording, knots=partial(misbook, share * 1e-9 * done))
        assert names(wrong) == seen


def misbook(amount, knots):
    knots["entries"][-1, 2] += amount


def test_energy_that_a_spring_takes_between_two_knots_is_no_gain():
    """Of two disks that turn about each other: 2.8e-4 J; but ten times that from nowhere is."""
    kinds = [
        {"name": "a", "radius": 0.0313, "mass": 1.779, "spin": True},
        {"name": "b", "radius": 0.018, "mass": 0.426, "spin": True, "shape": "sphere"},
    ]
    streams = [
        {"particle": "a", "at": [-0.3, 0.1756], "velocity": [0.5328, -0.8779], "interact": True},
        {"particle": "b", "at": [-0.1, 0.1337], "velocity": [0.3906, -0.1337]},
    ]  # fmt: skip
    recording = recorded({
        "gravity": 0.0, "particle": kinds, "stream": streams, "run": {"until": 0.6},
        "spring": [{"particle": 1, "other": 0, "stiffness": 43.6, "damper": 0.1}],
        "surface": [surface("far", (-90.0, -90.0), (90.0, -90.0))],
    }, "contact")  # fmt: skip
    assert not recording.laws

    def faster(knots):
        own = knots[recording.offsets[0] + 5 : recording.offsets[1]]
        own["velocity"] *= 1.0 + 2.8e-3 / (1.779 * (own["velocity"] ** 2).sum(axis=1)[:, None])

    assert laws.ENERGY in names(spoilt(recording, knots=faster))
