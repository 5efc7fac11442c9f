"""Lesson 5: landing on a moving belt: who pays, and how much becomes heat."""

from __future__ import annotations

from collections.abc import Mapping

from chutelab.classroom.exercises.exercise import (
    AS_PRINTED,
    BACKWARDS,
    Exercise,
    G,
    Mistake,
    Parameter,
    Question,
    Values,
    steps,
)
from chutelab.theory import transfer

PULLEY, AHEAD = 0.1, 0.5
"""m, radius of the pulley and distance of the plate: they do not matter to a landing."""


def fits(given: Values) -> bool:
    """Leave the pulley at its top."""
    return given.v0**2 > 1.05 * G * PULLEY


def tell(given: Values) -> Mapping[str, float]:
    """Tell the size of the velocity with which it comes back from the plate."""
    return {"back": given.e * given.v0}


def solve(given: Values) -> Mapping[str, float]:
    """Land: belt work and slip heat until nothing slips, and the paper's Eqs. (14) and (15)."""
    found = transfer(
        speed=given.v0,
        pulley_radius=PULLEY,
        distance=AHEAD,
        restitution=given.e,
        belt_speed=given.vb,
        mass=given.grams / 1000.0,
        interval=1.0 / given.rate,
    )
    vx = -float(found.v3x)
    return {
        "m": given.grams / 1000.0,
        "vx": vx,
        "slip": given.vb - vx,
        "work": float(found.belt_work),
        "heat": float(found.slip_heat),
        "time": (given.vb - vx) / (given.mu * G),
        "power": given.rate * float(found.belt_work),
        "dEk": float(found.dEk),
        "P": float(found.P),
        "gained": 0.5 * given.grams / 1000.0 * (given.vb**2 - vx**2),
    }


EXERCISE = Exercise(
    number=5,
    name="landing",
    title="Landing on a moving belt",
    story=(
        "A belt throws particles of {grams} g at v0 = {v0} m/s against a perpendicular plate with"
        " ε = {e}, so they come back at {back} m/s and land, against its direction, on an outgoing"
        " belt that runs forward at v_b = {vb} m/s. They do not turn; µ = {mu} on that belt,"
        " g = 9.81 m/s². Forward is positive."
    ),
    parameters=(
        Parameter("v0", "v0", "speed of the incoming belt", "m/s", steps(1.5, 4.0, 0.5)),
        Parameter("e", "ε", "coefficient of restitution of the plate", "", (0.3, 0.4, 0.5, 0.6)),
        Parameter("vb", "v_b", "speed of the outgoing belt", "m/s", steps(1.0, 4.0, 0.2)),
        Parameter("grams", "m", "mass of a particle", "g", steps(4.0, 20.0, 1.0)),
        Parameter("mu", "µ", "friction on the outgoing belt", "", (0.3, 0.4, 0.6)),
        Parameter("rate", "n", "particles per second", "1/s", (20.0, 30.0, 40.0, 60.0)),
    ),
    fits=fits,
    tell=tell,
    solve=solve,
    questions=(
        Question(
            title="work of the belt",
            text=(
                "How much work does the drive of the outgoing belt do on one particle, until it"
                " moves with the belt?"
            ),
            unit="J",
            answer=lambda s: s.work,
            mistakes=(
                Mistake(
                    BACKWARDS,
                    "You took the speed of arrival as if it were forward. It comes backwards: the"
                    " belt has to stop it first.",
                    lambda s: s.m * s.vb * (s.vb + s.vx),
                ),
                Mistake(
                    "kinetic energy gained",
                    "That is what the particle has more in the end. While it slips, the belt pays"
                    " for heat as well.",
                    lambda s: s.gained,
                ),
                Mistake(
                    AS_PRINTED,
                    "That is equation (14) as printed, ½ m (v3x² + v_b²): the direction of v3x is"
                    " lost in the square.",
                    lambda s: s.dEk,
                ),
                Mistake(
                    "heat for work",
                    "That is the part of the work which becomes heat.",
                    lambda s: s.heat,
                ),
                Mistake(
                    "belt and particle speed exchanged",
                    "Force times the way of what? The belt does the work while it moves at v_b, and"
                    " not at the speed of the particle.",
                    lambda s: -s.m * s.vx * s.slip,
                ),
            ),
            hints=(
                "The belt pulls at the particle with some force F, for some time t. Work of the"
                " belt: F times the way of the belt.",
                "F t is the change of momentum, whatever F is. The belt's way is v_b t.",
                "W = m v_b (v_b - vx), with vx = -ε v0.",
            ),
            working=(
                "the belt changes the momentum by m (v_b - vx), moving at v_b all the time\n"
                "W = m v_b (v_b - vx) = {m} · {vb} · ({vb} - ({vx})) J"
            ),
            source="Momentum times belt speed; against Eq. (14) of Molnár et al. (2016)",
        ),
        Question(
            title="heat of the slip",
            text="How much of it becomes heat, while the particle slips on the belt?",
            unit="J",
            answer=lambda s: s.heat,
            mistakes=(
                Mistake(
                    BACKWARDS,
                    "You took the difference of the speeds as if both were forward.",
                    lambda s: 0.5 * s.m * (s.vb + s.vx) ** 2,
                ),
                Mistake(
                    "difference of the squares",
                    "That is the energy which the particle gains. Heat is what the slip, that is"
                    " the difference of the velocities, costs.",
                    lambda s: s.gained,
                ),
                Mistake(
                    "half of the work",
                    "Half of the work becomes heat only for a particle that starts at rest.",
                    lambda s: 0.5 * s.work,
                ),
                Mistake(
                    AS_PRINTED,
                    "That is equation (14) as printed, with a sum of squares.",
                    lambda s: s.dEk,
                ),
            ),
            hints=(
                "Heat is friction force times the way of the slip, seen from the belt.",
                "Seen from the belt, the particle arrives with v_b - vx and comes to rest.",
                "Q = ½ m (v_b - vx)². Or: work minus what the particle gains.",
            ),
            working="Q = ½ m (v_b - vx)² = ½ · {m} · ({vb} - ({vx}))² J",
            source="Kinetic energy in the frame of the belt",
        ),
        Question(
            title="time of the slip",
            text=(
                "How long does the particle slip, if it is laid down softly, so that nothing but"
                " its weight presses it on the belt (µ = {mu})?"
            ),
            unit="s",
            answer=lambda s: s.time,
            mistakes=(
                Mistake(
                    BACKWARDS,
                    "You took the difference of the speeds as if both were forward.",
                    lambda s: (s.vb + s.vx) / (s.mu * G),
                ),
                Mistake(
                    "µ forgotten",
                    "You let it accelerate with g. Friction gives µ g.",
                    lambda s: s.slip / G,
                ),
                Mistake(
                    "a start from rest",
                    "You let the particle start at rest. It comes backwards.",
                    lambda s: s.vb / (s.mu * G),
                ),
                Mistake(
                    "half of the way only",
                    "That is how long the belt takes to stop the particle only. It then has to"
                    " bring it to v_b.",
                    lambda s: -s.vx / (s.mu * G),
                ),
            ),
            hints=(
                "Friction pulls with µ m g: how fast does the velocity change?",
                "By µ g every second. By how much does it have to change?",
                "t = (v_b - vx) / (µ g).",
            ),
            working="t = (v_b - vx) / (µ g) = ({vb} - ({vx})) / ({mu} · 9.81) s",
            source="Coulomb's law of friction, with the weight alone pressing",
        ),
        Question(
            title="power for a stream",
            text="Which power does the belt need for {rate} such particles per second?",
            unit="W",
            answer=lambda s: s.power,
            mistakes=(
                Mistake(
                    BACKWARDS,
                    "You took the speed of arrival as if it were forward.",
                    lambda s: s.rate * s.m * s.vb * (s.vb + s.vx),
                ),
                Mistake(
                    AS_PRINTED,
                    "That is equation (15), with the energy of (14), as printed.",
                    lambda s: s.P,
                ),
                Mistake(
                    "energy of one particle",
                    "That is the work on one particle.",
                    lambda s: s.work,
                ),
                Mistake(
                    "heat for work",
                    "That is the power that becomes heat. The drive pays for all of it.",
                    lambda s: s.rate * s.heat,
                ),
                Mistake(
                    "divided by the rate",
                    "You divided by the number of particles per second. More"
                    " particles, more power.",
                    lambda s: s.work / s.rate,
                ),
            ),
            hints=(
                "Power is energy per second.",
                "Each particle costs the work of question 1; how many are there in a second?",
                "P = n m v_b (v_b - vx).",
            ),
            working="P = n W = {rate} 1/s · {work} J",
            source="Steady stream: mass flow · v_b (v_b - vx); against Eq. (15)",
        ),
    ),
)
