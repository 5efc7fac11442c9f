"""`Record`, one measurement, and its way back from a TSV file."""

from __future__ import annotations

import csv
from dataclasses import dataclass, fields
from typing import TypeVar

R = TypeVar("R")


@dataclass(frozen=True)
class Record:
    """One method on one case with one value of its parameter; None where it does not apply.

    Attributes
    ----------
    case, method : str
        Names.
    parameter, value : str, float
        ``"dt"`` (s) or ``"rtol"``, and its value.
    first : float
        s of the first run, imports excluded.
    repeats : int
        Runs after it.
    median : float
        s, their median; the first run where it was so long that it was not repeated.
    error : float
        See the case.
    quantity : str
        Which quantity it is the error of.
    memory : int
        Peak of what Python and NumPy allocate, bytes, in a run of its own.
    residual : float
        Of the energy ledger, as a share of the energy turned over, for methods that keep one.
    overlap : float
        Largest overlap of two particles, in radii.
    place, place_shift : float
        Mean x (m) of all particles of a crowd at its end, and how far it is from that of the run
        with the least error.
    failed : str
        Why there is no error, "" if there is one.
    """

    case: str
    method: str
    parameter: str = ""
    value: float | None = None
    first: float | None = None
    repeats: int = 0
    median: float | None = None
    error: float | None = None
    quantity: str = ""
    memory: int | None = None
    residual: float | None = None
    overlap: float | None = None
    place: float | None = None
    place_shift: float | None = None
    failed: str = ""


@dataclass(frozen=True)
class Size:
    """One run of the scaling measurement.

    Attributes
    ----------
    case, method : str
        Names.
    particles, events : int
        How many; an event is what a recording lists.
    first, repeats, median, memory, failed
        See `Record`.
    """

    case: str
    method: str
    particles: int
    events: int | None = None
    first: float | None = None
    repeats: int = 0
    median: float | None = None
    memory: int | None = None
    failed: str = ""


def from_tsv(text: str, kind: type[R]) -> tuple[list[R], dict[str, str]]:
    """Return the rows and what is said about them, as `chutelab.util.files.tsv_text` wrote them.

    Raises
    ------
    ValueError
        If the columns are not those of the dataclass, or a value is no number.
    """
    lines = text.splitlines()
    head = [line for line in lines if line.startswith("# ")]
    about = dict(line[2:].split(": ", 1) for line in head)
    reader = csv.DictReader(lines[len(head) :], dialect="excel-tab")
    types = {field.name: str(field.type) for field in fields(kind)}  # type: ignore[arg-type]
    if reader.fieldnames is None or list(reader.fieldnames) != list(types):
        raise ValueError(f"expected the columns {', '.join(types)}")
    return [kind(**{key: _read(types[key], row[key]) for key in types}) for row in reader], about


def _read(kind: str, text: str) -> object:
    if kind == "str":
        return text
    if not text:
        return None
    return int(text) if kind.startswith("int") else float(text)
