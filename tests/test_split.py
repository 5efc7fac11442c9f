"""The picture of a velocity that splits along a plate and into it."""

from math import cos, hypot, radians, sin, sqrt

import numpy as np
import pytest
from matplotlib.text import Annotation

import chutelab
from chutelab.pictures.plots.measures import split_velocity

G, BALL = 9.81, 0.0063


def arrows(ax):
    """Ends of the arrows of a picture, from their tails to their tips."""
    drawn = [one for one in ax.get_children() if isinstance(one, Annotation) and one.arrow_patch]
    return [np.subtract(one.xy, one.xyann) for one in drawn]


def inclined(alpha_deg, v=2.0, d1=0.1):
    """Velocity of a disk at a plate whose pivot is at the belt's height, and the plate's way down.

    It meets the plate after t, when what is left of the gap across it is used up.
    """
    a = radians(alpha_deg)
    gap, half = d1 * cos(a) - BALL * sin(a) - BALL, 0.5 * G * sin(a)
    t = 2.0 * gap / (v * cos(a) + sqrt((v * cos(a)) ** 2 - 4.0 * half * gap))
    return np.array([v, -G * t]), np.array([sin(a), -cos(a)])


@pytest.mark.parametrize(("scene", "alpha"), [("inclined-40", 40), ("inclined-60", 60)])
def test_arrows_are_the_velocities_and_their_parts(scene, alpha):
    before, down = inclined(alpha)
    figure = split_velocity(chutelab.simulate(chutelab.load(scene)))
    left, right = figure.axes
    along = down * (before @ down)
    into = before - along
    for found, wanted in zip(arrows(left), (before, along, into), strict=True):
        assert found == pytest.approx(wanted, abs=1e-9)
    after = along - 0.5 * into
    for found, wanted in zip(arrows(right), (after, along, -0.5 * into), strict=True):
        assert found == pytest.approx(wanted, abs=1e-9)
    assert hypot(*(arrows(left)[1] + arrows(left)[2])) == pytest.approx(hypot(*before))
