"""Solving, optimising and propagating uncertainties, against closed forms written here."""

import csv
import json
import re
from math import cbrt, cos, pi, radians, sin, sqrt, tan
from pathlib import Path
from statistics import NormalDist

import numpy as np
import pytest
from click.testing import CliRunner
from PIL import Image

import chutelab
import typed as design
from chutelab import scene
from chutelab.cli import main
from chutelab.cli.options import uncertain
from chutelab.pictures.plots.studies import scan, spread
from chutelab.studies.design import roots
from chutelab.studies.design.evaluation import Evaluator, Outcomes, measured, target
from chutelab.studies.design.uncertainty import as_dict, indices, sampled, spreads
from chutelab.util.errors import InputError
from shared import call, some

G, V, R, D, DROP, M = 9.81, 2.0, 0.1, 0.5, 0.5, 0.008


def machine(**changes):
    """A mass point; the pivot at the pulley's top, so that d1 = R + D is where the plate begins."""
    document = {
        "particle": {"radius": 0.0, "mass": M},
        "incoming": {"speed": V, "pulley_radius": R},
        "plate": {"distance": D, "restitution": 0.5},
        "outgoing": {"drop": DROP, "speed": V, "start": -5.0, "length": 20.0},
    }
    for key, value in changes.items():
        table, _, name = key.partition("__")
        if value is None:
            del document[table]
        else:
            document[table][name] = value
    return scene.from_dict(document)


def at_plate(alpha, *, v=V, d1=R + D, g=G):
    """Into the plate and down along it: velocity where a horizontal throw meets its line."""
    c, s = cos(alpha), sin(alpha)
    # (x - d1) c + (y - R) s = 0 with x = v t, y - R = -g t²/2
    t = (v * c - sqrt((v * c) ** 2 - 2.0 * g * s * d1 * c)) / (g * s) if s else d1 / v
    vx, vy = v, -g * t
    return vx * c + vy * s, vx * s - vy * c


def forward(alpha, restitution, **machine_of):
    into, down = at_plate(alpha, **machine_of)
    return down * sin(alpha) - restitution * into * cos(alpha)


def ten():
    """Yield scene, --vary, and the closed form of the value at which landing.vx = belt speed."""
    a20, a40, a50 = radians(20.0), radians(40.0), radians(50.0)
    for degrees, restitution in ((20.0, 0.5), (35.0, 0.3)):
        belt = forward(radians(degrees), restitution, d1=R + 0.1)
        near = machine(plate__distance=0.1, plate__restitution=restitution, outgoing__speed=belt)
        yield near, "plate.angle_deg=10:45", degrees
    near = machine(plate__distance=0.1, plate__angle_deg=20.0)
    yield near, "outgoing.speed=-3:3", forward(a20, 0.5, d1=R + 0.1)

    into, down = at_plate(a40, v=3.0, d1=R + 0.1)
    fast = machine(incoming__speed=3.0, plate__distance=0.1, plate__angle_deg=40.0,
                   outgoing__speed=0.4)  # fmt: skip
    yield fast, "plate.restitution=0:1", (down * sin(a40) - 0.4) / (into * cos(a40))

    # vx' = v - (1 + ε) into cos α says how fast it falls at the plate, and that how far it flew.
    belt, restitution = 1.0, 0.4
    into = (V - belt) / ((1.0 + restitution) * cos(a40))
    falls = (V * cos(a40) - into) / sin(a40)
    reach = V * falls / G - 0.5 * falls**2 / G * tan(a40)
    given = {"plate__angle_deg": 40.0, "plate__restitution": restitution, "outgoing__speed": belt}
    yield machine(**given), "plate.distance=0.01:0.3", reach - R
    small = machine(**given, plate__distance=0.05)
    yield small, "incoming.pulley_radius=0.01:0.3", reach - 0.05
    flight = (R + 0.1) / (V - 0.5 * falls * tan(a40))
    heavy = machine(**given, plate__distance=0.1)
    yield scene.from_dict({**scene.to_dict(heavy), "gravity": 5.0}), "gravity=1:15", falls / flight

    yield machine(outgoing__speed=-0.7), "incoming.speed=1.2:3", 0.7 / 0.5

    # Friction on the plate takes µ (1 + ε) of the blow from what runs along it.
    into, down = at_plate(a50, d1=R + 0.05)
    rubbed = (down - (1.5 + 0.1 * into * cos(a50)) / sin(a50)) / (1.1 * into)
    rough = machine(plate__distance=0.05, plate__angle_deg=50.0, plate__restitution=0.1,
                    outgoing__speed=1.5)  # fmt: skip
    yield rough, "plate.friction=0:1", rubbed

    # Round the pulley first: cos φ1 = v²/(g R), and v cos φ1 is kept to the belt.
    slow = machine(plate=None, incoming__speed=0.6, outgoing__speed=0.3, outgoing__drop_from="top",
                   outgoing__drop=0.6)  # fmt: skip
    yield slow, "incoming.speed=0.1:0.95", cbrt(G * R * 0.3)


TEN = list(ten())


@pytest.mark.parametrize(("given", "vary", "expected"), some(TEN, 2))
def test_landing_with_the_belts_speed_agrees_with_the_closed_form(given, vary, expected):
    found = design.solve(given, vary, "landing.vx=outgoing.speed", points=41)
    assert len(found.answers) == 1
    assert found.answer.values[0] == pytest.approx(expected, rel=1e-10, abs=1e-10)
    assert found.answer.off[0] == pytest.approx(0.0, abs=1e-10)


TILT = radians(20.0)


def inclined(**changes):
    return machine(plate__distance=0.1, plate__angle_deg=20.0, **changes)


def energies():
    """dEk = ½ m (v3x² + v_b²) has two solutions, v3x and -v3x; v3x is linear in ε."""
    into, down = at_plate(TILT, d1=R + 0.1)
    c, s = cos(TILT), sin(TILT)
    return (lambda vx: (down * s - vx) / (into * c)), (lambda vx: 0.5 * M * (vx**2 + V**2))


@pytest.mark.parametrize(
    ("vx", "points", "off"), [(0.1, 21, 1e-10), (0.01, 12, 1e-9), (0.0, 20, 1e-7)]
)
def test_all_of_several_roots_are_reported(vx, points, off):
    """0.01: both between neighbours of the scan; 0: touches only, known to √ of a rounding."""
    restitution, energy = energies()
    found = design.solve(
        inclined(), "plate.restitution=0:1", f"dEk={energy(vx)!r} J", points=points
    )
    expected = sorted({restitution(vx), restitution(-vx)})
    np.testing.assert_allclose(found.points[:, 0], expected, rtol=0.0, atol=off)
    # The picture is of the one next to ε = 0.5.
    assert found.answer.values[0] == min(found.points[:, 0], key=lambda x: abs(x - 0.5))
    assert ("2 solutions" in repr(found)) is (len(expected) == 2)


def test_a_jump_over_the_target_is_no_root():
    given = chutelab.load("inclined-20")
    found = design.solve(given, "plate.angle_deg=10.353:11", "landing.vx=-0.85", points=11)
    assert not found.solved
    (jump,) = found.jumps
    assert jump.before < -0.85 < jump.after
    assert jump.high - jump.low < 1e-14
    assert jump.courses == ("plate, incoming, outgoing", "plate, outgoing")
    assert "jumps over" in repr(found)


def test_a_course_between_two_equal_ones_is_not_lost():
    def evaluate(points):
        x = points[:, 0]
        courses = np.select([x < 0.6, x < 0.601, x < 0.9], ["a", "c", "b"], "c").tolist()
        return Outcomes(points, courses, [""] * len(x), courses)

    found = roots.scan(evaluate, 0.0, 1.0, 3)
    assert found.complete
    assert [piece.course for piece in found.pieces] == ["a", "c", "b", "c"]
    np.testing.assert_allclose([change.at for change in found.changes], [0.6, 0.601, 0.9])
    assert all(change.high - change.low < 1e-15 for change in found.changes)


def test_where_the_plate_is_missed_every_angle_is_a_solution():
    given = machine(plate__distance=0.1, outgoing__drop_from="top", plate__above=0.2)
    found = design.solve(given, "plate.angle_deg=20:80", "landing.vx=outgoing.speed", points=61)
    # A point meets the plate if tan α <= v²/(2 g d1).
    missed = np.degrees(np.arctan(V**2 / (2.0 * G * (R + 0.1))))
    ((low, high),) = found.everywhere
    assert low == pytest.approx(missed, abs=1e-6)
    assert high == 80.0
    assert "Every plate.angle_deg from" in repr(found)


def test_where_nothing_lands_there_is_nothing_to_show():
    given = machine(outgoing__start=-9.0, outgoing__length=1.0)
    found = design.solve(given, "plate.restitution=0:1", "landing.vx=0", points=5)
    assert not found.solved
    assert found.nearest is None
    assert "no variant" in repr(found)
    with pytest.raises(ValueError, match="no variant"):
        _ = found.answer


def belt_pays(restitution):
    return M * V * (V - forward(TILT, restitution, d1=R + 0.1))


@pytest.mark.parametrize(
    ("goal", "of", "place", "restitution", "value"),
    [
        (design.minimize, "dEk", "inside", energies()[0](0.0), energies()[1](0.0)),
        (design.minimize, "belt_work", "end", 0.0, belt_pays(0.0)),
        (design.maximize, "belt_work", "end", 1.0, belt_pays(1.0)),
        (design.maximize, "power", "end", 1.0, 200.0 * belt_pays(1.0)),
    ],
)  # fmt: skip
def test_least_and_most_are_inside_or_at_the_ends(goal, of, place, restitution, value):
    found = goal(inclined(), "plate.restitution=0:1", of, points=9).answer
    assert found.place == place
    assert found.values[0] == pytest.approx(restitution, abs=1e-7)
    assert found.found[0] == pytest.approx(value, rel=1e-12, abs=0.0)


def test_what_does_not_depend_on_the_key_has_no_minimum():
    found = design.minimize(inclined(), "plate.restitution=0:1", "impact.t", points=5)
    assert len(found.answers) == 1
    assert "does not depend" in repr(found)


def test_slopes_are_the_derivatives():
    found = design.solve(inclined(), "plate.restitution=0:1", "landing.vx=0.2", points=9)
    into, _ = at_plate(TILT, d1=R + 0.1)
    (slope,) = found.answer.sensitivities
    value = found.answer.values[0]
    assert slope.derivative == pytest.approx(-into * cos(TILT), rel=1e-9)
    assert slope.step == pytest.approx(0.01 * value)
    expected = forward(TILT, 1.01 * value, d1=R + 0.1)
    assert slope.upper == pytest.approx(expected, rel=1e-12, abs=0.0)


def test_a_slope_next_to_a_jump_does_not_reach_over_it():
    given = chutelab.load("inclined-20")
    narrow, wide = (
        design.solve(given, f"plate.angle_deg={span}", "landing.vx=-0.9", points=21)
        for span in ("10.3:10.6", "5:20")
    )
    one, other = (found.answer.sensitivities[0].derivative for found in (narrow, wide))
    assert one < 0.0
    assert other == pytest.approx(one, rel=1e-2)


KEYS = ["plate.angle_deg=20:60", "plate.restitution=0.1:0.9"]


def test_two_targets_and_two_keys():
    given = chutelab.load("inclined-20")
    found = design.solve(given, KEYS, ["landing.vx=1", "landing.x=0.3"])
    assert found.solved
    assert found.answer.found == pytest.approx((1.0, 0.3), abs=1e-9)
    again = design.solve(given, KEYS, ["landing.vx=1", "landing.x=0.3"])
    assert again.answer.values == found.answer.values
    assert len(found.answer.sensitivities) == 4
    lacking = design.solve(inclined(), ["plate.restitution=0:1", "particle.mass=0.01:0.02"],
                           "landing.vx=9", seed=1)  # fmt: skip
    assert not lacking.solved
    assert lacking.nearest.values[0] == pytest.approx(0.0, abs=1e-6)
    assert any("many solutions" in note for note in lacking.notes)


NAMES = [
    "landing.x", "landing.vy", "impact.t", "separation.vx", "x3", "phi2_deg", "dEk", "d3",
    "belt_work", "slip_heat", "power", "ledger.restitution_loss",
    "ledger.by_surface.plate.restitution_loss", "impact.vx_after",
]  # fmt: skip


@pytest.mark.parametrize(
    ("name", "keys", "low", "high"),
    [
        ("inclined-20", ("plate.angle_deg", "plate.restitution"), (-10.0, 0.0), (80.0, 1.2)),
        ("perpendicular", ("incoming.speed", "incoming.pulley_radius"), (0.3, 0.05), (4.0, 0.5)),
    ],
)  # fmt: skip
def test_variants_run_at_once_give_the_bits_of_single_runs(name, keys, low, high):
    given = chutelab.load(name)
    known = [one for one in NAMES if _has(given, one)]
    quantities = [measured(given, one) for one in known]
    if given.outgoing is not None:
        quantities += target(given, "landing.vx", "outgoing.speed")[1:]
    draws = np.random.default_rng(5).uniform(low, high, size=(16, 2))
    together = Evaluator(given, keys, quantities)(draws)
    alone = Evaluator(given, keys, quantities)
    singly = [alone(draw[np.newaxis]) for draw in draws]
    np.testing.assert_array_equal(together.values, np.concatenate([o.values for o in singly]))
    assert together.courses == [o.courses[0] for o in singly]
    assert together.faults == [o.faults[0] for o in singly]
    assert (len(set(together.courses)) > 2) == (name == "inclined-20")


def _has(given, name):
    try:
        measured(given, name)
    except design.DesignError:
        return False
    return True


def test_units_and_sides_of_a_target():
    given = machine()
    run = chutelab.simulate(given)
    assert target(given, "landing.x", "300 mm")[1].of(run) == pytest.approx(0.3)
    assert target(given, "landing.x", 0.3)[1].unit == "m"
    assert target(given, "landing.vx", "incoming.speed")[1].of(run) == V
    assert target(given, "landing.vx", "impact.vx")[1].key == "impact.vx"


SOLVE = ("solve", "inclined-20")
VARY = ("--vary", "plate.angle_deg=0:60")
AIM = ("--target", "landing.vx=1")
BAD = [
    (("--vary", "plate.angel_deg=0:60", *AIM), "did you mean plate.angle_deg"),
    (("--vary", "plate.angle_deg=0", *AIM), "must be KEY=FROM:TO"),
    (("--vary", "plate.angle_deg=0:60:61", *AIM), "must be KEY=FROM:TO"),
    (("--vary", "plate.angle_deg=60:0", *AIM), "range is empty"),
    (("--vary", "plate.angle_deg=5:5", *AIM), "range is empty"),
    (("--vary", "plate.angle_deg=0m:1m", *AIM), "is in degrees, not in m"),
    (("--vary", "plate.angle_deg=0:a", *AIM), "is not a number"),
    (("--vary", "plate.angle_deg=0:nan", *AIM), "is not a number"),
    (("--vary", "plate.angle_deg=0:20-40", *AIM), "20-40 is not a number"),
    (("--vary", "plate.angle_deg=0:90", *AIM), "plate.angle_deg = 90"),
    (("--vary", "plate.restitution=0:1.5", *AIM), "from 0 to 1"),
    (("--vary", "stream.count=1:5", *AIM), "whole number"),
    (("--vary", "run.engine=0:1", *AIM), "no number"),
    (("--vary", "surface.hood.speed=0:1", *AIM), "no [[surface]]"),
    ((*VARY, *VARY, *AIM), "given already"),
    ((*VARY, "--target", "landing.vx"), "must be QUANTITY=VALUE"),
    ((*VARY, "--target", "landing.vxx=1"), "no such quantity"),
    ((*VARY, "--target", "landing.vx=1m"), "in m/s"),
    ((*VARY, "--target", "landing.vx=1 furlong"), "unknown unit"),
    ((*VARY, "--target", "landing.vx=plate.distance"), "in m/s, and plate.distance is in m"),
    ((*VARY, "--target", "landing.vx=plate.nothing"), "neither a number, nor a quantity"),
    ((*VARY, "--target", "landing.vx=landing.vx"), "both sides are the same"),
    ((*VARY, *AIM, "--target", "landing.x=1"), "need as many keys"),
    ((*VARY, "--minimize", "belt_wrok"), "did you mean belt_work"),
    ((*VARY, "--maximize", "impact.hood.t"), "no such quantity"),
    ((*VARY, *AIM, "--minimize", "belt_work"), "as many keys to vary"),
    (VARY, "Give --target, --minimize or --maximize"),
    (AIM, "--vary"),
    ((*VARY, *AIM, "--points", "2"), "from 3 to"),
    ((*VARY, *AIM, "--seed", "-1"), "from 0"),
]


@pytest.mark.parametrize(("arguments", "said"), BAD)
def test_bad_questions_are_refused_before_anything_runs(arguments, said, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("chutelab.studies.sweep.plan.judged", None)
    monkeypatch.setattr("chutelab.studies.sweep.plan.lent", None)
    result = call(*SOLVE, *arguments, "--out", "out", code=2)
    assert said in " ".join(result.output.split())
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_files_of_a_solution(tmp_path):
    out = tmp_path / "out"
    result = call(*SOLVE, *VARY, *AIM, "--points", "13", "--out", str(out))
    assert sorted(file.name for file in out.iterdir()) == [
        "overlay.png", "scan.png", "solution.toml", "solve.json",
    ]  # fmt: skip
    assert "47.82895061" in result.output
    assert "Sensitivity" in result.output
    recording = chutelab.simulate(chutelab.load(out / "solution.toml"))
    assert recording.title.endswith("; with plate.angle_deg=47.83")
    landing = recording.events[recording.events["kind"] == 4][0]
    assert landing["velocity_before"][0] == pytest.approx(1.0, abs=1e-12)
    told = json.loads((out / "solve.json").read_text(encoding="utf-8"))
    assert told["solved"] is True
    assert told["answers"][0]["values"]["plate.angle_deg"] == pytest.approx(47.82895061)
    for name in ("scan.png", "overlay.png"):
        assert len(np.unique(np.asarray(Image.open(out / name)))) > 20


def test_no_solution_exits_with_1_and_writes_the_nearest(tmp_path):
    arguments = (*SOLVE, *VARY, "--target", "landing.vx=9", "--points", "5")
    result = call(*arguments, "--out", str(tmp_path / "out"), "--json", code=1)
    told = json.loads(result.output)
    assert told["solved"] is False
    assert told["nearest"]["values"]["plate.angle_deg"] == 60.0
    assert (tmp_path / "out" / "nearest.toml").exists()
    assert not (tmp_path / "out" / "solution.toml").exists()


@pytest.mark.slow
def test_scan_shows_pieces_target_and_answer():
    found = design.solve(chutelab.load("inclined-20"), "plate.angle_deg=0:30", "landing.vx=-0.3",
                         points=41)  # fmt: skip
    figure = scan(found)
    gids = [line.get_gid() for line in figure.axes[0].lines]
    assert gids.count("quantity") == 3
    assert gids.count("target") == 1
    assert gids.count("solution") == len(found.answers) == 3
    several = design.solve(inclined(), ["plate.restitution=0:1", "particle.mass=0.01:0.02"],
                           "landing.vx=0.2")  # fmt: skip
    with pytest.raises(ValueError, match="several keys"):
        scan(several)


# x2 = d1 = R + d_okr for a point that leaves at the top: linear in both.
SR, SD = 0.004, 0.01


@pytest.fixture(scope="module")
def linear():
    given = [f"incoming.pulley_radius=±{SR}", f"plate.distance={D}+-{SD}"]
    return design.uncertainty(machine(), given, ["x2"], samples=1024)


def test_uncertainty_of_a_linear_quantity(linear):
    deviation = sqrt(SR**2 + SD**2)
    assert linear.nominal[0] == pytest.approx(R + D, rel=1e-12, abs=0.0)
    assert linear.mean[0] == pytest.approx(R + D, abs=0.002 * deviation)
    assert linear.deviation[0] == pytest.approx(deviation, rel=0.005)
    known = NormalDist(R + D, deviation)
    ends = [known.inv_cdf(share) for share in (0.025, 0.975)]
    np.testing.assert_allclose(linear.interval[0], ends, rtol=0, atol=0.05 * deviation)
    shares = np.array([SR**2, SD**2]) / deviation**2
    np.testing.assert_allclose(linear.indices[0].first, shares, rtol=0, atol=0.01)
    np.testing.assert_allclose(linear.indices[0].total, shares, rtol=0, atol=0.01)
    assert linear.runs == 1024 * 4 + 1


def test_the_same_seed_gives_the_same_uncertainty(linear):
    given = [f"incoming.pulley_radius=±{1000 * SR} mm", f"plate.distance=±{SD}"]
    again = design.uncertainty(machine(), given, ["x2"], samples=600)
    np.testing.assert_array_equal(again.outputs, linear.outputs)
    other = design.uncertainty(machine(), given, ["x2"], samples=1024, seed=1)
    assert not np.array_equal(other.outputs, linear.outputs)


def test_sobol_indices_of_ishigamis_function():
    a, b = 7.0, 0.1

    def f(x):
        return (
            np.sin(x[..., 0]) + a * np.sin(x[..., 1]) ** 2 + b * x[..., 2] ** 4 * np.sin(x[..., 0])
        )

    # Ishigami and Homma (1990): V1 = ½ (1 + b π⁴/5)², V2 = a²/8, V13 = 8 b² π⁸/225.
    v1, v2, v13 = 0.5 * (1.0 + b * pi**4 / 5.0) ** 2, a**2 / 8.0, 8.0 * b**2 * pi**8 / 225.0
    variance = v1 + v2 + v13
    points = pi * (2.0 * sampled(3, 4096, seed=0) - 1.0)
    found = indices(f(points), seed=0)
    np.testing.assert_allclose(found.first, np.array([v1, v2, 0.0]) / variance, rtol=0, atol=0.01)
    np.testing.assert_allclose(
        found.total, np.array([v1 + v13, v2, v13]) / variance, rtol=0, atol=0.01
    )
    assert (found.first_interval[:, 0] < found.first + 1e-12).all()
    assert (found.first_interval[:, 1] > found.first - 1e-12).all()


def test_draws_beyond_the_scenes_domain_are_cut_and_said():
    found = design.uncertainty(machine(), "restitution=0.95±0.05", ["landing.x"], samples=256)
    (one,) = found.spreads
    assert one.key == "plate.restitution"
    assert one.cut == pytest.approx(NormalDist().cdf(-1.0), rel=1e-9)
    assert found.inputs.max() <= 1.0
    # The mean of a normal distribution cut one deviation above its mean.
    assert found.inputs.mean() == pytest.approx(
        0.95 - 0.05 * NormalDist().pdf(1.0) / NormalDist().cdf(1.0), abs=5e-4
    )
    assert "16 % of plate.restitution" in repr(found)


def test_kinds_of_outcome_are_told_apart():
    """A point passes below the plate, `B` long, if it falls farther on the way: ½ g (d1/v)² > B."""
    b, d1, v, spread_of_v, h, e = 0.45, R + D, 2.0, 0.1, 1.5, 0.5
    given = machine(plate__below=b, outgoing__drop=h, outgoing__drop_from="top")
    found = design.uncertainty(given, f"incoming.speed={v}±{spread_of_v}:uniform", samples=1024)
    slowest = d1 * sqrt(G / (2.0 * b))
    passes = (slowest - (v - spread_of_v)) / (2.0 * spread_of_v)
    assert list(found.kinds) == ["plate, outgoing", "outgoing"]
    hit, missed = found.kinds.values()
    assert (missed.share, hit.share) == pytest.approx((passes, 1.0 - passes), abs=2e-3)
    # It falls for T whatever it hits; the plate turns v into -e v at t = d1/v.
    fall = sqrt(2.0 * h / G)
    slow, fast = 0.5 * (v - spread_of_v + slowest), 0.5 * (slowest + v + spread_of_v)
    assert missed.mean[0] == pytest.approx(slow * fall, rel=1e-3)
    assert hit.mean[0] == pytest.approx(d1 - e * (fast * fall - d1), rel=1e-3)
    assert hit.deviation[0] < 0.1 * found.deviation[0] > missed.deviation[0]
    shares = {kind: f"{100.0 * one.share:.1f} % touch {kind}" for kind, one in found.kinds.items()}
    assert all(line in repr(found) for line in shares.values())
    assert "2 kinds of outcome" in repr(found)
    told = as_dict(found)["touches"]["outgoing"]
    assert told["share"] == missed.share
    assert told["quantities"]["landing.x"]["mean"] == missed.mean[0]
    assert set(csv.DictReader(found.csv().splitlines()).fieldnames) > {"touches", "landing.x"}
    ax = spread(found).axes[0]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == [
        "touch plate, outgoing", "touch outgoing"
    ]  # fmt: skip


def test_samples_that_never_land_are_left_out_and_said():
    given = chutelab.load("inclined-60", ["particle.radius=0.004"])  # misses from 68.9° on
    found = design.uncertainty(given, "plate.angle_deg=69±3", ["landing.vx"], samples=64)
    lost = int(np.isnan(found.outputs).sum())
    assert 0 < lost == sum(found.lost.values())
    assert "are left out" in repr(found)
    assert np.isfinite(found.mean).all()


def test_a_sample_that_lacks_one_quantity_is_told_as_lacking_that_one():
    given = chutelab.load("perpendicular", ["outgoing.friction=0"])  # so that it never grips
    found = design.uncertainty(given, "plate.restitution=0.5±0.01", samples=64)
    assert found.lost == {"no belt_work (touches plate, outgoing)": 128}
    x = 0.5937 - 0.5 * 2.0 * (sqrt((G * 0.29685) ** 2 + G) - G * 0.29685) / G
    assert found.mean[0] == pytest.approx(x, rel=1e-4)
    assert np.isnan(found.mean[1])


def test_uniform_and_relative_spreads():
    given = ["incoming.speed=2±10%", "plate.distance=0.5+/-20mm:uniform"]
    speed, distance = spreads(machine(), uncertain(given))
    assert speed.spread == pytest.approx(0.2)
    assert (distance.law, distance.spread) == ("uniform", pytest.approx(0.02))
    np.testing.assert_allclose(distance.values(np.array([0.0, 0.5, 1.0])), [0.48, 0.5, 0.52])
    quartiles = speed.values(np.array([0.25, 0.5, 0.75]))
    np.testing.assert_allclose(quartiles, NormalDist(2.0, 0.2).quantiles(), rtol=1e-12)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ("restitution=0.5", "must be KEY=MEAN±SPREAD"), ("restitution=0.5±0", "more than 0"),
        ("restitution=0.5±-1", "more than 0"), ("restitution=0.5±a", "no number"),
        ("restitution=1.5±0.1", "from 0 to 1"), ("restitution=0.5±0.1:gamma", "normal and uniform"),
        ("plate.distance=0.5±1kg", "wrong unit in 1kg: it is in m"),
        ("plate.distance=0.5±1furlong", "unknown unit"), ("plate.distance=0.5±1s", "wrong unit"),
        ("stream.count=5±1", "whole"), ("nothing=1±1", "nothing"), ("plate.below=±1", "no value"),
        ([], "say what is uncertain"), (["restitution=0.5±0.1"] * 2, "given already"),
    ],
)  # fmt: skip
def test_bad_uncertainties_are_refused_before_anything_runs(given, said, monkeypatch):
    monkeypatch.setattr("chutelab.studies.sweep.plan.judged", None)
    monkeypatch.setattr("chutelab.studies.sweep.plan.lent", None)
    with pytest.raises(InputError, match=said):
        design.uncertainty(machine(), given)


def propagate(folder, given, *options, code=0):
    """Call ``sweep --uncertainty`` on `machine`, with 64 samples."""
    path = folder / "machine.toml"
    path.write_text(scene.to_toml(machine()), encoding="utf-8")
    command = ["sweep", path, "--uncertainty", given, "--sample", 64, *options]
    result = CliRunner().invoke(main, [str(word) for word in command])
    assert result.exit_code == code, result.output
    return result


@pytest.mark.slow
def test_sweep_writes_samples_and_picture_of_uncertainties(tmp_path):
    out, plot = tmp_path / "samples.csv", tmp_path / "spread.png"
    shown = propagate(tmp_path, "plate.restitution=0.5±0.05", "--out", out, "--plot", plot).stdout
    assert "share of plate.restitution" in shown
    assert shown.endswith(f"wrote {out}\nwrote {plot}\n")
    assert plot.stat().st_size > 10_000
    head, *rows = out.read_text(encoding="utf-8").splitlines()
    assert head == "plate.restitution,landing.x,belt_work,touches"
    assert len(rows) == 128
    *numbers, touched = next(csv.reader(rows))
    assert touched == "plate, outgoing"
    epsilon, x, work = map(float, numbers)
    # Upright plate: vx = -ε v, and the fall to the belt does not depend on ε.
    falls = G * (R + D) / V
    t3 = (sqrt(falls**2 + 2.0 * G * DROP) - falls) / G
    assert x == pytest.approx(R + D - epsilon * V * t3, rel=1e-12, abs=0.0)
    assert work == pytest.approx(M * V * (V + epsilon * V), rel=1e-12, abs=0.0)
    told = json.loads(propagate(tmp_path, "plate.restitution=0.5±0.05", "--json").stdout)
    assert told["quantities"]["landing.x"]["first"][0] == pytest.approx(1.0, abs=1e-6)


@pytest.mark.parametrize(
    ("given", "options", "said"),
    [
        ("restitution=0.5±0.1", ["--out", "rows.parquet"], "ends in .csv"),
        ("restitution=0.5±0.1", ["--plot", "picture.gif"], "ends in .png or .svg"),
        ("restitution=0.5±0.1", ["--out", "not/there.csv"], "there is no folder not"),
    ],
)
def test_sweep_refuses_uncertainties_before_it_runs(given, options, said, monkeypatch, tmp_path):
    monkeypatch.setattr("chutelab.studies.sweep.plan.judged", None)
    monkeypatch.setattr("chutelab.studies.sweep.plan.lent", None)
    monkeypatch.chdir(tmp_path)
    assert said in propagate(tmp_path, given, *options, code=2).stderr


def test_the_minimum_in_the_readme_is_inside_its_range():
    text = (Path(__file__).parents[1] / "README.md").read_text(encoding="utf-8")
    line = re.search(
        r"^chutelab solve (\S+) --vary (\S+=(\d+):(\d+)) --minimize belt_work$", text, re.MULTILINE
    )
    name, vary, low, high = line.groups()
    found = design.minimize(chutelab.load(name), vary, "belt_work")
    best = found.answer.values[0]
    assert f"here at {best:.0f}°" in text
    # By runs of their own: to both sides the belt pays more.
    paid = [
        chutelab.simulate(chutelab.load(name, {"plate.angle_deg": angle, "run.until": "settled"}))
        for angle in (float(low), best - 2.0, best, best + 2.0, float(high))
    ]
    work = [run.by_surface[run.surface_index("outgoing"), 0] for run in paid]
    assert work[0] > work[1] > work[2] < work[3] < work[4]
