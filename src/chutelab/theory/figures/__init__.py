"""The paper's Figures 6 to 9 and 11 to 13, as printed and corrected side by side.

>>> figure(7).columns["R, m"].shape
(93,)

- `model`: a figure as data: lines in panels, numbers, what the misprint does to its conclusion.
- `radius`: Figures 6 to 9, energy and velocities against the radius of the drive pulley.
- `paths`: Figures 11 to 13, trajectories.

V. Molnár et al., Mech. Sci. 7, 167-177, 2016, doi:10.5194/ms-7-167-2016. The paper's pictures are
not copied: what its text gives is computed anew, and what it does not give is said.
"""

from __future__ import annotations

from typing import Final

from chutelab.theory.figures.model import Line, Panel, PaperFigure
from chutelab.theory.figures.paths import path_figure
from chutelab.theory.figures.radius import energy_figure, velocity_figure
from chutelab.util.errors import InputError

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
    if number in (6, 7):
        return energy_figure(number)
    return velocity_figure(number) if number in (8, 9) else path_figure(number)


__all__ = ["DRAWINGS", "NUMBERS", "FigureError", "Line", "Panel", "PaperFigure", "figure"]
