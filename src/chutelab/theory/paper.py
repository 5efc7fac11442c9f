"""The paper's Tables 1, 3, 4 and 5, as printed, beside what the equations give, cell by cell."""

from __future__ import annotations

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass
from decimal import ROUND_HALF_UP, Decimal
from pathlib import Path
from typing import Any

import numpy as np

from chutelab.theory.results import Transfer
from chutelab.theory.transfer import Rebound, transfer
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet, Shown

PRINTED: dict[str, Any] = tomllib.loads(
    (Path(__file__).parent / "paper.toml").read_text(encoding="utf-8")
)
"""The paper's numbers as texts, with all their digits; the file says what they are."""

RADII: list[str] = PRINTED["radii"]
DISTANCES: list[str] = PRINTED["distances"]

TABLES = (1, 3, 4, 5)
"""Numbers of the tables that hold results (Table 2 lists the simulated model's dimensions)."""

SLACK = Decimal("1e-9")
"""Of half a unit of the last digit: a tie such as 0.6575 for 0.658 is one in decimal only."""

BALL_MASS = 0.26
"""kg, the steel ball of Table 2 (20 mm radius at 7.8e-6 kg/mm³)."""

PLATE_AHEAD = 0.5
"""m from the edge of the incoming support to the plate in the simulation of Table 3."""

FALL = 0.5
"""m, d2 of all tables."""


@dataclass(frozen=True)
class Cell:
    """One number of a table, as the paper has it and as the equations give it, in the same unit.

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
        What to know before drawing conclusions from the differences.
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
            # Broken here, or the terminal breaks some of them elsewhere.
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
        Which Eq. (9) the computed numbers follow; it matters to x3 of Table 1 and to the landing
        in Table 3 only.

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
    if number == 1:
        return _impacts(rebound)
    if number == 3:
        return _energies(rebound)
    if number in (4, 5):
        return _heights(number, rebound)
    raise ValueError(f"no table {number}: the paper's results are in tables 1, 3, 4 and 5")


def _row(label: str, printed: Sequence[str], computed: Sequence[float]) -> Row:
    cells = []
    for text, value in zip(printed, map(float, computed), strict=True):
        claim, found = Decimal(text), Decimal(repr(value))
        unit = Decimal(1).scaleb(int(claim.as_tuple().exponent))
        nearest = found.quantize(unit * SLACK, ROUND_HALF_UP).quantize(unit, ROUND_HALF_UP)
        differs = abs(found - claim) > unit * (Decimal("0.5") + SLACK)
        cells.append(Cell(text, value, f"{nearest:f}", differs))
    return Row(label, tuple(cells))


def at_radii(radii: Floats, speed: float, distance: float, rebound: Rebound) -> Transfer:
    """Carry a point of 8 g over an upright plate with ε = 0.5, from pulleys of these radii (m)."""
    return transfer(
        speed=speed, pulley_radius=radii, distance=distance, restitution=0.5, drop=FALL,
        mass=0.008, gravity=9.81, rebound=rebound,
    )  # fmt: skip


def _impacts(rebound: Rebound) -> Table:
    rows = []
    for speed, printed in PRINTED["impacts"].items():
        found = at_radii(np.array(RADII, dtype=float), float(speed), 0.5, rebound)
        computed = zip(found.x2, found.y2, found.x3, found.y3, strict=True)
        rows += [
            _row(f"v0 = {speed} m/s, R = {radius} m", *pair)
            for radius, *pair in zip(RADII, printed, computed, strict=True)
        ]
    corrected = transfer(speed=[2.0, 4.0], pulley_radius=0.05, distance=0.5, drop=FALL).x3
    return Table(
        1,
        "Table 1: coordinates of the impacts on plate and outgoing belt, m",
        rebound,
        ("speed and radius", "x2", "y2", "x3", "y3"),
        tuple(rows),
        (
            "The x3 column follows Eq. (9) as printed, which swaps sine and cosine: it damps the"
            " tangential velocity and keeps the normal one, against Eq. (8) and the paper's text."
            f" With the normal one damped, x3 is {corrected[0]:.3f} m instead of 0.137 m in the"
            f" first row, and {corrected[1]:.3f} m instead of 0.548 m at 4 m/s.",
        ),
    )


def _heights(number: int, rebound: Rebound) -> Table:
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
            _row(f"R = {radius} m", *pair)
            for radius, *pair in zip(RADII, PRINTED["heights"][speed], computed, strict=True)
        ),
    )


def _energies(rebound: Rebound) -> Table:
    """Table 3 for the paper's own simulated model: flat supports, so that φ1 = 0 and d1 = 0.5 m."""
    rows = []
    for speed, printed in PRINTED["energies"].items():
        radius = 0.1  # any pulley that is left at the top will do
        found = transfer(
            speed=float(speed),
            pulley_radius=radius,
            distance=PLATE_AHEAD - radius,
            drop=FALL,
            mass=BALL_MASS,
            rebound=rebound,
        )
        computed = [500.0 * BALL_MASS * float(v) ** 2 for v in (found.v2, found.v3)]
        rows.append(_row(f"v1 = {speed} m/s", printed, computed))
    first = rows[0].cells[0]
    joule = float(first.printed) / 1000.0
    fast = (2.0 * joule / BALL_MASS) ** 0.5
    fall = (fast**2 - 2.0**2) / (2.0 * 9.81)
    plate, support = (float(cell.printed) / 1000.0 for cell in rows[1].cells)
    after = (support - plate) / (BALL_MASS * 9.81)
    return Table(
        3,
        "Table 3: kinetic energy at the plate and at the outgoing support, N mm",
        rebound,
        ("speed", "E_k1", "E_k2"),
        tuple(rows),
        (
            f"Not reproducible. {float(first.printed):,.0f} N mm is {joule:.2f} J; a ball of"
            f" {BALL_MASS} kg has that at {fast:.1f} m/s, yet it leaves a belt of 2 m/s and would"
            f" have to fall {fall:.1f} m to get there. Over {PLATE_AHEAD} m to the plate it falls"
            f" {0.5 * 9.81 * (PLATE_AHEAD / 2.0) ** 2:.2f} m and has {first.computed:,.0f} N mm."
            f" At 4 m/s it would have to fall {after:.1f} m from the plate to the outgoing support,"
            " even if the plate took nothing.",
            "No factor repairs it: printed over computed is "
            + ", ".join(
                f"{float(cell.printed) / cell.computed:.1f}" for row in rows for cell in row.cells
            )
            + " in the four cells, and doubling the speed should multiply"
            f" E_k1 by {rows[1].cells[0].computed / first.computed:.2f}, printed is"
            f" {float(rows[1].cells[0].printed) / float(first.printed):.2f}.",
            "The paper gives neither the height of its supports nor the contact parameters of that"
            " simulation, so nothing is fitted to it here.",
        ),
    )
