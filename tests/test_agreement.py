"""The three answers: closed form, event-driven, Pymunk."""

from __future__ import annotations

from collections import Counter
from itertools import groupby
from math import cos, isfinite, radians, sin

import numpy as np
import pytest
from hypothesis import HealthCheck, Phase, assume, given, settings
from hypothesis import strategies as st

from chutelab import exact, machine, scene, stepper, theory
from chutelab.agreement import agreement
from chutelab.compare import QUANTITIES, compare
from chutelab.compare import scene_of as scene_from
from chutelab.recording import REASONS, Kind
from chutelab.simulation import simulate
from drawn import draw

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


def scene_of(draw, *, outgoing=True, max_time=30.0, dt=1e-3, align=True):
    return scene.from_dict(
        {
            "gravity": GRAVITY,
            "run": {"max_time": max_time, "dt": dt, "align": align},
            "particle": {"radius": draw["radius"]},
            "incoming": {"speed": draw["speed"], "pulley_radius": draw["pulley_radius"]},
            "plate": {
                "distance": draw["distance"] + draw.get("shift", 0.0),
                "angle_deg": draw["angle_deg"],
                "restitution": draw["restitution"],
                **({"below": draw["below"]} if "below" in draw else {}),
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


def surfaces_met(recording):
    """The surfaces in the order met; a run of bounces on one of them counts once."""
    return [name for name, _ in groupby(contacts_of(recording))]


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
        assert struck[1:2] != ["outgoing"], (reason, struck)


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
            assert len(compared.errors) >= len(QUANTITIES) - 2, (seed, compared.errors)
            tally["landed"] += 1
    assert tally["compared"] > 0.5 * len(seeds), tally
    assert tally["landed"] >= 0.1 * len(seeds), tally
    assert tally["corner"] < 0.05 * len(seeds), tally


stepped_draws = draws.map(lambda d: {**d, "radius": max(d["radius"], 0.002)})

STEPS = (1 / 60, 1e-2, 1e-3, 1e-4)

CARRIED = (
    "perpendicular", "perpendicular-fast", "inclined-20", "inclined-40", "inclined-60", "low-speed",
)  # fmt: skip


def apart(mine, its, what, scale):
    """Largest difference of two lists of events, as a share of a scale."""
    return float(np.abs(mine[what] - its[what]).max() / scale)


@pytest.mark.parametrize("name", CARRIED)
@pytest.mark.parametrize("dt", STEPS)
def test_pymunk_tells_the_story_of_a_shipped_scene_as_exact_does(name, dt):
    built = machine.build(scene.load(scene.find(name), [f"run.dt={dt}"]))
    recording, stepped = exact.run(built), stepper.run(built)
    mine, its = recording.events, stepped.events
    assert its["kind"].tolist() == mine["kind"].tolist()
    assert its["surface"].tolist() == mine["surface"].tolist()
    speed = np.hypot(*recording.track(0)["velocity"].T).max()
    for what, scale in (
        ("t", mine["t"][-1]),
        ("position", 1.0),
        ("velocity_before", speed),
        ("velocity_after", speed),
        ("normal_impulse", recording.particle.mass * speed),
        ("tangential_impulse", recording.particle.mass * speed),
    ):
        assert apart(mine, its, what, scale) < 1e-14, what
    energy = recording.particle.mass * speed**2
    assert stepped.by_surface == pytest.approx(recording.by_surface, abs=1e-14 * energy)
    ends = [one.track(0)[-1] for one in (recording, stepped)]
    assert ends[1]["position"] == pytest.approx(ends[0]["position"], abs=1e-14)
    assert ends[1]["entries"] == pytest.approx(ends[0]["entries"], abs=1e-14 * energy)
    # What is not stepped does not depend on the step.
    assert stepped.steps == 2


@pytest.mark.parametrize(
    "held",
    [
        True,
        False,
    ],
    ids=["rides round the pulley", "separates at the top"],
)
def test_pymunk_agrees_with_exact_at_any_step(held):
    tally = Counter()

    @settings(max_examples=60, suppress_health_check=list(HealthCheck), phases=[Phase.generate])
    @given(stepped_draws, st.sampled_from(STEPS))
    def one(draw, dt):
        rho = draw["pulley_radius"] + draw["radius"]
        if held:
            draw = {**draw, "speed": 0.95 * min(draw["speed"] / 6.0, 1.0) * (GRAVITY * rho) ** 0.5}
        else:
            assume(draw["speed"] ** 2 > 1.001 * GRAVITY * rho)
        built = built_or_none(scene_of(draw, max_time=1.0 / draw["speed"] + 4.0, dt=dt))
        assume(built is not None)
        recording = exact.run(built)
        assume(contacts_of(recording) == ["plate", "outgoing"])
        (hit,), (land,) = (recording.select(k) for k in (Kind.IMPACT, Kind.LANDING))
        # What rebounds more slowly than a step of gravity comes to rest; and steps are shorter
        # than √(2.5e-3 r/g), which takes 0.022 m/s from 2 cm.
        assume(hit["velocity_after"] @ plate_normal(recording) > 0.03)
        stepped = stepper.run(built)
        assert contacts_of(stepped) == ["plate", "outgoing"]
        speed = np.hypot(*recording.track(0)["velocity"].T).max()
        mine, its = (r.select(Kind.IMPACT, Kind.LANDING) for r in (recording, stepped))
        worst = max(
            apart(mine, its, what, scale)
            for what, scale in (
                ("t", land["t"]),
                ("position", 1.0),
                ("velocity_before", speed),
                ("velocity_after", speed),
                ("normal_impulse", recording.particle.mass * speed),
                ("tangential_impulse", recording.particle.mass * speed),
            )
        )
        books = np.abs(stepped.by_surface - recording.by_surface).max()
        worst = max(worst, books / (recording.particle.mass * speed**2))
        assert worst < 1e-11, (draw, dt, worst)
        tally["compared"] += 1

    one()
    assert tally["compared"] >= 20, tally


@pytest.mark.parametrize("dt", STEPS)
def test_pymunk_falls_freely_along_a_plate_that_takes_all(dt):
    # Nothing presses it on an upright plate, so there is nothing to step on the way down.
    draw = {
        "speed": 1.9, "pulley_radius": 0.03, "angle_deg": 0.0, "restitution": 0.0, "radius": 0.002,
        "distance": 0.1,
    }  # fmt: skip
    built = machine.build(scene_of(draw, max_time=3.0, dt=dt))
    recording, stepped = exact.run(built), stepper.run(built)
    assert contacts_of(recording) == contacts_of(stepped) == ["plate", "outgoing"]
    for what in ("t", "position", "velocity_after"):
        mine, its = (r.select(Kind.LANDING)[what] for r in (recording, stepped))
        assert its == pytest.approx(mine, abs=1e-8), what


@pytest.mark.parametrize(("dt", "examples"), [(1e-3, 60), (1e-4, 6)])
def test_pymunk_with_fixed_steps_agrees_with_exact_to_the_way_of_three(dt, examples):
    tally = Counter()

    @settings(
        max_examples=examples, suppress_health_check=list(HealthCheck), phases=[Phase.generate]
    )
    @given(stepped_draws)
    def one(draw):
        drawn = scene_of(draw, max_time=3.0, dt=dt, align=False)
        built = built_or_none(drawn)
        assume(built is not None)
        recording = exact.run(built)
        track = recording.track(0)
        way = 3.0 * dt * float(np.hypot(*track["velocity"].T).max())
        assume(way / 3.0 < draw["radius"] + stepper.HALF_THICKNESS)
        assume(surfaces_met(recording)[-1:] == ["outgoing"])
        shifted = []
        for shift in (-way, way):
            moved = built_or_none(scene_of({**draw, "shift": shift}, max_time=3.0))
            assume(moved is not None)
            shifted.append(exact.run(moved))
            assume(surfaces_met(shifted[-1]) == surfaces_met(recording))
        stepped = stepper.run(built)
        assert surfaces_met(stepped) == surfaces_met(recording)
        for kind in (Kind.IMPACT, Kind.LANDING):
            mine, its, *others = (
                r.select(kind)["position"][0] for r in (recording, stepped, *shifted)
            )
            off, along = np.abs(mine - its), 1 if kind is Kind.IMPACT else 0
            allowed = way
            if "incoming" in surfaces_met(recording):
                # A blow on the round pulley magnifies what came before it, in any answer.
                allowed = max(way, *(abs(mine[along] - other[along]) for other in others))
            assert off[along] <= allowed, (draw, off, allowed)
            tally["late"] += bool(off.max() > 1e-3 * way)
        tally["compared"] += 1

    one()
    assert tally["compared"] >= 0.2 * examples
    assert tally["late"] >= tally["compared"]  # plain steps they are


# What `verify` promises of one answer beside another.


def test_steps_that_end_at_impacts_are_promised_1e_8_of_the_extent():
    rows = agreement(scene.load("belt-landing"))
    assert [row.pair for row in rows] == ["exact, theory", "pymunk, exact", "pymunk, exact"]
    landing = simulate(scene.load("belt-landing")).track(0)["position"]
    assert rows[2].tolerance == pytest.approx(1e-8 * np.abs(landing).max(), rel=1e-12)
    assert all(row.holds and row.difference < 1e-12 for row in rows)


def test_fixed_steps_are_promised_three_steps_of_way():
    rows = agreement(scene.load("perpendicular", ["run.align=false"]))
    # The fastest it gets, at the landing: v² = v0² + 2 g (drop to the belt) after the impact.
    track = simulate(scene.load("perpendicular")).track(0)
    fastest = max(np.hypot(*velocity) for velocity in track["velocity"])
    assert rows[2].tolerance == pytest.approx(3.0 * 1e-3 * fastest, rel=1e-12)
    assert rows[2].holds
    assert rows[2].difference > 1e-5


@pytest.mark.parametrize(
    "overrides",
    [
        ["particle.radius=0.001"],
        ["run.align=false", "run.dt=0.1"],
        ["incoming.friction=0.5"],
    ],
)
def test_no_bound_where_none_is_known(overrides):
    rows = agreement(scene.load("perpendicular", overrides))
    assert {row.tolerance for row in rows[1:]} == {None}
