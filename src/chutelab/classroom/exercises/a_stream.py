"""Lesson 7: a stream: means, spread and power."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial
from math import sqrt

from chutelab.classroom.exercises.exercise import (
    AS_PRINTED,
    BACKWARDS,
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
    """Let the whole bed leave at the top, v0² > g (R + r + bed), and fall past the pulley."""
    radius = given.mm / 1000.0
    at_top = given.v0**2 > 1.05 * G * (given.R + radius + given.bed)
    return at_top and falls_past_pulley(given, radius, given.bed)


def solve(given: Values) -> Mapping[str, float]:
    """Carry the lowest and the highest layer over the plate.

    All fly at v0 from the top and reach the plate after the same time; the highest layer has the
    height of the bed more to fall from there.
    """
    carry = partial(
        transfer,
        speed=given.v0,
        pulley_radius=given.R,
        distance=given.d,
        restitution=given.e,
        particle_radius=given.mm / 1000.0,
        mass=given.grams / 1000.0,
        belt_speed=given.vb,
        interval=1.0 / given.rate,
        drop=[given.d2, given.d2 + given.bed],
    )
    found = carry()
    printed = carry(rebound="as-printed").x3
    vx = -float(found.v3x[0])
    mass = given.grams / 1000.0
    return {
        "m": mass,
        "r": given.mm / 1000.0,
        "flow": mass * given.rate,
        "vx": vx,
        "vy": float(found.v2y[0]),
        "t_low": float(found.t3[0]),
        "t_high": float(found.t3[1]),
        "spread": float(found.x3[1] - found.x3[0]),
        "spread_printed": float(printed[1] - printed[0]),
        "power": given.rate * float(found.belt_work[0]),
        "heat": given.rate * float(found.slip_heat[0]),
        "P": float(found.P[0]),
        "gained": 0.5 * mass * given.rate * (given.vb**2 - vx**2),
    }


EXERCISE = Exercise(
    number=7,
    name="a-stream",
    title="A stream: means, spread, power",
    story=(
        "A belt at v0 = {v0} m/s throws {rate} balls a second off the top of its pulley"
        " (R = {R} m), each of {grams} g and {mm} mm radius, lying in a bed: their centres are"
        " spread over {bed} m of height. A perpendicular plate stands d = {d} m ahead of the"
        " pulley's edge (ε = {e}). From there, the lowest layer falls another d2 = {d2} m to an"
        " outgoing belt that runs forward at v_b = {vb} m/s. The balls ignore each other;"
        " g = 9.81 m/s², forward is positive."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(2.0, 4.0, 0.2)),
        Parameter("R", "R", "radius of the pulley", "m", (0.1, 0.15, 0.2)),
        Parameter("rate", "n", "balls per second", "1/s", (20.0, 30.0, 40.0, 60.0, 80.0)),
        Parameter("grams", "m", "mass of a ball", "g", steps(4.0, 20.0, 1.0)),
        Parameter("mm", "r", "radius of a ball", "mm", (4.0, 5.0, 6.0)),
        Parameter("bed", "bed", "height of the bed, between centres", "m", (0.03, 0.04, 0.05)),
        Parameter("d", "d", "from the pulley's edge to the plate", "m", (0.3, 0.4, 0.5)),
        Parameter("e", "ε", "coefficient of restitution of the plate", "", (0.3, 0.4, 0.6)),
        Parameter("d2", "d2", "fall of the lowest layer from the plate", "m", (0.4, 0.5, 0.6)),
        Parameter("vb", "v_b", "speed of the outgoing belt", "m/s", steps(1.0, 4.0, 0.2)),
    ),
    fits=fits,
    solve=solve,
    questions=(
        Question(
            title="mass flow",
            text="How large is the mass flow, with {rate} balls of {grams} g per second?",
            unit="kg/s",
            answer=lambda s: s.flow,
            mistakes=(
                Mistake(
                    "mass over rate",
                    "You divided the mass by the rate. More balls a second, more mass.",
                    lambda s: s.m / s.rate,
                ),
                Mistake(
                    "rate over mass",
                    "You divided the rate by the mass.",
                    lambda s: s.rate / s.m,
                ),
                Mistake(
                    "tonnes per hour",
                    "That is the flow in t/h, as engineers state it. It is asked for in kg/s.",
                    lambda s: 3.6 * s.flow,
                ),
                Mistake(
                    "per minute",
                    "That is the mass of a minute.",
                    lambda s: 60.0 * s.flow,
                ),
            ),
            hints=(
                "How much mass passes in one second?",
                "{rate} balls, each of {grams} g.",
                "n m, with m in kg.",
            ),
            working="n m = {rate} 1/s · {m} kg",
            source="Definition of the mass flow",
        ),
        Question(
            title="distance between balls",
            text=(
                "How far ahead, horizontally, is one ball of the next in flight? From centre to"
                " centre, before the plate."
            ),
            unit="m",
            answer=lambda s: s.v0 / s.rate,
            mistakes=(
                Mistake(
                    "upside down",
                    "You divided the rate by the speed. That is how many there are on a metre.",
                    lambda s: s.rate / s.v0,
                ),
                Mistake(
                    "multiplied",
                    "You multiplied speed and rate. More balls a second are closer together.",
                    lambda s: s.rate * s.v0,
                ),
                Mistake(
                    "gap for distance",
                    "That is the gap between their surfaces.",
                    lambda s: s.v0 / s.rate - 2.0 * s.r,
                ),
                Mistake(
                    "belt and particle speed exchanged",
                    "You took the speed of the other belt.",
                    lambda s: s.vb / s.rate,
                ),
            ),
            hints=(
                "When the next ball leaves, how long has the one before been flying?",
                "1/n. And how far forward has it come?",
                "v0 / n.",
            ),
            working="v0 / n = {v0} m/s / ({rate} 1/s)",
            source="Eq. (3) of Molnár et al. (2016), at two times",
        ),
        Question(
            title="spread of the landing",
            text=(
                "Every layer reaches the plate at the same x, after the same time. But the highest"
                " layer has {bed} m more to fall. How far from each other do the lowest and the"
                " highest layer land? A positive number. It comes from a small difference of two"
                " times: keep all digits on the way."
            ),
            unit="m",
            answer=lambda s: s.spread,
            mistakes=(
                Mistake(
                    "ε forgotten",
                    "They come back from the plate, slower than v0.",
                    lambda s: s.v0 * (s.t_high - s.t_low),
                ),
                Mistake(
                    "height of the bed for the spread",
                    "That is the height of the bed itself.",
                    lambda s: s.bed,
                ),
                Mistake(
                    "a fall from rest",
                    "You let them start falling at the plate. They sink already when they meet it.",
                    lambda s: -s.vx * (sqrt(2.0 * (s.d2 + s.bed) / G) - sqrt(2.0 * s.d2 / G)),
                ),
                Mistake(
                    "the bed's fall alone",
                    "You took the time for falling {bed} m from rest. The highest layer falls these"
                    " last centimetres fast.",
                    lambda s: -s.vx * sqrt(2.0 * s.bed / G),
                ),
                Mistake(
                    AS_PRINTED,
                    "That follows from equation (9) as printed.",
                    lambda s: s.spread_printed,
                ),
            ),
            hints=(
                "How much later does the highest layer land? It moves back at ε v0 all that time.",
                "Both sink with v2y = g t2 at the plate, t2 = (R + d - r) / v0.",
                "t3 = (√(v2y² + 2 g fall) - v2y) / g, for d2 and for d2 + bed; ε v0 times the"
                " difference.",
            ),
            working=(
                "v2y = g t2 = {vy} m/s at the plate, for all layers\n"
                "t3 = (√(v2y² + 2 g fall) - v2y) / g: {t_low} s and {t_high} s\n"
                "spread = ε v0 ({t_high} s - {t_low} s)"
            ),
            source="Eqs. (10) to (12) of Molnár et al. (2016), with (9) corrected",
        ),
        Question(
            title="power of the outgoing belt",
            text=(
                "Which power does the outgoing belt need to take the stream along? The balls come"
                " backwards from the plate, and do not turn."
            ),
            unit="W",
            answer=lambda s: s.power,
            mistakes=(
                Mistake(
                    BACKWARDS,
                    "You took the speed of arrival as if it were forward.",
                    lambda s: s.flow * s.vb * (s.vb + s.vx),
                ),
                Mistake(
                    AS_PRINTED,
                    "That is equation (15), with the energy of (14), as printed.",
                    lambda s: s.P,
                ),
                Mistake(
                    "kinetic energy gained",
                    "That is what the stream gains. While it slips, the drive pays for heat too.",
                    lambda s: s.gained,
                ),
                Mistake(
                    "heat for work",
                    "That is the power that becomes heat.",
                    lambda s: s.heat,
                ),
                Mistake(
                    "belt and particle speed exchanged",
                    "You took v0 for the speed of the outgoing belt.",
                    lambda s: s.flow * s.v0 * (s.v0 - s.vx),
                ),
            ),
            hints=(
                "The belt changes the momentum of {rate} balls a second. Force times belt speed.",
                "Force = mass flow times (v_b - vx), with vx = -ε v0.",
                "P = n m v_b (v_b - vx).",
            ),
            working="P = n m v_b (v_b - vx) = {flow} · {vb} · ({vb} - ({vx})) W",
            source="Steady stream: mass flow · v_b (v_b - vx); against Eq. (15)",
        ),
    ),
)
