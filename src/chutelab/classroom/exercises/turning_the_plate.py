"""Lesson 4: what a tilted plate turns a stream into, and the angle that never touches."""

from __future__ import annotations

from collections.abc import Mapping
from math import atan, cos, degrees, hypot, radians, sin

from chutelab.classroom.exercises.exercise import (
    AS_PRINTED,
    SIGN,
    Exercise,
    G,
    Mistake,
    Parameter,
    Question,
    Values,
    steps,
)
from chutelab.theory import Transfer, transfer

LEAST_FORWARD = 0.15
"""m/s after the bounce, either way: less is a difference in which told digits do not suffice."""


def strike(given: Values) -> Transfer:
    """Meet the tilted plate: a point, thrown horizontally, the pivot as high as the belt."""
    return transfer(
        speed=given.v0,
        pulley_radius=given.R,
        distance=given.d,
        angle=radians(given.alpha),
        restitution=given.e,
    )


def matching(given: Values) -> float:
    """Return the angle whose plate touches the flight without being struck, degrees.

    Where the line of the plate just touches the parabola the discriminant of Eq. (5), generalised
    to an inclined plate, is 0: tan α = v0² / (2 g d1).
    """
    return degrees(atan(given.v0**2 / (2.0 * G * (given.R + given.d))))


def fits(given: Values) -> bool:
    """Leave at the top, meet the plate well before the matching angle, go on well off upright."""
    if given.v0**2 < 1.05 * G * given.R or given.alpha > matching(given) - 3.0:
        return False
    return abs(float(strike(given).v3x)) > LEAST_FORWARD


def tell(given: Values) -> Mapping[str, float]:
    """Tell the downward velocity at the plate."""
    return {"vy": float(strike(given).v2y)}


def solve(given: Values) -> Mapping[str, float]:
    """Bounce off the tilted plate: Eqs. (7) to (9), corrected and generalised."""
    found = strike(given)
    alpha, phi = radians(given.alpha), float(found.phi2)
    normal, along = float(found.v2) * sin(phi), float(found.v2) * cos(phi)
    return {
        "sin": sin(alpha),
        "cos": cos(alpha),
        "sin_of_degrees": sin(given.alpha),
        "cos_of_degrees": cos(given.alpha),
        "d1": given.R + given.d,
        "v2": float(found.v2),
        "vn": normal,
        "vt": along,
        "v2r": float(found.v2r),
        "vx": -float(found.v3x),
        "matching": matching(given),
    }


EXERCISE = Exercise(
    number=4,
    name="turning-the-plate",
    title="Turning the plate",
    story=(
        "A belt throws particles, small enough to be points, off the top of its pulley (R = {R} m)"
        " at v0 = {v0} m/s. A plate turns about a pivot d = {d} m ahead of the pulley's edge and as"
        " high as the belt. Its top leans back towards the belt by α = {alpha}° from the vertical;"
        " ε = {e}, no friction, g = 9.81 m/s². A particle meets it at {v0} m/s forward and"
        " {vy} m/s down."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(1.6, 3.2, 0.2)),
        Parameter("R", "R", "radius of the pulley", "m", (0.05, 0.06, 0.08, 0.1)),
        Parameter("d", "d", "from the pulley's edge to the pivot", "m", (0.03, 0.04, 0.12)),
        Parameter("alpha", "α", "angle of the plate", "°", steps(20.0, 60.0, 5.0)),
        Parameter("e", "ε", "coefficient of restitution", "", (0.4, 0.5, 0.6)),
    ),
    fits=fits,
    tell=tell,
    solve=solve,
    questions=(
        Question(
            title="speed into the plate",
            text=(
                "It arrives with {v0} m/s forward and {vy} m/s down, at a plate of α = {alpha}°."
                " How large is the component at right angles to the plate, into it?"
            ),
            unit="m/s",
            answer=lambda s: s.vn,
            mistakes=(
                Mistake(
                    "both parts into the plate",
                    "You added the two parts. But the plate leans the same way as the fall goes:"
                    " falling takes the particle away from it.",
                    lambda s: s.v0 * s.cos + s.vy * s.sin,
                ),
                Mistake(
                    "sine and cosine exchanged",
                    "That is the component along the plate. At α = 0 the plate is vertical: then v0"
                    " has to be left.",
                    lambda s: s.vt,
                ),
                Mistake(
                    "the fall forgotten",
                    "You turned the horizontal velocity only. Part of the fall is at right angles"
                    " to the plate, too.",
                    lambda s: s.v0 * s.cos,
                ),
                Mistake(
                    "the plate not turned",
                    "That is the component into a vertical plate.",
                    lambda s: s.v0,
                ),
                Mistake(
                    "degrees for radians",
                    "math.sin and math.cos take radians, and they were given degrees.",
                    lambda s: s.v0 * s.cos_of_degrees - s.vy * s.sin_of_degrees,
                ),
            ),
            hints=(
                "Draw the plate, its normal, and both components. Which of them run into it?",
                "The normal points cos α forward and sin α up, seen into the plate.",
                "vn = v0 cos α - vy sin α, with vy the downward speed.",
            ),
            working="vn = v0 cos α - vy sin α = {v0} · {cos} - {vy} · {sin} m/s",
            source="Eq. (7) of Molnár et al. (2016), generalised to an inclined plate",
        ),
        Question(
            title="speed after the bounce",
            text="How fast is the particle after the bounce (ε = {e})?",
            unit="m/s",
            answer=lambda s: s.v2r,
            mistakes=(
                Mistake(
                    "ε on both components",
                    "You multiplied the whole speed by ε. What is along the plate stays.",
                    lambda s: s.e * s.v2,
                ),
                Mistake(
                    AS_PRINTED,
                    "That is equation (9) as printed: it damps the component along the plate.",
                    lambda s: hypot(s.vn, s.e * s.vt),
                ),
                Mistake(
                    "a bounce without loss",
                    "That is the speed before the bounce.",
                    lambda s: s.v2,
                ),
                Mistake(
                    "ε on the wrong component",
                    "You damped the horizontal component, as an upright plate would.",
                    lambda s: hypot(s.e * s.v0, s.vy),
                ),
                Mistake(
                    "component along the plate forgotten",
                    "That is the component at right angles to the plate alone.",
                    lambda s: s.e * s.vn,
                ),
            ),
            hints=(
                "Only the component of question 1 is damped. What is the other one?",
                "Along the plate: vt = v0 sin α + vy cos α, and it stays.",
                "v' = √(vt² + (ε vn)²).",
            ),
            working=(
                "vt = v0 sin α + vy cos α = {vt} m/s along the plate, before and after\n"
                "vn = {vn} m/s into it, ε vn comes back\n"
                "v' = √(vt² + (ε vn)²) = √({vt}² + ({e} · {vn})²) m/s"
            ),
            source="Eq. (9) of Molnár et al. (2016), corrected",
        ),
        Question(
            title="which way it goes on",
            text="What is its horizontal velocity after the bounce? Forward is positive.",
            unit="m/s",
            answer=lambda s: s.vx,
            mistakes=(
                Mistake(
                    SIGN,
                    "The size is right, but not the direction. vt takes it forward, the rebound"
                    " back: which of them is stronger?",
                    lambda s: -s.vx,
                ),
                Mistake(
                    "the plate not turned",
                    "That is what an upright plate would do.",
                    lambda s: -s.e * s.v0,
                ),
                Mistake(
                    "ε forgotten",
                    "That is a bounce without loss.",
                    lambda s: s.vt * s.sin - s.vn * s.cos,
                ),
                Mistake(
                    "ε on the wrong component",
                    "You damped the component along the plate, not the one into it.",
                    lambda s: s.e * s.vt * s.sin - s.vn * s.cos,
                ),
                Mistake(
                    "rebound into the plate",
                    "You let ε vn go on into the plate. It comes back from it.",
                    lambda s: s.vt * s.sin + s.e * s.vn * s.cos,
                ),
                Mistake(
                    "sine and cosine exchanged",
                    "Sine and cosine are exchanged: at α = 0, vt is vertical and has no share.",
                    lambda s: s.vt * s.cos - s.e * s.vn * s.sin,
                ),
            ),
            hints=(
                "Turn the two components back into forward and up.",
                "vt points down the plate, forward by sin α. The rebound points back by cos α.",
                "vx' = vt sin α - ε vn cos α.",
            ),
            working="vx' = vt sin α - ε vn cos α = {vt} · {sin} - {e} · {vn} · {cos} m/s",
            source="Eqs. (8) and (9) of Molnár et al. (2016), corrected, for an inclined plate",
        ),
        Question(
            title="the angle that never touches",
            text=(
                "Now the plate is turned further, about the same pivot. From which angle α on is it"
                " never touched? There the plate runs alongside the parabola; d1 = R + d = {R} m +"
                " {d} m, and the plate is long enough."
            ),
            unit="degrees",
            answer=lambda s: s.matching,
            mistakes=(
                Mistake(
                    "velocity at the pivot's distance",
                    "You matched the direction of the flight at x = d1. The leaning plate would be"
                    " touched elsewhere: farther on, and lower.",
                    lambda s: degrees(atan(s.v0**2 / (G * s.d1))),
                ),
                Mistake(
                    "distance from the wrong place",
                    "You counted the way from the pulley's edge. The flight begins at its top,"
                    " x = 0.",
                    lambda s: degrees(atan(s.v0**2 / (2.0 * G * s.d))),
                ),
                Mistake(
                    "angle from the horizontal",
                    "That is the plate's angle above the horizontal.",
                    lambda s: 90.0 - s.matching,
                ),
                Mistake(
                    "the tangent, not the angle",
                    "That is the tangent of the angle.",
                    lambda s: s.v0**2 / (2.0 * G * s.d1),
                ),
            ),
            hints=(
                "Write the gap between particle and plate as a function of time.",
                "It is d1 cos α - v0 cos α t + ½ g sin α t². When does that have no zero?",
                "When its discriminant is negative: (v0 cos α)² < 2 g sin α d1 cos α.",
            ),
            working=(
                "the gap d1 cos α - v0 cos α t + ½ g sin α t² has no zero if"
                " (v0 cos α)² < 2 g d1 sin α cos α\n"
                "tan α = v0² / (2 g d1) = {v0}² / (2 · 9.81 · {d1})"
            ),
            source="Discriminant of Eq. (5) of Molnár et al. (2016) for an inclined plate",
        ),
    ),
)
