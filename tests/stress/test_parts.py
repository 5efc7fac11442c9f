"""The laws on arcs, gates, several sizes and pairs: kept by a run, broken by one that is spoilt."""

from math import cos, hypot, radians, sin, sqrt

import numpy as np
import pytest

from chutelab.checks import stress as laws
from chutelab.checks.stress import barriers
from chutelab.results import Kind
from stress.case import merged, surface, thrown
from stress.runs import FLOOR, HOP, evidence

R, RIM = 0.01, 0.1
BOWL = {"name": "bowl", "center": [0.0, 0.0], "radius": RIM, "from_deg": 180.0, "to_deg": 360.0,
        "restitution": 0.5, "friction": 0.0}  # fmt: skip
DISK = {"particle": {"radius": R}}
INSIDE = {**DISK, "surface": [BOWL], **thrown((0.03, 0.0), (0.0, 0.0)), "run": {"until": 0.3}}
PEG = {**BOWL, "name": "peg", "to_deg": 540.0}
OUTSIDE = {**DISK, "surface": [PEG], **thrown((0.03, 0.2), (0.0, 0.0)), "run": {"until": 0.15}}


def knot_at_blow(e):
    """Number of the first knot at the time of the first blow."""
    (hit, *_) = e.recording.select(Kind.IMPACT)
    return int(np.argmax(e.recording.knots["t"] == hit["t"]))


@pytest.mark.parametrize(("tables", "side"), [(INSIDE, 1.0), (OUTSIDE, -1.0)])
def test_a_hair_deeper_in_an_arc_is_too_deep(tables, side):
    """Moved by 10 nm along the radius, outward on the inside and inward on the outside."""
    whole = evidence(tables)
    row = knot_at_blow(whole)

    def sink(knots):
        place = knots["position"][row]
        # On the rim the centre is R -+ r from the arc's centre.
        assert hypot(*place) == pytest.approx(RIM - side * R, abs=1e-12)
        knots["position"][row] += side * 1e-8 * place / hypot(*place)

    assert barriers.depth(whole).holds
    bad = barriers.depth(evidence(tables, knots=sink))
    assert bad.figure == pytest.approx(1e-8, rel=1e-2)
    assert not bad.holds


@pytest.mark.parametrize(("degrees", "through"), [(270.0, 1), (181.0, 1), (179.0, 0), (90.0, 0)])
def test_an_arc_is_passed_between_its_ends_only(degrees, through):
    """Straight out from the centre of a half circle below, at several angles."""
    direction = np.array([cos(radians(degrees)), sin(radians(degrees))])
    still = merged(INSIDE, {"gravity": 0.0, "run": {"until": 1.0}})

    def out(knots):
        knots["position"] = [0.0, 0.0]
        knots["position"][-1] = 2.0 * RIM * direction
        knots["velocity"] = 2.0 * RIM * direction

    assert barriers.nothing_through(evidence(still)).figure == 0
    bad = barriers.nothing_through(evidence(still, knots=out))
    assert bad.figure == through
    assert not through or "particle 0 through bowl" in bad.detail


def test_the_end_of_an_arc_is_a_point():
    """A disk that falls on the end at (-R, 0) lies (x + R, y) from it."""
    on_end = merged(INSIDE, {"stream": {"at": [-RIM - 0.004, 0.1]}})
    whole = evidence(on_end)
    (hit, *_) = whole.recording.select(Kind.IMPACT)
    x, y = hit["position"]
    assert hypot(x + RIM, y) == pytest.approx(R, abs=1e-12)
    assert barriers.on_something(whole).holds
    row = int(np.argmax(whole.recording.events["t"] == hit["t"]))

    def off(events):
        events["position"][row] += [-1e-6 * (x + RIM) / R, -1e-6 * y / R]

    bad = barriers.on_something(evidence(on_end, events=off))
    assert bad.figure == pytest.approx(1e-6, rel=1e-3)
    assert not bad.holds


def gated(**keys):
    """A flight of 1 m/s along x, without gravity, through a wall at x = 0.5 m with some keys."""
    wall = {**surface("gate", (0.5, -1.0), (0.5, 1.0)), **keys}
    return {"gravity": 0.0, "particle": {"radius": 0.06}, "surface": [wall],
            **thrown((0.0, 0.0), (1.0, 0.0)),
            "run": {"until": 1.0}}  # fmt: skip


@pytest.mark.parametrize(
    ("keys", "through"),
    [({"opens_at": 0.3}, 0), ({"opens_at": 0.6}, 1), ({"closes_at": 0.7}, 0),
     ({"closes_at": 0.3}, 1)],
)  # fmt: skip
def test_a_gate_is_there_only_while_it_is_closed(keys, through):
    """One that flies straight on is at the wall, within r = 6 cm, from 0.44 to 0.56 s."""
    e = evidence(gated(**keys))

    def straight(knots):
        knots["position"] = np.stack([knots["t"], np.zeros(len(knots))], axis=-1)
        knots["velocity"] = [1.0, 0.0]

    assert barriers.nothing_through(e).holds
    assert barriers.depth(e).holds
    passed = evidence(gated(**keys), knots=straight)
    assert barriers.nothing_through(passed).figure == through
    assert barriers.depth(passed).holds == (not through)


@pytest.mark.parametrize("engine", ["exact", "contact", "pymunk"])
def test_a_gate_that_shuts_ignores_what_it_overlaps(engine):
    """Closed at 0.495 s, when the centre is 5 mm before it: the disk flies on."""
    e = evidence(gated(closes_at=0.495), engine, None if engine == "exact" else 1e-3)
    assert e.recording.knots["position"][-1, 0] == pytest.approx(1.0, rel=1e-9)
    for law in (barriers.depth, barriers.nothing_through):
        assert law(e).holds


TWO = {
    "gravity": 0.0,
    "particle": [{"name": "a", "radius": 0.02, "spin": True},
                 {"name": "b", "radius": 0.005, "mass": 0.001, "spin": True}],
    "stream": [
        {"name": "one", "particle": "a", "at": [0.0, 0.0], "velocity": [0.2, 0.0],
         "interact": True, "restitution": 0.5, "friction": 0.3},
        {"name": "two", "particle": "b", "at": [0.1, 0.01], "velocity": [-0.5, 0.0],
         "restitution": 0.25, "friction": 0.1},
    ],
    "run": {"until": 0.4},
}  # fmt: skip


def two(**changes):
    return evidence(TWO, "contact", 1e-3, **changes)


def test_two_sizes_overlap_by_what_lacks_to_the_sum_of_their_radii():
    """Centres 22 mm apart: 3 mm deep, 0.6 of the smaller radius, for as long as it lasts."""

    def near(knots):
        half = np.flatnonzero(np.diff(knots["t"]) < 0.0)[0] + 1
        knots["velocity"] = 0.0
        knots["position"][:half] = [0.0, 0.0]
        knots["position"][half:] = [0.022, 0.0]

    bad = two(knots=near)
    assert barriers.overlap(bad).figure == pytest.approx(0.003, rel=1e-9)
    assert barriers.pressed(bad).figure == pytest.approx(0.6, rel=1e-9)
    assert not barriers.overlap(bad).holds
    assert not barriers.pressed(bad).holds
    # The centre of the smaller is nearly outside the larger, 20 mm: it has not passed.
    assert barriers.nothing_through_another(bad).holds


def test_momentum_counts_each_mass():
    """Of two masses, m1 Δv1 = -m2 Δv2; the same Δv for both would be no exchange."""

    def exchange(knots):
        half = np.flatnonzero(np.diff(knots["t"]) < 0.0)[0]
        knots["velocity"][half, 0] += 0.01
        knots["velocity"][-1, 0] -= 0.01

    assert laws.momentum(two()).holds
    bad = laws.momentum(two(knots=exchange))
    # |0.01 (m1 - m2)| / (m1 v1 + m2 v2) before they meet, m1 = 8 g, m2 = 1 g.
    assert bad.figure == pytest.approx(0.01 * 7.0 / (8.0 * 0.2 + 1.0 * 0.5), rel=1e-9)
    assert not bad.holds


def blow(name, amount, tables=HOP, engine="exact"):
    """A run as it is, and one whose first blow has a number moved."""
    dt = None if engine == "exact" else 1e-3
    whole = evidence(tables, engine, dt)
    kinds = (Kind.IMPACT, Kind.COLLISION)
    row = int(np.argmax(np.isin(whole.recording.events["kind"], kinds)))

    def change(events):
        events[name][row] += amount(events[row])

    return whole, evidence(tables, engine, dt, events=change)


def test_a_blow_turns_back_what_the_restitution_of_the_pair_says():
    """1 % more of what is due, ε sqrt(2 g h) from a drop of h, of the largest speed."""
    whole, bad = blow("velocity_after", lambda hit: 0.01 * hit["velocity_after"] * [0.0, 1.0])
    assert barriers.rebound(whole).holds
    due = 0.5 * sqrt(2.0 * 9.81 * (0.3 - 0.004))
    assert barriers.rebound(bad).figure == pytest.approx(0.01 * due / bad.bounds.speed, rel=1e-9)
    assert not barriers.rebound(bad).holds


@pytest.mark.parametrize(
    ("tables", "engine", "friction"), [(HOP, "exact", 0.3), (TWO, "contact", None)]
)
def test_a_blow_grips_by_no_more_than_the_friction_of_the_pair(tables, engine, friction):
    whole, bad = blow("tangential_impulse", lambda hit: hit["normal_impulse"], tables, engine)
    assert barriers.cone(whole).holds
    assert not barriers.cone(bad).holds
    if friction is not None:
        (hit, *_) = bad.recording.select(Kind.IMPACT)
        excess = abs(hit["tangential_impulse"]) - friction * hit["normal_impulse"]
        assert barriers.cone(bad).figure == pytest.approx(
            excess / (0.008 * bad.bounds.speed), rel=1e-9
        )


def test_a_blow_never_pulls():
    _, bad = blow("normal_impulse", lambda hit: -2.0 * hit["normal_impulse"])
    assert not barriers.cone(bad).holds


def test_each_kind_has_its_own_values_on_a_surface():
    """A steel floor: one kind comes back with 0.8, the other with 0.1 of its speed."""
    floor = {
        name: value for name, value in FLOOR.items() if name not in ("restitution", "friction")
    }
    both = {
        "particle": [{"name": "a", "radius": 0.01}, {"name": "b", "radius": 0.005}],
        "pair": [{"between": ["a", "floor"], "restitution": 0.8, "friction": 0.0},
                 {"between": ["b", "floor"], "restitution": 0.1, "friction": 0.0}],
        "surface": [floor],
        "stream": [{"particle": name, "at": [x, 0.3], "velocity": [0.0, 0.0]}
                   for name, x in (("a", 0.0), ("b", 0.5))],
        "run": {"until": 0.4},
    }  # fmt: skip
    whole = evidence(both)
    hits = whole.recording.first(whole.recording.select(Kind.IMPACT))
    shares = -hits["velocity_after"][:, 1] / hits["velocity_before"][:, 1]
    np.testing.assert_allclose(shares, [0.8, 0.1], rtol=1e-12)
    assert barriers.rebound(whole).holds

    def exchange(events):
        # As if the second were of the first kind.
        row = int(np.flatnonzero((events["kind"] == Kind.IMPACT) & (events["particle"] == 1))[0])
        events["velocity_after"][row] *= 8.0

    assert not barriers.rebound(evidence(both, events=exchange)).holds
