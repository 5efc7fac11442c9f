"""Simulated against theory: quantities from the events, errors from their scales."""

from dataclasses import replace
from math import acos, cos, hypot, isnan, nan, pi, radians, sin

import numpy as np
import pytest

from chutelab import scene, theory
from chutelab.engines.simulation import simulate
from chutelab.results import Kind
from chutelab.results.arrival import never
from chutelab.results.quantities import compare, relative_error
from chutelab.results.quantities import from_events as from_recorded
from chutelab.scene.quantities import THEORY

M, R, r = 0.008, 0.1, 0.0063


def run(name, *overrides, **options):
    return simulate(scene.load(scene.find(name), overrides), **options)


@pytest.mark.parametrize("away", [-5e-15, 5e-15, 5e-13])
def test_a_rebound_up_along_the_plate_is_told_as_such_whatever_rounding_does(away):
    """φ2r = atan2(along, away) of the way down is ±π there; what is no rounding counts."""
    left, hit, down = (never(1) for _ in range(3))
    hit["velocity_before"], hit["velocity_after"] = (1.0, 0.0), (-away, 1.0)
    told = from_recorded(scene.load("perpendicular"), left, hit, down, r, M)["phi2r"][0]
    assert told == (pi if abs(away) < 1e-14 else pi - away)


def first(recording, kind, surface):
    return next(
        event
        for event in recording.events
        if event["particle"] == 0
        and event["kind"] == kind
        and recording.surfaces[event["surface"]] == surface
    )


def from_events(recording):
    """The paper's quantities of particle 0, from separation, impact and landing."""
    drawn = recording.scene
    alpha, belt, rate = radians(drawn.plate.angle_deg), drawn.outgoing.speed, drawn.stream.rate
    left = first(recording, Kind.SEPARATION, "incoming")
    hit = first(recording, Kind.IMPACT, "plate")
    down = first(recording, Kind.LANDING, "outgoing")
    (x1, y1), (x2, y2), (x3, y3) = (event["position"] for event in (left, hit, down))
    before, after, last = (
        hit["velocity_before"], hit["velocity_after"], down["velocity_before"]
    )  # fmt: skip
    rho = drawn.incoming.pulley_radius + drawn.particle.radius
    # the face looks along (-cos α, -sin α); its own direction downwards is (sin α, -cos α)
    along = np.array([sin(alpha), -cos(alpha)])
    energy = 0.5 * drawn.particle.mass * (last[0] ** 2 + belt**2)
    return {
        "phi1": acos(min(y1 / rho, 1.0)), "v1": hypot(*left["velocity_after"]),
        "t2": hit["t"] - left["t"], "x2": x2 - x1, "y2": y1 - y2, "v2": hypot(*before),
        "phi2": acos(before @ along / hypot(*before)),
        "phi2r": acos(after @ along / hypot(*after)), "v2r": hypot(*after),
        "t3": down["t"] - hit["t"], "x3": x2 - x3, "y3": y2 - y3,
        "v3x": -last[0], "v3y": -last[1], "v3": hypot(*last),
        "d3": rho - y3, "dEk": energy, "P": energy * rate,
    }  # fmt: skip


CASES = [
    ("perpendicular", ()), ("inclined-20", ()),
    ("inclined-60", ("outgoing.speed=-1.5", "stream.rate=40")),
    ("low-speed", ("particle.mass=0.3",)), ("slip", ()),
    ("stream-independent", ("stream.count=30",)),
]  # fmt: skip


@pytest.mark.parametrize(("name", "overrides"), CASES)
def test_the_quantities_are_those_of_the_events(name, overrides):
    recording = run(name, *overrides)
    found, expected = compare(recording).simulated, from_events(recording)
    assert set(found) == set(THEORY) == {*expected, "belt_work", "slip_heat"}
    for quantity, value in expected.items():
        # near 0 an arc cosine keeps half the digits only
        loose = 1e-7 if quantity == "phi1" else 1e-14
        assert found[quantity] == pytest.approx(value, rel=1e-13, abs=loose), quantity
    assert isnan(found["belt_work"])
    assert isnan(found["slip_heat"])


@pytest.mark.parametrize(("name", "overrides"), CASES)
@pytest.mark.parametrize("engine", ["exact", "pymunk"])
def test_an_error_is_a_difference_over_the_larger_of_theory_and_scale(engine, name, overrides):
    if engine == "pymunk" and "stream" in name:
        overrides = ("stream.count=1",)
    recording = run(name, *overrides, engine=engine)
    compared, drawn = compare(recording), recording.scene
    predicted = theory.predict(drawn)
    v2, t2, t3 = (float(getattr(predicted, key)) for key in ("v2", "t2", "t3"))
    energy = 0.5 * drawn.particle.mass * v2**2
    length = drawn.incoming.pulley_radius + drawn.plate.distance
    scales = {
        **dict.fromkeys(("x2", "y2", "x3", "y3", "d3"), length),
        **dict.fromkeys(("v1", "v2", "v2r", "v3x", "v3y", "v3"), v2),
        **dict.fromkeys(("t2", "t3"), t2 + t3),
        **dict.fromkeys(("phi1", "phi2", "phi2r"), 1.0),
        "dEk": energy,
        "P": energy * drawn.stream.rate,
    }
    expected = {
        key: abs(compared.simulated[key] - float(getattr(predicted, key)))
        / max(abs(float(getattr(predicted, key))), scale)
        for key, scale in scales.items()
    }
    assert compared.errors == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert compared.max == max(compared.errors.values())
    assert compared.reason == ""
    if engine == "exact":
        assert compared.max < 2e-13 if name == "slip" else compared.max < 5e-15
    else:
        assert compared.max < 0.03


def test_a_wrong_event_shows_in_its_quantities_only():
    recording = run("perpendicular")
    events = recording.events.copy()
    hit = np.flatnonzero(events["kind"] == Kind.IMPACT)[0]
    events["velocity_after"][hit] *= 1.25
    compared = compare(replace(recording, events=events))
    wrong = {name for name, error in compared.errors.items() if error > 1e-12}
    assert wrong == {"v2r"}
    assert compared.errors["v2r"] == pytest.approx(
        0.25 * compared.theory["v2r"] / max(compared.theory["v2r"], compared.theory["v2"])
    )


def test_where_one_of_the_two_has_no_answer_there_is_no_error():
    none = compare(run("free-fall"))
    assert (none.errors, none.max) == ({}, None)
    assert "incoming" in none.reason
    part = compare(run("perpendicular", "outgoing.start=2.0", "outgoing.drop_from=top"))
    assert set(part.errors) == {"phi1", "v1", "t2", "x2", "y2", "v2", "phi2", "phi2r", "v2r"}
    assert part.max < 1e-14
    assert isnan(part.simulated["x3"])
    assert isnan(part.theory["x3"])
    assert part.reason.startswith("misses")


def test_errors_where_nothing_moves_stay_finite():
    assert relative_error(0.5, 0.0, 0.0) == 0.5
    assert relative_error(0.5, 0.0, nan) == 0.5
    assert relative_error(3.0, 2.0, nan) == 0.5
    assert relative_error(3.0, 2.0, 4.0) == 0.25
    assert relative_error(-3.0, -4.0, 2.0) == 0.25


@pytest.mark.parametrize(
    ("name", "speed"), [("perpendicular", 2.0), ("perpendicular", 0.0), ("inclined-20", -1.5)]
)
def test_the_belt_of_a_settled_run_pays_what_the_formula_says(name, speed):
    long = ("outgoing.start=-20", "outgoing.length=40")
    recording = run(name, "run.until=settled", f"outgoing.speed={speed}", *long)
    compared = compare(recording)
    vx = first(recording, Kind.LANDING, "outgoing")["velocity_before"][0]
    work, heat = M * speed * (speed - vx), 0.5 * M * (speed - vx) ** 2
    size = 0.5 * M * compared.theory["v2"] ** 2
    assert compared.simulated["belt_work"] == pytest.approx(work, abs=1e-14 * size)
    assert compared.simulated["slip_heat"] == pytest.approx(heat, abs=1e-14 * size)
    assert {"belt_work", "slip_heat"} <= set(compared.errors)
    assert compared.max < 1e-14


def test_a_particle_that_never_stops_slipping_is_not_compared_with_one_that_does():
    endless = ("outgoing.friction=0", "run.until=settled")
    found = compare(simulate(scene.load("perpendicular", endless)))
    assert "belt_work" not in found.errors
    assert found.theory["belt_work"] > 0.0
    assert found.max < 5e-15


def test_a_rebound_up_along_the_plate_has_one_angle():
    # ε = 0 and no friction: up along the plate, where φ2' is π and rounding could say -π.
    angles = np.linspace(-59.0, -21.0, 8)
    for angle in angles:
        compared = compare(
            run("perpendicular", f"plate.angle_deg={angle}", "plate.restitution=0",
                "incoming.speed=5.0")
        )  # fmt: skip
        assert compared.simulated["phi2r"] == pytest.approx(pi, abs=1e-13)


def test_what_the_belt_pays_is_compared_only_where_it_alone_brings_to_rest():
    # It bounces from the belt back to the plate, whose blow the closed form does not know.
    nook = ("plate.angle_deg=20", "plate.restitution=0.1", "outgoing.restitution=0.8")
    way = ("incoming.speed=3", "outgoing.drop=1.0", "outgoing.speed=4", "outgoing.length=60")
    again = run("perpendicular", *nook, *way, "run.until=settled")
    assert again.ended[0] == 2
    after = again.events["t"] > again.select(Kind.LANDING)["t"][0]
    assert "plate" in [again.surfaces[s] for s in again.events["surface"][after]]
    assert isnan(compare(again).simulated["belt_work"])
    alone = run("perpendicular", "run.until=settled")
    assert compare(alone).errors["belt_work"] < 1e-12
