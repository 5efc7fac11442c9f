"""The paper's Figures 6 to 9 and 11 to 13 as data, as printed and corrected side by side.

>>> figure(7).columns["R, m"].shape
(93,)

Figures 6 to 9 show energy and velocities against the radius of the drive pulley. Figures 11 to 13
show trajectories: the paper drew them with a multibody program, in which Eq. (9) has no part. Here
they are computed as they should be, and as they would be if Eq. (9) held as printed, with φ2
counted from the inclined plate, as Eqs. (7) and (8) count it.

V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. The paper's pictures are
not copied: what its text gives is computed anew, and what it does not give is said.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import Scene, from_dict
from chutelab.theory.paper import BALL_MASS, DISTANCES, FALL, PLATE_AHEAD, RADII, at_radii
from chutelab.theory.transfer import Rebound, transfer
from chutelab.util.arrays import Floats
from chutelab.util.errors import InputError
from chutelab.util.files import csv_text
from chutelab.util.tables import Sheet, Shown

__all__ = ["FORMS", "FigureError", "Line", "Panel", "PaperFigure", "figure"]

RESTITUTION: Final = 0.5
"""ε of the plate in all figures."""

GRAVITY: Final = 9.81
"""m/s²."""

FORMS: tuple[Rebound, Rebound] = ("as-printed", "corrected")
"""Of Eq. (9)."""

SAID: Final = {"as-printed": "Eq. (9) as printed", "corrected": "Eq. (9) corrected"}


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a panel: its points, and those (M, 2) that are marked on it.

    The label is for the legend, "" for none. The role says what it is drawn like: "first" to
    "fourth", "plate" or "belt".
    """

    label: str
    x: Floats
    y: Floats
    role: str
    marks: Floats | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """One panel: title, labels of its axes, lines, and whether x and y have the same scale."""

    title: str
    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    to_scale: bool = False


@dataclass(frozen=True, eq=False, repr=False)
class PaperFigure(Shown):
    """A figure of the paper, computed anew.

    Attributes
    ----------
    number : int
        As in the paper.
    title : str
        What it shows.
    panels : tuple of Panel
        By twos: as printed, corrected.
    meaning : tuple of str
        What the misprint does to the figure's conclusion.
    missing : tuple of str
        What the paper's text does not give, and what is taken instead.
    columns : dict of ndarray
        The numbers, by name with unit; one length.
    rows : list of int
        Which of them are shown as a table.
    scenes : dict of Scene
        What is behind it, by file name without suffix.
    sweep : str
        The command that makes its corrected side with the engine; "" without a sweep.
    """

    number: int
    title: str
    panels: tuple[Panel, ...]
    meaning: tuple[str, ...]
    missing: tuple[str, ...]
    columns: dict[str, NDArray[Any]]
    rows: list[int]
    scenes: dict[str, Scene]
    sweep: str = ""

    def sheet(self) -> Sheet:
        """Return some of the numbers, and what they mean."""
        columns = [column[self.rows].tolist() for column in self.columns.values()]
        return Sheet(
            f"Figure {self.number}: {self.title}",
            tuple(self.columns),
            tuple(
                tuple(f"{cell:.4g}" if isinstance(cell, float) else str(cell) for cell in row)
                for row in zip(*columns, strict=True)
            ),
            texts=sum(column.dtype.kind not in "fi" for column in self.columns.values()),
            notes=(*self.meaning, *(f"Not in the text: {text}" for text in self.missing)),
        )

    def csv(self) -> str:
        """Return the numbers as CSV, in full."""
        return csv_text(self.columns)


NUMBERS: Final = (6, 7, 8, 9, 11, 12, 13)
"""Figures that show results."""

DRAWINGS: Final = {
    1: "a drawing of the machine",
    2: "a drawing of the three phases",
    3: "a drawing of the flight to the plate",
    4: "a drawing of the forces at the plate",
    5: "a drawing of the velocities at the outgoing belt",
    10: "a view of the simulated model, without results",
}
"""Figures that show none, and what they are."""


class FigureError(InputError):
    """The paper has no such figure of results."""


def figure(number: int) -> PaperFigure:
    """Compute a figure of the paper anew.

    Parameters
    ----------
    number : {6, 7, 8, 9, 11, 12, 13}
        As in the paper.

    Raises
    ------
    FigureError
        If there is no such figure, or it shows no results.
    """
    there = ", ".join(map(str, NUMBERS))
    if number in DRAWINGS:
        raise FigureError(
            f"figure {number} is {DRAWINGS[number]}: there is nothing to compute; there are {there}"
        )
    if number not in NUMBERS:
        raise FigureError(f"the paper has no figure {number} of results; there are {there}")
    if number in CASES:
        return _trajectories(number)
    return _energies(number) if number in (6, 7) else _velocities(number)


def _scene(title: str, mass: float, speed: float, radius: float, plate: dict[str, float]) -> Scene:
    return from_dict(
        {
            "title": title,
            "gravity": GRAVITY,
            "particle": {"radius": 0.0, "mass": mass},
            "incoming": {"speed": speed, "pulley_radius": radius},
            "plate": {"restitution": RESTITUTION, **plate},
            "outgoing": {"drop": FALL},
        }
    )


# Figures 6 to 9: against the radius of the drive pulley.

MASS: Final = 0.008
"""kg; the paper says 7.95 g to 8 g."""

GRID: Final = np.unique(np.concatenate([np.linspace(0.05, 0.5, 91), np.array(RADII, dtype=float)]))
"""Radii, m: those of the paper's tables, and enough between them for a smooth line."""

SHOWN: Final = np.searchsorted(GRID, np.array(RADII, dtype=float)).tolist()
"""Which of them the tables have."""

NEAR, FAR = float(DISTANCES[0]), float(DISTANCES[-1])
"""Least and largest d_okr of the paper's tables, m."""

SPEEDS: Final = {6: 2.0, 7: 4.0, 8: 2.0, 9: 4.0}

SWEEP: Final = "chutelab sweep figure-{}.toml --vary incoming.pulley_radius=0.05:0.5:91"
"""The same radii with the engine."""


def _against_the_radius(
    number: int,
    title: str,
    y_label: str,
    curves: dict[Rebound, dict[str, Floats]],
    columns: dict[str, Floats],
    meaning: tuple[str, ...],
    missing: tuple[str, ...],
) -> PaperFigure:
    """Return a figure of one panel a form, each with its curves by label."""
    roles, speed = ("first", "second", "third", "fourth"), SPEEDS[number]
    panels = tuple(
        Panel(
            SAID[form], "pulley radius R, m", y_label,
            tuple(
                Line(label, GRID, y, role, np.column_stack([GRID, y])[SHOWN])
                for role, (label, y) in zip(roles, curves[form].items(), strict=False)
            ),
        )
        for form in FORMS
    )  # fmt: skip
    scene = _scene(
        f"Figure {number} of the paper: v0 = {speed:g} m/s, first radius",
        MASS, speed, float(GRID[0]), {"distance": NEAR},
    )  # fmt: skip
    return PaperFigure(
        number, title, panels, meaning, missing, {"R, m": GRID, **columns}, SHOWN,
        {f"figure-{number}": scene}, SWEEP.format(number),
    )  # fmt: skip


def _energies(number: int) -> PaperFigure:
    """Figures 6 and 7: energy of Eq. (14)."""
    speed = SPEEDS[number]
    curves: dict[Rebound, dict[str, Floats]] = {
        form: {f"d_okr = {d:g} m": 1000.0 * at_radii(GRID, speed, d, form).dEk for d in (NEAR, FAR)}
        for form in FORMS
    }
    printed, right = (curves[form][f"d_okr = {NEAR:g} m"] for form in FORMS)
    critical = speed**2 / GRAVITY
    meaning = (
        f"As printed the energy falls from {printed[0]:.1f} mJ at R = {GRID[0]:g} m to"
        f" {printed[-1]:.1f} mJ at {GRID[-1]:g} m, {100.0 * (1.0 - printed[-1] / printed[0]):.0f} %"
        " less: the paper concludes that a larger pulley saves energy. With Eq. (9) corrected the"
        " particle comes down with v3x = ε v1 cos φ1, whatever the radius:"
        f" {right[0]:.1f} mJ for every pulley that the belt leaves at the top."
    )
    if critical < GRID[-1]:
        meaning += (
            f" Only beyond R = v0²/g = {critical:.3f} m, where the particle rides round the pulley"
            f" first, the energy falls, to {right[-1]:.1f} mJ at {GRID[-1]:g} m. The trend below"
            " that is the misprint."
        )
    else:
        meaning += " At this speed that is all of them: the whole trend is the misprint."
    return _against_the_radius(
        number,
        f"energy of a particle after the impact on the outgoing belt, v0 = {speed:g} m/s",
        "energy ΔE_k of Eq. (14), mJ",
        curves,
        {
            f"ΔE_k, mJ, {form}, {label}": energy
            for form in FORMS
            for label, energy in curves[form].items()
        },
        (meaning,),
        (
            "which distance d_okr the curve is for (the paper varies it from 0.5 to 1 m): both ends"
            " are drawn.",
            "which of 7.95 g and 8 g the particle has: 8 g here. The range of the axis: the radii"
            " of Table 1.",
            "v_dop of the outgoing belt: v0, as both belts have the same speed in Sect. 2.",
        ),
    )


def _velocities(number: int) -> PaperFigure:
    """Figures 8 and 9: velocities of the three phases."""
    speed = SPEEDS[number]
    found = {form: at_radii(GRID, speed, NEAR, form) for form in FORMS}
    printed, right = found.values()
    columns = {"v1, m/s": right.v1, "v2, m/s": right.v2}
    curves: dict[Rebound, dict[str, Floats]] = {}
    for form, one in found.items():
        columns |= {
            f"v2', m/s, {form}": one.v2r,
            f"v3, m/s, {form}": one.v3,
            f"v3x, m/s, {form}": one.v3x,
        }
        curves[form] = {
            "v1, leaving the pulley": one.v1,
            "v2, at the plate": one.v2,
            "v2', after it": one.v2r,
            "v3, at the belt": one.v3,
        }
    where = "too slow" if printed.v2r[0] < right.v2r[0] else "too fast"
    critical = speed**2 / GRAVITY
    until = (
        f"up to R = {critical:.3f} m and {right.v3x[-1]:.3f} m/s at the end."
        if critical < GRID[-1]
        else "throughout."
    )
    return _against_the_radius(
        number,
        f"velocities of the particle in the three phases, v1 = {speed:g} m/s",
        "speed, m/s",
        curves,
        columns,
        (
            "v1 and v2 come before the plate, where the misprint has no part. After it, the printed"
            f" equation makes the particle {where} at R = {GRID[0]:g} m:"
            f" v2' = {printed.v2r[0]:.3f} m/s instead of {right.v2r[0]:.3f} m/s; at"
            f" R = {GRID[-1]:g} m it is {printed.v2r[-1]:.3f} instead of {right.v2r[-1]:.3f} m/s.",
            "That v2' grows with the radius holds either way, because the fall to the plate is"
            " longer. That v3x falls with it, from which the paper reads a saving of energy, does"
            f" not: printed {printed.v3x[0]:.3f} to {printed.v3x[-1]:.3f} m/s, corrected"
            f" {right.v3x[0]:.3f} m/s {until}",
        ),
        (
            "which velocities are drawn, and against what: here v1, v2, v2' and v3, the speeds that"
            " the text compares, against the radius R.",
            f"the distance d_okr: {NEAR:g} m here, as in Table 1.",
        ),
    )


# Figures 11 to 13: trajectories with an upright plate and with inclined ones.

POINTS: Final = 61
"""Of each flight's line."""

PLATE_NEAR: Final = 0.1
"""m from the edge of the incoming support to the plate, Sect. 3.2."""

ABOVE: Final = 0.1
"""m of plate above its pivot that are drawn."""

FLIGHT: Final = np.dtype([("t", "f8"), ("position", "f8", 2), ("velocity", "f8", 2)])
"""A point of a flight in the world frame: time since its start, place and velocity."""


@dataclass(frozen=True)
class Case:
    """One picture of a figure: its scene's name, belt speed (m/s) and plate angle (°).

    `ahead` is d1, m from the edge of the incoming support to the plate's pivot, at the same height;
    `below` the plate below it, m, no more than leaves the way to the belt free. Supports have no
    pulley, so any `radius` (m) that is left at the top will do.
    """

    name: str
    speed: float
    angle: float
    ahead: float
    below: float = 0.3
    radius: float = 0.05

    def __str__(self) -> str:
        return f"{self.speed:g} m/s, {self.angle:g}°"


CASES: Final = {
    11: (
        Case("figure-11-left", 2.0, 0.0, PLATE_AHEAD, below=0.45, radius=0.1),
        Case("figure-11-right", 4.0, 0.0, PLATE_AHEAD, below=0.45, radius=0.1),
    ),
    12: (
        Case("figure-12-left", 1.0, 20.0, PLATE_NEAR, below=0.14),
        Case("figure-12-right", 2.0, 40.0, PLATE_NEAR, below=0.14),
    ),
    13: (Case("figure-13", 2.0, 60.0, PLATE_NEAR),),
}


def path(case: Case, form: Rebound) -> NDArray[Any]:
    """Carry a mass point over the plate, with Eq. (9) in either form.

    Returns
    -------
    ndarray, (2, POINTS), dtype `FLIGHT`
        The flights to the plate, and from there to the belt.
    """
    alpha = np.radians(case.angle)
    found = transfer(
        speed=case.speed, pulley_radius=case.radius, distance=case.ahead - case.radius,
        angle=alpha, restitution=RESTITUTION, drop=FALL, gravity=GRAVITY, unbounded_plate=False,
    )  # fmt: skip
    size = found.v2r
    if form == "as-printed":
        # `transfer` has this form for an upright plate only.
        size = found.v2 * np.hypot(np.sin(found.phi2), RESTITUTION * np.cos(found.phi2))  # Eq. (9)
    down = np.array([np.sin(alpha), -np.cos(alpha)])
    away = np.array([-np.cos(alpha), -np.sin(alpha)])
    after = size * (np.cos(found.phi2r) * down + np.sin(found.phi2r) * away)  # Eq. (8)
    start = np.array([0.0, case.radius])
    impact = start + np.array([found.x2, -found.y2])
    t3 = (after[1] + np.sqrt(after[1] ** 2 + 2.0 * GRAVITY * FALL)) / GRAVITY
    flights = np.empty((2, POINTS), dtype=FLIGHT)
    legs = (start, np.array([case.speed, 0.0]), float(found.t2)), (impact, after, t3)
    for flight, (position, velocity, until) in zip(flights, legs, strict=True):
        flight["t"] = np.linspace(0.0, until, POINTS)
        fall, elapsed = np.array([0.0, -GRAVITY]), flight["t"][:, np.newaxis]
        flight["position"] = position + velocity * elapsed + 0.5 * fall * elapsed**2
        flight["velocity"] = velocity + fall * elapsed
    return flights


Paths = dict[tuple[Case, Rebound], NDArray[Any]]


def _trajectories(number: int) -> PaperFigure:
    cases = CASES[number]
    paths: Paths = {(case, form): path(case, form) for case in cases for form in FORMS}
    points = np.concatenate([point for flights in paths.values() for point in flights])
    flights = [(str(case), form, leg) for case, form in paths for leg in ("to plate", "to belt")]
    texts = np.repeat(flights, POINTS, axis=0)
    columns: dict[str, NDArray[Any]] = {
        "case": texts[:, 0],
        "form": texts[:, 1],
        "flight": texts[:, 2],
        "t, s": points["t"],
        "x, m": points["position"][:, 0],
        "y, m": points["position"][:, 1],
        "vx, m/s": points["velocity"][:, 0],
        "vy, m/s": points["velocity"][:, 1],
    }
    # The first and the last point of each flight to the belt.
    rows = [2 * POINTS * n + row for n in range(len(paths)) for row in (POINTS, 2 * POINTS - 1)]
    panels = tuple(
        Panel(f"{case}, {SAID[form]}", "x, m", "y, m", _lines(case, found), to_scale=True)
        for (case, form), found in paths.items()
    )
    scenes = {
        case.name: _scene(
            f"Figure {number} of the paper: {case}",
            BALL_MASS,
            case.speed,
            case.radius,
            {
                "distance": case.ahead - case.radius,
                "angle_deg": case.angle,
                "above": ABOVE,
                "below": case.below,
            },
        )
        for case in cases
    }
    title, meaning, missing = {11: _upright, 12: _inclined, 13: _steep}[number](paths)
    missing += (
        "how far below the incoming support the outgoing one lies: the particle falls d2 = 0.5 m"
        " after the plate here, as in Sect. 2.",
        "friction and how the contacts were modelled: none here; the particle is a point, ε = 0.5.",
    )
    return PaperFigure(number, title, panels, meaning, missing, columns, rows, scenes)


def _lines(case: Case, flights: NDArray[Any]) -> tuple[Line, ...]:
    alpha, top = np.radians(case.angle), case.radius
    along = np.array([ABOVE, -case.below])
    first, second = flights["position"]
    x, y = second[-1]
    reach = np.array([min(-0.1, x - 0.1), max(case.ahead + 0.15, x + 0.1)])
    return (
        Line("plate", case.ahead - along * np.sin(alpha), top + along * np.cos(alpha), "plate"),
        Line("belts", np.array([-0.2, 0.0]), np.full(2, top), "belt"),
        Line("", reach, np.full(2, y), "belt"),
        Line("to the plate", first[:, 0], first[:, 1], "first"),
        Line("after it", second[:, 0], second[:, 1], "second", second[[0, -1]]),
    )


Words = tuple[str, tuple[str, ...], tuple[str, ...]]
"""Title, meaning and what is missing of one of these figures, see `PaperFigure`."""


def _upright(paths: Paths) -> Words:
    parts = []
    for case in CASES[11]:
        printed, right = (case.ahead - paths[case, form]["position"][1, -1, 0] for form in FORMS)
        parts.append(
            f"at {case.speed:g} m/s it comes down {right:.3f} m back from the plate, as printed"
            f" {printed:.3f} m"
        )
    meaning = (
        "The figure is the simulation's, which knows no Eq. (9): its paths are the corrected ones,"
        f" {'; '.join(parts)}.",
        "What the paper reads off it, that a faster particle meets the plate higher up and at a"
        " larger angle φ2, comes before the plate and stands.",
    )
    return "trajectories with an upright plate", meaning, ()


def _forward(flights: NDArray[Any]) -> float:
    """Return the velocity forward with which the particle lands, m/s."""
    return float(flights["velocity"][1, -1, 0])


def _inclined(paths: Paths) -> Words:
    parts = [
        f"{case}: {_forward(paths[case, 'corrected']):+.2f} m/s (as printed"
        f" {_forward(paths[case, 'as-printed']):+.2f})"
        for case in CASES[12]
    ]
    faster = _forward(path(replace(CASES[12][0], speed=2.0), "corrected"))
    meaning = (
        f"Forward velocity at the belt: {', '.join(parts)}. The misprint changes how fast the"
        " particle leaves the plate, not whether it goes forward: the direction is Eq. (8)'s, which"
        " is right.",
        "The paper's own sentences disagree about 20°: in one the particle goes on forward in both"
        " pictures, in another it bounces backward at 1 m/s. With d1 = 0.1 m it goes forward at"
        f" 1 m/s, and backward at 2 m/s ({faster:+.2f} m/s).",
    )
    missing = (
        "where the plate's pivot is: at the height of the incoming support, 0.1 m ahead, which the"
        " text gives for angles up to 20° and 1 m/s, and which is taken for 40° too."
    )
    return "trajectories with plates inclined by 20° and 40°", meaning, (missing,)


def _steep(paths: Paths) -> Words:
    (case,) = CASES[13]
    printed, right = (paths[case, form] for form in FORMS)
    before = np.hypot(*right["velocity"][0, -1])
    after, printed_after = (np.hypot(*one["velocity"][1, 0]) for one in (right, printed))
    meaning = (
        f"At 60° the particle almost grazes the plate, keeps {after:.2f} of {before:.2f} m/s and"
        f" comes down with {_forward(right):+.2f} m/s forward, close to the belt's own"
        f" {case.speed:g} m/s: the paper's recommendation of a steep plate stands.",
        f"As printed, Eq. (9) would leave it {printed_after:.2f} m/s and"
        f" {_forward(printed):+.2f} m/s forward, because it damps what runs along the"
        " plate: the misprint speaks against the very plate that the paper recommends. The"
        " simulation, which knows no Eq. (9), does not.",
    )
    missing = (
        "the speed, of which the caption has the symbol only: 2 m/s here, as in the text before.",
        "where the plate's pivot is: 0.1 m ahead here, as in Fig. 12.",
    )
    return "trajectory with a plate inclined by 60°", meaning, missing
