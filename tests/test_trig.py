"""Sine, cosine and their inverses, against the C library's in extended precision."""

from fractions import Fraction
from math import isnan, nan, pi

import numpy as np
import pytest

from chutelab.core import Module
from chutelab.util.arrays import LARGEST_ANGLE, RADIANS, arc_cos, atan2, sin_cos

LONG = np.longdouble
RNG = np.random.default_rng(15)

needs_extended = pytest.mark.skipif(
    np.finfo(LONG).eps > 1e-18, reason="long doubles have no more digits than doubles here"
)

DEGREES = np.arange(-720.0, 720.5, 7.5)
ANGLES = {
    "degrees": DEGREES * RADIANS,
    "near quarter turns": (np.nextafter(DEGREES * RADIANS, 1e3)),
    "within one turn": RNG.uniform(-pi, pi, 20_000),
    "within ten turns": RNG.uniform(-20.0 * pi, 20.0 * pi, 20_000),
    "as far as it goes": RNG.uniform(-LARGEST_ANGLE, LARGEST_ANGLE, 20_000),
    "small": 10.0 ** RNG.uniform(-300.0, 0.0, 1000),
}


def ulps(found, wanted):
    """Return by how many units in the last place arrays differ at most."""
    unit = np.spacing(np.abs(wanted).astype(np.float64)).astype(LONG)
    return float(np.max(np.abs(found.astype(LONG) - wanted) / unit))


@needs_extended
@pytest.mark.parametrize("name", ANGLES)
def test_sine_and_cosine_are_right_to_the_last_unit(name):
    angle = ANGLES[name]
    sine, cosine = sin_cos(angle)
    assert ulps(sine, np.sin(angle.astype(LONG))) < 0.8
    assert ulps(cosine, np.cos(angle.astype(LONG))) < 0.8


@needs_extended
def test_the_angle_of_a_vector_is_right_in_all_directions_and_proportions():
    turned = RNG.uniform(-pi, pi, 20_000)
    size = 10.0 ** RNG.uniform(-6.0, 6.0, (2, 20_000))
    for y, x in ((np.sin(turned), np.cos(turned)), size * np.sign(np.sin(RNG.random(2)))[:, None]):
        assert ulps(atan2(y, x), np.arctan2(y.astype(LONG), x.astype(LONG))) < 1.5


@needs_extended
def test_the_angle_of_a_cosine_is_right_near_1_too():
    for cosine in (RNG.uniform(-1.0, 1.0, 20_000), 1.0 - 10.0 ** RNG.uniform(-16.0, 0.0, 20_000)):
        assert ulps(arc_cos(cosine), np.arccos(cosine.astype(LONG))) < 2.5


def test_angles_of_round_numbers():
    assert sin_cos(0.0) == (0.0, 1.0)
    assert [sin_cos(n * pi)[1] for n in (0, 1, 2, -1)] == [1.0, -1.0, 1.0, -1.0]
    assert [sin_cos(n * pi / 2.0)[0] for n in (1, -1, 3)] == [1.0, -1.0, -1.0]
    assert sin_cos(60.0 * RADIANS)[1] == 0.5000000000000001
    corners = [(0, 1), (1, 1), (1, 0), (1, -1), (0, -1), (-1, -1), (-1, 0), (-1, 1)]
    eighths = [0, 1, 2, 3, 4, -3, -2, -1]
    assert [atan2(y, x) for y, x in corners] == [n * pi / 4.0 for n in eighths]
    assert atan2(0.0, 0.0) == 0.0
    assert [arc_cos(c) for c in (1.0, 0.0, -1.0)] == [0.0, pi / 2.0, pi]


def test_what_has_no_answer_is_nan():
    for angle in (nan, 1.1 * LARGEST_ANGLE, -np.inf):
        assert np.isnan(sin_cos(np.array([angle, angle]))).all()
        assert all(map(isnan, sin_cos(angle)))
    assert isnan(arc_cos(1.5))
    assert isnan(arc_cos(nan))
    assert np.isnan(arc_cos(np.array([-1.5, 2.0]))).all()
    assert isnan(atan2(nan, 1.0))


def test_a_quarter_turn_is_as_far_from_its_double_as_it_is():
    """π to 60 digits: the cosine of the double nearest to π/2 is what that lacks."""
    exact = Fraction("3.14159265358979323846264338327950288419716939937510582097494") / 2
    assert sin_cos(pi / 2.0)[1] == float(exact - Fraction(pi / 2.0))


@pytest.mark.parametrize("every", [20, pytest.param(1, marks=pytest.mark.slow)])
def test_the_core_has_the_same_bits(every):
    core = Module()
    for angles in ANGLES.values():
        angles = angles[::every]
        up, across = sin_cos(angles)
        assert [core.call("sine", angle) for angle in angles.tolist()] == up.tolist()
        assert [core.call("cosine", angle) for angle in angles.tolist()] == across.tolist()
    y, x = RNG.uniform(-20.0, 20.0, (2, 20_000 // every))
    found = [core.call("angle_of", *pair) for pair in zip(y.tolist(), x.tolist(), strict=True)]
    assert found == atan2(y, x).tolist()
    directions = [(0.0, 0.0), (-0.0, -1.0), (1.0, 1.0), (1.0, 0.0), (-1.0, 0.0), (-1.0, -1.0)]
    assert [core.call("angle_of", *pair) for pair in directions] == [
        atan2(*pair) for pair in directions
    ]
    cosines = RNG.uniform(-1.0, 1.0, 20_000 // every)
    found = [core.call("angle_of_cosine", one) for one in cosines.tolist()]
    assert found == arc_cos(cosines).tolist()
    assert all(isnan(core.call(name, 1.5e6)) for name in ("sine", "cosine"))
    assert isnan(core.call("angle_of_cosine", 1.5))
