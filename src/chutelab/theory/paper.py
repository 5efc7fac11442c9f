"""The paper's Tables 1, 3, 4 and 5 as printed, beside computed values, cell by cell."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path
from typing import Any

import numpy as np

from chutelab.theory.transfer import Rebound, Transfer, transfer
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown

PRINTED: dict[str, Any] = tomllib.loads(
    (Path(__file__).parent / "paper.toml").read_text(encoding="utf-8")
)
"""The paper's numbers as texts, with all their digits; explained in the file."""

WORDS: dict[str, Any] = PRINTED["words"]
"""Texts on tables and figures, with names of computed values in braces."""

RADII: list[str] = PRINTED["radii"]
DISTANCES: list[str] = PRINTED["distances"]

TABLES = (1, 3, 4, 5)
"""Numbers of the tables that hold results (Table 2 lists the simulated model's dimensions)."""

SLACK = Decimal("1e-9")
"""Relative tolerance on half a unit of the last digit: a tie such as 0.6575 for 0.658 is a tie only
in decimal."""

BALL_MASS = 0.26
"""kg, the steel ball of Table 2 (20 mm radius at 7.8e-6 kg/mm³)."""

PLATE_AHEAD = 0.5
"""m from the edge of the incoming support to the plate in the simulation of Table 3."""

FALL = 0.5
"""m, d2 of all tables."""


@dataclass(frozen=True)
class Cell:
    """One number of a table, as printed and as computed, in the same unit.

    `rounded` is the computed one with the printed number of decimals, halves away from zero. It
    differs if the two are more than half a unit of the last printed digit apart; ties agree.
    """

    printed: str
    computed: float
    rounded: str
    differs: bool

    def __str__(self) -> str:
        return f"{self.printed} {self.rounded}{'*' if self.differs else ''}"


@dataclass(frozen=True)
class Row:
    """One row: its label (the pulley radius, or the belt speed, with the unit) and its cells."""

    label: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True, repr=False)
class Table(Shown):
    """One table of the paper.

    Attributes
    ----------
    number : int
        As in the paper.
    title : str
        What it holds, with units.
    rebound : {"corrected", "as-printed"}
        Form of Eq. (9) behind the computed numbers.
    columns : tuple of str
        Heads of the label and of each cell.
    rows : tuple of Row
        A row per pulley radius; Table 1 has its two speeds one after the other.
    notes : tuple of str
        Remarks on the differences.
    """

    number: int
    title: str
    rebound: Rebound
    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    notes: tuple[str, ...] = ()

    @property
    def cells(self) -> int:
        """Number of cells."""
        return sum(len(row.cells) for row in self.rows)

    @property
    def differing(self) -> int:
        """Number of cells that differ in a printed digit."""
        return sum(cell.differs for row in self.rows for cell in row.cells)

    def sheet(self) -> Sheet:
        """Return printed and computed numbers side by side, marked with * where they differ."""
        form = self.rebound.replace("-", " ")
        return Sheet(
            f"{self.title}\n(printed, computed with Eq. (9) {form})",
            # Lines are broken here, as the terminal would break some of them elsewhere.
            tuple(column.replace(" = ", " =\n") for column in self.columns),
            tuple((row.label, *map(str, row.cells)) for row in self.rows),
            notes=(
                f"{self.differing} of {self.cells} cells differ in a printed digit.",
                *self.notes,
            ),
        )


def table(number: int, rebound: Rebound = "as-printed") -> Table:
    """Compute a table of the paper anew.

    Parameters
    ----------
    number : {1, 3, 4, 5}
        Which table.
    rebound : {"corrected", "as-printed"}
        Form of Eq. (9) for the computed numbers; it matters only for x3 of Table 1 and the landing
        in Table 3.

    Returns
    -------
    Table
        Printed and computed numbers, marked where they differ.

    Raises
    ------
    ValueError
        If the paper has no such table of results.

    Examples
    --------
    >>> table(1).differing, table(1, rebound="corrected").differing
    (0, 22)
    """
    if number not in BUILT:
        raise ValueError(f"no table {number}: the paper's results are in tables 1, 3, 4 and 5")
    return BUILT[number](number, rebound)


def compared(label: str, printed: Sequence[str], computed: Sequence[float]) -> Row:
    """Return a row of printed numbers beside computed ones."""
    cells = []
    for text, value in zip(printed, map(float, computed), strict=True):
        claim, found = Decimal(text), Decimal(repr(value))
        unit = Decimal(1).scaleb(int(claim.as_tuple().exponent))
        nearest = found.quantize(unit * SLACK, ROUND_HALF_UP).quantize(unit, ROUND_HALF_UP)
        differs = abs(found - claim) > unit * (Decimal("0.5") + SLACK)
        cells.append(Cell(text, value, f"{nearest:f}", differs))
    return Row(label, tuple(cells))


def at_radii(radii: Floats, speed: float, distance: float, rebound: Rebound) -> Transfer:
    """Compute the transfer of an 8 g point over an upright plate, ε = 0.5, by radius (m)."""
    return transfer(
        speed=speed, pulley_radius=radii, distance=distance, restitution=0.5, drop=FALL,
        mass=0.008, gravity=9.81, rebound=rebound,
    )  # fmt: skip


def impacts(number: int, rebound: Rebound) -> Table:
    """Table 1."""
    rows = []
    for speed, printed in PRINTED["impacts"].items():
        found = at_radii(np.array(RADII, dtype=float), float(speed), 0.5, rebound)
        computed = zip(found.x2, found.y2, found.x3, found.y3, strict=True)
        rows += [
            compared(f"v0 = {speed} m/s, R = {radius} m", *pair)
            for radius, *pair in zip(RADII, printed, computed, strict=True)
        ]
    slow, fast = transfer(speed=[2.0, 4.0], pulley_radius=0.05, distance=0.5, drop=FALL).x3
    return Table(
        number,
        "Table 1: coordinates of the impacts on plate and outgoing belt, m",
        rebound,
        ("speed and radius", "x2", "y2", "x3", "y3"),
        tuple(rows),
        (WORDS["impacts"].format(slow=slow, fast=fast),),
    )


def heights(number: int, rebound: Rebound) -> Table:
    """Tables 4 and 5."""
    speed = "2" if number == 4 else "4"
    radii, v0 = np.array(RADII, dtype=float), float(speed)
    columns = [at_radii(radii, v0, float(distance), rebound).d3 for distance in DISTANCES]
    computed = zip(*columns, strict=True)
    return Table(
        number,
        f"Table {number}: height d3 of the transfer at v0 = {speed} m/s, m",
        rebound,
        ("radius", *(f"d_okr = {distance} m" for distance in DISTANCES)),
        tuple(
            compared(f"R = {radius} m", *pair)
            for radius, *pair in zip(RADII, PRINTED["heights"][speed], computed, strict=True)
        ),
    )


def energies(number: int, rebound: Rebound) -> Table:
    """Table 3 for the paper's own simulated model: flat supports, so that φ1 = 0 and d1 = 0.5 m."""
    rows = []
    for speed, printed in PRINTED["energies"].items():
        radius = 0.1  # any pulley that the particle leaves at the top will do
        found = transfer(
            speed=float(speed),
            pulley_radius=radius,
            distance=PLATE_AHEAD - radius,
            drop=FALL,
            mass=BALL_MASS,
            rebound=rebound,
        )
        computed = [500.0 * BALL_MASS * float(v) ** 2 for v in (found.v2, found.v3)]
        rows.append(compared(f"v1 = {speed} m/s", printed, computed))
    (first, _), (second, _) = cells = [row.cells for row in rows]
    joule, plate, support = (float(cell.printed) / 1000.0 for cell in (first, *cells[1]))
    fast = (2.0 * joule / BALL_MASS) ** 0.5
    values = {
        "printed": 1000.0 * joule,
        "joule": joule,
        "mass": BALL_MASS,
        "fast": fast,
        "fall": (fast**2 - 2.0**2) / (2.0 * 9.81),
        "ahead": PLATE_AHEAD,
        "sunk": 0.5 * 9.81 * (PLATE_AHEAD / 2.0) ** 2,
        "computed": first.computed,
        "after": (support - plate) / (BALL_MASS * 9.81),
        "ratios": ", ".join(
            f"{float(cell.printed) / cell.computed:.1f}" for row in cells for cell in row
        ),
        "growth": second.computed / first.computed,
        "printed_growth": float(second.printed) / float(first.printed),
    }
    return Table(
        number,
        "Table 3: kinetic energy at the plate and at the outgoing support, N mm",
        rebound,
        ("speed", "E_k1", "E_k2"),
        tuple(rows),
        tuple(text.format(**values) for text in WORDS["energies"]),
    )


BUILT: dict[int, Callable[[int, Rebound], Table]] = {
    1: impacts, 3: energies, 4: heights, 5: heights,
}  # fmt: skip
