"""Wear: sums by hand over blows and slides, the ledger's entries, and where they lie."""

import csv
from math import atan, cos, pi, radians, sin, sqrt, tan

import numpy as np
import pytest

import chutelab
from chutelab.results.wear import KEYS, finnie, worn
from chutelab.util.errors import InputError
from shared import call

G = 9.81
ENGINES = ("exact", "contact", "pymunk")


def test_finnie_is_greatest_where_tan_2_gamma_is_two_thirds():
    """f = sin 2γ - 3 sin² γ, f' = 2 cos 2γ - 3 sin 2γ = 0; from tan γ = 1/3 on cos² γ / 3."""
    best = 0.5 * atan(2.0 / 3.0)
    angles = np.linspace(0.0, 0.5 * pi, 20_001)
    assert angles[finnie(angles).argmax()] == pytest.approx(best, abs=1e-4)
    assert finnie(best) == pytest.approx(sin(2 * best) - 3 * sin(best) ** 2)
    joint = atan(1.0 / 3.0)
    assert finnie(joint - 1e-9) == pytest.approx(cos(joint) ** 2 / 3.0, abs=1e-8)
    assert finnie([0.5 * pi, radians(45.0)]) == pytest.approx([0.0, 1.0 / 6.0], abs=1e-15)


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("lean", [20.0, 80.0])
def test_a_blow_by_hand(engine, lean):
    """A disk that does not turn falls on a face that leans from the ground by so much.

    v = √(2 g h); v_n = v cos, v_t = v sin; J_n = m (1 + ε) v_n, J_t = min(µ J_n, m v_t); the heat
    is J_t (v_t - J_t / 2m), what the blow loses ½ m (1 - ε²) v_n²; γ is between the face and v.
    """
    m, r, eps, mu, a, fall = 0.2, 0.01, 0.4, 0.3, radians(lean), 0.5
    face = {"name": "face", "from": [-cos(a), -sin(a)], "to": [cos(a), sin(a)],
            "restitution": eps, "friction": mu}  # fmt: skip
    # It strikes 0.3 m up the face from its middle.
    at = [0.3 * cos(a) - r * sin(a), 0.3 * sin(a) + r * cos(a) + fall]
    particle = {"radius": r, "mass": m, "spin": False}
    scene = {"particle": particle, "surface": [face], "stream": {"at": at, "velocity": [0.0, 0.0]},
             "run": {"until": sqrt(2 * fall / G) + 0.02}}  # fmt: skip
    one = chutelab.simulate(scene, engine=engine).wear("face")
    v = sqrt(2.0 * G * fall)
    into, past = v * cos(a), v * sin(a)
    drag = min(mu * m * (1.0 + eps) * into, m * past)
    gamma = 0.5 * pi - a
    f = sin(2 * gamma) - 3 * sin(gamma) ** 2 if tan(gamma) < 1 / 3 else cos(gamma) ** 2 / 3
    expected = {
        "impact": 0.5 * m * (1.0 - eps**2) * into**2,
        "sliding": drag * (past - 0.5 * drag / m),
        "erosion": m * v**2 * f,
        "abrasion": drag * (past - 0.5 * drag / m) / mu,
    }
    tolerance = 1e-9 if engine == "pymunk" else 1e-12
    for key, value in expected.items():
        found = getattr(one, key)
        assert found.sum() == pytest.approx(value, rel=tolerance), key
        # 1.3 m along 2 m in 50 pieces of 40 mm.
        assert np.flatnonzero(found).tolist() == [32], key
    assert one.places[32] == pytest.approx(
        np.outer([0.28, 0.30, 0.32], [cos(a), sin(a)]), abs=1e-12
    )


@pytest.mark.parametrize("engine", ENGINES)
def test_a_slide_rubs_each_piece_alike(engine):
    """15° down, µ = 0.1: load times distance is m g cos times the length, heat µ times it."""
    a, m, mu = radians(15.0), 0.5, 0.1
    ramp = {"name": "ramp", "from": [0.0, 0.0], "to": [2 * cos(a), -2 * sin(a)],
            "restitution": 0.0, "friction": mu}  # fmt: skip
    at = [0.1 * cos(a) + 0.01 * sin(a), -0.1 * sin(a) + 0.01 * cos(a)]
    run = chutelab.simulate(
        {"particle": {"radius": 0.01, "mass": m, "spin": False}, "surface": [ramp],
         "stream": {"at": at, "velocity": [0.0, 0.0]}, "run": {"until": 1.1}},
        engine=engine,
    )  # fmt: skip
    one = run.wear("ramp")
    reach = 0.1 + 0.5 * G * (sin(a) - mu * cos(a)) * 1.1**2
    begin, end = one.edges[:-1], one.edges[1:]
    inside = (np.minimum(end, reach) - np.maximum(begin, 0.1)).clip(0.0)
    expected = m * G * cos(a) * inside
    tolerance = 1e-3 * expected.max()
    assert one.abrasion == pytest.approx(expected, abs=tolerance)
    assert one.sliding == pytest.approx(mu * expected, abs=mu * tolerance)
    assert one.abrasion.sum() == pytest.approx(m * G * cos(a) * (reach - 0.1), rel=1e-6)
    volume = run.wear("ramp", pieces=10, abrasion=2e-12).abrasion
    assert volume == pytest.approx(2e-12 * one.abrasion.reshape(10, 5).sum(axis=1))


@pytest.mark.parametrize("engine", ENGINES)
def test_a_belt_is_struck_by_the_relative_velocity_and_rubbed_until_nothing_slips(engine):
    """On a belt at u a disk that does not turn falls: m u² / 2 of heat, whatever µ > 0 is."""
    m, u, fall = 0.008, 2.0, 0.3
    belt = {"name": "belt", "from": [-1.0, 0.0], "to": [3.0, 0.0], "speed": u,
            "restitution": 0.0, "friction": 0.5}  # fmt: skip
    scene = {"particle": {"radius": 0.006, "mass": m, "spin": False}, "surface": [belt],
             "stream": {"at": [0.0, fall + 0.006], "velocity": [0.0, 0.0]},
             "run": {"until": 1.0}}  # fmt: skip
    one = chutelab.simulate(scene, engine=engine).wear("belt")
    v = sqrt(2.0 * G * fall)
    gamma = atan(v / u)
    assert one.sliding.sum() == pytest.approx(0.5 * m * u * u, rel=1e-6)
    assert one.abrasion.sum() == pytest.approx(m * u * u, rel=1e-6)
    assert one.erosion.sum() == pytest.approx(m * (u * u + v * v) * cos(gamma) ** 2 / 3.0, rel=1e-6)
    # Struck with friction µ m v, it slides on from 0 at µ g until it runs with the belt.
    began = 0.5 * v
    reach = (u * u - began * began) / (2.0 * 0.5 * G)
    worn_at = one.edges[:-1][one.sliding > 1e-9]
    assert worn_at[0] == pytest.approx(1.0 - 0.04, abs=0.08)
    assert worn_at[-1] == pytest.approx(1.0 + reach, abs=0.08)


def test_a_plate_that_turns_is_struck_where_it_is_then():
    """At ω = 1 rad/s about its end; a disk that waits is met s away: ½ m (1 - ε²) ω² s²."""
    paddle = {"name": "paddle", "from": [0.0, 0.0], "to": [1.0, 0.0], "restitution": 0.5,
              "friction": 0.0, "turn": 180.0 / pi}  # fmt: skip
    scene = {"gravity": 0.0, "particle": {"radius": 0.01, "mass": 1.0, "spin": False},
             "surface": [paddle], "stream": {"at": [0.5, 0.2], "velocity": [0.0, 0.0]},
             "run": {"until": 0.4}}  # fmt: skip
    one = chutelab.simulate(scene, engine="contact").wear("paddle", pieces=100)
    (part,) = np.flatnonzero(one.impact)
    arm = sqrt(0.5**2 + 0.2**2 - 0.01**2)
    assert one.edges[part] <= arm <= one.edges[part + 1]
    assert one.impact.sum() == pytest.approx(0.5 * (1.0 - 0.5**2) * arm**2, rel=1e-9)
    # The face goes straight at the centre, which is at rest: nothing cuts.
    assert one.erosion.sum() == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize(
    ("scene", "engine"),
    [("spoon", "exact"), ("spoon", "contact"), ("slip", "pymunk"), ("cascade", "exact")],
)
def test_sums_over_pieces_are_the_ledgers(scene, engine):
    run = chutelab.simulate(scene, engine=engine)
    for name in run.machine.surfaces:
        one, entries = run.wear(name), run.ledger.by_surface[name]
        scale = run.ledger.turned_over
        assert one.impact.sum() == pytest.approx(entries["restitution_loss"], abs=1e-12 * scale)
        assert one.sliding.sum() == pytest.approx(entries["friction_loss"], abs=1e-12 * scale)
        assert one.unplaced == 0.0


def test_what_slides_close_above_a_surface_does_not_wear_it():
    """One slides on the floor's left, one 0.3 r above its right, on a shelf."""
    r, grip = 0.01, {"restitution": 0.0, "friction": 0.3}
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0], **grip}
    shelf = {"name": "shelf", "from": [0.3, 0.3 * r], "to": [0.9, 0.3 * r], **grip}
    run = chutelab.simulate({
        "particle": {"radius": r}, "surface": [floor, shelf], "run": {"until": 0.2},
        "stream": [{"at": [-0.9, r], "velocity": [0.8, 0.0]},
                   {"at": [0.4, 1.3 * r], "velocity": [0.8, 0.0]}],
    })  # fmt: skip
    worn_at = run.wear("floor").sliding
    lost = run.ledger.by_surface["floor"]["friction_loss"]
    assert run.ledger.by_surface["shelf"]["friction_loss"] == pytest.approx(lost, rel=1e-6)
    assert worn_at[: len(worn_at) // 2].sum() == pytest.approx(lost, rel=1e-9)
    assert worn_at[len(worn_at) // 2 :].sum() == 0.0


def test_in_a_crowd_they_are_too():
    run = chutelab.simulate("hopper", {"stream.count": 60})
    for name in ("left", "right", "gate"):
        one, entries = run.wear(name), run.ledger.by_surface[name]
        assert one.sliding.sum() == pytest.approx(entries["friction_loss"], rel=1e-9)
        assert one.impact.sum() == pytest.approx(entries["restitution_loss"], rel=1e-9)
        # Of several blows at one instant one may give what another takes.
        assert one.sliding.min() >= -1e-4 * one.sliding.sum()


def test_files_quantities_and_refusals(tmp_path):
    called = ["run", "spoon", "--out", str(tmp_path), "--only", "wear", "--language", "de"]
    call(*called, "--erosion", "2e-11", "--abrasion", "3e-13")
    rows = list(csv.DictReader((tmp_path / "wear.csv").read_text("utf-8").splitlines()))
    run = chutelab.simulate("spoon")
    assert {row["surface"] for row in rows} == {"plate", "outgoing", "spoon"}
    told = [float(row["erosion"]) for row in rows if row["surface"] == "spoon"]
    assert told == run.wear("spoon").erosion.tolist()
    for key, k in (("erosion", 2e-11), ("abrasion", 3e-13)):
        volumes = [float(row[f"{key}_m3"]) for row in rows if row["surface"] == "spoon"]
        assert volumes == getattr(run.wear("spoon", **{key: k}), key).tolist()
    for given in (["--erosion", "0"], ["--abrasion", "hard"], ["--erosion", "inf"]):
        refused = call(*called, *given, code=2)
        assert given[0].strip("-") in refused.output
    lost = call("run", "spoon", "--erosion", "1e-11", code=2)
    assert "--erosion is for wear.csv: give --out DIR, with wear" in lost.output
    assert (tmp_path / "wear.png").stat().st_size > 20_000
    for key in KEYS:
        values = getattr(run.wear("spoon"), key)
        assert run.measure(f"wear.spoon.{key}.sum") == values.sum()
        assert run.measure(f"wear.spoon.{key}.peak") == values.max()
    # No friction, no heat: nothing tells how far what slides there slides.
    assert np.isnan(run.measure("wear.plate.abrasion.sum"))
    with pytest.raises(InputError, match="spoon"):
        run.wear("spon")
    with pytest.raises(InputError, match="pieces = 0: a whole number from 1"):
        run.wear("spoon", pieces=0)
    with pytest.raises(InputError, match="a finite number above 0"):
        worn(run, "spoon", erosion=-1.0)
