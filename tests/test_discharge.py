"""Discharge methods: each against the balance of forces, written here, and against the engines."""

import json
from math import cos, inf, pi, radians, sin, sqrt

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab.classroom.lessons import find
from chutelab.cli import main
from chutelab.studies.discharge import side_by_side
from chutelab.theory.discharge import DischargeError, bed_area, discharge, left, loading

CASE = {"speed": 1.2, "radius": 0.315, "depth": 0.06}
G = 9.81


def slid(u, begin, static, kinetic, sticks, step=2e-5):
    """Step a body in u(α) = v²/(g r) from where it is held by friction to where it lifts off.

    du/dα = 2 (sin α - µ n), n = cos α - u + s: weight, friction and the force towards the axis.
    """
    angle = begin
    while abs(sin(angle)) <= static * (cos(angle) - u + sticks):
        angle += step

    def rate(a, v):
        return 2.0 * (sin(a) - kinetic * (cos(a) - v + sticks))

    while cos(angle) - u + sticks > 0.0:
        k1 = rate(angle, u)
        k2 = rate(angle + 0.5 * step, u + 0.5 * step * k1)
        u += step * k2
        angle += step
    return angle, u


@pytest.mark.parametrize("rises", [-1.0, 1.0], ids=["falling", "rising"])
@pytest.mark.parametrize("seed", range(6))
def test_slip_and_adhesion_obey_the_balance_of_forces(seed, rises):
    rng = np.random.default_rng(seed)
    kinetic = rng.uniform(0.1, 1.5)
    static = kinetic * rng.uniform(1.0, 1.5)
    u, sticks = rng.uniform(0.05, 0.9), rng.choice([0.0, rng.uniform(0.0, 0.3)])
    # What rises has to be held from the pulley's first point on: static friction holds it there.
    steepest = np.arctan(static) if rises > 0.0 else 0.3
    rise = rises * rng.uniform(0.0, min(0.3, steepest))
    if rises > 0.0:
        u = min(u, 0.9 * (cos(rise) + sticks - sin(rise) / static))
    found = left(u, rise, static, kinetic, sticks)
    assert found == pytest.approx(slid(u, -rise, static, kinetic, sticks), abs=2e-4)


@pytest.mark.parametrize(("friction", "speed"), [(0.5, 2.0), (0.3, 1.0), (1.2, 1.7)])
def test_booth_is_the_slip_law_of_the_exact_engine(friction, speed):
    scene = {"incoming.friction": friction, "incoming.speed": speed}
    run = chutelab.simulate("slip", scene, engine="exact")
    r, big = run.scene.particle.radius, run.scene.incoming.pulley_radius
    leaves = run.select("separation")[0]
    path = discharge("booth", speed=speed, radius=big, depth=2.0 * r, friction=friction).centre
    assert path.at([0.0])[0] == pytest.approx(leaves["position"], rel=1e-9)
    v = path.speed * np.array([cos(path.angle), -sin(path.angle)])
    assert v == pytest.approx(leaves["velocity_after"], rel=1e-9)


def test_published_cases():
    """After Hastie and Wypych: R 0.315 m, h 60 mm, 1.2 m/s, 0.3 m below the axis."""
    booth = [discharge("booth", friction=mu, **CASE).lower.across(-0.3) for mu in (0.8, 0.4)]
    assert np.round(booth, 3).tolist() == [0.473, 0.492]
    assert round(discharge("cema", **CASE).centre.across(-0.3), 3) == 0.442
    golka = discharge("golka", **CASE)
    edges = [golka.lower.across(-0.3), golka.upper.across(-0.3)]
    assert np.round(edges, 3).tolist() == [0.397, 0.481]


def test_methods_are_one_where_nothing_sets_them_apart():
    thin = {**CASE, "depth": 0.0}
    point = discharge("point", **thin).lower
    for method in ("cema", "booth", "golka", "korzen"):
        for path in discharge(method, **thin).paths:
            assert (path.angle, path.speed) == pytest.approx((point.angle, point.speed))
    assert cos(point.angle) == pytest.approx(1.2**2 / (G * 0.315))
    slips = {**CASE, "friction": 0.5}
    booth, korzen = (discharge(method, **slips).centre for method in ("booth", "korzen"))
    assert (korzen.angle, korzen.speed) == (booth.angle, booth.speed)


@pytest.mark.parametrize("method", ["point", "cema", "booth", "golka", "korzen"])
@pytest.mark.parametrize("rise", [-0.2, 0.0, 0.2])
def test_a_fast_bed_leaves_where_the_belt_meets_the_pulley(method, rise):
    found = discharge(method, speed=4.0, radius=0.3, depth=0.1, incline=rise, friction=0.6)
    assert found.high_speed
    assert {(path.angle, path.speed) for path in found.paths} == {(-rise, 4.0)}


def test_golka_keeps_the_flow_and_cema_the_depth():
    golka = discharge("golka", **CASE)
    r = np.linspace(golka.lower.radius, golka.upper.radius, 100_001)
    flow = np.trapezoid(1.2 * r / 0.315, r)
    assert flow == pytest.approx(1.2 * 0.06, rel=1e-9)
    assert golka.upper.speed == pytest.approx(1.2 * r[-1] / r[0])
    cema = discharge("cema", centroid=0.02, **CASE)
    times = np.linspace(0.0, 0.4, 9)
    way = cema.centre.at(times)
    for edge, far in ((cema.lower, 0.02), (cema.upper, 0.04)):
        assert np.hypot(*(edge.at(times) - way).T) == pytest.approx(np.full(9, far))
    assert (cema.upper.at(times)[:, 1] > cema.lower.at(times)[:, 1]).all()


def test_paths_fall_as_bodies_do_and_divergence_multiplies_the_fall():
    path = discharge("point", **CASE).lower
    times = np.array([0.0, 0.1, 0.3])
    start = 0.315 * np.array([sin(path.angle), cos(path.angle)])
    v = 1.2 * np.array([cos(path.angle), -sin(path.angle)])
    expected = start + v * times[:, None] - [0.0, 0.5 * G] * times[:, None] ** 2
    assert path.at(times) == pytest.approx(expected)
    assert path.across(float(expected[2, 1])) == pytest.approx(expected[2, 0])
    assert np.isnan(path.across(0.4))
    wide = discharge("golka", divergence=(1.0, 1.3), **CASE).upper
    x = wide.at(times)[:, 0] - wide.at([0.0])[0, 0]
    fall = wide.at([0.0])[0, 1] - wide.at(times)[:, 1] - x * np.tan(wide.angle)
    assert fall == pytest.approx(1.3 * G * x**2 / (2.0 * wide.speed**2 * cos(wide.angle) ** 2))


def test_air_slows_light_spheres_and_not_heavy_ones():
    def path(sphere):
        return discharge("korzen", friction=0.5, sphere=sphere, **CASE).centre

    free, (r, m) = path(None), (0.02, 0.01)
    assert path((0.005, 1e6)).across(-1.0) == pytest.approx(free.across(-1.0), rel=1e-9)
    # Schiller and Naumann: C = 24 (1 + 0.15 Re^0.687)/Re, 0.44 from Re = 1000 on, in small steps.
    z = free.radius * complex(sin(free.angle), cos(free.angle))
    v = free.speed * complex(cos(free.angle), -sin(free.angle))
    step = 1e-5
    for _ in range(40_000):
        re = 1.2 * 2.0 * r * abs(v) / 1.8e-5
        c = 0.44 if re >= 1000.0 else 24.0 / re * (1.0 + 0.15 * re**0.687)
        slowed = -1j * G - 0.5 * 1.2 * c * pi * r**2 * abs(v) * v / m
        z, v = z + step * (v + 0.5 * step * slowed), v + step * slowed
    assert path((r, m)).at([0.4])[0] == pytest.approx([z.real, z.imag], abs=1e-6)
    assert free.at([0.4])[0, 0] - z.real > 1e-3


def test_bed_and_loading():
    width, roll, trough, surcharge = 1.2, 0.45, radians(35.0), radians(20.0)
    side = 0.5 * (0.9 * width - 0.05 - roll)
    half, high = 0.5 * roll + side * cos(trough), side * sin(trough)
    x = np.linspace(-half, half, 200_001)
    floor = np.maximum(0.0, np.abs(x) - 0.5 * roll) * np.tan(trough)
    # A parabola that begins at the surcharge angle at either edge.
    cap = high + np.tan(surcharge) * (half**2 - x**2) / (2.0 * half)
    expected = np.trapezoid(cap - floor, x)
    found = bed_area(width=width, roll=roll, trough=trough, surcharge=surcharge)
    assert found == pytest.approx(expected, rel=1e-6)
    assert round(found, 3) == 0.166
    load = loading(mass_rate=800.0 / 3.6, belt_speed=2.0, speed=0.323, friction=0.5)
    assert round(load.power, 2) == 745.33
    # On the way it slips, friction µ m g does the work that brings m from v_x to v_b.
    assert 0.5 * G * load.length == pytest.approx(0.5 * (2.0**2 - 0.323**2))


@pytest.mark.parametrize(
    ("change", "key"),
    [
        ({"speed": 0.0}, "speed"),
        ({"depth": -0.1}, "depth"),
        ({"centroid": 0.1}, "centroid"),
        ({"friction": 0.0}, "friction"),
        ({"static_friction": 0.1, "friction": 0.5}, "static_friction"),
        ({"adhesion": 10.0}, "unit_weight"),
        ({"adhesion": 1e5, "unit_weight": 1.0}, "adhesion"),
        ({"incline": 0.3, "friction": 0.1}, "incline"),
    ],
)
def test_what_has_no_answer_is_refused_by_name(change, key):
    with pytest.raises(DischargeError, match=key):
        discharge("korzen", **{**CASE, **change})


def test_side_by_side_with_a_simulated_stream():
    heights = [0.0, -0.5]
    found = side_by_side("slip", [*heights, -5.0])
    assert found.lines["booth"][1] == pytest.approx(found.lines["simulated"][1], abs=2e-6)
    r = found.scene.particle.radius
    half = (found.lines["simulated"][2] - found.lines["simulated"][0]) / 2.0
    down = sqrt(2.0 * G * 0.5)
    assert r < half[1] < r * sqrt(1.0 + (4.0 / down) ** 2)  # across the path, at 45° or steeper
    with pytest.raises(DischargeError, match="incoming"):
        side_by_side("galton")


@pytest.mark.parametrize(
    "changes",
    [{"pair": [{"between": ["grain", "incoming"], "friction": 0.3}]}, {"air_density": 1.2}],
)
def test_the_simulated_stream_is_that_of_the_scene(changes):
    """It passes where the scene's own particle lands: with values of its pair, and in its air."""
    name = {"particle.name": "grain", "particle.mass": 1e-4}
    whole = chutelab.load(
        "slip", {"plate.distance": 9.0, "outgoing.drop_from": "top", **name} | changes
    )
    landing = chutelab.simulate(whole).summary()["landing"]
    found = side_by_side(whole, landing["y"]).lines["simulated"][1]
    assert found == pytest.approx(landing["x"], abs=2e-6)


def test_a_simulated_bed_of_particles_that_ignore_each_other_is_told():
    """On a belt with Coulomb friction all lie on the belt itself, whatever the methods' depth."""
    bed = {"stream.count": 5, "stream.bed_height": 0.06}
    assert "has no depth" in " ".join(side_by_side(chutelab.load("slip", bed)).sheet().notes)


def test_the_simulated_stream_is_counted_by_hand():
    """2, 50 and 98 % of where centres pass a height; edges lie r |v| / |v_y| beside."""
    first = chutelab.scene.to_dict(chutelab.load("stream", {"stream.count": 40}))["stream"]
    scene = chutelab.load("stream", {"stream": [first, {"count": 7, "start": 5.0}]})
    found = side_by_side(scene, [-0.2])
    assert found.scene.count == 40  # of the first stream alone
    run, x, aside = found.recording, [], []
    for n in range(40):
        knots = run.knots[run.offsets[n] : run.offsets[n + 1]]
        low = np.flatnonzero(knots["position"][:, 1] <= -0.2)[0]
        before, after = knots["t"][low - 1], knots["t"][low]
        for _ in range(25):
            t = 0.5 * (before + after)
            place, velocity, *_ = (one[0][n] for one in run.at([t]))
            before, after = (t, after) if place[1] > -0.2 else (before, t)
        x.append(place[0])
        aside.append(run.radius[n] * np.hypot(*velocity) / -velocity[1])
    x, aside = np.array(x), np.array(aside)
    expected = np.quantile(x - aside, 0.02), np.quantile(x, 0.5), np.quantile(x + aside, 0.98)
    told = found.lines["simulated"][:, 0]
    assert told == pytest.approx(expected, abs=1e-4)
    notes = " ".join(found.sheet().notes)
    less = 1000.0 * (found.lines["cema"][1, 0] - told[1])
    assert "cema less simulated, at y = -0.2 m: lower" in notes
    assert f"centre {less:+.1f}" in notes


def test_command(tmp_path):
    def run(*arguments):
        return CliRunner().invoke(main, ["discharge", *arguments])

    told = json.loads(run("slip", "--heights", "0,-0.3", "--json").stdout)
    assert told["methods"]["booth"]["centre"]["angle_deg"] == pytest.approx(23.157, abs=1e-3)
    assert told["heights"] == [0.0, -0.3]
    out = tmp_path / "out"
    assert run("slip", "--out", str(out)).exit_code == 0
    assert sorted(path.name for path in out.iterdir()) == ["discharge.json", "discharge.png"]
    rests = run("slip", "--set", "incoming.speed=0")
    assert rests.exit_code == 2
    assert "incoming.speed = 0.0: must be > 0 m/s" in rests.stderr
    for heights in ("low", "nan", "-0.1,inf", "99", "-1e9"):
        wrong = run("slip", "--heights", heights)
        assert wrong.exit_code == 2
        assert "heights" in wrong.stderr


def test_the_numbers_that_lesson_12_gives_are_those_of_the_methods():
    """In mm, 0.3 m below the axis; of Golka, which has no middle, that of its two edges."""
    lesson = find(12)
    given = [
        {c.head: list(c.given) for c in step.columns if c.given}
        for step in lesson.steps
        if step.kind == "note"
    ]

    def across(method, *edges, v=1.2, r=0.315, mu=inf):
        found = discharge(method, speed=v, radius=r, depth=0.06, friction=mu)
        return round(1000 * float(np.mean([getattr(found, e).across(-0.3) for e in edges])))

    # Alone, its centre is on a circle of 0.32 m.
    alone = [across("booth", "lower", r=0.32, mu=mu) for mu in (inf, 0.8, 0.6, 0.4)]
    held = {
        "mass point": [across("point", "centre", v=v) for v in (1.2, 1.0)],
        "CEMA": [across("cema", "centre", v=v) for v in (1.2, 1.0)],
        "Golka": [across("golka", "lower", "upper", v=v) for v in (1.2, 1.0)],
    }
    slips = [across("booth", "centre", mu=mu) for mu in (0.8, 0.6, 0.4)]
    assert given == [{"Booth": alone}, held, {"Booth": slips}]
    for language in ("en", "de"):
        (told,) = [one.then for one in find(12, language).steps if one.kind == "explain"]
        for number in (held["mass point"][0], held["CEMA"][0], held["Golka"][0], slips[1]):
            assert f"| {number} |" in told
