"""Lesson 8: can you trust a simulation? Order, step, energy, tunnelling."""

from __future__ import annotations

from collections.abc import Mapping
from math import log, log10

from chutelab.classroom.exercises.exercise import (
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
"""m, radius of the pulley and distance of the plate in question 3."""


def fits(given: Values) -> bool:
    """Show an order that methods have, and one that is not told by rounding it."""
    order = log(given.e1 / given.e2) / log(given.ratio)
    return 1.6 < order < 3.4 and abs(order - round(order)) > 0.05


def tell(given: Values) -> Mapping[str, float]:
    """Tell the shorter step, and the books of a run up to the end of the slip, from theory."""
    found = transfer(
        speed=given.v0,
        pulley_radius=PULLEY,
        distance=AHEAD,
        restitution=given.e,
        drop=given.d2,
        belt_speed=given.vb,
        mass=0.008,
    )
    start = 0.5 * 0.008 * given.v0**2
    plate = start * (1.0 - given.e**2)
    belt = 0.5 * 0.008 * float(found.v3y) ** 2
    books = {
        "start_mJ": start,
        "work_mJ": float(found.belt_work),
        "bounce_mJ": plate + belt,
        "heat_mJ": float(found.slip_heat),
        "fall_mJ": 0.008 * G * float(found.d3),
    }
    return {
        "dt2": given.dt1 / given.ratio,
        **{name: round(1000.0 * energy, 2) for name, energy in books.items()},
    }


def solve(given: Values) -> Mapping[str, float]:
    """Evaluate what was measured."""
    order = log(given.e1 / given.e2) / log(given.ratio)
    entries = given.work_mJ + given.bounce_mJ + given.heat_mJ
    return {
        "observed": order,
        "step": given.dt2 * (given.wanted / given.e2) ** (1.0 / order),
        "turned": given.start_mJ + entries + given.fall_mJ,
        "entries": entries,
        "share": given.residual_uJ / 1000.0 / (given.start_mJ + entries + given.fall_mJ),
        "bound": (given.r_mm + 0.5 * given.thick_mm) / 1000.0 / given.v,
    }


EXERCISE = Exercise(
    number=8,
    name="trust",
    title="Can you trust a simulation?",
    story=(
        "Somebody simulates a transfer with steps of {dt1} s, and gets an error of {e1} m; with"
        " steps of {dt2} s it is {e2} m. One of the runs, with v0 = {v0} m/s, ε = {e}, v_b = {vb}"
        " m/s and d2 = {d2} m, closes with these books: {start_mJ} mJ of kinetic energy at the"
        " start, belt work {work_mJ} mJ, losses in bounces {bounce_mJ} mJ,"
        " slip heat {heat_mJ} mJ, {fall_mJ} mJ of potential energy less than at the start, and a"
        " residual of {residual_uJ} µJ that nothing explains."
    ),
    parameters=(
        Parameter("dt1", "dt1", "the longer step", "s", (0.001, 0.002, 0.004, 0.005)),
        Parameter("ratio", "dt1/dt2", "ratio of the steps", "", (2.0, 4.0, 5.0)),
        Parameter("e1", "e1", "error with dt1", "m", (2e-4, 3e-4, 4e-4, 6e-4)),
        Parameter("e2", "e2", "error with dt2", "m", (5e-6, 8e-6, 1.2e-5, 2e-5, 3e-5, 5e-5, 8e-5)),
        Parameter("wanted", "e", "error that is wanted", "m", (1e-7, 2e-7, 5e-7)),
        Parameter("v0", "v0", "speed of the belt", "m/s", steps(1.5, 4.0, 0.5)),
        Parameter("e", "ε", "coefficient of restitution of the plate", "", (0.3, 0.4, 0.5, 0.6)),
        Parameter("vb", "v_b", "speed of the outgoing belt", "m/s", (1.2, 1.8, 2.2, 2.8, 3.2)),
        Parameter("d2", "d2", "fall from the plate to the belt", "m", (0.4, 0.5, 0.6)),
        Parameter("residual_uJ", "residual", "what the books do not explain", "µJ", (3, 4, 6, 7)),
        Parameter("v", "v", "speed of a ball", "m/s", (3, 4, 6, 8, 12)),
        Parameter("r_mm", "r", "radius of that ball", "mm", (3, 4, 6)),
        Parameter("thick_mm", "w", "thickness of the wall", "mm", (2, 3, 4, 5)),
    ),
    fits=fits,
    tell=tell,
    solve=solve,
    questions=(
        Question(
            title="observed order",
            text=(
                "The error is {e1} m with dt = {dt1} s, and {e2} m with dt = {dt2} s. Suppose that"
                " error ∝ dt^p: which order p do these two runs show?"
            ),
            unit="",
            answer=lambda s: s.observed,
            mistakes=(
                Mistake(
                    "upside down",
                    "You divided the logarithms the other way round.",
                    lambda s: 1.0 / s.observed,
                ),
                Mistake(
                    "logarithms forgotten",
                    "That is by how much the error shrinks. With which power of the step is that?",
                    lambda s: s.e1 / s.e2,
                ),
                Mistake(
                    "ratio of the ratios",
                    "You divided the ratio of the errors by the ratio of the steps. p is a power:"
                    " take logarithms of both.",
                    lambda s: s.e1 / s.e2 / s.ratio,
                ),
                Mistake(
                    "the steps forgotten",
                    "That is the logarithm of the errors' ratio, as if the steps differed by a"
                    " factor of ten (or e).",
                    lambda s: log10(s.e1 / s.e2),
                ),
            ),
            hints=(
                "By which factor does the error shrink, and by which the step?",
                "error factor = (step factor)^p. Take the logarithm of both sides.",
                "p = log(e1 / e2) / log(dt1 / dt2).",
            ),
            working="p = log({e1} / {e2}) / log({dt1} / {dt2})",
            source="Definition of the order of convergence",
        ),
        Question(
            title="the step for an error",
            text="Which step would bring the error down to {wanted} m, if it goes on like that?",
            unit="s",
            answer=lambda s: s.step,
            mistakes=(
                Mistake(
                    "as if the order were 1",
                    "You let the error go with dt. It goes with dt^p.",
                    lambda s: s.dt2 * s.wanted / s.e2,
                ),
                Mistake(
                    "power p for 1/p",
                    "You raised the ratio of the errors to p. Solve error ∝ dt^p for dt.",
                    lambda s: s.dt2 * (s.wanted / s.e2) ** s.observed,
                ),
                Mistake(
                    "upside down",
                    "That is a longer step than before, for a smaller error.",
                    lambda s: s.dt2 * (s.e2 / s.wanted) ** (1.0 / s.observed),
                ),
                Mistake(
                    "step and error of different runs",
                    "You took the longer step with the error of the shorter one.",
                    lambda s: s.dt1 * (s.wanted / s.e2) ** (1.0 / s.observed),
                ),
            ),
            hints=(
                "By which factor must the error shrink, starting from {e2} m?",
                "The step has to shrink by that factor to the power 1/p.",
                "dt = dt2 (e / e2)^(1/p), with all digits of p.",
            ),
            working="dt = dt2 (e / e2)^(1/p) = {dt2} s · ({wanted} / {e2})^(1 / {observed})",
            source="error ∝ dt^p, solved for dt",
        ),
        Question(
            title="residual of the energy",
            text=(
                "Which share of the energy turned over is the residual of {residual_uJ} µJ? Turned"
                " over is: kinetic energy at the start, plus belt work, plus losses in bounces,"
                " plus slip heat, plus the size of the change of potential energy."
            ),
            unit="",
            answer=lambda s: s.share,
            mistakes=(
                Mistake(
                    "share of the energy at the start",
                    "You divided by the kinetic energy at the start. Far more than that was turned"
                    " over.",
                    lambda s: s.residual_uJ / 1000.0 / s.start_mJ,
                ),
                Mistake(
                    "potential energy forgotten",
                    "The fall turns energy over, too.",
                    lambda s: s.residual_uJ / 1000.0 / (s.start_mJ + s.entries),
                ),
                Mistake(
                    "gains minus losses",
                    "You subtracted the losses. Here all sizes are added, so that nothing can"
                    " cancel.",
                    lambda s: (
                        s.residual_uJ
                        / 1000.0
                        / (s.start_mJ + s.work_mJ - s.bounce_mJ - s.heat_mJ + s.fall_mJ)
                    ),
                ),
                Mistake(
                    "upside down",
                    "You divided the energy by the residual.",
                    lambda s: 1.0 / s.share,
                ),
            ),
            hints=(
                "Add up the sizes of all five energies; no sign matters.",
                "Mind the units: the residual is in µJ, the books are in mJ.",
                "residual / 1000 / ({start_mJ} + {work_mJ} + {bounce_mJ} + {heat_mJ} + {fall_mJ}).",
            ),
            working="{residual_uJ} µJ / {turned} mJ",
            source="chutelab.results.ledger: residual over energy turned over",
        ),
        Question(
            title="not through the wall",
            text=(
                "A ball of radius r = {r_mm} mm flies at {v} m/s against a wall w = {thick_mm} mm"
                " thick. A solver looks once per step, and pushes a ball that overlaps the wall out"
                " on the side where its centre is. How long may a step be at most, so that the"
                " centre cannot get past the middle of the wall between two looks, the first of"
                " them just before the touch?"
            ),
            unit="s",
            answer=lambda s: s.bound,
            mistakes=(
                Mistake(
                    "thickness forgotten",
                    "You left out the wall. It has room for the ball's centre up to its middle.",
                    lambda s: s.r_mm / 1000.0 / s.v,
                ),
                Mistake(
                    "radius forgotten",
                    "You treated the ball as a point. It touches when its centre is r away.",
                    lambda s: 0.5 * s.thick_mm / 1000.0 / s.v,
                ),
                Mistake(
                    "the whole thickness",
                    "You took the whole wall. Past its middle, the ball is pushed out behind it.",
                    lambda s: (s.r_mm + s.thick_mm) / 1000.0 / s.v,
                ),
                Mistake(
                    "upside down",
                    "You divided the speed by the way.",
                    lambda s: s.v / ((s.r_mm + 0.5 * s.thick_mm) / 1000.0),
                ),
            ),
            hints=(
                "How far can the ball go in one step?",
                "v dt. From the first touch to the middle of the wall the centre has"
                " r + w/2 to go.",
                "dt < (r + w/2) / v, in metres and seconds.",
            ),
            working="dt = (r + w/2) / v = ({r_mm} + {thick_mm}/2) mm / ({v} m/s)",
            source="Tunnelling: v dt < r + half the thickness",
        ),
    ),
)
