"""The paper's Figures 6 to 9 and 11 to 13 as data, as printed and corrected side by side.

>>> figure(7).columns["R, m"].shape
(93,)

Figures 6 to 9 show energy and velocities against the radius of the drive pulley. Figures 11 to 13
show trajectories: the paper drew them with a multibody program, in which Eq. (9) has no part. Here
they are computed correctly, and as they would be if Eq. (9) held as printed, with φ2 measured from
the inclined plate, as in Eqs. (7) and (8).

V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. The paper's pictures are
not copied: values in its text are computed again, and missing ones are listed.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import Scene, from_dict
from chutelab.theory.paper import BALL_MASS, DISTANCES, FALL, PLATE_AHEAD, RADII, WORDS, at_radii
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

    The label is for the legend, "" for none. The role chooses its look: "first" to "fourth",
    "plate" or "belt".
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
        In pairs: as printed, corrected.
    meaning : tuple of str
        Effect of the misprint on the figure's conclusion.
    missing : tuple of str
        Values missing in the paper's text, and those used instead.
    columns : dict of ndarray
        The numbers, by name with unit; one length.
    rows : list of int
        Which of them are shown as a table.
    scenes : dict of Scene
        The scenes behind it, by file name without suffix.
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
"""Figures without results, and their content."""


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
        return trajectories(number)
    return against_the_radius(number)


def worded(
    number: int,
    words: dict[str, Any],
    values: dict[str, Any],
    panels: tuple[Panel, ...],
    columns: dict[str, NDArray[Any]],
    rows: list[int],
    scenes: dict[str, Scene],
    sweep: str = "",
) -> PaperFigure:
    """Return a figure with computed values filled into its words."""
    title = words["title"].format(**values)
    meaning, missing = (
        tuple(text.format(**values) for text in words[kind]) for kind in ("meaning", "missing")
    )
    return PaperFigure(number, title, panels, meaning, missing, columns, rows, scenes, sweep)


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
"""The radii of the tables."""

NEAR, FAR = float(DISTANCES[0]), float(DISTANCES[-1])
"""Least and largest d_okr of the paper's tables, m."""

SPEEDS: Final = {6: 2.0, 7: 4.0, 8: 2.0, 9: 4.0}

ROLES: Final = ("first", "second", "third", "fourth")

SWEEP: Final = "chutelab sweep figure-{}.toml --vary incoming.pulley_radius=0.05:0.5:91"
"""The same radii with the engine."""


def against_the_radius(number: int) -> PaperFigure:
    """Figures 6 and 7: energy of Eq. (14); 8 and 9: velocities of the three phases."""
    speed = SPEEDS[number]
    critical = speed**2 / GRAVITY
    values = {"speed": speed, "near": GRID[0], "far": GRID[-1], "critical": critical, "d_okr": NEAR}
    found = {form: at_radii(GRID, speed, NEAR, form) for form in FORMS}
    printed, right = found.values()
    columns: dict[str, NDArray[Any]] = {"R, m": GRID}
    curves: dict[Rebound, dict[str, Floats]] = {form: {} for form in FORMS}
    if number in (6, 7):
        words, y_label = WORDS["figures"]["energies"], "energy ΔE_k of Eq. (14), mJ"
        for form in FORMS:
            for d in (NEAR, FAR):
                energy = 1000.0 * at_radii(GRID, speed, d, form).dEk
                curves[form][f"d_okr = {d:g} m"] = energy
                columns[f"ΔE_k, mJ, {form}, d_okr = {d:g} m"] = energy
        (first, *_, last), level = (1000.0 * one.dEk for one in found.values())
        values |= {"first": first, "last": last, "share": 100.0 * (1.0 - last / first)}
        values |= {"level": level[0], "right_last": level[-1]}
    else:
        words, y_label = WORDS["figures"]["velocities"], "speed, m/s"
        columns |= {"v1, m/s": right.v1, "v2, m/s": right.v2}
        for form, one in found.items():
            for name, speeds in (("v2'", one.v2r), ("v3", one.v3), ("v3x", one.v3x)):
                columns[f"{name}, m/s, {form}"] = speeds
            curves[form] = {
                "v1, leaving the pulley": one.v1,
                "v2, at the plate": one.v2,
                "v2', after it": one.v2r,
                "v3, at the belt": one.v3,
            }
        values |= {"first": printed.v2r[0], "last": printed.v2r[-1]}
        values |= {"right_first": right.v2r[0], "right_last": right.v2r[-1]}
        values |= {"back_first": printed.v3x[0], "back_last": printed.v3x[-1]}
        values |= {"right_back": right.v3x[0], "right_back_last": right.v3x[-1]}
        values["how"] = "too slow" if printed.v2r[0] < right.v2r[0] else "too fast"
    values["rest"] = words["slow" if critical < GRID[-1] else "fast"].format(**values)
    panels = tuple(
        Panel(
            SAID[form], "pulley radius R, m", y_label,
            tuple(
                Line(label, GRID, y, role, np.column_stack([GRID, y])[SHOWN])
                for role, (label, y) in zip(ROLES, curves[form].items(), strict=False)
            ),
        )
        for form in FORMS
    )  # fmt: skip
    scene = _scene(
        f"Figure {number} of the paper: v0 = {speed:g} m/s, first radius",
        MASS, speed, float(GRID[0]), {"distance": NEAR},
    )  # fmt: skip
    scenes = {f"figure-{number}": scene}
    return worded(number, words, values, panels, columns, SHOWN, scenes, SWEEP.format(number))


# Figures 11 to 13: trajectories with an upright plate and with inclined ones.

POINTS: Final = 61
"""Points of each flight's line."""

PLATE_NEAR: Final = 0.1
"""m from the edge of the incoming support to the plate, Sect. 3.2."""

ABOVE: Final = 0.1
"""m; length of plate drawn above its pivot."""

FLIGHT: Final = np.dtype([("t", "f8"), ("position", "f8", 2), ("velocity", "f8", 2)])
"""A point of a flight in the world frame: time since its start, place and velocity."""


@dataclass(frozen=True)
class Case:
    """One picture of a figure: its scene's name, belt speed (m/s) and plate angle (°).

    `ahead` is d1, m from the edge of the incoming support to the plate's pivot, at the same height;
    `below` the plate below it, m, short enough to leave the way to the belt free. Supports have no
    pulley, so any `radius` (m) will do that the particle leaves at the top.
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
    """Compute the path of a mass point over the plate, with Eq. (9) in either form.

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


def trajectories(number: int) -> PaperFigure:
    """Figures 11 to 13."""
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
        Panel(f"{case}, {SAID[form]}", "x, m", "y, m", lines_of(case, found), to_scale=True)
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
    words = WORDS["figures"][str(number)]
    words = {**words, "missing": words["missing"] + WORDS["figures"]["simulated"]["missing"]}
    return worded(number, words, told(number, paths), panels, columns, rows, scenes)


def lines_of(case: Case, flights: NDArray[Any]) -> tuple[Line, ...]:
    """Return the lines of a case: plate, belts and the two flights."""
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


def told(number: int, paths: Paths) -> dict[str, Any]:
    """Return the values for the words of a figure."""

    def forward(flights: NDArray[Any]) -> float:
        return float(flights["velocity"][1, -1, 0])

    if number == 11:
        parts = []
        for case in CASES[11]:
            printed, right = (case.ahead - paths[case, f]["position"][1, -1, 0] for f in FORMS)
            parts.append(
                f"at {case.speed:g} m/s it comes down {right:.3f} m back from the plate, as"
                f" printed {printed:.3f} m"
            )
        return {"landings": "; ".join(parts)}
    if number == 12:
        parts = [
            f"{case}: {forward(paths[case, 'corrected']):+.2f} m/s (as printed"
            f" {forward(paths[case, 'as-printed']):+.2f})"
            for case in CASES[12]
        ]
        faster = path(replace(CASES[12][0], speed=2.0), "corrected")
        return {"forward": ", ".join(parts), "faster": forward(faster)}
    (case,) = CASES[13]
    as_printed, corrected = (paths[case, form] for form in FORMS)
    return {
        "speed": case.speed,
        "before": np.hypot(*corrected["velocity"][0, -1]),
        "after": np.hypot(*corrected["velocity"][1, 0]),
        "printed_after": np.hypot(*as_printed["velocity"][1, 0]),
        "right": forward(corrected),
        "printed": forward(as_printed),
    }
