"""Every law is kept by a run as it is, and broken by one with a number in it moved."""

from dataclasses import replace
from itertools import combinations
from math import nan

import numpy as np
import pytest

import crowds
from chutelab import machine
from chutelab.checks import stress as laws
from chutelab.checks.stress import Evidence, Verdict, barriers, judge
from chutelab.engines import contact
from chutelab.results import Kind, Recording
from references import surface_depths
from stress.case import TRANSFER, merged, scene_of, surface, thrown
from stress.runs import FLOOR, HOP, PAIR, adder, evidence


def teller(law, name, row, field, amount, tables=HOP):
    """What a law says of a run as it is, and of one with a number in it moved."""
    return law(evidence(tables)), law(evidence(tables, **{name: adder(field, row, amount)}))


@pytest.mark.parametrize(
    ("law", "name", "field", "row", "amount", "figure"),
    [
        (laws.finite, "knots", "velocity", 1, nan, None),
        (laws.finite, "knots", "omega", 1, nan, None),
        (laws.finite, "events", "normal_impulse", 1, nan, None),
        (laws.finite, "events", "t", 1, nan, None),
        (laws.ordered, "knots", "t", 1, -1.0, None),
        (laws.lasting, "knots", "t", -1, -1e-9, 1e-9),
        (barriers.depth, "knots", "position", 1, [0.0, -1e-8], 1e-8),
        (laws.residual, "knots", "velocity", -1, [0.0, 1e-4], None),
        (laws.residual, "knots", "entries", -1, [0, 0, 1e-11], None),
    ],
)
def test_a_number_that_is_moved_breaks_its_law(law, name, field, row, amount, figure):
    good, bad = teller(law, name, row, field, amount)
    assert good.holds
    assert not bad.holds
    assert figure is None or bad.figure == pytest.approx(figure, rel=1e-3)


def test_loads_that_are_off_by_a_hundred_millionth_are_told():
    borne = merged(HOP, {"run": {"loads": 0.1}})
    size = float(np.abs(evidence(borne).recording.impulses["force"]).sum())
    # The figure is a share of these and of m |v| at the start, which is less.
    good, bad = (
        laws.loads(evidence(borne, impulses=adder("force", 4, off * size))) for off in (0.0, 1e-8)
    )
    assert good.holds
    assert 4e-9 < bad.figure <= 1e-8
    assert not bad.holds


def test_a_particle_without_a_track_is_lost():
    def forget(offsets):
        offsets[1] = 0

    assert laws.released(evidence()).holds
    assert laws.released(evidence(offsets=forget)).figure == 1


def test_what_starts_in_a_surface_may_stay_but_not_sink():
    lying = merged(HOP, {"stream": {"at": [0.0, 0.004], "velocity": [0.1, 0.0], "count": 1}})

    def sink(knots):
        knots["position"][:, 1] -= 1e-3

    def sink_on(knots):
        knots["position"][:, 1] -= 1e-3
        knots["position"][-1, 1] -= 1e-6

    assert barriers.depth(evidence(lying, knots=sink)).holds
    assert barriers.depth(evidence(lying, knots=sink_on)).figure == pytest.approx(1e-6, rel=1e-6)


def test_the_pulley_is_a_surface_too():
    tables = {
        "incoming": {"speed": 0.5, "pulley_radius": 0.1, "length": 0.1},
        "run": {"until": 0.4},
    }
    assert barriers.depth(evidence(tables)).holds

    def inside(knots):
        on_top = np.argmax(knots["position"][:, 0] > 0.0)
        knots["position"][on_top] *= 0.99

    bad = barriers.depth(evidence(tables, knots=inside))
    assert not bad.holds
    assert "pulley" in bad.detail


@pytest.mark.parametrize("place", [0.3, 0.999])
def test_a_centre_on_the_other_side_went_through(place):
    wall = surface("wall", (1.0, 0.0), (1.0, 1.0))
    flight = {
        "gravity": 0.0,
        "particle": {"radius": 0.0},
        "surface": [wall],
        **thrown((0.0, place), (1.0, 0.0)),
        "run": {"until": 0.5},
    }

    def jump(knots):
        knots["position"][-1, 0] = 1.5
        knots["velocity"][-1] = knots["velocity"][0] = [3.0, 0.0]

    assert barriers.nothing_through(evidence(flight)).holds
    bad = barriers.nothing_through(evidence(flight, knots=jump))
    assert bad.figure == 1
    assert "particle 0 through wall" in bad.detail
    past = merged(flight, {"stream": {"at": [0.0, 1.0 + place]}})
    assert barriers.nothing_through(evidence(past, knots=jump)).holds


def test_a_passage_there_and_back_within_one_interval_is_seen():
    # A flight of one interval whose middle lies beyond the ceiling.
    ceiling = surface("ceiling", (-1.0, 0.3), (2.0, 0.3))
    thrown_up = {**thrown((0.0, 0.0), (0.5, 2.0)), "run": {"until": 0.4}}
    hidden = merged(thrown_up, {"surface": [surface("away", (5.0, 0.5), (6.0, 0.5))]})
    recording = evidence(hidden).recording
    built = machine.build(scene_of({**thrown_up, "surface": [ceiling]}, "test", "exact", None))
    assert np.count_nonzero(np.abs(recording.knots["position"][:, 1]) < 0.02) == 2
    under = replace(recording, knots=recording.knots.copy())
    assert barriers.nothing_through(Evidence(replace(under, machine=built))).holds
    up = recording.knots.copy()
    up["velocity"][:, 1] *= 2.0
    over = Evidence(replace(recording, machine=built, knots=up))
    assert barriers.nothing_through(over).figure == 2
    first, *_ = over.recording.laws
    assert first.law == "nothing through a surface"


def test_energy_from_nothing_is_seen():
    good, bad = teller(laws.energy, "knots", 3, "velocity", [0.0, -1e-9])
    assert good.holds
    # ½ m ((v + δ)² - v²) of what is in play.
    v = -evidence().recording.knots["velocity"][3, 1]
    assert bad.figure == pytest.approx(0.008 * v * 1e-9 / evidence().bounds.energy, rel=0.05)
    assert not bad.holds


def test_a_belt_may_raise_energy_only_by_its_work():
    belt = merged(HOP, {"surface": [{**FLOOR, "speed": 3.0}]})

    def unpaid(knots):
        knots["entries"][:, 0] *= 0.4  # half of it is heat

    assert np.ptp(evidence(belt).recording.knots["entries"][:, 0]) > 1e-3
    assert laws.energy(evidence(belt)).holds
    assert not laws.energy(evidence(belt, knots=unpaid)).holds


def crowd(**changes):
    return evidence(PAIR, "contact", 1e-3, **changes)


@pytest.mark.parametrize("law", [laws.momentum, laws.spin, laws.energy])
def test_one_faster_particle_breaks_the_laws_of_a_crowd(law):
    def push(knots):
        knots["velocity"][-1] *= 2.0

    assert law(crowd()).holds
    assert not law(crowd(knots=push)).holds


def may_open(recording, t):
    """Σ M / 0.012 (p δ / dt)², over disks and surfaces at a time: J, of docs/physics.md."""
    m, found = recording.machine, []
    (x,), _ = recording.at([t])
    there = np.flatnonzero(np.isfinite(x[:, 0]))
    x, r = x[there], np.broadcast_to(m.particle.radius, recording.count)[there]
    for i, j in combinations(range(len(x)), 2):
        found.append((r[i] + r[j] - np.hypot(*(x[i] - x[j])), min(r[i], r[j])))
    for depths in surface_depths(m, x, r, t):
        found += zip(depths, r, strict=True)
    depth, least = np.array([one for one in found if one[0] > 0.0]).reshape(-1, 2).T
    beyond = np.maximum(depth / least - 5e-4, 0.0)
    part = np.minimum(np.clip(depth / least / 0.03, 0.1, 1.0) * beyond, 0.01) * least
    return np.max(m.particle.mass) / 0.012 * float(((part / m.dt) ** 2).sum())


def test_removed_overlaps_may_give_a_crowd_energy_up_to_their_bound_in_each_step():
    """60 disks without gravity: at one step removed overlaps give 7e-4 of the energy."""
    recording = Recording.of(contact.run(crowds.crowd(220, count=60)[1]))
    assert recording.gravity == 0.0
    good = laws.energy(Evidence(recording))
    assert good.holds
    assert good.bound <= 1e-9
    totals, turned = recording.totals, Evidence(recording).bounds.energy
    lost = totals["entries"][:, 1:].sum(axis=1)  # without gravity and drives: what was taken
    given = -np.diff(lost)
    k = int(np.argmax(given))
    most = max(may_open(recording, t) for t in totals["t"][k : k + 2])
    assert 1e-4 * turned < given[k] < most
    assert not any(may_open(recording, t) for t in totals["t"][:2])
    for step, room in ((k, most - given[k]), (0, 0.0)):
        for share, holds in ((-1e-9, True), (3e-9, False)):
            more = totals.copy()
            more["kinetic"][step + 1 :] += room + share * turned
            verdict = laws.energy(Evidence(replace(recording, totals=more)))
            assert verdict.holds == holds


def test_a_crowd_may_get_back_as_much_as_in_every_run():
    """With gravity: 5 % of a radius for each particle's weight, and 1 % of the energy in play."""
    recording = Recording.of(contact.run(crowds.crowd(37, count=60)[1]))
    lost = recording.totals["entries"][:, 1:].sum(axis=1)  # by the ledger, what energy fell by
    m, turned = recording.machine.particle, Evidence(recording).bounds.energy
    weight = recording.gravity * np.broadcast_to(m.mass, recording.count).sum()
    most = 0.05 * weight * np.max(m.radius) + 0.01 * turned
    k = len(lost) // 2
    for share, holds in ((0.99, True), (1.01, False)):
        more = recording.totals.copy()
        more["kinetic"][k] += share * most - (lost[:k].max() - lost[k])
        verdict = laws.energy(Evidence(replace(recording, totals=more)))
        assert verdict.figure == pytest.approx(share * most / turned, rel=1e-6)
        assert verdict.holds == holds


def test_a_turn_more_breaks_angular_momentum_only():
    change = adder("omega", -1, 400.0)
    assert not laws.spin(crowd(knots=change)).holds
    assert laws.momentum(crowd(knots=change)).holds


def test_two_in_one_place_overlap():
    def together(knots):
        half = len(knots) // 2
        knots["position"][half:] = knots["position"][half - 1] + [0.001, 0.0]
        knots["position"][:half] = knots["position"][half - 1]
        knots["velocity"] = 0.0

    good, bad = barriers.overlap(crowd()), barriers.overlap(crowd(knots=together))
    assert good.holds
    assert bad.figure == pytest.approx(0.039, rel=1e-9)
    assert not bad.holds


def test_no_disk_stays_in_another_for_longer_than_a_step():
    """Two disks of 2 cm, 4 mm deep in each other from the middle on: 0.2 r, and more than 5 %."""

    def still(knots):
        knots["velocity"] = 0.0
        half = len(knots) // 2
        knots["position"][:half] = knots["position"][half - 1]
        knots["position"][half:] = knots["position"][half - 1] + [0.036, 0.0]

    good, bad = barriers.pressed(crowd()), barriers.pressed(crowd(knots=still))
    assert good.holds
    assert bad.figure == pytest.approx(0.2, rel=1e-9)
    assert not bad.holds


def test_slow_disks_whose_centres_come_within_a_radius_went_through_each_other():
    """One at rest, one that passes 15 mm from its centre at 1 m/s: a 20th of the radius a step."""

    def ghosts(knots):
        half = len(knots) // 2
        first, second = knots[:half], knots[half:]
        first["velocity"], second["velocity"] = [0.0, 0.0], [1.0, 0.0]
        first["position"] = [1.0, 0.0]
        second["position"][:, 0] = 0.5 + second["t"] - second["t"][0]
        second["position"][:, 1] = 0.015

    good, bad = (barriers.nothing_through_another(e) for e in (crowd(), crowd(knots=ghosts)))
    assert (good.figure, good.bound) == (0, 0.0)
    assert bad.figure == 1
    assert "0 and 1" in bad.detail


def test_a_bounce_beside_the_surface_is_off_nothing():
    """An impact 1 nm above the floor, or one that names another surface."""
    hits = np.flatnonzero(evidence().recording.events["kind"] == Kind.IMPACT)
    good, bad = teller(barriers.on_something, "events", hits[0], "position", [0.0, 1e-9])
    assert good.holds
    assert bad.figure == pytest.approx(1e-9, rel=1e-3)
    assert not bad.holds
    assert "off floor" in bad.detail
    wall = merged(HOP, {"surface": [FLOOR, surface("wall", (2.0, 0.0), (2.0, 1.0))]})
    hits = np.flatnonzero(evidence(wall).recording.events["kind"] == Kind.IMPACT)
    other = barriers.on_something(evidence(wall, events=adder("surface", hits[0], 1)))
    assert other.figure > 1.0


def test_a_collision_with_one_that_is_elsewhere_is_off_nothing():
    (hit,) = crowd().recording.select(Kind.COLLISION)
    row = np.flatnonzero(crowd().recording.events["kind"] == Kind.COLLISION)[0]
    good = barriers.on_something(crowd())
    away = hit["position"] - crowd().recording.at([hit["t"]])[0][0][hit["other"]]
    bad = barriers.on_something(crowd(events=adder("position", row, 0.2 * away)))
    assert good.holds
    # 20 % farther from its partner than two radii of 2 cm.
    assert bad.figure == pytest.approx(0.2 * 0.04, rel=1e-3)
    assert not bad.holds


TURNING = {
    "surface": [surface("paddle", (-0.5, 0.0), (0.5, 0.0)) | {"pivot": [0.0, 0.0], "turn": -90.0}],
    **thrown((0.3, 0.3), (0.0, -1.0)),
    "particle": {"radius": 0.01},
    "run": {"until": 0.22},
}
"""A ball falls on a paddle that turns."""


def test_a_bounce_off_what_moves_is_looked_for_where_it_is_by_then():
    """Until the bounce the paddle has turned by 90 degrees a second."""
    e = evidence(TURNING, "contact", 1e-3)
    (hit,) = e.recording.select(Kind.IMPACT)
    good = barriers.on_something(e)
    still = replace(e.machine, movers=())
    bad = barriers.on_something(Evidence(replace(e.recording, machine=still)))
    assert good.holds
    # Seen from where it was at the start, the ball is its height above, less its radius.
    assert bad.figure == pytest.approx(abs(abs(hit["position"][1]) - 0.01), rel=1e-9)
    assert abs(hit["position"][1]) > 0.05
    assert not bad.holds


BOXES = {
    "particle": [{"name": "box", "shape": "box", "size": [0.02, 0.06], "mass": 0.1}],
    "surface": [FLOOR],
    "stream": [
        {"at": [0.0, 0.03], "velocity": [0.5, 0.0], "interact": True},
        {"at": [0.04, 0.03], "velocity": [0.0, 0.0], "interact": True},
    ],
    "run": {"until": 0.3, "engine": "contact"},
}  # fmt: skip
"""One box slides against another: 0.02 m lie between them, and each reaches 0.03 m up and down."""


def test_boxes_meet_by_their_outlines():
    """A circle of 0.01 m inside each would meet elsewhere, and lie 0.02 m above the floor."""
    e = evidence(BOXES, "contact", 1e-3)
    (first, *_) = np.flatnonzero(e.recording.events["kind"] == Kind.COLLISION)
    good = barriers.on_something(e)
    assert good.holds
    away = adder("position", first, [-0.01, 0.0])
    bad = barriers.on_something(evidence(BOXES, "contact", 1e-3, events=away))
    assert bad.figure == pytest.approx(0.01, abs=good.bound)
    assert not bad.holds


def test_a_hinge_whose_energy_is_not_its_own_breaks_a_law_of_every_run():
    flap = surface("flap", (0.0, 0.0), (0.3, 0.0)) | {"hinge": [0.0, 0.0], "mass": 0.2}
    tables = {**TURNING, "surface": [flap]}
    assert laws.of_every_run(evidence(tables, "contact", 1e-3)).holds
    bad = laws.of_every_run(evidence(tables, "contact", 1e-3, swings=adder("rate", -1, 5.0)))
    assert bad.figure == 1
    assert "flap" in bad.detail


def test_one_released_in_another_or_in_a_surface_has_no_room():
    starts = np.flatnonzero(crowd().recording.events["kind"] == Kind.RELEASE)
    there = crowd().recording.at([crowd().recording.events["t"][starts[1]]])[0][0][0]
    here = crowd().recording.events["position"][starts[1]]

    def inside(events):
        events["position"][starts[1]] += (1.0 - 0.03 / np.hypot(*(there - here))) * (there - here)

    assert barriers.released_free(crowd()).holds
    bad = barriers.released_free(crowd(events=inside))
    assert bad.figure == pytest.approx(0.01, rel=1e-9)
    assert "particle 1 in 0" in bad.detail
    good, low = teller(barriers.released_free, "events", 0, "position", [0.0, -0.297])
    assert good.holds
    assert low.figure == pytest.approx(0.001, rel=1e-9)
    assert "in floor" in low.detail


def test_what_rides_on_a_belt_that_will_throw_it_has_not_settled():
    """Of the surfaces that move, only the outgoing belt is one to settle on."""
    lying = merged(HOP, {
        "surface": [{**FLOOR, "speed": 0.0}],
        "stream": {"at": [0.0, 0.004], "velocity": [0.1, 0.0], "count": 1},
        "run": {"until": "settled"},
    })  # fmt: skip
    assert barriers.settled_to_stay(evidence()) is None
    e = evidence(lying)
    assert barriers.settled_to_stay(e).holds
    moving = scene_of(merged(lying, {"surface": [{**FLOOR, "speed": 1.0}]}), "test", "exact", None)
    bad = barriers.settled_to_stay(Evidence(replace(e.recording, machine=machine.build(moving))))
    assert bad.figure == 1
    assert "0 on floor" in bad.detail
    carried = evidence(merged(TRANSFER, {"run": {"until": "settled"}}))
    assert carried.machine.segments.speed[-1] != 0.0
    assert barriers.settled_to_stay(carried).holds


def test_fast_disks_in_steps_all_alike_are_promised_no_surface():
    """A disk that goes farther than its radius in a step may cross a surface unseen."""
    slow, fast = (evidence(PAIR, "pymunk", dt) for dt in (1e-3, 0.1))
    radii = np.hypot(*fast.recording.knots["velocity"].T).max() * 0.1 / 0.02
    assert laws.unseen(slow) == ""
    assert laws.unseen(fast).startswith(f"up to {radii:.2g} radii in a step")
    assert laws.unseen(evidence(PAIR, "contact", 0.1)) == ""
    assert laws.unseen(evidence(HOP, "pymunk", 0.1)) == ""
    assert laws.unseen(evidence(HOP, "fixed", 0.1)).startswith("up to ")


def test_only_what_such_disks_may_break_is_not_promised(monkeypatch):
    for name in ("nothing through", "ledger closes"):
        monkeypatch.setitem(laws.LAWS, name, lambda e: Verdict(1.0, 0.0))
    found = {one.law: one for one in judge(evidence(PAIR, "pymunk", 0.1))}
    assert not found["nothing through"].broken
    assert "radii in a step" in found["nothing through"].unpromised
    assert found["ledger closes"].broken
    kept = {one.law: one for one in judge(evidence(PAIR, "pymunk", 1e-3))}
    assert kept["nothing through"].broken
