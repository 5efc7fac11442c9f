"""Lesson 3: the bounce on a perpendicular plate, and the misprint in equation (9)."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import sqrt

from chutelab.classroom.exercises.exercise import (
    AS_PRINTED,
    DOUBLE,
    RADIUS,
    SIGN,
    Exercise,
    G,
    Mistake,
    Parameter,
    Question,
    Values,
    falls_past_pulley,
    steps,
)
from chutelab.theory import transfer


def fits(given: Values) -> bool:
    """Leave the pulley at its top, v0² > g Rc, and fall past it after the plate."""
    at_top = given.v0**2 > 1.05 * G * (given.R + given.r)
    return at_top and falls_past_pulley(given, given.r)


def solve(given: Values) -> Mapping[str, float]:
    """Carry the particle over the plate; once with Eq. (9) as printed, once as a point."""
    carry = partial(
        transfer,
        speed=given.v0,
        pulley_radius=given.R,
        distance=given.d,
        drop=given.d2,
        restitution=given.e,
        mass=given.grams / 1000.0,
    )
    found = carry(particle_radius=given.r)
    printed = carry(particle_radius=given.r, rebound="as-printed")
    point = carry()
    return {
        "m": given.grams / 1000.0,
        "vx": -float(found.v3x),
        "vx_printed": -float(printed.v3x),
        "t2": float(found.t2),
        "y2": float(found.y2),
        "vy": float(found.v2y),
        "v2": float(found.v2),
        "v2r": float(found.v2r),
        "v2r_printed": float(printed.v2r),
        "v2r_point": float(point.v2r),
        "t3": float(found.t3),
        "x3": float(found.x3),
        "x3_printed": float(printed.x3),
        "lost": 0.5 * given.grams / 1000.0 * (float(found.v2) ** 2 - float(found.v2r) ** 2),
    }


EXERCISE = Exercise(
    number=3,
    name="the-bounce",
    title="The bounce, and the misprint",
    story=(
        "A belt at v0 = {v0} m/s throws a ball of radius r = {r} m and mass {grams} g off the top"
        " of its pulley (R = {R} m). A perpendicular plate stands d = {d} m ahead of the pulley's"
        " edge and has a coefficient of restitution ε = {e}, no friction. g = 9.81 m/s²; x points"
        " forward, from the belt to the plate."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(2.0, 4.0, 0.2)),
        Parameter("R", "R", "radius of the pulley", "m", (0.1, 0.15, 0.2)),
        Parameter("r", "r", "radius of the ball", "m", (0.03, 0.04, 0.05)),
        Parameter("grams", "m", "mass of the ball", "g", steps(5.0, 20.0, 1.0)),
        Parameter("d", "d", "from the pulley's edge to the plate", "m", steps(0.3, 0.6, 0.05)),
        Parameter("e", "ε", "coefficient of restitution of ball and plate", "", (0.4, 0.6, 0.7)),
        Parameter("d2", "d2", "fall from the impact to the landing", "m", steps(0.4, 1.0, 0.1)),
    ),
    fits=fits,
    solve=solve,
    questions=(
        Question(
            title="velocity off the plate",
            text=(
                "The ball meets the plate with a horizontal velocity of {v0} m/s. What is its"
                " horizontal velocity right after the bounce (ε = {e})? Forward is positive."
            ),
            unit="m/s",
            answer=lambda s: s.vx,
            mistakes=(
                Mistake(
                    SIGN,
                    "The size is right. But the plate throws the ball back, and forward is"
                    " positive.",
                    lambda s: -s.vx,
                ),
                Mistake(
                    "a bounce without loss",
                    "That is a bounce in which nothing is lost. Where did ε go?",
                    lambda s: -s.v0,
                ),
                Mistake(
                    "the part lost for the part kept",
                    "You took 1 - ε. But ε is the part of the normal velocity that comes back, not"
                    " the part that is lost.",
                    lambda s: -(1.0 - s.e) * s.v0,
                ),
                Mistake(
                    "ε taken for a share of the energy",
                    "You took √ε: ε is a ratio of velocities, not of energies.",
                    lambda s: -sqrt(s.e) * s.v0,
                ),
                Mistake(
                    AS_PRINTED,
                    "That follows from equation (9) as it is printed. Read it against equation (8):"
                    " which component does a plate damp?",
                    lambda s: s.vx_printed,
                ),
            ),
            hints=(
                "A plate without friction can only push at right angles to itself.",
                "The plate stands upright, so its normal is horizontal: ε acts on vx alone.",
                "Of the speed into the plate, the share ε comes back, the other way.",
            ),
            working="vx' = -ε v0 = -{e} · {v0} m/s",
            source="Newton's law of restitution; Eq. (8) of Molnár et al. (2016)",
        ),
        Question(
            title="speed after the bounce",
            text=(
                "How fast is the ball right after the bounce, that is v2'? It has flown from the"
                " top of the pulley (x = 0) until its edge touched the plate at"
                " x = R + d = {R} m + {d} m."
            ),
            unit="m/s",
            answer=lambda s: s.v2r,
            mistakes=(
                Mistake(
                    AS_PRINTED,
                    "That is equation (9) as printed: it damps the velocity along the plate and"
                    " keeps the one into it. Which of the two does a plate without friction damp?",
                    lambda s: s.v2r_printed,
                ),
                Mistake(
                    "ε on both components",
                    "You multiplied the whole speed by ε. The plate only damps the component at"
                    " right angles to it.",
                    lambda s: s.e * s.v2,
                ),
                Mistake(
                    "a bounce without loss",
                    "That is the speed before the bounce.",
                    lambda s: s.v2,
                ),
                Mistake(
                    "the fall forgotten",
                    "That is the horizontal component alone. On its way to the plate the ball has"
                    " been falling, too.",
                    lambda s: s.e * s.v0,
                ),
                Mistake(
                    RADIUS,
                    "You let the centre of the ball fly all the way to the plate. Its edge is there"
                    " first.",
                    lambda s: s.v2r_point,
                ),
            ),
            hints=(
                "Two components: the horizontal one from question 1, and the vertical one.",
                "The vertical one is g t, and the plate does not change it."
                " How long is the flight?",
                "The centre flies R + d - r forward, at v0. Then v2' = √(vx'² + (g t)²).",
            ),
            working=(
                "t2 = (R + d - r) / v0 = ({R} + {d} - {r}) / {v0} s = {t2} s\n"
                "v2y = g t2 = {vy} m/s, which the plate leaves as it is\n"
                "v2' = √((ε v0)² + v2y²) = √(({e} · {v0})² + {vy}²) m/s"
            ),
            source="Eqs. (5), (8) and (9), corrected, of Molnár et al. (2016)",
        ),
        Question(
            title="landing behind the plate",
            text=(
                "From the impact on, the centre of the ball falls another d2 = {d2} m until it"
                " lands on the outgoing belt. How far back from the place of the impact does it"
                " land? Give x3 > 0, back from the plate."
            ),
            unit="m",
            answer=lambda s: s.x3,
            mistakes=(
                Mistake(
                    AS_PRINTED,
                    "That is what Table 1 of the paper does, with equation (9) as printed.",
                    lambda s: s.x3_printed,
                ),
                Mistake(
                    "a fall from rest",
                    "You let the ball start falling at the plate. It was falling before, and the"
                    " plate does not stop that.",
                    lambda s: -s.vx * sqrt(2.0 * s.d2 / G),
                ),
                Mistake(
                    "ε forgotten",
                    "It flies back with v0, you say. Look at question 1 again.",
                    lambda s: s.v0 * s.t3,
                ),
                Mistake(
                    "the whole fall for a part of it",
                    "You took the time of the whole fall from the pulley's top. It flies back only"
                    " from the plate on.",
                    lambda s: -s.vx * (s.t2 + s.t3),
                ),
            ),
            hints=(
                "It flies back at a constant |vx'|, for the time t3 that the fall d2 takes.",
                "At the plate it already sinks with v2y = g t2: d2 = v2y t3 + ½ g t3².",
                "t3 = (√(v2y² + 2 g d2) - v2y) / g, and x3 = ε v0 t3.",
            ),
            working=(
                "v2y = g t2 = {vy} m/s at the plate\n"
                "t3 = (√(v2y² + 2 g d2) - v2y) / g = {t3} s\n"
                "x3 = ε v0 t3 = {e} · {v0} · {t3} m; the paper's misprint makes it {x3_printed} m"
            ),
            source="Eqs. (10) to (12) of Molnár et al. (2016), with (9) corrected",
        ),
        Question(
            title="energy lost in the bounce",
            text=(
                "How much energy does the bounce cost the ball (m = {grams} g)? A positive number."
            ),
            unit="J",
            answer=lambda s: s.lost,
            mistakes=(
                Mistake(
                    DOUBLE,
                    "Twice what it should be: kinetic energy is ½ m v².",
                    lambda s: 2.0 * s.lost,
                ),
                Mistake(
                    "1 - ε for 1 - ε²",
                    "The velocity shrinks by ε, so what becomes of the energy, which goes with the"
                    " square?",
                    lambda s: 0.5 * s.m * s.v0**2 * (1.0 - s.e),
                ),
                Mistake(
                    "energy of the velocity lost",
                    "You took the energy of the difference of the velocities. Take the difference"
                    " of the energies.",
                    lambda s: 0.5 * s.m * (s.v0 - s.e * s.v0) ** 2,
                ),
                Mistake(
                    "ε on both components",
                    "You let the plate damp the vertical motion, too.",
                    lambda s: 0.5 * s.m * s.v2**2 * (1.0 - s.e**2),
                ),
                Mistake(
                    "what is kept for what is lost",
                    "That is what is left of the energy of the horizontal motion.",
                    lambda s: 0.5 * s.m * (s.e * s.v0) ** 2,
                ),
                Mistake(
                    AS_PRINTED,
                    "With equation (9) as printed the plate would damp the vertical motion only.",
                    lambda s: 0.5 * s.m * s.vy**2 * (1.0 - s.e**2),
                ),
            ),
            hints=(
                "Energy before minus energy after. Which component changes at all?",
                "Only the horizontal one: from v0 to ε v0. Mind that the mass is in grams.",
                "½ m v0² (1 - ε²), with m in kg.",
            ),
            working="½ m v0² (1 - ε²) = ½ · {m} kg · ({v0} m/s)² · (1 - {e}²)",
            source="Kinetic energy before and after Eq. (9), corrected",
        ),
    ),
)
