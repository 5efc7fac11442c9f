"""The answers: closed form, event-driven, contact dynamics, Pymunk, and SciPy's ODE solver."""

from __future__ import annotations

import re
from collections import Counter
from math import cos, isfinite, radians, sin
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st

from chutelab import ballistics, exact, impact, machine, reference, scene, theory
from chutelab.accuracy import reach
from chutelab.agreement import ANSWERS, agreement, verify
from chutelab.agreement.pairs import order
from chutelab.compare import QUANTITIES, compare
from chutelab.compare import scene_of as scene_from
from chutelab.exact import touch
from chutelab.recording import Kind

GRAVITY = 9.81

draws = st.fixed_dictionaries(
    {
        "speed": st.floats(0.3, 6.0),
        "pulley_radius": st.floats(0.03, 0.6),
        "angle_deg": st.floats(-60.0, 60.0),
        "restitution": st.floats(0.0, 1.0),
        "radius": st.floats(0.0, 0.02).filter(lambda r: r == 0.0 or r > 1e-6),
        "distance": st.floats(0.1, 1.5),
    }
)


def scene_of(draw, *, outgoing=True, max_time=30.0):
    return scene.from_dict(
        {
            "gravity": GRAVITY,
            "run": {"max_time": max_time},
            "particle": {"radius": draw["radius"]},
            "incoming": {"speed": draw["speed"], "pulley_radius": draw["pulley_radius"]},
            "plate": {
                "distance": draw["distance"],
                "angle_deg": draw["angle_deg"],
                "restitution": draw["restitution"],
            },
            **({"outgoing": {"drop": 0.5, "drop_from": "impact"}} if outgoing else {}),
        }
    )


def contacts_of(recording):
    """Surfaces that particle 0 strikes, in the order of events."""
    struck = recording.select(Kind.IMPACT, Kind.LANDING)
    return [recording.surfaces[event["surface"]] for event in struck if event["particle"] == 0]


def built_or_none(drawn):
    try:
        return machine.build(drawn)
    except scene.SceneError:
        return None


def plate_normal(recording):
    alpha = radians(scene_from(recording).plate.angle_deg)
    return np.array([-cos(alpha), -sin(alpha)])


def allowance(draw, found):
    """1e-12, divided by how near the draw is to a grazing impact or to the critical speed."""
    rc = draw["pulley_radius"] + draw["radius"]
    critical = abs(1.0 - draw["speed"] ** 2 / (GRAVITY * rc))
    grazing = abs(found["v2"] and found["normal"] / found["v2"]) if found else 1.0
    bound = 1e-12
    if grazing < 1e-3:
        bound /= grazing
    if critical < 1e-6:
        bound /= max(critical, 1e-300)
    return bound


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
        assert struck[1:2] != ["outgoing"], (reason, struck)


def test_exact_agrees_with_the_closed_form_on_a_thousand_random_scenes():
    tally = Counter()

    @settings(max_examples=1000, phases=[Phase.generate], suppress_health_check=list(HealthCheck))
    @given(draws)
    def one(draw):
        prediction = theory.predict(scene_of(draw))
        # Some rebounds rattle on in the nip of plate and pulley: stop once all is told.
        told = [float(t) for t in (prediction.t2, prediction.t3) if isfinite(t)]
        enough = 2.0 / draw["speed"] + sum(told) + 6.0
        drawn = scene_of(draw, max_time=enough)
        reason = str(prediction.reason)
        tally["drawn"] += 1
        built = built_or_none(drawn)
        if built is None:
            # The plate's line is missed, so there is nothing to hang the outgoing belt on; what
            # the theory says of the same scene without one, the engine confirms.
            assert theory.Reason.of(reason) is theory.Reason.NO_IMPACT, reason
            alone = scene_of(draw, outgoing=False, max_time=enough)
            confirm(str(theory.predict(alone).reason), exact.run(machine.build(alone)))
            tally["refused"] += 1
            return
        recording = exact.run(built)
        compared = compare(recording)
        if reason:
            confirm(reason, recording)
            tally[reason.partition(":")[0]] += 1
            return
        assert contacts_of(recording) == ["plate", "outgoing"]
        names = [n for n in QUANTITIES if n not in ("belt_work", "slip_heat")]
        assert set(names) == set(compared.errors)
        hit = recording.select(Kind.IMPACT)[0]
        vx, vy = hit["velocity_before"]
        alpha = radians(draw["angle_deg"])
        found = {"v2": compared.simulated["v2"], "normal": vx * cos(alpha) + vy * sin(alpha)}
        assert compared.max <= allowance(draw, found), (draw, compared.errors)
        tally["reached"] += 1

    one()
    assert tally["drawn"] == sum(n for what, n in tally.items() if what != "drawn") >= 1000
    assert tally["reached"] >= 0.4 * tally["drawn"], tally


# What `verify` promises of one answer beside another.


def rows_of(name, *overrides):
    return {row.pair: row for row in agreement(scene.load(name, overrides))}


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


@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("slip", []),
        ("perpendicular", ["incoming.friction=0.4", "particle.spin=true", "run.until=settled"]),
    ],
)
def test_where_contacts_last_a_stepped_engine_converges(name, overrides):
    row = rows_of(name, *overrides)["pymunk, exact"]
    assert row.least
    assert row.tolerance == 0.5
    assert row.holds
    assert row.difference > 1.0


def test_the_promise_grows_with_what_a_scene_makes_of_a_change():
    """At v0² = g Rc (1 - δ), cos φ1 = 1 - δ: dφ1/dv = -(2/v0) cos φ1 / sin φ1, sin φ1 = √(2 δ)."""
    delta = 1e-8
    speed = (GRAVITY * 0.104 * (1.0 - delta)) ** 0.5
    row = rows_of("perpendicular", f"incoming.speed={speed!r}")["exact, theory"]
    # Speeds and gravity fall by one share s: cos φ1 = v²/(g Rc) falls by s, φ1 grows by s / sin φ1,
    # and the place of the separation moves by Rc times that, measured by d1 = 0.6 m.
    growth = 0.104 / 0.6 / (2.0 * delta) ** 0.5
    assert row.tolerance == pytest.approx(1e-12 * growth, rel=0.1)
    assert row.holds


def test_who_cannot_run_a_scene_is_named_with_the_reason():
    rows = rows_of("perpendicular", "particle.radius=0")
    assert "mass point" in rows["pymunk"].quantity or "more than 0" in rows["pymunk"].quantity
    assert rows["exact, theory"].holds
    assert rows["dop853, exact"].holds


@pytest.mark.parametrize(
    ("errors", "found"),
    [
        ([1e-2, 1e-2 / 16, 1e-2 / 256], 2.0),
        ([1e-2, 1e-2 / 4, 1e-2 / 16], 1.0),
        ([1e-2, 1e-5, 1e-2], 0.0),
        ([1e-5, 1e-2, 1e-2], 0.0),
        ([1e-8, 1e-12, 1e-12], np.log(10.0) / np.log(4.0)),
        ([1e-12, 1e-10, 1e-11], np.inf),
    ],
)
def test_an_order_is_what_the_worst_errors_show(errors, found):
    assert order(errors, 4.0, 1e-9) == pytest.approx(found)


def test_an_order_of_runs_in_which_other_things_happen_is_none():
    assert np.isnan(order([1e-3, np.inf, 1e-5], 4.0, 1e-9))


def test_what_the_answers_share_is_what_they_import():
    """The theory imports none of our mechanics; the reference and pymunk no formula of ours."""
    sources = {
        "theory": theory.__path__[0],
        "pymunk": __import__("chutelab.engines.pymunk", fromlist=["run"]).__path__[0],
    }
    ours = r"chutelab\.(ballistics|impact|ride|nominal|exact)\b"
    for name, folder in sources.items():
        text = "".join(path.read_text("utf-8") for path in Path(folder).glob("*.py"))
        assert not re.search(rf"(from|import) {ours}", text), name
    text = Path(reference.__file__).read_text("utf-8")
    assert not re.search(rf"(from|import) {ours}", text)
    assert set(ANSWERS) == {"theory", "exact", "contact", "pymunk", "dop853"}


# A wrong formula, planted where the exact engine takes it from, must be seen from outside.

WRONG = 1e-6
"""Relative error of the planted formula."""


def restitution_on_the_slip(approach, slip, restitution, friction, share):
    """The printed Eq. (9) in an engine: the wrong component is damped."""
    normal, _ = impact.impulses(approach, slip, 1.0, friction, share)
    return normal, -(1.0 - np.asarray(restitution)) * np.asarray(slip)


def late_descent(gap, rate, acceleration):
    return ballistics.descent(gap, rate, acceleration) * (1.0 + WRONG)


def lively_blow(s, who, contact, before, approach, rebound, landing, blow=touch._blow):
    return blow(s, who, contact, before, approach, rebound * (1.0 + WRONG), landing)


PLANTED = [
    ("chutelab.exact.touch._blow", lively_blow),
    ("chutelab.exact.touch.impulses", restitution_on_the_slip),
    ("chutelab.exact.detect.descent", late_descent),
]


@pytest.mark.parametrize("until", ["landed", "settled"])
@pytest.mark.parametrize(("where", "wrong"), PLANTED)
def test_a_wrong_formula_is_caught_from_outside(where, wrong, until, monkeypatch):
    drawn = scene.load("perpendicular", [f"run.until={until}"])
    assert verify(drawn).failures == 0
    assert reach(drawn, 1e-9)[1].met
    monkeypatch.setattr(where, wrong)
    failed = [row.pair for row in verify(drawn).agreements if not row.holds]
    assert "exact, theory" in failed
    assert {f"{name}, exact" for name in ("dop853", "contact", "pymunk")} <= set(failed)
    assert not {"dop853, theory", "contact, theory", "pymunk, theory"} & set(failed)
    found = reach(drawn, 0.1 * WRONG)[1]
    assert not found.met
    assert found.reached is None or found.reached > 0.1 * WRONG
    assert found.against == ("theory" if until == "landed" else "dop853")


def test_a_wrong_formula_that_places_the_belt_is_caught_by_the_theory(monkeypatch):
    """The machine's own arrays are shared by all engines; only the theory has none of them."""
    right = ballistics.crossing
    monkeypatch.setattr("chutelab.nominal.crossing", lambda *gap: right(*gap) * (1.0 + WRONG))
    drawn = scene.load("perpendicular")
    failed = [row.pair for row in agreement(drawn) if not row.holds]
    assert {"exact, theory", "dop853, theory", "contact, theory", "pymunk, theory"} <= set(failed)
    assert not reach(drawn, 0.1 * WRONG)[1].met
