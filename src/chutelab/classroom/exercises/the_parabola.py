"""Lesson 1: what a belt throws, with nothing in the way."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, atan2, degrees, hypot, sqrt

from chutelab.classroom.exercises.exercise import (
    Exercise,
    G,
    Mistake,
    Parameter,
    Question,
    Values,
    steps,
)


def solve(given: Values) -> Mapping[str, float]:
    """Throw it horizontally: Eqs. (3), (4), (6) and (7) with φ1 = 0, solved for the fall h."""
    time = sqrt(2.0 * given.h / G)
    sinking = G * time
    return {
        "t": time,
        "x": given.v0 * time,
        "vy": sinking,
        "v": hypot(given.v0, sinking),
        "below": degrees(atan2(sinking, given.v0)),
    }


EXERCISE = Exercise(
    number=1,
    name="the-parabola",
    title="The parabola: what a belt throws",
    story=(
        "A belt runs at v0 = {v0} m/s and throws a stone off the top of its pulley, horizontally."
        " The stone falls h = {h} m until it lands. Air does not matter; g = 9.81 m/s²."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(1.6, 5.0, 0.2)),
        Parameter("h", "h", "fall to the landing", "m", steps(0.4, 2.5, 0.1)),
    ),
    solve=solve,
    questions=(
        Question(
            title="time of the fall",
            text="How long does the stone fall, over h = {h} m?",
            unit="s",
            answer=lambda s: s.t,
            mistakes=(
                Mistake(
                    "square root forgotten",
                    "That is t², in s². What is left to do?",
                    lambda s: 2.0 * s.h / G,
                ),
                Mistake(
                    "a 2 forgotten",
                    "In h = ½ g t² there is a ½ that has to come along: check what is under the"
                    " root.",
                    lambda s: sqrt(s.h / G),
                ),
                Mistake(
                    "belt speed for the speed of falling",
                    "You let it fall at the belt's speed. That speed is horizontal: it takes the"
                    " stone forward and not down.",
                    lambda s: s.h / s.v0,
                ),
            ),
            hints=(
                "Forward and down are two motions that know nothing of each other.",
                "Downward it starts from rest: h = ½ g t².",
                "Solve that for t: t = √(2 h / g).",
            ),
            working="t = √(2 h / g) = √(2 · {h} m / 9.81 m/s²)",
            source="Eq. (4) of Molnár et al. (2016) with φ1 = 0",
        ),
        Question(
            title="distance flown",
            text="How far forward does the stone fly until then, with v0 = {v0} m/s?",
            unit="m",
            answer=lambda s: s.x,
            mistakes=(
                Mistake(
                    "height for distance",
                    "That is how far it falls, not how far it flies forward.",
                    lambda s: s.h,
                ),
                Mistake(
                    "speed of falling for the belt speed",
                    "You multiplied the time by the vertical speed at the end. What takes it"
                    " forward?",
                    lambda s: s.vy * s.t,
                ),
                Mistake(
                    "the straight way",
                    "That is the straight line from start to landing. The distance along the floor"
                    " is asked for.",
                    lambda s: hypot(s.x, s.h),
                ),
                Mistake(
                    "a 2 forgotten",
                    "The time is too short: look at question 1 again, at what is under the root.",
                    lambda s: s.v0 * sqrt(s.h / G),
                ),
            ),
            hints=(
                "Nothing pushes forward or back during the flight.",
                "So it keeps the belt's speed, for the time of question 1.",
                "x = v0 t.",
            ),
            working="x = v0 t = {v0} m/s · {t} s",
            source="Eq. (3) of Molnár et al. (2016) with φ1 = 0",
        ),
        Question(
            title="speed at the landing",
            text="How fast is the stone when it lands? The speed itself, not a component.",
            unit="m/s",
            answer=lambda s: s.v,
            mistakes=(
                Mistake(
                    "vertical part only",
                    "That is the vertical component. It still flies forward, too.",
                    lambda s: s.vy,
                ),
                Mistake(
                    "horizontal part only",
                    "That is the belt's speed. The fall adds a vertical component.",
                    lambda s: s.v0,
                ),
                Mistake(
                    "components added up",
                    "You added the two components. They are at right angles.",
                    lambda s: s.v0 + s.vy,
                ),
                Mistake(
                    "a 2 forgotten",
                    "v² = v0² + 2 g h has a 2 in it: it comes from the ½ in ½ m v².",
                    lambda s: sqrt(s.v0**2 + G * s.h),
                ),
                Mistake(
                    "square root forgotten",
                    "That is v², in m²/s².",
                    lambda s: s.v**2,
                ),
            ),
            hints=(
                "The horizontal component has not changed. What has the vertical one become?",
                "The vertical one is g t. The two are at right angles: Pythagoras.",
                "v = √(v0² + (g t)²), which is √(v0² + 2 g h), as the energy says, too.",
            ),
            working=(
                "vy = g t = {vy} m/s downward\nv = √(v0² + vy²) = √(({v0} m/s)² + ({vy} m/s)²)"
            ),
            source="Eq. (6) of Molnár et al. (2016) with φ1 = 0",
        ),
        Question(
            title="direction at the landing",
            text="In which direction does it fly then? As an angle below the horizontal, > 0.",
            unit="degrees",
            answer=lambda s: s.below,
            mistakes=(
                Mistake(
                    "angle to the vertical",
                    "That is the angle to the vertical: the components are exchanged.",
                    lambda s: 90.0 - s.below,
                ),
                Mistake(
                    "direction to the landing point",
                    "That is where you would look to see the landing point from the start. The"
                    " stone lands more steeply than that.",
                    lambda s: degrees(atan(s.h / s.x)),
                ),
                Mistake(
                    "the tangent, not the angle",
                    "That is vy / v0, the tangent of the angle.",
                    lambda s: s.vy / s.v0,
                ),
                Mistake(
                    "tangent with the whole speed",
                    "You divided by the whole speed and took the arctan: divide by the horizontal"
                    " component, or take the arcsin.",
                    lambda s: degrees(atan(s.vy / s.v)),
                ),
            ),
            hints=(
                "A velocity points along its components: {v0} m/s forward, and g t down.",
                "The tangent of the angle is the vertical over the horizontal component.",
                "arctan(g t / v0), in degrees: math.degrees(math.atan2(g * t, v0)).",
            ),
            working="arctan(vy / v0) = arctan({vy} / {v0})",
            source="Direction of the velocity of Eq. (6) of Molnár et al. (2016)",
        ),
    ),
)
