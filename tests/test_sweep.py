"""Sweeps: every row agrees with a single run to 1e-12, whichever process computes it, and when."""

import json
from contextlib import contextmanager
from dataclasses import replace
from math import sqrt
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from chutelab.cli.options import varied
from chutelab.core import Module, dtype
from chutelab.engines import exact
from chutelab.engines.exact import CornerError, lent
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results import Kind, Recording
from chutelab.results.ledger import ledger
from chutelab.results.quantities import compare
from chutelab.results.recorder import Recorder
from chutelab.results.rows import EVENT
from chutelab.scene import SceneError, load, parse
from chutelab.scene.look import Row
from chutelab.scene.overrides import value_at
from chutelab.scene.units import with_unit
from chutelab.scene.variants import Family, Judge, Vary
from chutelab.studies.sweep import (
    COLUMNS,
    MOST_VARIANTS,
    REASON,
    TEXTS,
    TOUCHES,
)
from chutelab.studies.sweep.plan import row_of, runs
from chutelab.studies.sweep.plan import swept as swept_block
from chutelab.util.errors import InputError
from handmade import assert_legible
from shared import call, some
from typed import planned, sweep

PAID, HEAT = (f"ledger.by_surface.outgoing.{name}" for name in ("belt_work", "friction_loss"))

JOINED = """
[incoming]
speed = 2.0
pulley_radius = 0.1
[outgoing]
drop = 0.5
drop_from = "top"
start = 0.5
friction = 0.2
[[surface]]
name = "ramp"
from = [0.2, -0.2]
to = [0.5, -0.4]
restitution = 0.0
friction = 0.1
[run]
until = "settled"
max_time = 5.0
"""
"""With outgoing.drop = 0.5 the ramp ends where the belt begins."""


@pytest.fixture(autouse=True)
def _elsewhere(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)


def block_of(scene, varies, **options):
    plan = planned(scene, varies, **options)
    return plan.block(0, plan.count)


ROUNDING = {"error.max": 1e-12, "ledger.residual": 1e-15}
"""What is an error itself agrees absolutely: relative, and in J."""

ALIKE = 1e-14
"""Share of their mean by which values of particles may differ, and so the spread of like ones."""


def rounding_of(name, expected):
    if name.endswith(".spread"):
        means = np.abs(expected[name.replace(".spread", ".mean")])
        return ALIKE * np.nanmax(means, initial=0.0)
    return ROUNDING.get(name, 0.0)


def assert_same(found, expected):
    assert list(found) == list(expected)
    for name in expected:
        if name in TEXTS:
            assert found[name].tolist() == expected[name].tolist()
        else:
            np.testing.assert_allclose(
                found[name], expected[name], rtol=1e-12, atol=rounding_of(name, expected),
                err_msg=name,
            )  # fmt: skip


# the batch against single runs -------------------------------------------------------------------


FAMILIES = """
perpendicular | | plate.angle_deg=-20:80:5 incoming.speed=0:4:4 plate.restitution=0,0.5,1
perpendicular | outgoing.drop_from=top | particle.radius=0:0.05:4 particle.mass=0.01,1 gravity=0,1,9.81
perpendicular | run.until=settled | outgoing.drop=0.05:0.6:4 outgoing.speed=-1:2:3 outgoing.friction=0,1
perpendicular | outgoing.drop_from=top | plate.above=0:0.2:3 plate.below=0:0.2:3 plate.angle_deg=0,30,80
perpendicular | | run.until=0.1:2:5 run.max_time=0.5,1 run.dt=0.001,0.01
perpendicular | stream.velocity=[2.0,0.0] | incoming.speed=0:2:3 plate.restitution=0,1
perpendicular | stream.at=[-0.2,0.204] | incoming.pulley_radius=0.1:0.2:3
perpendicular | stream.at=[-0.2,0.3] | incoming.speed=1,2 particle.radius=0,0.1
perpendicular | particle.spin=true run.engine=exact | particle.radius=0:0.01:3 plate.friction=0.3,1
belt-landing | | plate.restitution=0:1.2:4 outgoing.friction=0.1,0.5 outgoing.restitution=0,0.4
low-speed | | incoming.speed=0:1:5 incoming.pulley_radius=0.05,0.2
slip | | incoming.speed=0.1:1:3 incoming.friction=0:1:3
slip | particle.spin=true | incoming.speed=0.3,1 incoming.friction=0.2,0.5
free-fall | stream.count=1 | surface.ramp.opens_at=0.1,0.3,0.6 stream.start=0,0.2
free-fall | stream.count=1 | gravity=0,9.81 surface.ramp.restitution=0,0.5 surface.floor.speed=-1,1
free-fall | stream.count=1 | stream.at[0]=-0.1:0.1:3 stream.at[1]=0.2:1:3 surface.ramp.points[1][0]=0.2:0.6:3
perpendicular | stream.at=[-0.2,0.204] | stream.at[0]=-0.6:0.1:5 stream.at[1]=0.1,0.204,0.3
perpendicular | stream.velocity=[2.0,0.0] incoming.friction=0.5 | stream.velocity[0]=1:3:3 stream.velocity[1]=0,0.5
perpendicular | stream.velocity=[2.0,0.0] | stream.velocity[0]=1:3:3 incoming.speed=2,3
spoon | stream.count=1 | surface.spoon.center[0]=0.9:1.2:4 surface.spoon.center[1]=-0.4,-0.3 surface.spoon.friction=0,0.5
spoon | stream.count=1 | surface.spoon.radius=0.4:0.6:3 surface.spoon.to_deg=220:300:3 particle.radius=0.002:0.006:3
rock-box | stream.count=1 stream.interact=false | incoming.speed=1.5:2.5:4 stream.start=0,0.1
cascade | stream.count=1 stream.interact=false | gravity=5:10:4 incoming.speed=1.5,2
inclined-conveyor | stream.count=1 | incoming.speed=1.5:2.5:4 incoming.incline_deg=0:15:3
spoon | stream.count=7 | surface.spoon.center[0]=0.9:1.2:4 stream.bed_height=0,0.02 particle.radius=0.002:0.006:3
stream | stream.interact=false stream.count=5 particle.radius=[0.002,0.004] | plate.angle_deg=-60:40:5 stream.rate=50,200
stream-independent | stream.count=6 stream.speed_spread=0.1 incoming.friction=0.5 | particle.mass=0.01:0.1:3 incoming.speed=1,3
cascade | stream.count=6 stream.bed_height=0.3 run.until=2.2 | conveyor.middle.speed=-2,0,1 plate[0].angle_deg=0,60 outgoing.length=0.1,2
perpendicular | stream.count=3 run.until=0.5 | stream.rate=1,10,100 plate.restitution=0,0.5
"""  # noqa: E501
"""A scene, what is set, what is varied."""


@pytest.mark.parametrize("line", some(FAMILIES.strip().splitlines()))
def test_rows_of_a_batch_are_those_of_single_runs(line):
    name, settings, varies = (part.split() for part in line.split("|"))
    block = block_of(load(*name, settings), varies)
    singles = swept_block(block, apart=True)
    assert_same(swept_block(block), singles)


@pytest.mark.parametrize("seed", [0, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2))])
def test_samples_over_many_keys_are_single_runs(seed):
    ranges = [
        "plate.angle_deg=-40:70", "incoming.speed=0.2:5", "plate.distance=0.05:1",
        "outgoing.drop=0.1:1", "particle.radius=0.001:0.02", "plate.friction=0:1",
        "plate.restitution=0:1", "incoming.pulley_radius=0.05:0.3", "particle.mass=0.001:1",
        "gravity=1:20", "outgoing.speed=-3:3", "outgoing.restitution=0:0.9",
    ]  # fmt: skip
    scene = load("perpendicular", ["run.until=settled", "run.max_time=5.0"])
    block = block_of(scene, ranges, sample=60, seed=seed)
    singles = swept_block(block, apart=True)
    found = swept_block(block)
    assert_same(found, singles)
    assert np.isfinite(found["landing.x.mean"]).sum() > 10


def test_a_batch_does_not_run_its_variants_one_by_one(monkeypatch):
    def never(*_):
        raise AssertionError("ran alone")

    monkeypatch.setattr("chutelab.studies.sweep.plan.alone", never)
    swept = sweep(load("perpendicular"), ["plate.angle_deg=-10:10:50", "incoming.speed=0.5,2,4"])
    assert np.isfinite(swept.columns["landing.x.mean"]).sum() > 100


@pytest.mark.parametrize("leaves", [False, True])
def test_a_batch_keeps_the_ends_of_tracks_and_nothing_once_it_is_read(leaves):
    """Of what misses the belt also the places of events, from which rides are far."""
    scene = load("spoon", ["stream.count=3", *["outgoing.start=3"] * leaves])
    found = runs(block := block_of(scene, ["incoming.speed=1.98,2.0"]))
    _, batch = next(found)
    alone = [recording for _, recording in runs(block, apart=True)]
    for n, track in enumerate(map(batch.track, range(6))):
        whole, events = alone[n // 3].track(n % 3), alone[n // 3].events
        places = events["position"][events["particle"] == n % 3]
        near = np.hypot(*(whole["position"][:, None] - places).T).min(axis=0) < 1e-4
        assert 4 * near.sum() < len(whole)
        near[1:-1] &= leaves
        for name in ("t", "position", "velocity", "entries"):
            assert track[name] == pytest.approx(whole[name][near], rel=1e-12, abs=1e-14)
    assert next(found, None) is None
    with pytest.raises(AttributeError):
        batch.track(0)


@pytest.mark.parametrize("sunk", [0.0, 1e-5])
def test_a_batch_is_judged_inside_its_rides_before_their_knots_are_dropped(sunk):
    """For the laws the middle of the spoon, where rides neither begin nor end, is too narrow."""
    built = build(Family(load("spoon", "stream.count=1"), {"incoming.speed": np.array([2.0])}, 1))
    core, recorder = Module(), Recorder(built, apart=True)
    exact.fill(core, built, 0.0, apart=True)
    core.run("follow_and_judge", 1, -2)
    pieces = core.array("barriers", dtype("Barrier"), 10, of="Laws")
    (spoon,) = (row for row in pieces[:5] if row["radius"] == 0.5)
    spoon["begin"] += 0.6
    spoon["extent"] -= 1.2
    spoon["radius"] -= sunk
    exact.follow(core, recorder, None)
    # What stands out is run again with all its knots, and by the machine itself it keeps all laws.
    assert core.structs["Exact"].brief == (sunk == 0.0)
    record = exact.ended(core, recorder, None)
    assert (len(record.knots) > 15) == (sunk > 0.0)
    assert Recording.of(record).laws == ()


@pytest.mark.slow
@pytest.mark.parametrize(("scene", "key", "low", "high"), [
    (load("spoon", "stream.count=1"), "surface.spoon.center[0]", 1.0, 1.1),
    (load("slip"), "incoming.friction", 0.3, 0.9),
])  # fmt: skip
def test_ten_thousand_variants_of_a_lone_scene_take_two_seconds(scene, key, low, high):
    """Of one processor; 0.4 to 0.6 s were measured."""
    values = np.linspace(low, high, 10_000)
    begun = process_time()
    found = sweep(scene, {key: values})
    assert process_time() - begun < 2.0
    assert np.isfinite(found.columns["landing.x.mean"]).mean() > 0.9


def test_surfaces_may_join_in_some_variants_only():
    scene = parse(JOINED)
    block = block_of(scene, ["outgoing.drop=0.3,0.5,0.6", "surface.ramp.friction=0:0.4:3"])
    found = swept_block(block)
    singles = swept_block(block, apart=True)
    assert_same(found, singles)
    # Across the joint the particle slides onto the belt; beside it, it falls onto or under it.
    assert len(np.unique(found["landing.vy.mean"][[0, 3, 6]].round(6))) > 1


def test_points_and_disks_by_several_run_at_once():
    """Disks meet the end of a ledge, which a point beside it misses."""
    ledge = """
[[surface]]
name = "ledge"
from = [0.0, 0.0]
to = [1.0, 0.0]
[stream]
at = [-0.004, 0.5]
velocity = [0.0, 0.0]
interact = false
count = 4
[run]
until = 2.0
"""
    block = block_of(parse(ledge), ["particle.radius=0,0.01,0.02,0"])
    ((which, _),) = runs(block)
    assert len(which) == 4
    found = swept_block(block)
    assert_same(found, swept_block(block, apart=True))
    assert found[TOUCHES].tolist() == ["nothing", "ledge", "ledge", "nothing"]


def test_machines_that_differ_in_speeds_alone_keep_their_own():
    values = ["incoming.speed=1.4,1.4,2.0", "surface.ramp.speed=0.0,0.3"]
    block = block_of(parse(JOINED), values)
    assert_same(swept_block(block), swept_block(block, apart=True))


SEVERAL = """
gravity = 9.81
[[surface]]
name = "ramp"
from = [-1.0, 1.0]
to = [0.0, 0.5]
friction = 0.1
restitution = 0.3
[[surface]]
name = "flat"
from = [0.0, 0.5]
to = [0.5, 0.5]
friction = 0.2
[[surface]]
name = "bowl"
center = [0.9, 0.2]
radius = 0.5
from_deg = 180
to_deg = 300
restitution = 0.4
friction = 0.3
[[surface]]
name = "belt"
from = [-1, -1]
to = [4, -1.1]
speed = 1.5
friction = 0.4
restitution = 0.2
[particle]
radius = 0.01
[stream]
count = 4
rate = 5
at = [-0.9, 1.2]
to = [-0.5, 1.2]
velocity = [0.5, 0.0]
[run]
until = 3.0
"""


STRAIGHT_ON = SEVERAL.replace(
    "from = [0.0, 0.5]\nto = [0.5, 0.5]", "points = [[0.0, 0.5], [0.2, 0.4], [0.2, 0.8]]"
).replace("restitution = 0.3", "restitution = 0.0")
"""It slides on to the second surface without a blow, then against its wall."""


@pytest.mark.parametrize(
    "scene", [SEVERAL, STRAIGHT_ON, SEVERAL.replace("radius = 0.01", "radius = 0")]
)
@pytest.mark.parametrize("key", [
    "surface.ramp.restitution=0:0.6:4", "surface.flat.friction=0:0.5:4",
    "surface.bowl.friction=0:1:4", "surface.bowl.restitution=0:0.5:4",
    "surface.belt.speed=0:3:4", "surface.belt.friction=0.1,0.2,0.2,0.4",
])  # fmt: skip
@pytest.mark.parametrize("gate", ["", "opens_at = 0.9"])
def test_what_members_share_is_to_the_bit_what_each_has_alone(scene, key, gate):
    """A member alone shares nothing: the paths up to where members differ are its own."""
    scene = scene.replace('name = "flat"', f'name = "flat"\n{gate}')
    block = block_of(parse(scene), [key])

    def told(block):
        ((books, *columns),) = (
            (one.by_surface.copy(), *(one.events[name].tolist() for name in EVENT.names))
            for _, one in runs(block)
        )
        return books.reshape(len(block.values), -1).tolist(), [*zip(*columns, strict=True)]

    assert EVENT.names[1] == "particle"
    books, events = told(block)
    for row in range(4):
        (alone,), own = told(replace(block, values=block.values[[row]]))
        assert alone == books[row]
        own = [(t, particle + 4 * row, *rest) for t, particle, *rest in own]
        assert own == [event for event in events if event[1] // 4 == row]


@pytest.mark.parametrize(("radius", "friction"), [(0.006, "0.1,0.9"), (3e-5, "0.3,0.5")])
def test_rides_of_a_family_are_judged_between_few_knots(radius, friction):
    """A cubic with the directions of an arc at its ends leaves it by h^6/27650 of the radius.

    That is 4e-10 at h = 0.15 rad, less than the laws overlook. A track that stood out would be run
    again with all its knots, which the family then keeps.
    """
    scene = load("spoon", f"particle.radius={radius}")
    block = block_of(scene, [f"surface.spoon.friction={friction}"])
    ((counts, ended),) = ((np.diff(one.offsets), one.ended_by("settled")) for _, one in runs(block))
    assert ended.any()
    assert set(counts[ended].tolist()) == {2}


def test_of_many_impacts_in_a_row_a_family_keeps_six():
    """Rows tell them from five at most; a run alone keeps all, and neither loses what follows."""
    block = block_of(parse(SEVERAL), ["surface.bowl.restitution=0.2,0.5"])
    (family,) = (one.events.copy() for _, one in runs(block))
    alone = [one for _, one in runs(block, apart=True)]
    for row, one in enumerate(alone):
        own, left, met = one.events, [], dict.fromkeys(range(4), (0, None))
        for event in own[np.lexsort((own["t"], own["particle"]))]:
            count, surface = met[event["particle"]]
            again = event["kind"] == Kind.IMPACT and event["surface"] == surface
            count = count + 1 if again else 1
            met[event["particle"]] = count, event["surface"] if event["kind"] == Kind.IMPACT else -2
            if count <= 6:
                left.append((event["t"], event["particle"] + 4 * row, event["kind"]))
        assert len(own) > len(left)
        mine = family[family["particle"] // 4 == row]
        times, *labels = zip(*left, strict=True)
        assert [mine["particle"].tolist(), mine["kind"].tolist()] == [*map(list, labels)]
        np.testing.assert_allclose(mine["t"], times, rtol=1e-15)


def test_one_that_the_exact_engine_cannot_follow_spoils_no_other(monkeypatch):
    # A spinning disk that a belt presses into a corner: pymunk follows it.
    corner = """
[particle]
spin = true
[[surface]]
name = "floor"
from = [-1.0, 0.0]
to = [1.0, 0.0]
[[surface]]
name = "wall"
from = [0.5, -0.1]
to = [0.5, 1.0]
[stream]
at = [0.3, 0.1]
velocity = [0.0, 0.0]
[run]
max_time = 2.0
"""
    block = block_of(parse(corner), ["surface.floor.speed=0:1:5", "surface.wall.restitution=0,0.3"])
    singles = swept_block(block, apart=True)
    refused = []

    @contextmanager
    def watched(machine):
        try:
            with lent(machine) as record:
                yield record
        except CornerError:
            refused.append(machine.count)
            raise

    monkeypatch.setattr("chutelab.studies.sweep.plan.lent", watched)
    assert_same(swept_block(block), singles)
    assert refused[0] == 10
    assert 1 <= refused.count(1) < 10


@pytest.mark.parametrize(
    "what", ["[[string]]\nfrom = [0.0, 0.5]\n", '[particle]\nshape = "box"\nsize = [0.04, 0.02]\n']
)
def test_what_the_exact_engine_does_not_have_runs_with_the_one_that_has(what):
    """On a string 0.3 m long it never comes to a floor 0.7 m below; a box turns as it bounces."""
    floor = '[[surface]]\nname = "floor"\nfrom = [-2.0, -0.2]\nto = [2.0, -0.2]\n'
    start = "[stream]\nat = [0.3, 0.5]\nvelocity = [0.0, 0.0]\n[run]\nuntil = 0.5\n"
    block = block_of(parse(what + floor + start), ["gravity=8,9.81"])
    found = swept_block(block)
    assert_same(found, swept_block(block, apart=True))
    assert set(found[TOUCHES]) == {"nothing" if "string" in what else "floor"}


# what a row holds --------------------------------------------------------------------------------


def test_a_stream_has_means_and_spreads():
    scene = load("stream-independent", ["stream.count=40", "stream.bed_height=0.05"])
    swept = sweep(scene, ["incoming.speed=1,2"])
    for row, speed in enumerate((1, 2)):
        recording = simulate(load("stream-independent", [
            "stream.count=40", "stream.bed_height=0.05", f"incoming.speed={speed}"
        ]))  # fmt: skip
        down = recording.first(recording.select(Kind.LANDING))
        x, vx = down["position"][:, 0], down["velocity_before"][:, 0]
        found = {name: swept.columns[name][row] for name in COLUMNS}
        assert found["landing.x.mean"] == pytest.approx(x.mean(), rel=1e-14, abs=0.0)
        assert found["landing.x.spread"] == pytest.approx(x.std(), rel=1e-12, abs=0.0)
        assert found["landing.vx.spread"] == pytest.approx(vx.std(), rel=1e-12, abs=1e-15)
        assert found["landing.t.mean"] == pytest.approx(down["t"].mean(), rel=1e-13, abs=0.0)
        work = ledger(recording).by_surface["outgoing"]["belt_work"]
        assert found[PAID] == pytest.approx(work, rel=1e-14, abs=0.0)
        power = work / 40 * scene.stream.rate
        assert found["ledger.power"] == pytest.approx(power, rel=1e-14, abs=0.0)
        assert found["misses"] == 40 - len(down)


def test_what_the_belt_pays_is_that_of_solve_and_theory_only_where_runs_go_on_until_no_slip():
    from chutelab.studies.design import value

    m, vb, vx, mu = 0.008, 2.0, -1.0, 0.5
    down = sqrt((9.81 * 0.29685) ** 2 + 2.0 * 9.81 * 0.5)
    landed = sweep(load("perpendicular"), ["plate.restitution=0.5"])
    settled = sweep(load("perpendicular", ["run.until=settled"]), ["plate.restitution=0.5"])
    assert landed.columns[PAID][0] == pytest.approx(m * vb * mu * down, rel=1e-12, abs=0.0)
    assert settled.columns[PAID][0] == pytest.approx(m * vb * (vb - vx), rel=1e-12, abs=0.0)
    assert settled.columns[HEAT][0] == pytest.approx(0.5 * m * (vb - vx) ** 2, rel=1e-12, abs=0.0)
    for column, name in ((PAID, "belt_work"), (HEAT, "slip_heat"), ("ledger.power", "power")):
        expected = value(load("perpendicular"), name)
        assert settled.columns[column][0] == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert "counted up to run.until" in str(landed)
    assert "counted up to run.until" not in str(settled)


def test_a_run_until_settled_that_never_is_says_so():
    scene = load("perpendicular", ["run.until=settled", "stream.count=2"])
    swept = sweep(scene, ["outgoing.friction=0,0.5"])
    assert swept.columns["misses"].tolist() == [0.0, 0.0]
    assert swept.columns[PAID][0] == 0.0
    slides, rides = swept.columns[REASON].tolist()
    assert "2 of 2 particles arrived, but never came to rest" in slides
    assert rides == ""
    assert sweep(load("perpendicular"), ["outgoing.friction=0"]).columns[REASON].tolist() == [""]


def test_a_variant_that_cannot_be_or_misses_is_a_row_with_its_reason():
    scene = load("perpendicular", ["outgoing.drop_from=top", "outgoing.start=0.3"])
    swept = sweep(scene, ["plate.restitution=0.5,2", "outgoing.drop=0.95,1.5,5"])
    reasons = swept.columns[REASON].tolist()
    assert reasons[0] == ""
    assert "it missed the outgoing belt: left the scene" in reasons
    assert all("plate.restitution = 2" in reason for reason in reasons[3:])
    assert all("must be a number from 0 to 1" in reason for reason in reasons[3:])
    assert np.isnan(swept.columns["landing.x.mean"][3:]).all()
    missed = reasons.index("it missed the outgoing belt: left the scene")
    assert swept.columns["misses"][missed] == 1.0
    assert np.isnan(swept.columns["landing.x.mean"][missed])
    assert swept.columns["ledger.restitution_loss"][missed] > 0.0


@pytest.mark.parametrize(("scene", "settings", "values"), [
    ("spoon", (), {"surface[0].from_deg": (180.0, 265.0, -95.0, -95.5, 265.0, 180.0)}),
    ("spoon", ("surface.spoon.to_deg=200",), {"surface[0].radius": (0.5, 1e-9, 0.4, 1e-9, 0.6)}),
    ("spoon", ("surface.spoon.opens_at=1",), {"surface[0].closes_at": (2.0, 1.0, 0.5, 1.0)}),
    ("spoon", ("run.until=1.5",), {"stream.start": (0, 1.5, 1.4, 2), "gravity": (9.8, 1, 0, 2)}),
    ("spoon", ("stream.width=0.014",), {"particle.radius": (0.004, 0.008, 0.007, 0.0, 0.003)}),
    ("spoon", (), {"plate.above": (0, 1, 0, 0), "plate.below": (0, 0, 1, 0)}),
    ("cascade", (), {"conveyor[0].to[0]": (1.2, -0.2, 1.0)}),
])  # fmt: skip
def test_variants_are_refused_as_their_scenes_are_by_the_rules_that_read_what_varies(
    scene, settings, values, monkeypatch
):
    base, told, cost = load(scene, settings), [], []
    judge, read, count = Judge(base, (*values,)), Row.__getitem__, []
    monkeypatch.setattr(Row, "__getitem__", lambda row, key: count.append(key) or read(row, key))
    for row in zip(*values.values(), strict=True):
        own = dict(zip(values, row, strict=True))
        count.clear()
        found = judge.finds(own)
        cost.append(len(count))
        try:
            base.with_values(own)
            told.append((found, False))
        except SceneError:
            told.append((found, True))
    assert all(found == is_faulty for found, is_faulty in told)
    assert {found for found, _ in told} == {False, True}
    # All rules once, then those alone that read a key that varies.
    assert max(cost[1:]) < 0.4 * cost[0], cost


def test_a_run_that_gets_stuck_is_a_row(monkeypatch):
    from chutelab.results.recorder import StalledError

    def stuck(*_args, **_options):
        raise StalledError(0, 1.0, (0.0, 0.5), "it hangs")

    monkeypatch.setattr("chutelab.studies.sweep.plan.judged", stuck)
    monkeypatch.setattr("chutelab.studies.sweep.plan.lent", stuck)
    reasons = sweep(load("perpendicular"), ["plate.restitution=0,1"]).columns[REASON]
    assert ["it hangs" in reason for reason in reasons] == [True, True]


# validating many at once -------------------------------------------------------------------------


DEPENDENT = """
perpendicular | | incoming.speed=1,3 incoming.pulley_radius=0.1,0.2 | outgoing.speed plate.pivot_height
perpendicular | outgoing.speed=1.5 | incoming.speed=1,3 | outgoing.speed
perpendicular | particle.density=2000 | particle.radius=0.004,0.01 | particle.mass
perpendicular | particle.material=coal | particle.radius=0.004,0.01 | particle.mass
perpendicular | stream.rate=120t/h stream.width=0.8 | particle.mass=0.01,0.02 particle.radius=0.004,0.01 | stream.rate
own | | material[0].density=900,1900 | particle.mass stream.rate
own | | material[0].restitution=0.1,0.3 | material[0].restitution_steel material[0].restitution_rubber
"""  # noqa: E501
"""A scene, what is set, what varies, and what follows from it."""


@pytest.mark.parametrize("line", DEPENDENT.strip().splitlines())
def test_a_family_has_the_numbers_that_each_of_its_scenes_has(line):
    name, settings, varies, keys = (part.split() for part in line.split("|"))
    scene = load("perpendicular" if name == ["own"] else name[0], settings)
    if name == ["own"]:
        scene = scene.with_values(
            {
                "material": [{"name": "own", "density": 1000, "restitution": 0.2, "friction": 0.3}],
                "particle": {"material": "own", "radius": 0.01},
                "stream": {"rate": "90 t/h"},
                "plate": {"distance": 0.3},
            }
        )
    columns = {vary.key: np.array(vary.values) for vary in varied(varies, ranges=False)}
    each = [scene.with_values({key: own[n] for key, own in columns.items()}) for n in range(2)]
    family = Family(each[0], columns)
    assert len(family) == 2
    for key in keys:
        expected = [value_at(one, key) for one in each]
        assert np.broadcast_to(family.at(key), 2).tolist() == expected
    pairs = [np.array([one.met(0, surface) for one in each]) for surface in scene.surfaces[1:]]
    for expected, surface in zip(pairs, scene.surfaces[1:], strict=True):
        for column, own in zip(expected.T, family.met(0, surface), strict=True):
            assert np.broadcast_to(own, 2).tolist() == column.tolist()
    assert np.broadcast_to(family.rate, 2).tolist() == [one.rate for one in each]


# what is refused before anything runs ------------------------------------------------------------


@pytest.mark.parametrize(
    ("varies", "allowed"),
    [
        (["plate.angel_deg=0:60:3"], "did you mean plate.angle_deg?"),
        (["hood.speed=1,2"], "unknown key"),
        (["surface.hood.speed=1,2"], "no [[surface]]"),
        (["plate.angle_deg=3:3:4"], "the range is empty"),
        (["plate.angle_deg=0:60:0"], "a whole number from 1"),
        (["plate.angle_deg=0:60"], "must be KEY=FROM:TO:COUNT"),
        (["plate.angle_deg=0:0.5mm:4"], "is in degrees, not in m"),
        (["plate.distance=10:50mm:3"], "one kind of unit"),
        (["plate.distance=1lightyear,2lightyear"], "is in m, not in lightyear"),
        (["plate.angle_deg=a,b"], "a is not a number"),
        (["plate.angle_deg=nan,1"], "nan is not a number"),
        (["title=1,2"], "only numbers can be varied"),
        (["stream.count=1.5,2"], "whole numbers only"),
        (["plate.angle_deg=0:1:1000000000000"], "from 1 to 10000"),
        (["plate.angle_deg=0:1:10000", "incoming.speed=1:2:10000"], "at most 1000000 are allowed"),
        (["plate.angle_deg=0,1", "plate.angle_deg=2,3"], "varied already"),
    ],
    ids=lambda value: value[0] if isinstance(value, list) else None,
)
def test_what_cannot_be_varied_is_refused_with_what_is_allowed(varies, allowed, monkeypatch):
    monkeypatch.setattr("chutelab.studies.sweep.swept", None)
    options = [option for vary in varies for option in ("--vary", vary)]
    result = call("sweep", "perpendicular", *options, "--out", "rows.csv", code=2)
    assert allowed in result.stderr
    assert varies[-1] in result.stderr
    assert result.stdout == ""
    assert not list(Path().iterdir())


@pytest.mark.parametrize(
    ("options", "allowed"),
    [
        (["--sample", "0"], "from 1 to 1000000"),
        (["--sample", "3", "--seed", "-1"], "a whole number from 0"),
        (["--out", "rows.txt"], ".csv or .parquet"),
        (
            ["--out", "nowhere/rows.csv"],
            "nowhere/rows.csv: cannot be written: there is no folder nowhere",
        ),
        (["--plot", "rows.csv"], ".png"),
        (["--plot", "rows.png", "--of", "height"], "landing.vx.mean"),
        (["--resume"], "--out"),
        (["--scheduler", "nobody"], "tcp://"),
    ],
    ids=" ".join,
)
def test_options_that_cannot_be_are_refused_before_anything_runs(options, allowed, monkeypatch):
    monkeypatch.setattr("chutelab.studies.sweep.swept", None)
    vary = "plate.angle_deg=0:10" if "--sample" in options else "plate.angle_deg=0,10"
    result = call("sweep", "perpendicular", "--vary", vary, *options, code=2)
    assert allowed in result.stderr
    assert not list(Path().iterdir())


# grids and samples -------------------------------------------------------------------------------


def test_the_last_key_of_a_grid_runs_fastest():
    swept = sweep(load("perpendicular"), {"incoming.speed": [2.0, 3.0], "plate.angle_deg": [0, 5]})
    assert swept.columns["incoming.speed"].tolist() == [2.0, 2.0, 3.0, 3.0]
    assert swept.columns["plate.angle_deg"].tolist() == [0.0, 5.0, 0.0, 5.0]
    assert swept.shape == (2, 2)
    with pytest.raises(ValueError, match="read-only"):
        swept.columns["landing.x.mean"][0] = 0.0


def test_a_latin_hypercube_has_one_sample_in_each_row_and_column():
    plan = planned(
        load("perpendicular"), ["plate.angle_deg=0:50", "incoming.speed=1:2"], sample=50, seed=3
    )
    shares = (plan.samples - [0.0, 1.0]) / [50.0, 1.0]
    for column in shares.T:
        assert sorted(np.floor(50 * column).tolist()) == list(range(50))
    again = planned(
        load("perpendicular"), ["plate.angle_deg=0:50", "incoming.speed=1:2"], sample=50, seed=3
    )
    assert again.samples.tobytes() == plan.samples.tobytes()


def test_sobol_points_fill_the_ranges_evenly():
    varies = ["plate.angle_deg=0:64", "incoming.speed=1:2"]
    plan = planned(load("perpendicular"), varies, sample=64, design="sobol")
    values = plan.samples
    # A scrambled (0, 6, 2)-net: one point in each strip of 1/64.
    assert sorted(np.floor(values[:, 0]).tolist()) == list(range(64))
    fewer = planned(load("perpendicular"), varies, sample=40, design="sobol")
    assert fewer.samples.tobytes() == values[:40].tobytes()


def test_whole_numbers_are_drawn_as_such_with_both_ends():
    plan = planned(load("stream-independent"), ["stream.seed=3:5"], sample=300)
    seeds, counts = np.unique(plan.samples, return_counts=True)
    assert seeds.tolist() == [3.0, 4.0, 5.0]
    assert counts.tolist() == [100, 100, 100]


def test_samples_need_ranges_and_grids_need_counts():
    scene = load("perpendicular")
    with pytest.raises(InputError, match="between two ends"):
        planned(scene, ["plate.angle_deg=1,2,3"], sample=4)
    with pytest.raises(InputError, match="between two ends, not from lists"):
        planned(scene, [Vary("plate.angle_deg", (1.0, 2.0))], sample=4)
    with pytest.raises(InputError, match="lhs, sobol"):
        planned(scene, ["plate.angle_deg=1:2"], sample=4, design="grid")
    with pytest.raises(InputError, match=str(MOST_VARIANTS)):
        planned(scene, ["plate.angle_deg=1:2"], sample=MOST_VARIANTS + 1)


# the command, the picture ------------------------------------------------------------------------


def test_the_command_prints_a_table_and_writes_files():
    varies = "--vary", "plate.angle_deg=0:30:4", "--vary", "plate.restitution=0,1"
    result = call("sweep", "perpendicular", *varies, "--out", "rows.csv", "--plot", "rows.png")
    assert "8 variants" in result.stdout
    assert "× outgoing.drop_from" in result.stdout
    assert {path.name for path in Path().iterdir()} == {"rows.csv", "rows.png"}
    assert Path("rows.png").read_bytes().startswith(b"\x89PNG")
    found = json.loads(
        call("sweep", "perpendicular", "--vary", "plate.angle_deg=0,80", "--json").stdout
    )
    assert found["variants"] == 2
    assert found["columns"]["landing.x.mean"][1] is None
    assert found["columns"]["landing.vx.mean"][0] == -1.0


PASSED = """
gravity = 9.81
[particle]
radius = 0.0
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.5
below = 0.45
[outgoing]
drop = 1.5
drop_from = "top"
length = 20.0
"""
"""A mass point falls ½ g (0.6 m / v)² up to the plate, which is 0.45 m long below the pivot."""


def passes(speed):
    return 0.5 * 9.81 * (0.6 / speed) ** 2 > 0.45


def test_a_row_says_what_is_touched():
    swept = sweep(parse(PASSED), ["incoming.speed=1.9:2.1:21"])
    missed = passes(swept.columns["incoming.speed"])
    assert 0 < missed.sum() < 21
    expected = np.where(missed, "outgoing", "plate, outgoing")
    assert swept.columns[TOUCHES].tolist() == expected.tolist()
    assert swept.columns["impact.count"].tolist() == (~missed).astype(float).tolist()
    assert f"{(~missed).sum()} touch plate, outgoing; {missed.sum()} touch outgoing" in repr(swept)


def test_bounces_in_a_row_are_one_touch_and_a_run_that_cannot_be_touches_nothing_known():
    swept = sweep(load("perpendicular"), ["plate.angle_deg=-45,0,89"])
    leaning, upright, refused = swept.columns[TOUCHES].tolist()
    hits = simulate(load("perpendicular", ["plate.angle_deg=-45"])).select(Kind.IMPACT)
    assert len(hits) > 1
    assert leaning == upright == "plate, outgoing"
    assert (refused, swept.columns[REASON][2] != "") == ("", True)


@pytest.mark.parametrize(("edge", "told"), [(0.975, "left"), (0.965, "left | right")])
def test_a_crowds_ways_are_told_from_a_fiftieth_on(edge, told):
    """Of 100 beside each other, 1 cm apart, 2 or 3 fall on the floor on the right."""
    floors = "".join(
        f'[[surface]]\nname = "{name}"\nfrom = [{low}, -0.5]\nto = [{high}, -0.5]\n'
        for name, low, high in (("left", -0.5, edge), ("right", edge, 1.5))
    )
    falling = "[stream]\ncount = 100\nat = [0.0, 0.0]\nto = [0.99, 0.0]\nvelocity = [0.0, 0.0]\n"
    particle, end = "[particle]\nradius = 0.001\n", "[run]\nuntil = 0.5\n"
    crowd = parse(particle + falling + floors + end)
    assert row_of(crowd)[TOUCHES].tolist() == [told]


def test_a_map_is_hatched_where_the_plate_is_missed():
    from chutelab.pictures.plots.studies import sweep_figure

    swept = sweep(parse(PASSED), ["incoming.speed=1.9:2.1:11", "plate.restitution=0:1:10"])
    figure = sweep_figure(swept, "landing.vx.mean")
    figure.write("map.svg")
    ax = figure.axes[0]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["never meets the plate"]
    (hatched,) = (one for one in ax.collections if getattr(one, "hatches", [None])[0])
    points = np.column_stack([swept.columns["incoming.speed"], swept.columns["plate.restitution"]])
    inside = hatched.get_paths()[0].contains_points(points)
    assert inside.tolist() == passes(points[:, 0]).tolist()


def test_of_what_comes_down_on_the_pulley_again_all_say_what_holds_until_then():
    """Thrown up at 60° with v² < g (R + r)/cos 60°: it leaves where the belt ends, at its speed."""
    given = load("perpendicular", ["incoming.incline_deg=60", "incoming.length=0.5"])
    speeds = [0.8, 1.2, 1.391]
    swept = sweep(given, [f"incoming.speed={','.join(map(str, speeds))}"])
    for speed, told in zip(speeds, swept.columns["error.max"], strict=True):
        found = compare(simulate(given, {"incoming.speed": speed}))
        assert list(found.errors) == ["phi1", "v1"]
        assert found.theory["phi1"] == pytest.approx(-np.pi / 3.0, rel=1e-14)
        assert found.theory["v1"] == pytest.approx(speed, rel=1e-14)
        assert told == pytest.approx(found.max, abs=1e-15)
        assert found.max < 1e-14
        words = " ".join(str(found).split())
        assert "from here on; early contact: pulley: the flight comes down on it again" in words


@pytest.mark.parametrize("count", [3, 9], ids=["lines", "map"])
def test_a_picture_is_legible_and_says_up_to_when_it_counts(count):
    from chutelab.pictures.plots.studies import sweep_figure

    vary = ["plate.angle_deg=-20:40:9", f"incoming.speed=2:4:{count}"]
    for until, told in (("landed", "up to the landing"), ("settled", "until nothing slips")):
        swept = sweep(load("perpendicular", [f"run.until={until}"]), vary)
        for column in (PAID, "landing.vx.mean"):
            figure = sweep_figure(swept, column)
            figure.canvas.draw()
            assert_legible(figure, 1.0)
            labels = " ".join(ax.get_ylabel() for ax in figure.axes).replace("\n", " ")
            assert (told in labels) is (column == PAID)


@pytest.mark.parametrize(
    ("column", "says"),
    [("ledger.power", "times the rate"), ("loads.plate.normal.peak", "plate, largest of a bin, N")],
)
def test_an_axis_says_all_of_what_a_column_is(column, says):
    from chutelab.pictures.plots.studies import sweep_figure

    swept = sweep(load("stream", ["stream.count=5", "run.loads=0.01"]), ["plate.angle_deg=0,5"])
    figure = sweep_figure(swept, column)
    figure.canvas.draw()
    assert_legible(figure, 1.0)
    assert says in figure.axes[0].get_ylabel().replace("\n", " ")


def test_help_names_the_columns():
    said = " ".join(call("sweep", "--help").stdout.split())
    for name, row in COLUMNS.items():
        assert f"{name} {with_unit(row.meaning, row.unit)}" in said


def test_a_frame_has_the_columns():
    pytest.importorskip("pandas")
    swept = sweep(load("perpendicular"), ["plate.angle_deg=0,10"])
    frame = swept.frame()
    assert list(frame.columns) == list(swept.columns)
    assert frame["landing.vx.mean"].tolist() == swept.columns["landing.vx.mean"].tolist()
