"""An accuracy that can be asked for: what is said to be reached is, and the reference is named."""

from dataclasses import replace

import numpy as np
import pytest

from chutelab import scene as sc
from chutelab import theory
from chutelab.engines.reference import UnableError
from chutelab.engines.simulation import choose, simulate
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.results.quantities import compare
from chutelab.scene.quantities import THEORY
from chutelab.studies.accuracy import (
    FLOOR,
    MOST_STEPS,
    apart,
    each,
    parse,
    reach,
    sizes,
    stirred,
    together,
)
from chutelab.util.errors import InputError

# One particle, run by the exact engine: a stepped one has its step halved.
LONE = [
    name for name, scene in ((name, sc.load(name)) for name in sc.shipped())
    if scene.count == 1 and choose(build(scene)) == "exact"
]  # fmt: skip


def difference(one, other, unit="relative"):
    return apart(list(each(one)), list(each(other)), sizes(other), unit)[0]


# What can be asked for.


def test_an_accuracy_is_a_share_or_a_length():
    for text, size, unit in [
        ("1e-6", 1e-6, "relative"), ("0.1%", 1e-3, "relative"), ("0.5", 0.5, "relative"),
        ("1e-15", 1e-15, "relative"), ("1mm", 1e-3, "m"), (" 2.5 cm ", 0.025, "m"),
        ("3 µm", 3e-6, "m"), ("3um", 3e-6, "m"), ("50nm", 5e-8, "m"), ("1 m", 1.0, "m"),
    ]:  # fmt: skip
        found = parse(text)
        assert (found.size, found.unit) == (pytest.approx(size, rel=1e-15, abs=0.0), unit)


@pytest.mark.parametrize(
    "text",
    ["", "0", "-1", "nan", "inf", "1e-30", "0.6", "60%", "5 parsecs", "0mm", "-1mm", "1e9m",
     "1e-16 m", "1 s", "1 J", "mm", "exact", "1e999", "1;2"],
)  # fmt: skip
def test_what_cannot_be_asked_for_is_refused_with_what_can(text):
    with pytest.raises(InputError) as caught:
        parse(text)
    said = str(caught.value)
    assert repr(text) in said
    assert "a relative error from 1e-15 to 0.5" in said
    assert "1mm" in said


# What a run is held against.


@pytest.mark.parametrize(
    "name", [pytest.param(one, marks=[pytest.mark.slow] * (one == "loop")) for one in LONE]
)
def test_exact_is_held_against_theory_or_scipy(name):
    scene = sc.load(name)
    recording, found = reach(scene, 1e-9)
    assert np.array_equal(recording.knots, simulate(scene).knots), "the run is the ordinary one"
    assert (found.asked, found.unit, found.met, found.dt) == (1e-9, "relative", True, None)
    whole = scene.run.until == "landed" and not theory.predict(scene).reason
    assert found.against == (
        "theory" if whole else "dop853" if scene.stream.count == 1 else "contact"
    )
    assert found.runs == (1 if whole else 2)
    worst = compare(recording).max
    assert worst is None or worst <= found.reached
    assert FLOOR <= found.reached < 1e-11
    assert not found.chaotic


@pytest.mark.parametrize(
    ("name", "engine"),
    [
        # A belt that brakes, a slip round the pulley, and blows alone.
        pytest.param(name, engine, marks=() if name in quick else pytest.mark.slow)
        for engine, quick in (
            ("contact", ("belt-landing", "slip", "inclined-40")),
            ("pymunk", ("slip", "inclined-40")),
        )
        for name in LONE
    ],
)  # fmt: skip
def test_a_stepped_engine_is_as_exact_as_it_says(name, engine):
    scene = sc.load(name, [f"run.engine={engine}", "stream.count=1"])
    recording, found = reach(scene, 2e-6)
    assert recording.engine == engine
    assert found.met
    assert found.dt <= scene.run.dt
    assert found.against in ("theory", "exact")
    # The true error, but for what the theory does not speak of or for roundings.
    true = difference(recording, simulate(scene, engine="exact"))
    assert true <= max(2e-6, 2.0 * found.reached)


@pytest.mark.parametrize("order", [1.0, 2.0])
def test_steps_are_halved_until_the_witness_is_near(order, monkeypatch):
    """An engine with a made-up error of 0.05 m (dt / 1 ms)^order in the place of its landing."""
    scene = sc.load("belt-landing", ["run.engine=pymunk"])
    monkeypatch.setattr("chutelab.studies.accuracy.judged", made_up(scene, order))
    _, found = reach(scene, "1mm")
    halvings = np.ceil(np.log2(50.0) / order)
    assert found.met
    assert found.dt == 1e-3 / 2.0**halvings
    assert found.runs == halvings + 2
    assert found.reached == pytest.approx(0.05 * 2.0 ** (-order * halvings), rel=1e-9)


def made_up(scene, order, size=0.05, steps=0.1):
    plain = simulate(scene, engine="exact")

    def run(asked, engine=None, progress=None):
        if engine == "exact":
            return plain
        events = plain.events.copy()
        landed = events["kind"] == Kind.LANDING
        events["position"][landed, 0] += size * (asked.run.dt / 1e-3) ** order
        return replace(
            plain, events=events, engine="pymunk", knots=plain.knots.copy(),
            machine=build(asked), steps=round(steps / asked.run.dt),
        )  # fmt: skip

    return run


def test_an_error_that_two_runs_share_is_no_accuracy(monkeypatch):
    """The same wrong answer at every step: nothing but another engine can tell."""
    scene = sc.load("belt-landing", ["run.engine=pymunk"])
    monkeypatch.setattr("chutelab.studies.accuracy.judged", made_up(scene, 0.0))
    _, found = reach(scene, "1mm")
    assert not found.met
    assert found.reached == pytest.approx(0.05, rel=1e-9)
    assert found.method == "difference from the exact engine; a shorter step helps no more"


def test_a_search_has_a_bound(monkeypatch):
    scene = sc.load("belt-landing", ["run.engine=pymunk"])
    monkeypatch.setattr("chutelab.studies.accuracy.judged", made_up(scene, 1.0, steps=1.0))
    _, found = reach(scene, "50nm")
    assert not found.met
    assert 1.0 / found.dt <= MOST_STEPS < 2.0 / found.dt
    assert f"more than {MOST_STEPS:,} steps" in found.method


def test_without_another_answer_nothing_is_promised(monkeypatch):
    # A point that falls on a floor: no theory, no disks, and no SciPy.
    fall = {
        "particle": {"radius": 0.0},
        "surface": [{"name": "floor", "points": [[-1.0, 0.0], [1.0, 0.0]]}],
        "stream": {"at": [0.0, 0.5], "velocity": [0.1, 0.0]},
        "run": {"until": 0.4},
    }
    scene = sc.from_dict(fall)
    assert reach(scene, 1e-9)[1].against == "dop853"

    def missing(_machine, _progress):
        raise UnableError("SciPy is missing")

    monkeypatch.setattr("chutelab.engines.reference.run", missing)
    _, found = reach(scene, 1e-9)
    assert (found.met, found.reached, found.against) == (False, None, None)
    assert found.method.startswith("none: no other answer; not dop853 (SciPy is missing), nor ")


def test_what_happens_in_one_answer_only_is_not_met(monkeypatch):
    scene = sc.load("perpendicular", ["run.until=settled"])
    other = simulate(sc.load("perpendicular", ["outgoing.length=0.1", "run.until=settled"]))
    other = replace(other, engine="dop853")
    monkeypatch.setattr("chutelab.engines.reference.run", lambda _machine, _progress: other)
    _, found = reach(scene, 1e-3)
    assert (found.reached, found.met) == (None, False)
    assert found.method.startswith("none: exact and dop853 differ in")


def test_a_length_speaks_of_places_only():
    _, found = reach(sc.load("perpendicular"), "1um")
    assert (found.asked, found.unit, found.met) == (1e-6, "m", True)
    assert THEORY[found.worst].kind == "length"
    _, found = reach(sc.load("belt-landing", ["particle.radius=0.004"]), "1um")
    assert found.met
    assert found.worst.startswith("place")


# Crowds.


def test_of_a_crowd_the_whole_is_held_against_another_engine():
    scene = sc.load("stream", ["stream.count=12", "run.until=landed"])
    recording, found = reach(scene, "1um")
    assert len(recording.select(Kind.COLLISION)) > 0
    assert found.chaotic
    assert not found.met
    assert found.runs == 4
    assert found.against == "pymunk"
    assert found.worst == "mean landing point"
    assert found.method.startswith(
        "a crowd as a whole: the mean landing point of contact and pymunk"
    )
    other = simulate(scene, engine="pymunk")
    means = [next(iter(together(run))).values[0] for run in (recording, other)]
    assert abs(means[0] - means[1]) <= found.reached * (1.0 + 1e-12)


# The parts.


@pytest.mark.parametrize("name", [*LONE, "cascade", "spoon", "stream", "stream-independent"])
def test_a_disturbance_changes_gravity_and_speeds_by_next_to_nothing(name):
    scene = sc.load(name, ["stream.count=3"])
    changed = stirred(scene, 1e-9)
    assert changed.gravity == scene.gravity * (1.0 - 1e-9)
    if scene.incoming is not None:
        assert changed.incoming.speed == scene.incoming.speed * (1.0 - 1e-9)
    assert changed.expect == ()
    moved = difference(simulate(changed), simulate(scene))
    assert 1e-11 < moved < 1e-6


def test_a_distance_in_metres_is_that_of_places():
    one, other = (
        simulate(sc.load("perpendicular", overrides)) for overrides in ([], ["outgoing.drop=0.501"])
    )
    down, up = (run.select(Kind.LANDING)[0]["position"] for run in (one, other))
    assert difference(one, other, "m") == pytest.approx(np.hypot(*(down - up)), rel=1e-12, abs=0.0)
    # 1 mm of 0.6 m; times and velocities change by less.
    assert difference(one, other) == pytest.approx(np.hypot(*(down - up)) / 0.6, rel=0.5)
