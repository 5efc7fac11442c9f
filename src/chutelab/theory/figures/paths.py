"""Figures 11 to 13: trajectories with an upright plate and with inclined ones.

The paper drew them with a multibody program, in which Eq. (9) has no part. Here they are computed:
as they should be, and as they would be if Eq. (9) held as printed. For an inclined plate that
means the printed equation with φ2 counted from the inclined plate, as Eqs. (7) and (8) count it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from chutelab.scene import Scene, from_dict
from chutelab.theory.figures.model import (
    FORMS,
    GRAVITY,
    POINTS,
    RESTITUTION,
    Flight,
    Form,
    Line,
    Panel,
    PaperFigure,
    Path,
    path,
)
from chutelab.theory.paper import BALL_MASS, FALL, PLATE_AHEAD
from chutelab.util.arrays import Floats

PULLEY: Final = {11: 0.1, 12: 0.05, 13: 0.05}
"""m; supports have no pulley, so any that is left at the top will do."""

PLATE_NEAR: Final = 0.1
"""m from the edge of the incoming support to the plate, Sect. 3.2."""

ABOVE: Final = 0.1
BELOW: Final = {11: 0.45, 12: 0.14, 13: 0.3}
"""m of plate that are drawn: no more than leaves the way to the belt free."""


@dataclass(frozen=True)
class Case:
    """One picture: where it is in the paper's figure, belt speed (m/s) and plate angle (°).

    `ahead` is the way from the edge of the incoming support to the plate's pivot, m.
    """

    where: str
    speed: float
    angle: float
    ahead: float


CASES: Final = {
    11: (Case("left", 2.0, 0.0, PLATE_AHEAD), Case("right", 4.0, 0.0, PLATE_AHEAD)),
    12: (Case("left", 1.0, 20.0, PLATE_NEAR), Case("right", 2.0, 40.0, PLATE_NEAR)),
    13: (Case("", 2.0, 60.0, PLATE_NEAR),),
}


def path_figure(number: int) -> PaperFigure:
    """Compute Figure 11, 12 or 13: trajectories of the simulation."""
    cases = CASES[number]
    paths = {
        (case, form): path(case.speed, case.angle, case.ahead, form, PULLEY[number])
        for case in cases
        for form in FORMS
    }
    panels = []
    for case in cases:
        left, right = (
            Panel(form, _named(case), "x, m", "y, m", _lines(number, case, paths[case, form]), True)
            for form in FORMS
        )
        panels.append((left, right))
    columns = _columns(paths)
    ends = tuple(
        row for row in range(len(columns["x, m"])) if row % (2 * POINTS) in (POINTS, 2 * POINTS - 1)
    )
    return PaperFigure(
        number,
        {
            11: "trajectories with an upright plate",
            12: "trajectories with plates inclined by 20° and 40°",
            13: "trajectory with a plate inclined by 60°",
        }[number],
        tuple(panels),
        MEANINGS[number](paths),
        MISSING[number],
        columns,
        ends,
        {
            f"figure-{number}{'-' if case.where else ''}{case.where}": _scene(number, case)
            for case in cases
        },
    )


def _named(case: Case) -> str:
    return f"{case.speed:g} m/s, {case.angle:g}°"


def _lines(number: int, case: Case, found: Path) -> tuple[Line, ...]:
    radians = np.radians(case.angle)
    up = np.array([-np.sin(radians), np.cos(radians)])
    pivot = np.array([case.ahead, PULLEY[number]])
    plate = np.stack([pivot + ABOVE * up, pivot - BELOW[number] * up])
    landing = found.second.position[-1]
    reach = np.array([min(-0.1, landing[0] - 0.1), max(case.ahead + 0.15, landing[0] + 0.1)])
    top = PULLEY[number]
    return (
        Line("plate", plate[:, 0], plate[:, 1], "plate"),
        Line("belts", np.array([-0.2, 0.0]), np.array([top, top]), "belt"),
        Line("", reach, np.full(2, landing[1]), "belt"),
        Line("to the plate", *_xy(found.first), "first"),
        Line("after it", *_xy(found.second), "second", found.second.position[[0, -1]]),
    )


def _xy(flight: Flight) -> tuple[Floats, Floats]:
    return flight.position[:, 0], flight.position[:, 1]


def _columns(paths: dict[tuple[Case, Form], Path]) -> dict[str, Any]:
    rows: dict[str, list[Any]] = {
        name: []
        for name in ("case", "form", "flight", "t, s", "x, m", "y, m", "vx, m/s", "vy, m/s")
    }
    for (case, form), found in paths.items():
        for flight, leg in (("to plate", found.first), ("to belt", found.second)):
            numbers = np.column_stack([leg.t, leg.position, leg.velocity])
            for row in numbers.tolist():
                for column, value in zip(
                    rows.values(), (_named(case), form, flight, *row), strict=True
                ):
                    column.append(value)
    return {name: np.array(column) for name, column in rows.items()}


def _upright(paths: dict[tuple[Case, Form], Path]) -> tuple[str, ...]:
    parts = []
    for case in CASES[11]:
        printed, right = (paths[case, form] for form in FORMS)
        back, printed_back = (
            case.ahead - found.second.position[-1, 0] for found in (right, printed)
        )
        parts.append(
            f"at {case.speed:g} m/s it comes down {back:.3f} m back from the plate, as printed"
            f" {printed_back:.3f} m"
        )
    return (
        "The figure is the simulation's, which knows no Eq. (9): its paths are the corrected ones,"
        f" {'; '.join(parts)}.",
        "What the paper reads off it, that a faster particle meets the plate higher up and at a"
        " larger angle φ2, comes before the plate and stands.",
    )


def _inclined(paths: dict[tuple[Case, Form], Path]) -> tuple[str, ...]:
    parts = [
        f"{_named(case)}: {paths[case, 'corrected'].landing[0]:+.2f} m/s (as printed"
        f" {paths[case, 'as-printed'].landing[0]:+.2f})"
        for case in CASES[12]
    ]
    other = path(2.0, 20.0, PLATE_NEAR, "corrected", PULLEY[12]).landing[0]
    return (
        f"Forward velocity at the belt: {', '.join(parts)}. The misprint changes how fast the"
        " particle leaves the plate, not whether it goes forward: the direction is Eq. (8)'s, which"
        " is right.",
        "The paper's own sentences disagree about 20°: in one the particle goes on forward in both"
        " pictures, in another it bounces backward at 1 m/s. With d1 = 0.1 m it goes forward at"
        f" 1 m/s, and backward at 2 m/s ({other:+.2f} m/s).",
    )


def _steep(paths: dict[tuple[Case, Form], Path]) -> tuple[str, ...]:
    (case,) = CASES[13]
    printed, right = (paths[case, form] for form in FORMS)
    before, after = right.speeds
    return (
        f"At 60° the particle almost grazes the plate, keeps {after:.2f} of {before:.2f} m/s and"
        f" comes down with {right.landing[0]:+.2f} m/s forward, close to the belt's own"
        f" {case.speed:g} m/s: the paper's recommendation of a steep plate stands.",
        f"As printed, Eq. (9) would leave it {printed.speeds[1]:.2f} m/s and"
        f" {printed.landing[0]:+.2f} m/s forward, because it damps what runs along the"
        " plate: the misprint speaks against the very plate that the paper recommends. The"
        " simulation, which knows no Eq. (9), does not.",
    )


MEANINGS: Final = {11: _upright, 12: _inclined, 13: _steep}

_COMMON: Final = (
    "how far below the incoming support the outgoing one lies: the particle falls d2 = 0.5 m after"
    " the plate here, as in Sect. 2.",
    "friction and how the contacts were modelled: none here; the particle is a point, ε = 0.5.",
)

MISSING: Final = {
    11: _COMMON,
    12: (
        "where the plate's pivot is: at the height of the incoming support, 0.1 m ahead, which the"
        " text gives for angles up to 20° and 1 m/s, and which is taken for 40° too.",
        *_COMMON,
    ),
    13: (
        "the speed, of which the caption has the symbol only: 2 m/s here, as in the text before.",
        "where the plate's pivot is: 0.1 m ahead here, as in Fig. 12.",
        *_COMMON,
    ),
}


def _scene(number: int, case: Case) -> Scene:
    radius = PULLEY[number]
    return from_dict(
        {
            "title": f"Figure {number} of the paper: {_named(case)}",
            "gravity": GRAVITY,
            "particle": {"radius": 0.0, "mass": BALL_MASS},
            "incoming": {"speed": case.speed, "pulley_radius": radius},
            "plate": {
                "distance": case.ahead - radius, "angle_deg": case.angle, "above": ABOVE,
                "below": BELOW[number], "restitution": RESTITUTION,
            },
            "outgoing": {"drop": FALL},
        }
    )  # fmt: skip
