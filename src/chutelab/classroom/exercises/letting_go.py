"""Lesson 2: riding round the pulley, and where that ends."""

from __future__ import annotations

from collections.abc import Mapping
from math import acos, cos, degrees, sin, sqrt

from chutelab.classroom.exercises.exercise import (
    RADIUS,
    SIGN,
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


def fits(given: Values) -> bool:
    """Ride round the pulley, but not to the side of it: v0² well below g R."""
    return given.v0**2 > 0.3 * G * (given.R + given.r) and given.v0**2 < 0.95 * G * given.R


def solve(given: Values) -> Mapping[str, float]:
    """Separate from the pulley, carried by adhesion: Eqs. (1) and (2)."""
    left = transfer(speed=given.v0, pulley_radius=given.R, particle_radius=given.r, distance=FAR)
    phi = float(left.phi1)
    ride = given.R + given.r
    return {
        "Rc": ride,
        "u": given.v0**2 / (G * ride),
        "phi": phi,
        "phi_deg": degrees(phi),
        "critical": sqrt(G * ride),
        "y": ride * cos(phi),
        "vx": float(left.v1) * cos(phi),
        "vy": -float(left.v1) * sin(phi),
        "slid": sqrt(given.v0**2 + 2.0 * G * ride * (1.0 - cos(phi))),
    }


EXERCISE = Exercise(
    number=2,
    name="letting-go",
    title="When does it let go?",
    story=(
        "A belt runs at v0 = {v0} m/s over a pulley of radius R = {R} m. A ball of radius r = {r} m"
        " lies on it and is carried along without slipping; its centre rides on a circle of radius"
        " Rc = R + r. g = 9.81 m/s². Angles count from the top of the pulley; y from its axis, up."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(1.0, 2.4, 0.1)),
        Parameter("R", "R", "radius of the pulley", "m", (0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6)),
        Parameter("r", "r", "radius of the ball", "m", (0.04, 0.05, 0.06)),
    ),
    fits=fits,
    solve=solve,
    questions=(
        Question(
            title="critical speed",
            text="From which belt speed on would the ball leave at the very top of the pulley?",
            unit="m/s",
            answer=lambda s: s.critical,
            mistakes=(
                Mistake(
                    RADIUS,
                    "You took R. What goes round is the centre of the ball, on a larger circle.",
                    lambda s: sqrt(G * s.R),
                ),
                Mistake("square root forgotten", "That is v², in m²/s².", lambda s: G * s.Rc),
                Mistake(
                    "a fall for a circle",
                    "√(2 g Rc) is what falling from a height Rc gives. What holds a body on a"
                    " circle?",
                    lambda s: sqrt(2.0 * G * s.Rc),
                ),
                Mistake(
                    "divided by the radius",
                    "You divided g by the radius. That is a rate of turning, in rad/s.",
                    lambda s: sqrt(G / s.Rc),
                ),
            ),
            hints=(
                "On a circle a body needs a force to the centre, m v² / Rc. What provides it?",
                "At the top all of the weight points to the centre: m g, and not more.",
                "v² / Rc = g, with Rc = R + r.",
            ),
            working="v = √(g (R + r)) = √(9.81 · ({R} + {r})) m/s",
            source="Eq. (2) of Molnár et al. (2016) with φ1 = 0, for the path of the centre",
        ),
        Question(
            title="angle of separation",
            text="At which angle φ1 from the top does the ball let go, at v0 = {v0} m/s?",
            unit="degrees",
            answer=lambda s: s.phi_deg,
            mistakes=(
                Mistake(
                    RADIUS,
                    "You took R for the radius of the circle. The centre rides on Rc = R + r.",
                    lambda s: degrees(acos(s.v0**2 / (G * s.R))),
                ),
                Mistake(
                    "angle from the horizontal",
                    "You took the sine for the cosine: that is the angle above the horizontal.",
                    lambda s: 90.0 - s.phi_deg,
                ),
                Mistake(
                    "square forgotten",
                    "You took the ratio of the speeds. Forces go with the square of the speed.",
                    lambda s: degrees(acos(sqrt(s.u))),
                ),
                Mistake(
                    "sliding for riding",
                    "That is for a ball that slides down without friction and gets faster. Here"
                    " the belt keeps it at v0.",
                    lambda s: degrees(acos((2.0 + s.u) / 3.0)),
                ),
                Mistake(
                    "the cosine, not the angle",
                    "That is cos φ1. Which angle has it?",
                    lambda s: s.u,
                ),
            ),
            hints=(
                "At an angle φ only a share of the weight points to the centre.",
                "It lets go where that share, m g cos φ, is no more than m v0² / Rc.",
                "cos φ1 = v0² / (g Rc), and math.acos answers in radians.",
            ),
            working="cos φ1 = v0² / (g Rc) = {v0}² / (9.81 · {Rc}) = {u}",
            source="Eq. (2) of Molnár et al. (2016), for the path of the centre",
        ),
        Question(
            title="height of the separation",
            text="How high above the axis of the pulley is the ball's centre when it lets go?",
            unit="m",
            answer=lambda s: s.y,
            mistakes=(
                Mistake(
                    RADIUS,
                    "You took R cos φ1. The centre is Rc = R + r away from the axis.",
                    lambda s: s.R * s.u,
                ),
                Mistake(
                    "sine for cosine",
                    "That is how far forward it is. φ1 counts from the top.",
                    lambda s: s.Rc * sin(s.phi),
                ),
                Mistake(
                    "way down for height",
                    "That is how far it has come down from the top.",
                    lambda s: s.Rc * (1.0 - s.u),
                ),
                Mistake(
                    "degrees for radians",
                    "math.cos takes radians, and it was given degrees.",
                    lambda s: s.Rc * cos(s.phi_deg),
                ),
            ),
            hints=(
                "The centre is at the distance Rc from the axis, turned by φ1 from the top.",
                "y = Rc cos φ1; math.cos takes radians.",
                "Put in cos φ1 = v0² / (g Rc): what is left of Rc?",
            ),
            working="y = Rc cos φ1 = {Rc} m · {u} (which is v0² / g: the pulley does not matter!)",
            source="Eq. (2) of Molnár et al. (2016)",
        ),
        Question(
            title="vertical velocity",
            text="What is the vertical velocity of the ball when it lets go? Up is positive.",
            unit="m/s",
            answer=lambda s: s.vy,
            mistakes=(
                Mistake(
                    SIGN,
                    "The size is right. But it goes down there, and up is positive.",
                    lambda s: -s.vy,
                ),
                Mistake(
                    "sine and cosine exchanged",
                    "That is the size of the horizontal component. At the top, where φ = 0, the"
                    " vertical one is 0.",
                    lambda s: -s.vx,
                ),
                Mistake(
                    "the other component",
                    "That is the horizontal velocity.",
                    lambda s: s.vx,
                ),
                Mistake(
                    "degrees for radians",
                    "math.sin takes radians, and it was given degrees.",
                    lambda s: -s.v0 * sin(s.phi_deg),
                ),
                Mistake(
                    "sliding for riding",
                    "You let the ball gain speed on the way down. The belt does not let it: it is"
                    " carried at v0.",
                    lambda s: -s.slid * sin(s.phi),
                ),
            ),
            hints=(
                "Its speed is still v0: the belt carries it. Only the direction has turned.",
                "It moves along the circle, so at φ1 it points φ1 below the horizontal.",
                "vy = -v0 sin φ1.",
            ),
            working="vy = -v0 sin φ1 = -{v0} m/s · sin {phi_deg}°",
            source="Eqs. (1) and (2) of Molnár et al. (2016)",
        ),
    ),
)
