"""The answers: closed form, event-driven, contact dynamics, Pymunk, and SciPy's ODE solver."""

from collections import Counter
from dataclasses import replace
from math import cos, isfinite, radians, sin

import numpy as np
import pytest
from scipy.integrate import quad

from chutelab import machine, scene, theory
from chutelab.checks.agreement import agreement, order, verify
from chutelab.core import dtype
from chutelab.engines import exact, reference, simulation
from chutelab.engines.contact import Job
from chutelab.engines.pymunk.lone import Lone
from chutelab.engines.simulation import simulate
from chutelab.machine import builder
from chutelab.results import REASONS, Kind
from chutelab.results.quantities import compare
from chutelab.scene.quantities import THEORY
from chutelab.studies.accuracy import reach
from drawn import draw
from shared import some

GRAVITY = 9.81


def contacts_of(recording):
    """Surfaces that particle 0 strikes, in the order of events."""
    struck = recording.select(Kind.IMPACT, Kind.LANDING)
    return [recording.surfaces[event["surface"]] for event in struck if event["particle"] == 0]


def plate_normal(recording):
    alpha = radians(recording.scene.plate.angle_deg)
    return np.array([-cos(alpha), -sin(alpha)])


def allowance(drawn, prediction):
    """1e-12, divided by how near a scene is to a grazing impact or to the critical speed."""
    worst = 1.0
    if isfinite(prediction.phi2) and abs(sin(prediction.phi2)) < 1e-3:
        worst = abs(sin(prediction.phi2))
    if drawn.incoming is not None and drawn.gravity > 0.0:
        ride = drawn.incoming.pulley_radius + drawn.particle.radius
        critical = abs(1.0 - drawn.incoming.speed**2 / (drawn.gravity * ride))
        if critical < 1e-6:
            worst = min(worst, critical)
    return 1e-12 / max(worst, 1e-300)


def confirm(reason, recording):
    """Check what a reason of the theory claims against the events of the engine."""
    kind, struck = theory.Reason.of(reason), contacts_of(recording)
    named = str(reason).partition(": ")[2].partition(":")[0]
    named = "incoming" if named == "pulley" else named
    if kind is theory.Reason.EARLY:
        assert struck[0] == named, (reason, struck)
    elif kind is theory.Reason.NO_IMPACT:
        assert struck[:1] != ["plate"], (reason, struck)
    elif kind is theory.Reason.SECOND and named == "plate" != struck[1]:
        # Without restitution it does not bounce on the plate, it slides down on it.
        hit = recording.select(Kind.IMPACT)[0]
        track = recording.track(0)
        then = track[track["t"] > hit["t"]][0]
        offset = (then["position"] - hit["position"]) @ plate_normal(recording)
        assert abs(offset) < 1e-12, reason
    elif kind is theory.Reason.SECOND:
        assert struck[:2] == ["plate", named], (reason, struck)
    else:
        assert kind is theory.Reason.MISSES, reason
        if struck[1:2] != ["outgoing"]:
            return
        # Below the level at which it would lie on the belt it may clip an end of it: beyond that,
        # and a radius from it.
        hit = recording.select(Kind.IMPACT, Kind.LANDING)[1]
        m, radius = recording.machine, recording.particle.radius
        belt = m.segments.of(int(np.flatnonzero(m.segments.surface == m.landing)[0]))
        ends = np.stack(belt.ends)
        (x, y), (low, high) = hit["position"], ends[:, 0]
        assert not low <= x <= high, (reason, struck)
        assert np.hypot(*(hit["position"] - ends).T).min() == pytest.approx(radius, rel=1e-9)
        assert y < ends[0, 1] + radius - 1e-9, (reason, struck)


@pytest.mark.parametrize(
    "seeds", [range(40), pytest.param(range(500), marks=pytest.mark.slow)], ids=["40", "500"]
)
def test_exact_is_the_closed_form_wherever_that_speaks(seeds):
    tally = Counter()
    for seed in seeds:
        drawn = draw(seed)
        prediction = theory.predict(drawn)
        reason, kind = str(prediction.reason), theory.Reason.of(prediction.reason)
        tally[kind] += 1
        try:
            recording = exact.run(machine.build(drawn))
        except exact.CornerError:
            # A disk held between a belt and a wall; the theory has stopped before.
            assert kind is not None, seed
            tally["corner"] += 1
            continue
        compared = compare(recording)
        tally["compared"] += bool(compared.errors)
        assert (compared.max or 0.0) <= allowance(drawn, prediction), (seed, compared.errors)
        if REASONS[recording.ended[0]] == "time" or kind is theory.Reason.OUTSIDE:
            continue
        free = drawn.incoming.friction != "adhesion"
        if drawn.gravity == 0.0 and (free or "second contact: incoming" in reason):
            # Nothing presses it on the belt: it flies along it, on the way there or back.
            told = (Kind.IMPACT, Kind.SEPARATION) if free else (Kind.IMPACT,)
            assert not len(recording.select(*told, surface="incoming"))
        elif reason:
            confirm(reason, recording)
        else:
            assert contacts_of(recording)[:2] == ["plate", "outgoing"], seed
            # All but the two that only a particle has that settles.
            assert len(compared.errors) >= len(THEORY) - 2, (seed, compared.errors)
            tally["landed"] += 1
    assert tally["compared"] > 0.5 * len(seeds), tally
    assert tally["landed"] >= 0.1 * len(seeds), tally
    assert tally["corner"] < 0.05 * len(seeds), tally


# What `verify` promises of one answer beside another.


def rows_of(name, *overrides):
    return {", ".join(row.pair): row for row in agreement(scene.load(name, overrides))}


@pytest.mark.parametrize(("count", "alone"), [(10, False), (11, True)])
def test_of_more_than_ten_that_do_not_meet_pymunk_runs_the_first_alone(count, alone, monkeypatch):
    def quick(drawn, engine, **options):
        del engine, options
        return simulate(drawn, engine="exact")

    monkeypatch.setattr("chutelab.checks.agreement.answer", quick)
    found = verify(scene.load("stream-independent", [f"stream.count={count}"]))
    assert ("runs particle 0 alone" in found.skipped.get("pymunk", "")) is alone


def test_where_all_contacts_are_blows_the_engines_agree_to_what_each_promises():
    rows = rows_of("perpendicular")
    assert set(rows) == {
        f"{name}, {base}"
        for name in ("exact", "dop853", "contact", "pymunk")
        for base in ("theory", "exact")
        if name != base
    }
    # The flight magnifies nothing: a change of the inputs comes out as it went in.
    for name, bound in (("exact", 1e-12), ("dop853", 1e-12), ("contact", 1e-10), ("pymunk", 1e-9)):
        assert rows[f"{name}, theory"].tolerance == pytest.approx(bound, rel=1e-6)
    assert all(row.holds and not row.least for row in rows.values())


def test_where_contacts_last_a_stepped_engine_converges():
    rows = rows_of("slip", "incoming.length=0.1", "run.dt=0.002")
    for name, least in (("contact", 1.5), ("pymunk", 0.5)):
        row = rows[f"{name}, exact"]
        assert (row.least, row.tolerance, row.holds) == (True, least, True)


def test_what_lies_still_stays_where_it_is():
    """A box of 0.0243 m sinks by the step's g dt² or less, 2.5 µm: no order, 1e-4 of its size."""
    row = rows_of("dominoes", "run.until=0.1")["pymunk, contact"]
    assert (row.least, row.tolerance, row.holds) == (False, 1e-4, True)
    assert 0.0 < row.difference < GRAVITY * 0.0005**2 / 0.0243


@pytest.mark.parametrize(("growth", "compared"), [(1e5, True), (1e7, False)])
def test_beyond_a_million_times_a_change_no_order_is_looked_for(growth, compared, monkeypatch):
    """Made up: how far runs are apart, of one engine and of two."""

    def apart(one, other):
        return (1e-9 * growth if one.engine == other.engine else 1e-3), "all"

    monkeypatch.setattr("chutelab.checks.agreement.distance", apart)
    monkeypatch.setattr("chutelab.checks.agreement.NEARBY", (1.0,))
    said = rows_of("slip", "run.until=0.6")["contact, exact"].quantity
    assert said.startswith("order" if compared else "a change of the inputs comes out 1e+07")


def test_the_promise_grows_with_what_a_scene_makes_of_a_change():
    """At v0² = g Rc (1 - δ), cos φ1 = 1 - δ: dφ1/dv = -(2/v0) cos φ1 / sin φ1, sin φ1 = √(2 δ)."""
    delta = 1e-8
    speed = (GRAVITY * 0.1063 * (1.0 - delta)) ** 0.5
    row = rows_of("perpendicular", f"incoming.speed={speed!r}")["exact, theory"]
    # Speeds and gravity fall by one share s: cos φ1 = v²/(g Rc) falls by s, φ1 grows by s / sin φ1,
    # and the place of the separation moves by Rc times that, measured by d1 = 0.6 m.
    growth = 0.1063 / 0.6 / (2.0 * delta) ** 0.5
    assert row.tolerance == pytest.approx(1e-12 * growth, rel=0.1)
    assert row.holds


def test_an_answer_that_takes_too_long_is_left_out_and_what_none_shows_fails():
    told = verify(scene.load("perpendicular"), max_seconds=1e-9)
    late = "it takes longer than 1e-09 s"
    assert told.skipped == dict.fromkeys(("exact", "contact", "pymunk"), late)
    assert {", ".join(row.pair): row.quantity for row in told.agreements} == dict.fromkeys(
        ("exact", "dop853", "contact", "pymunk"), f"left out: {late}"
    )
    promised = [row for row in told.findings if row.engine != "theory"]
    assert promised
    assert all(np.isnan(row.simulated) for row in promised)
    assert told.failures == sum(row.tolerance is not None for row in promised) > 0
    assert f"pymunk is left out: {late}" in told.sheets("")[0].notes


@pytest.mark.parametrize(
    ("errors", "found"),
    [
        ([1e-2, 1e-2 / 16, 1e-2 / 256], 2.0), ([1e-2, 1e-2 / 4, 1e-2 / 16], 1.0),
        ([1e-2, 1e-5, 1e-2], 0.0), ([1e-5, 1e-2, 1e-2], 0.0),
        ([1e-8, 1e-12, 1e-12], np.log(10.0) / np.log(4.0)), ([1e-12, 1e-10, 1e-11], np.inf),
        ([1e-3, np.inf, 1e-5], np.nan),  # other things happen in one of them
    ],
)  # fmt: skip
def test_an_order_is_what_the_worst_errors_show(errors, found):
    assert order(errors, 4.0, 1e-9) == pytest.approx(found, nan_ok=True)


# A wrong formula, planted where the exact engine takes it from, must be seen from outside.

WRONG = 1e-6
"""Relative error of the planted formula."""


def heavier(module, machine, *given, honest=exact.fill):
    honest(module, machine, *given)
    module.array("lones", dtype("Lone"), machine.count, of="Exact")["gravity"] *= 1.0 + WRONG


def livelier(module, machine, *given, honest=exact.fill):
    honest(module, machine, *given)
    pieces = len(machine.segments.length) + len(machine.arcs.surface) + (machine.pulley is not None)
    module.array("materials", dtype("Pair"), pieces, of="Exact")["restitution"] *= 1.0 + WRONG


def caught(until):
    """Tell that what the exact engine does differs from all else, and from nothing else."""
    drawn = scene.load("perpendicular", [f"run.until={until}"])
    failed = [", ".join(row.pair) for row in verify(drawn).agreements if not row.holds]
    assert "exact, theory" in failed
    assert {f"{name}, exact" for name in ("dop853", "contact", "pymunk")} <= set(failed)
    assert not {"dop853, theory", "contact, theory", "pymunk, theory"} & set(failed)
    # Asked for by name: where the laws of every run see the fault, auto takes another engine.
    exactly = scene.load("perpendicular", [f"run.until={until}", "run.engine=exact"])
    found = reach(exactly, 0.1 * WRONG)[1]
    assert not found.met
    assert found.reached is None or found.reached > 0.1 * WRONG
    assert found.against == ("theory" if until == "landed" else "dop853")


@pytest.mark.parametrize("until", ["landed", pytest.param("settled", marks=pytest.mark.slow)])
@pytest.mark.parametrize("wrong", [heavier, livelier])
def test_a_wrong_number_is_caught_from_outside(wrong, until, monkeypatch):
    drawn = scene.load("perpendicular", [f"run.until={until}"])
    assert verify(drawn).failures == 0
    assert reach(drawn, 1e-9)[1].met
    monkeypatch.setattr(simulation, "ahead", builder.build)  # not in the core, so that it is filled
    monkeypatch.setattr(exact, "fill", wrong)
    caught(until)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("file", "text", "wrong"),
    [
        ("exact_meet.c", "span / -acceleration : (gap + gap) / span;",
         "span / -acceleration : (1.0 + 1e-6) * (gap + gap) / span;"),
        ("exact_contact.c", "double rebound = c.restitution * approach;",
         "double rebound = (1.0 + 1e-6) * c.restitution * approach;"),
        # The printed Eq. (9) in an engine: the wrong component is damped.
        ("exact_contact.c", "push = limited(-A.share * slip, grip);",
         "push = -(1.0 - c->restitution) * slip;"),
    ],
)  # fmt: skip
def test_a_wrong_formula_is_caught_from_outside(file, text, wrong, with_fault):
    with_fault(file, text, wrong)
    caught("landed")


@pytest.mark.slow
def test_a_wrong_formula_of_the_contact_engine_is_wrong_in_no_other(with_fault):
    with_fault("impacts.c", "-c.rest * u[0]", "(1.0 + 1e-6) * -c.rest * u[0]")
    failed = {row.pair for row in agreement(scene.load("perpendicular")) if not row.holds}
    assert failed == {("contact", "theory"), ("contact", "exact")}


def heavier_core(job, module, machine, *, honest=Job.__init__, **more):
    honest(job, module, replace(machine, gravity=machine.gravity * (1.0 + WRONG)), **more)


def heavier_flight(run, *given, honest=Lone.__init__):
    honest(run, *given)
    run.pull *= 1.0 + WRONG


def heavier_ode(run, *given, honest=reference._Run.__init__):
    honest(run, *given)
    run.g = run.g * (1.0 + WRONG)


@pytest.mark.parametrize(
    ("name", "where", "wrong"),
    [
        ("exact", "chutelab.engines.exact.fill", heavier),
        ("contact", "chutelab.engines.contact.Job.__init__", heavier_core),
        ("pymunk", "chutelab.engines.pymunk.lone.Lone.__init__", heavier_flight),
        ("dop853", "chutelab.engines.reference._Run.__init__", heavier_ode),
    ],
)
def test_what_is_wrong_in_one_engine_is_wrong_in_no_other(name, where, wrong, monkeypatch):
    monkeypatch.setattr(simulation, "ahead", builder.build)
    monkeypatch.setattr(where, wrong)
    failed = [
        ", ".join(row.pair) for row in agreement(scene.load("perpendicular")) if not row.holds
    ]
    assert any(name in pair for pair in failed)
    assert all(name in pair for pair in failed)


def test_what_places_the_belt_is_shared_by_the_engines_and_told_by_the_theory(monkeypatch):
    """An error in the nominal particle's flight moves the belt for all engines alike."""
    given = scene.load("perpendicular", ["outgoing.drop=1"])
    right = simulate(given)
    # In 1.1 of the time to the plate, t2 = 0.5937 m / (2 m/s), it falls 1.21 of the height.
    lower = 0.21 * 0.5 * GRAVITY * (0.5937 / 2.0) ** 2
    honest = builder.lay

    def sunk(*given):
        laid = honest(*given)
        for end in ("start", "end"):
            laid[0]["segments"][end][2, 1] -= lower
        return laid

    monkeypatch.setattr(simulation, "ahead", builder.build)
    monkeypatch.setattr(builder, "lay", sunk)
    wrong = [simulate(given, engine=engine) for engine in ("exact", "contact", "pymunk")]
    monkeypatch.undo()
    heights = [one.select(Kind.LANDING)[0]["position"][1] for one in wrong]
    before = right.select(Kind.LANDING)[0]["position"][1]
    assert heights == pytest.approx([before - lower] * 3, abs=1e-9)
    assert all(compare(one).max > 0.05 for one in wrong)


LATE = {"exact": 1e-12, "contact": 2e-6, "pymunk": 2e-6}
"""s by which an engine may be off where a surface ends on which a particle slides or rolls."""


@pytest.mark.parametrize("engine", LATE)
@pytest.mark.parametrize(
    ("spin", "friction", "speed", "told"),
    some([
        (False, 0.2, 3.0, ["SLIP", "STICK"]), (False, 0.0, -1.0, ["SLIP"]),
        (True, 0.9, 0.0, ["STICK"]), (True, 0.9, 3.0, ["SLIP", "STICK"]),
    ], 2),
)  # fmt: skip
def test_what_goes_over_to_another_surface_slips_or_grips_there_from_then_on(
    engine, spin, friction, speed, told
):
    """From rest down a chute of length s: s = a t²/2 with a = g (sin β - µ cos β), or rolling
    a = 2/3 g sin β. There a belt goes on in its line.
    """
    beta, s, r = radians(30.0), 0.3, 0.01
    along = np.array([cos(beta), -sin(beta)])
    chute = {"from": (-along).tolist(), "to": [0.0, 0.0], "friction": friction}
    belt = {"from": [0.0, 0.0], "to": (3.0 * along).tolist(), "friction": 0.7, "speed": speed}
    start = -s * along + r * np.array([sin(beta), cos(beta)])
    recording = simulate(
        {
            "gravity": GRAVITY, "particle": {"radius": r, "spin": spin},
            "surface": [{"name": "chute", **chute}, {"name": "belt", **belt}],
            "stream": {"at": start.tolist(), "velocity": [0.0, 0.0]}, "run": {"until": 0.8},
        },
        engine=engine,
    )  # fmt: skip
    pull = 2.0 / 3.0 * sin(beta) if spin else sin(beta) - friction * cos(beta)
    events = recording.select(surface="belt")
    assert [Kind(kind).name for kind in events["kind"]] == told
    assert events["t"][0] == pytest.approx((2.0 * s / (GRAVITY * pull)) ** 0.5, abs=LATE[engine])


@pytest.mark.parametrize("engine", LATE)
def test_what_slides_down_a_round_chute_on_to_the_outgoing_belt_has_landed(engine):
    """Without friction v² = v1² + 2 g h from an angle φ off the lowest point on: t = ∫ ρ dφ / v."""
    size, r, low, first = 0.5, 0.01, -0.6, radians(50.0)
    path, center = size - r, np.array([0.0, low + size])
    chute = {"radius": size, "from_deg": 200.0, "to_deg": 270.0, "friction": 0.0}
    out = np.array([-sin(first), -cos(first)])
    recording = simulate(
        {
            "gravity": GRAVITY, "incoming": {"speed": 1.0, "pulley_radius": 0.05},
            "outgoing": {"drop": 0.65, "drop_from": "top", "start": 0.0, "length": 2.0},
            "particle": {"radius": r},
            "surface": [{"name": "chute", "center": center.tolist(), **chute}],
            "stream": {"at": (center + path * out).tolist(), "velocity": [cos(first), -sin(first)]},
            "run": {"until": "landed"},
        },
        engine=engine,
    )  # fmt: skip

    def rate(angle):
        return path / (1.0 + 2.0 * GRAVITY * path * (cos(angle) - cos(first))) ** 0.5

    (landing,) = recording.select(Kind.LANDING)
    assert landing["t"] == pytest.approx(quad(rate, 0.0, first)[0], abs=LATE[engine])
    speed = path / rate(0.0)
    # The stepped ones to second order: 100 dt².
    off = 1e-12 if engine == "exact" else 1e-4
    np.testing.assert_allclose(landing["velocity_after"], [speed, 0.0], rtol=0, atol=off)
    assert [REASONS[n] for n in recording.ended] == ["landed"]
