"""The reference: one particle as an ODE, against closed forms written out here, and exact."""

import subprocess
import sys
from collections import Counter
from math import acos, atan2, cos, exp, hypot, pi, sin, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq

from chutelab import scene
from chutelab.engines import exact, reference
from chutelab.machine import build
from chutelab.results import REASONS, Kind
from chutelab.results.ledger import ledger
from chutelab.studies.accuracy import apart, each, sizes
from stress.cases import machine as drawn

G = 9.81


def run(tables):
    return reference.run(build(scene.from_dict(tables)))


def floor(**changes):
    surface = {"name": "floor", "points": [[-9.0, 0.0], [9.0, 0.0]], "restitution": 0.0}
    return {**surface, "friction": 0.3, **changes}


def thrown(at, velocity, until, *surfaces, **particle):
    return {
        "particle": {"radius": 0.01, **particle},
        "surface": list(surfaces),
        "stream": {"at": list(at), "velocity": list(velocity)},
        "run": {"until": until},
    }


def transfer(**tables):
    incoming = {"speed": 2.0, "pulley_radius": 0.5, **tables.pop("incoming", {})}
    return {
        "particle": {"radius": 0.004, **tables.pop("particle", {})},
        "incoming": incoming,
        "run": {"until": 0.9},
    }


def left_at(recording):
    (left,) = recording.select(Kind.SEPARATION)
    return atan2(*left["position"]), hypot(*left["velocity_after"])


def test_a_carried_particle_leaves_where_its_weight_no_longer_holds_it():
    phi, speed = left_at(run(transfer()))
    assert phi == pytest.approx(acos(2.0**2 / (G * 0.504)), rel=1e-13, abs=0.0)
    assert speed == pytest.approx(2.0, rel=1e-13, abs=0.0)


def test_a_slipping_particle_obeys_the_law_of_the_finite_friction():
    """u = v²/(g Rc) = [(4µ²-2) cos φ - 6µ sin φ]/(1+4µ²) + C e^{2µφ}, until u = cos φ."""
    mu, u0 = 0.5, 2.0**2 / (G * 0.504)
    onset = brentq(lambda p: sin(p) - mu * (cos(p) - u0), 0.0, 1.0, xtol=1e-15)

    def particular(p):
        return ((4 * mu**2 - 2) * cos(p) - 6 * mu * sin(p)) / (1 + 4 * mu**2)

    c = (u0 - particular(onset)) * exp(-2 * mu * onset)
    leaves = brentq(lambda p: particular(p) + c * exp(2 * mu * p) - cos(p), onset, 1.0, xtol=1e-15)
    phi, speed = left_at(run(transfer(incoming={"friction": mu})))
    assert phi == pytest.approx(leaves, rel=1e-12, abs=0.0)
    assert speed == pytest.approx(sqrt(G * 0.504 * cos(leaves)), rel=1e-12, abs=0.0)


def test_bounces_end_after_2u_over_g_1_minus_epsilon():
    epsilon, fall = 0.5, 0.4
    tables = thrown((0.0, 0.01 + fall), (0.0, 0.0), "settled", floor(restitution=epsilon))
    found = run(tables)
    down = sqrt(2.0 * fall / G)
    expected = down + 2.0 * epsilon * G * down / (G * (1.0 - epsilon))
    assert found.track(0)["t"][-1] == pytest.approx(expected, rel=1e-12, abs=0.0)
    assert REASONS[found.ended[0]] == "settled"


@pytest.mark.parametrize(("gap", "falls"), [(1e-11, True), (1e-13, False)])
def test_what_is_a_trillionth_of_a_metre_from_a_surface_touches_it(gap, falls):
    recording = run(thrown((0.0, 0.01 + gap), (0.0, 0.0), 0.01, floor(restitution=0.5)))
    struck = recording.select(Kind.IMPACT)["t"]
    assert len(struck) > 0 if falls else not len(struck)
    if falls:
        assert struck[0] == pytest.approx(sqrt(2.0 * gap / G), rel=1e-6)


@pytest.mark.parametrize(("speed", "slips"), [(3e-9, True), (3e-11, False)])
def test_what_slips_by_less_than_a_ten_billionth_of_a_metre_a_second_sticks(speed, slips):
    recording = run(thrown((0.0, 0.01), (speed, 0.0), 0.01, floor()))
    (stick,) = recording.select(Kind.STICK)["t"]
    assert stick == pytest.approx(speed / (0.3 * G) * slips, rel=1e-6)


def test_round_the_end_of_a_belt_the_surface_runs_on_along_the_rim():
    """A disk that falls on the very end at 45° meets v along (n_y, -n_x), n the contact normal."""
    speed, r, mu = 3.0, 0.01, 0.2
    belt = floor(points=[[-1.0, 0.0], [0.0, 0.0]], speed=speed, friction=mu, restitution=0.5)
    found = run(thrown((r * sin(pi / 4), 0.5), (0.0, 0.0), 0.5, belt))
    hit = found.select(Kind.IMPACT)[0]
    n = np.array([sin(pi / 4), cos(pi / 4)])
    along = np.array([n[1], -n[0]])
    closing, slip = -hit["velocity_before"] @ n, hit["velocity_before"] @ along - speed
    assert slip < 0.0
    assert hit["normal_impulse"] / 0.008 == pytest.approx(1.5 * closing, rel=1e-9)
    pushed = min(mu * 1.5 * closing, -slip)
    assert hit["tangential_impulse"] / 0.008 == pytest.approx(pushed, rel=1e-9)


def test_what_it_cannot_follow_is_refused():
    with pytest.raises(reference.UnableError, match="one particle"):
        reference.run(build(scene.load("stream")))
    vee = {"name": "vee", "points": [[-1.0, 1.0], [0.0, 0.0], [1.0, 1.0]], "restitution": 0.0}
    with pytest.raises(reference.UnableError, match="corner"):
        run(thrown((0.0, 0.5), (0.0, 0.0), 3.0, vee))


@pytest.mark.parametrize(
    ("surface", "more", "what"),
    [
        ({"name": "peg", "center": [0.0, 0.0], "radius": 0.1}, {}, "straight surfaces"),
        (floor(opens_at=1.0), {}, "always there"),
        (floor(), {"particle": {"spin": True, "rolling_friction": 0.1}}, "rolling friction"),
        (floor(), {"string": [{"from": [0.0, 2.0]}]}, "joints"),
    ],
)
def test_what_it_has_no_equations_for_is_refused(surface, more, what):
    with pytest.raises(reference.UnableError, match=what):
        run({**thrown((0.0, 0.5), (0.0, 0.0), 3.0, surface), **more})


def test_without_scipy_it_says_what_to_install():
    code = (
        "import sys; sys.modules['scipy.integrate'] = None\n"
        "from chutelab import scene; from chutelab.machine import build\n"
        "from chutelab.engines import reference\n"
        "try: reference.run(build(scene.load('perpendicular')))\n"
        "except reference.UnableError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == 'SciPy is missing: pip install "chutelab[bench]"\n'


@pytest.mark.parametrize("count", [20, pytest.param(60, marks=pytest.mark.slow)])
def test_it_and_exact_tell_the_same_of_machines_drawn_at_random(count):
    """Surfaces that cross, fold, move and grip: all answers within 1e-9, but where one refuses."""
    tally = Counter()
    for seed in range(count):
        built = build(scene.from_dict(drawn(seed)))
        try:
            one, other = reference.run(built), exact.run(built)
        except (reference.UnableError, exact.CornerError):
            tally["refused"] += 1
            continue
        off, which = apart(list(each(one)), list(each(other)), sizes(other), "relative")
        assert off < 1e-9, (seed, which)
        assert ledger(one).relative_residual < 1e-13
        tally["agree"] += 1
    assert tally["refused"] <= 0.05 * count, tally
