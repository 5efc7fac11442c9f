"""A figure of the paper as data: lines in panels, printed beside corrected, and what it means.

Flights over a plate, which several figures are made of, are computed here with either form of
Eq. (9).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Final, Literal

import numpy as np
from numpy.typing import NDArray

from chutelab.scene import Scene
from chutelab.theory.paper import FALL
from chutelab.theory.transfer import transfer
from chutelab.util.arrays import Floats
from chutelab.util.files import csv_text
from chutelab.util.tables import Sheet, Shown

Form = Literal["as-printed", "corrected"]

RESTITUTION: Final = 0.5
"""ε of the plate in all figures."""

GRAVITY: Final = 9.81
"""m/s²."""

FORMS: tuple[Form, Form] = ("as-printed", "corrected")

SAID = {"as-printed": "Eq. (9) as printed", "corrected": "Eq. (9) corrected"}


@dataclass(frozen=True, eq=False)
class Line:
    """One line of a panel.

    Attributes
    ----------
    label : str
        For the legend; "" for none.
    x, y : ndarray
        Points, SI units.
    role : {"first", "second", "third", "fourth", "plate", "belt"}
        What it is drawn like.
    marks : ndarray or None
        Points (M, 2) that are marked on it.
    """

    label: str
    x: Floats
    y: Floats
    role: str
    marks: Floats | None = None


@dataclass(frozen=True, eq=False)
class Panel:
    """One panel: its title, what its axes are, and its lines.

    Attributes
    ----------
    form : {"as-printed", "corrected"}
        Which Eq. (9).
    case : str
        What else tells it from its neighbours; "" if nothing does.
    to_scale : bool
        Whether x and y are drawn alike, as in a picture of the machine.
    """

    form: Form
    case: str
    x_label: str
    y_label: str
    lines: tuple[Line, ...]
    to_scale: bool = False

    @property
    def title(self) -> str:
        """Case and form."""
        return f"{self.case}, {SAID[self.form]}" if self.case else SAID[self.form]


@dataclass(frozen=True, eq=False, repr=False)
class PaperFigure(Shown):
    """A figure of the paper, computed anew.

    Attributes
    ----------
    number : int
        As in the paper.
    title : str
        What it shows.
    panels : tuple of tuple of Panel
        Rows of two: as printed, corrected.
    meaning : tuple of str
        What the misprint does to the figure's conclusion.
    missing : tuple of str
        What the paper's text does not give, and what is taken instead.
    columns : dict of ndarray
        The numbers, by name with unit; one length.
    rows : sequence of int
        Which of them are shown as a table.
    scenes : dict of Scene
        What is behind it, by file name without suffix.
    sweep : str
        The command that makes its corrected side with the engine; "" without a sweep.
    """

    number: int
    title: str
    panels: tuple[tuple[Panel, Panel], ...]
    meaning: tuple[str, ...]
    missing: tuple[str, ...]
    columns: dict[str, NDArray[Any]]
    rows: tuple[int, ...]
    scenes: dict[str, Scene] = field(default_factory=dict)
    sweep: str = ""

    def sheet(self) -> Sheet:
        """Return some of the numbers, and what they mean."""
        names = tuple(self.columns)
        texts = sum(column.dtype.kind not in "fi" for column in self.columns.values())
        return Sheet(
            f"Figure {self.number}: {self.title}",
            names,
            tuple(tuple(_cell(self.columns[name][row]) for name in names) for row in self.rows),
            texts=texts,
            notes=(*self.meaning, *(f"Not in the text: {text}" for text in self.missing)),
        )

    def csv(self) -> str:
        """Return the numbers as CSV, in full."""
        return csv_text(self.columns)


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


POINTS: Final = 61
"""Of each flight's line."""


@dataclass(frozen=True, eq=False)
class Flight:
    """A flight in the world frame: times (P,) since its start, positions and velocities (P, 2)."""

    t: Floats
    position: Floats
    velocity: Floats

    @classmethod
    def of(cls, start: Floats, velocity: Floats, until: float) -> Flight:
        """Fly from a point with a velocity until a time, SI units."""
        t = np.linspace(0.0, until, POINTS)
        fall = np.array([0.0, -GRAVITY])
        elapsed = t[:, np.newaxis]
        position = start + velocity * elapsed + 0.5 * fall * elapsed**2
        return cls(t, position, velocity + fall * elapsed)


@dataclass(frozen=True, eq=False)
class Path:
    """What becomes of the particle.

    Attributes
    ----------
    first, second : Flight
        To the plate, and from there to the belt.
    """

    first: Flight
    second: Flight

    @property
    def landing(self) -> Floats:
        """Velocity at the belt, m/s."""
        last: Floats = self.second.velocity[-1]
        return last

    @property
    def speeds(self) -> tuple[float, float]:
        """Speeds before and after the plate, m/s."""
        before, after = self.first.velocity[-1], self.second.velocity[0]
        return float(np.hypot(*before)), float(np.hypot(*after))


def path(speed: float, angle: float, ahead: float, form: Form, radius: float = 0.1) -> Path:
    """Carry a mass point over a plate, with Eq. (9) in either form.

    Parameters
    ----------
    speed : float
        m/s.
    angle : float
        Of the plate, degrees from the vertical.
    ahead : float
        d1, m from the point where the belt is left to the plate's pivot, at the same height.
    radius : float
        Of the pulley, m, left at the top.
    """
    found = transfer(
        speed=speed, pulley_radius=radius, distance=ahead - radius, angle=np.radians(angle),
        restitution=RESTITUTION, drop=FALL, gravity=GRAVITY, unbounded_plate=False,
    )  # fmt: skip
    before = float(found.phi2)
    v2 = float(found.v2)
    if form == "as-printed":
        size = v2 * np.hypot(np.sin(before), RESTITUTION * np.cos(before))  # Eq. (9), as printed
    else:
        size = v2 * np.hypot(np.cos(before), RESTITUTION * np.sin(before))
    down = np.array([np.sin(np.radians(angle)), -np.cos(np.radians(angle))])
    away = np.array([-np.cos(np.radians(angle)), -np.sin(np.radians(angle))])
    turned = float(found.phi2r)  # Eq. (8)
    after = size * (np.cos(turned) * down + np.sin(turned) * away)
    start = np.array([0.0, radius])
    impact = start + np.array([float(found.x2), -float(found.y2)])
    until = (after[1] + np.sqrt(after[1] ** 2 + 2.0 * GRAVITY * FALL)) / GRAVITY
    return Path(
        Flight.of(start, np.array([speed, 0.0]), float(found.t2)), Flight.of(impact, after, until)
    )
