"""Lesson 6: why the textbook angle is a limit."""

from __future__ import annotations

from collections.abc import Mapping
from math import acos, asin, atan, degrees, hypot, inf, sqrt

import numpy as np

from chutelab.classroom.exercises.exercise import (
    RADIUS,
    Exercise,
    G,
    Mistake,
    Parameter,
    Question,
    Values,
    steps,
)
from chutelab.theory import transfer

FAR = 100.0
"""m to a plate that is in nobody's way."""

NEARLY_ENDLESS = 1e9
"""µ that stands for an infinite one: a free disk then leaves within 1e-8 rad of the limit."""


def onset(friction: float, start: float) -> float:
    """Return the angle (degrees) where a body that does not turn begins to slip.

    sin φ = µ (cos φ - u0), with u0 = v0² / (g Rc), solved for φ.
    """
    return degrees(atan(friction) - asin(friction * start / hypot(1.0, friction)))


def fits(given: Values) -> bool:
    """Ride round the pulley: v0² below g R, but not by far."""
    return given.v0**2 > 0.25 * G * (given.R + given.r) and given.v0**2 < 0.9 * G * given.R


def solve(given: Values) -> Mapping[str, float]:
    """Leave the pulley with adhesion, with Coulomb's friction, and as a disk that only rolls."""
    ride = given.R + given.r
    left = transfer(
        speed=given.v0,
        pulley_radius=given.R,
        particle_radius=given.r,
        distance=FAR,
        friction=[inf, given.mu, NEARLY_ENDLESS],
        spin=[False, False, True],
    )
    textbook, slipping, rolling = (float(angle) for angle in np.degrees(left.phi1))
    start = given.v0**2 / (G * ride)
    return {
        "Rc": ride,
        "u0": start,
        "u_point": given.v0**2 / (G * given.R),
        "textbook": textbook,
        "leaves": slipping,
        "rolling": rolling,
        "onset": onset(given.mu, start),
        "critical": sqrt(G * ride),
    }


EXERCISE = Exercise(
    number=6,
    name="grip-or-slip",
    title="Grip or slip: the textbook angle is a limit",
    story=(
        "A belt at v0 = {v0} m/s carries a body of radius r = {r} m over a pulley of radius"
        " R = {R} m; its centre rides at Rc = R + r. The friction between them is µ = {mu};"
        " g = 9.81 m/s². Angles count from the top of the pulley. A useful short form is"
        " u0 = v0² / (g Rc)."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(1.0, 2.4, 0.1)),
        Parameter("R", "R", "radius of the pulley", "m", (0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)),
        Parameter("r", "r", "radius of the body", "m", (0.04, 0.05, 0.06)),
        Parameter("mu", "µ", "friction of belt and body", "", (0.3, 0.4, 0.5, 0.6, 0.7, 0.8)),
    ),
    fits=fits,
    solve=solve,
    questions=(
        Question(
            title="the textbook angle",
            text=(
                "Where does the body leave if the belt grips without limit (adhesion): the angle φ1"
                " of most textbooks?"
            ),
            unit="degrees",
            answer=lambda s: s.textbook,
            mistakes=(
                Mistake(
                    RADIUS,
                    "You took R for the radius of the circle. The centre rides at Rc = R + r.",
                    lambda s: degrees(acos(s.u_point)),
                ),
                Mistake(
                    "angle from the horizontal",
                    "You took the sine for the cosine: that is the angle above the horizontal.",
                    lambda s: 90.0 - s.textbook,
                ),
                Mistake(
                    "square forgotten",
                    "You took the ratio of the speeds. Forces go with the square of the speed.",
                    lambda s: degrees(acos(sqrt(s.u0))),
                ),
                Mistake(
                    "friction's limit for the grip",
                    "That is where a body with µ = {mu} leaves, after it has slipped.",
                    lambda s: s.leaves,
                ),
            ),
            hints=(
                "With adhesion it is carried at v0 until the pulley no longer has to push.",
                "That is where the weight's share to the centre is m v0² / Rc.",
                "cos φ1 = v0² / (g Rc) = u0.",
            ),
            working="cos φ1 = u0 = {v0}² / (9.81 · {Rc}) = {u0}",
            source="Eq. (2) of Molnár et al. (2016), for the path of the centre",
        ),
        Question(
            title="where slip begins",
            text=(
                "With µ = {mu}, and a body that does not turn: at which"
                " angle does it begin to slip?"
            ),
            unit="degrees",
            answer=lambda s: s.onset,
            mistakes=(
                Mistake(
                    "an incline that stands still",
                    "That is arctan µ, the angle for a slope at rest. Going round takes away from"
                    " the force that presses the body on.",
                    lambda s: degrees(atan(s.mu)),
                ),
                Mistake(
                    "separation for slip",
                    "That is where it leaves the pulley. It begins to slip earlier.",
                    lambda s: s.leaves,
                ),
                Mistake(
                    "pressed on by going round",
                    "You added u0. Going round makes the body lighter on the pulley.",
                    lambda s: onset(s.mu, -s.u0),
                ),
                Mistake(
                    "a disk that rolls",
                    "That is for a free disk, which can roll. This body does not turn.",
                    lambda s: onset(7.0 * s.mu, (3.0 * s.u0 + 4.0) / 7.0),
                ),
                Mistake(
                    RADIUS,
                    "You took R for the radius of the circle. The centre rides at Rc = R + r.",
                    lambda s: onset(s.mu, s.u_point),
                ),
            ),
            hints=(
                "Along the pulley its weight pulls with m g sin φ. How much can friction hold?",
                "µ times the normal force, which is m g (cos φ - u0).",
                "sin φ = µ (cos φ - u0): try φ = 5°, 10°, … or solve with"
                " φ = arctan µ - arcsin(µ u0 / √(1 + µ²)).",
            ),
            working=(
                "sin φ = µ (cos φ - u0), with u0 = {u0}\n"
                "φ = arctan µ - arcsin(µ u0 / √(1 + µ²)), with µ = {mu}"
            ),
            source="Coulomb's law of friction on a circle, docs/physics.md",
        ),
        Question(
            title="a disk that rolls",
            text=(
                "A free disk (I = ½ m r²) rolls down instead of slipping. Let µ be endless, so that"
                " it rolls until it leaves: at which angle does it leave?"
            ),
            unit="degrees",
            answer=lambda s: s.rolling,
            mistakes=(
                Mistake(
                    "the textbook angle",
                    "That is for a body that is held at v0. A disk that rolls gets faster.",
                    lambda s: s.textbook,
                ),
                Mistake(
                    "sliding for rolling",
                    "That is for a body that slides without friction. Rolling takes energy too.",
                    lambda s: degrees(acos((2.0 + s.u0) / 3.0)),
                ),
                Mistake(
                    "a start from rest",
                    "That is cos φ = 4/7, for a disk that starts at rest. This one starts with the"
                    " belt's speed.",
                    lambda s: degrees(acos(4.0 / 7.0)),
                ),
                Mistake(
                    "a hoop for a disk",
                    "That is for a hoop, I = m r². A disk has half of that.",
                    lambda s: degrees(acos((s.u0 + 1.0) / 2.0)),
                ),
                Mistake(
                    RADIUS,
                    "You took R for the radius of the circle. The centre rides at Rc = R + r.",
                    lambda s: degrees(acos((3.0 * s.u_point + 4.0) / 7.0)),
                ),
            ),
            hints=(
                "The centre of a disk that rolls speeds up with 2/3 of what sliding would give:"
                " part of the energy goes into turning.",
                "So u = v² / (g Rc) grows as u = u0 + (4/3) (1 - cos φ).",
                "It leaves where u = cos φ: cos φ1 = (3 u0 + 4) / 7.",
            ),
            working=(
                "u = u0 + (4/3)(1 - cos φ) = cos φ, so cos φ1 = (3 u0 + 4) / 7 = (3 · {u0} + 4) / 7"
            ),
            source="Rolling from belt speed on, docs/physics.md",
        ),
        Question(
            title="slipping at once",
            text=(
                "From which belt speed on does the body leave right at the top, as soon as it would"
                " slip, with µ = {mu}?"
            ),
            unit="m/s",
            answer=lambda s: s.critical,
            mistakes=(
                Mistake(
                    "µ where it does not matter",
                    "You put µ in. At the top nothing pulls along the belt: friction has nothing to"
                    " do there.",
                    lambda s: sqrt(s.mu * G * s.Rc),
                ),
                Mistake(
                    RADIUS,
                    "You took R for the radius of the circle. The centre rides at Rc = R + r.",
                    lambda s: sqrt(G * s.R),
                ),
                Mistake("square root forgotten", "That is v², in m²/s².", lambda s: G * s.Rc),
                Mistake(
                    "a fall for a circle",
                    "√(2 g Rc) is what falling from a height Rc gives.",
                    lambda s: sqrt(2.0 * G * s.Rc),
                ),
            ),
            hints=(
                "Put φ = 0 into the condition of question 2.",
                "0 = µ (1 - u0): which u0 is that, whatever µ is?",
                "u0 = 1, so v = √(g Rc).",
            ),
            working="sin 0 = µ (1 - u0) gives u0 = 1: v = √(g Rc) = √(9.81 · {Rc}) m/s, for any µ",
            source="Eq. (2) of Molnár et al. (2016) with φ1 = 0, for the path of the centre",
        ),
    ),
)
