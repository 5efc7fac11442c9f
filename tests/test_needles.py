"""Needles at the joints of a chain: tips thinner than the way of a step, corners in hollows."""

import numpy as np
import pytest

import chutelab
from chutelab.results import Kind

R = 0.01
"""m; half the length of a needle."""


@pytest.mark.parametrize("past", [2e-5, 1e-4, 5e-4, 2e-3])
@pytest.mark.parametrize("slope", [0.1, 0.5, 2.0])
def test_a_tip_meets_a_ridge_that_is_as_thin_as_a_hair_there(past, slope):
    """A flat rhombic needle, t R thick, falls on a ridge that its tip lies past by `past`.

    Its lower edge rises towards the tip as t, so it is t past below the axis over the ridge, and
    meets it after the time in which it falls from h to there, before the tip reaches the slope.
    """
    t, h, fast = 0.03, 0.03, 3.0
    assert t < slope
    particle = {"name": "needle", "shape": "polygon", "mass": 0.01, "spin": True}
    particle |= {"points": [[-R, 0.0], [0.0, -t * R], [R, 0.0], [0.0, t * R]]}
    scene = {
        "particle": particle,
        "surface": [
            {
                "name": "ridge",
                "points": [[-0.03, -0.03 * slope], [0.0, 0.0], [0.03, -0.03 * slope]],
                "restitution": 0.3,
                "friction": 0.3,
            }
        ],
        "stream": {"at": [past - R, h], "velocity": [0.0, -fast], "interact": True},
        "run": {"until": 0.012, "engine": "contact"},
    }
    run = chutelab.simulate(scene)
    fall = h - t * past
    meets = 2.0 * fall / (fast + np.sqrt(fast**2 + 2.0 * run.gravity * fall))
    assert run.select(Kind.IMPACT, Kind.LANDING)["t"][0] == pytest.approx(meets, abs=1e-12)
    assert not run.laws


@pytest.mark.parametrize("bend", [0.01, 0.05, 0.3])
@pytest.mark.parametrize("lean", [0.003, 0.03, 0.3])
@pytest.mark.parametrize("gap", [1e-6, 1e-8, 1e-12, -1e-10])
def test_a_tip_slides_over_a_ridge_without_a_blow(bend, lean, gap):
    """Without weight nothing acts on a needle whose tip slides along a face and off a ridge.

    The lower edge at the tip is steeper than the face by `lean`, and the next face falls away by
    `bend`, by more or less than that. The gap, m, is small, as that of a lasting contact is.
    """
    t, x, v = 0.1, -0.004, np.array([1.5, 0.0])
    angle = -np.arctan(t) - lean
    tip = np.array([np.cos(angle), np.sin(angle)]) * R
    particle = {"name": "needle", "shape": "polygon", "mass": 0.01, "spin": True}
    particle |= {"points": [[-R, 0.0], [0.0, -t * R], [R, 0.0], [0.0, t * R]]}
    both = {"restitution": 0.0, "friction": 0.0}
    run = chutelab.simulate(
        {
            "gravity": 0.0,
            "particle": particle,
            "surface": [
                {
                    "name": "ridge",
                    "points": [[-0.05, 0.0], [0.0, 0.0], [0.05, -0.05 * np.tan(bend)]],
                    **both,
                }
            ],
            "stream": {
                "at": (np.array([x, gap]) - tip).tolist(),
                "velocity": v.tolist(),
                "angle_deg": float(np.degrees(angle)),
                "interact": True,
                **both,
            },
            "run": {"until": 0.01, "engine": "contact"},
        }
    )
    assert run.at(np.linspace(0.0, 0.01, 21)).velocity[:, 0] == pytest.approx(
        np.tile(v, (21, 1)), abs=1e-9
    )


def pour(seed):
    """Return a pour of needles without friction on a chain of random slopes between walls."""
    g = np.random.default_rng(seed)
    x = np.linspace(-0.06, 0.06, int(g.integers(3, 9)))
    y, t = g.uniform(0.0, 0.04, len(x)), float(g.choice([0.03, 0.1]))
    floor = np.column_stack((x, y)).tolist()
    tail = [[0.0, -t * R], [R, 0.0], [0.0, t * R]]
    tail = [[-R, 0.0], *tail] if g.integers(2) else [[-R, -t * R], [R, 0.0], [-R, t * R]]
    both = {"restitution": float(g.choice([0.0, 0.3, 0.7])), "friction": 0.0}
    return {
        "particle": {"name": "n", "mass": 0.01, "spin": True, "shape": "polygon", "points": tail},
        "surface": [{"name": "floor", "points": [[-0.06, 1.0], *floor, [0.06, 1.0]], **both}],
        "stream": {
            "count": int(g.choice([1, 3, 8, 15])),
            "interact": True,
            "fill": [[-0.05, float(y.max()) + 0.01], [0.05, 0.6]],
            "seed": seed,
            "velocity": [0.0, -3.0],
            "omega": float(g.choice([30.0, -200.0, 200.0])),
            "angle_deg": 45.0,
            **both,
        },
        "run": {"until": 0.8, "engine": "contact"},
    }


@pytest.mark.parametrize("seed", [2, 64, 128, 158, 173, 181, 182])
def test_no_needle_goes_through_a_floor(seed):
    """Tips slide over ridges, where the needle's centre is behind the line of the next face, and
    are pressed into hollows, where a tip beyond the end of one face is through the other."""
    assert not chutelab.simulate(pour(seed)).laws
