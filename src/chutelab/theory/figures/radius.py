"""Figures 6 to 9: energy and velocities against the radius of the drive pulley."""

from __future__ import annotations

from typing import Final

import numpy as np

from chutelab.scene import Scene, from_dict
from chutelab.theory.figures.model import (
    FORMS,
    GRAVITY,
    RESTITUTION,
    Form,
    Line,
    Panel,
    PaperFigure,
)
from chutelab.theory.paper import DISTANCES, FALL, RADII
from chutelab.theory.results import Transfer
from chutelab.theory.transfer import transfer
from chutelab.util.arrays import Floats

MASS: Final = 0.008
"""kg; the paper says 7.95 g to 8 g."""

GRID: Final = np.unique(np.concatenate([np.linspace(0.05, 0.5, 91), np.array(RADII, dtype=float)]))
"""Radii, m: those of the paper's tables, and enough between them for a smooth line."""

SHOWN: Final = tuple(int(np.searchsorted(GRID, float(radius))) for radius in RADII)

SPEEDS: Final = {6: 2.0, 7: 4.0, 8: 2.0, 9: 4.0}

SWEEP: Final = "chutelab sweep figure-{}.toml --vary incoming.pulley_radius=0.05:0.5:91"
"""The same radii with the engine."""

ROLES: Final = ("first", "second", "third", "fourth")


def energy_figure(number: int) -> PaperFigure:
    """Compute Figure 6 or 7: energy of Eq. (14) against the radius."""
    speed = SPEEDS[number]
    near, far = float(DISTANCES[0]), float(DISTANCES[-1])
    found = {(form, d): _paper(speed, d, form) for form in FORMS for d in (near, far)}
    left, right = (
        Panel(
            form, "", "pulley radius R, m", "energy ΔE_k of Eq. (14), mJ",
            tuple(
                _line(f"d_okr = {d:g} m", 1000.0 * found[form, d].dEk, role)
                for d, role in ((near, "first"), (far, "second"))
            ),
        )
        for form in FORMS
    )  # fmt: skip
    columns = {"R, m": GRID}
    for (form, d), one in found.items():
        columns[f"ΔE_k, mJ, {form}, d_okr = {d:g} m"] = 1000.0 * one.dEk
    return PaperFigure(
        number,
        f"energy of a particle after the impact on the outgoing belt, v0 = {speed:g} m/s",
        ((left, right),),
        (_energy_meaning(speed, *(found[form, near].dEk for form in FORMS)),),
        (
            "which distance d_okr the curve is for (the paper varies it from 0.5 to 1 m): both ends"
            " are drawn.",
            "which of 7.95 g and 8 g the particle has: 8 g here. The range of the axis: the radii"
            " of Table 1.",
            "v_dop of the outgoing belt: v0, as both belts have the same speed in Sect. 2.",
        ),
        columns,
        SHOWN,
        {f"figure-{number}": _scene(number, speed)},
        SWEEP.format(number),
    )


def _energy_meaning(speed: float, printed: Floats, right: Floats) -> str:
    drop = 100.0 * (1.0 - printed[-1] / printed[0])
    high = speed**2 / GRAVITY
    text = (
        f"As printed the energy falls from {1000 * printed[0]:.1f} mJ at R = {GRID[0]:g} m to"
        f" {1000 * printed[-1]:.1f} mJ at {GRID[-1]:g} m, {drop:.0f} % less: the paper concludes"
        " that a larger pulley saves energy. With Eq. (9) corrected the particle comes down with"
        f" v3x = ε v1 cos φ1, whatever the radius: {1000 * right[0]:.1f} mJ for every pulley that"
        " the belt leaves at the top."
    )
    if high < GRID[-1]:
        return (
            f"{text} Only beyond R = v0²/g = {high:.3f} m, where the particle rides round the"
            f" pulley first, the energy falls, to {1000 * right[-1]:.1f} mJ at {GRID[-1]:g} m. The"
            " trend below that is the misprint."
        )
    return f"{text} At this speed that is all of them: the whole trend is the misprint."


def velocity_figure(number: int) -> PaperFigure:
    """Compute Figure 8 or 9: velocities of the three phases against the radius."""
    speed = SPEEDS[number]
    distance = float(DISTANCES[0])
    found = {form: _paper(speed, distance, form) for form in FORMS}
    names = {
        "v1": "leaving the pulley", "v2": "at the plate", "v2r": "after it",
        "v3": "at the belt",
    }  # fmt: skip
    symbols = {"v2r": "v2'"}
    left, right = (
        Panel(
            form, "", "pulley radius R, m", "speed, m/s",
            tuple(
                _line(f"{symbols.get(name, name)}, {what}", getattr(found[form], name), role)
                for (name, what), role in zip(names.items(), ROLES, strict=True)
            ),
        )
        for form in FORMS
    )  # fmt: skip
    columns = {"R, m": GRID, "v1, m/s": found["corrected"].v1, "v2, m/s": found["corrected"].v2}
    for form, one in found.items():
        for name in ("v2r", "v3", "v3x"):
            columns[f"{symbols.get(name, name)}, m/s, {form}"] = getattr(one, name)
    return PaperFigure(
        number,
        f"velocities of the particle in the three phases, v1 = {speed:g} m/s",
        ((left, right),),
        _velocity_meaning(speed, found["as-printed"], found["corrected"]),
        (
            "which velocities are drawn, and against what: here v1, v2, v2' and v3, the speeds that"
            " the text compares, against the radius R.",
            f"the distance d_okr: {distance:g} m here, as in Table 1.",
        ),
        columns,
        SHOWN,
        {f"figure-{number}": _scene(number, speed)},
        SWEEP.format(number),
    )


def _velocity_meaning(speed: float, printed: Transfer, right: Transfer) -> tuple[str, ...]:
    ratio = printed.v2r / right.v2r
    where = "too slow" if ratio[0] < 1.0 else "too fast"
    text = (
        "v1 and v2 come before the plate, where the misprint has no part. After it, the printed"
        f" equation makes the particle {where} at R = {GRID[0]:g} m: v2' = {printed.v2r[0]:.3f} m/s"
        f" instead of {right.v2r[0]:.3f} m/s; at R = {GRID[-1]:g} m it is {printed.v2r[-1]:.3f}"
        f" instead of {right.v2r[-1]:.3f} m/s."
    )
    grows = (
        "That v2' grows with the radius holds either way, because the fall to the plate is longer."
        " That v3x falls with it, from which the paper reads a saving of energy, does not: printed"
        f" {printed.v3x[0]:.3f} to {printed.v3x[-1]:.3f} m/s, corrected {right.v3x[0]:.3f} m/s"
    )
    critical = speed**2 / GRAVITY
    if critical < GRID[-1]:
        return (text, f"{grows} up to R = {critical:.3f} m and {right.v3x[-1]:.3f} m/s at the end.")
    return (text, f"{grows} throughout.")


def _paper(speed: float, distance: float, form: Form) -> Transfer:
    return transfer(
        speed=speed, pulley_radius=GRID, distance=distance, restitution=RESTITUTION, drop=FALL,
        mass=MASS, gravity=GRAVITY, rebound=form,
    )  # fmt: skip


def _line(label: str, y: Floats, role: str) -> Line:
    rows = list(SHOWN)
    return Line(label, GRID, y, role, np.column_stack([GRID[rows], y[rows]]))


def _scene(number: int, speed: float) -> Scene:
    return from_dict(
        {
            "title": f"Figure {number} of the paper: v0 = {speed:g} m/s, first radius",
            "gravity": GRAVITY,
            "particle": {"radius": 0.0, "mass": MASS},
            "incoming": {"speed": speed, "pulley_radius": float(GRID[0])},
            "plate": {"distance": float(DISTANCES[0]), "restitution": RESTITUTION},
            "outgoing": {"drop": FALL},
        }
    )
