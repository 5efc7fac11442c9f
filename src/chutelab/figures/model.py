"""A figure of the paper as data: lines in panels, printed beside corrected, and what it means."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Final, Literal

from chutelab.frames import csv_text
from chutelab.sheet import Sheet, Shown

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from chutelab.scene import Scene

    Floats = NDArray[np.float64]

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
