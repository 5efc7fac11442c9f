"""The rows of a sweep: columns, computation from a recording, table and files.

A recording has one variant with all its particles, or a family: V variants of M particles. Both go
through the same operations, so that a row does not depend on that. Files, CSV or Parquet, keep
every bit, and are written whole or not at all.
"""

from __future__ import annotations

import csv
import io
import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.results import REASONS, Kind, Recording
from chutelab.results.arrival import fates
from chutelab.results.quantities import at_first, measured
from chutelab.results.stream import told_fates
from chutelab.scene.quantities import COLUMNS, FORMER, HEAT, PAID, REGISTRY, lookup
from chutelab.scene.variants import Quantity
from chutelab.util.arrays import Floats, begins, sorted_by
from chutelab.util.errors import InputError, library
from chutelab.util.files import csv_columns, csv_lines, unquoted, whole, write_lines
from chutelab.util.tables import Sheet, Shown, frame, many, number

Rows = Mapping[str, NDArray[Any]]

Columns = dict[str, NDArray[Any]]

TOUCHES: Final = "touches"
"""The column with the surfaces that particles meet, see `touches`; "" without a run."""

REASON: Final = "reason"
"""The column with the reason why numbers are missing; "" if none are."""

ERROR: Final = ".error"
"""Ending of names of columns with the standard error of the mean over seeds."""

TEXTS: Final = (TOUCHES, REASON)
"""The columns of words, which come last."""


def no_column(name: str) -> str:
    """Return which columns of numbers there are, or the name of a quantity in a sweep.

    >>> no_column("landing.x")
    'landing.x is called landing.x.mean now: in a run landing.x is of one particle'
    """
    if (row := REGISTRY.get(name)) and row.of == "lone":
        why = f"{name} is what is paid until nothing slips, this is up to run.until"
        return f"{name} is called {row.together} now: {why}"
    if f"{name}.mean" in COLUMNS:
        return f"{name} is called {name}.mean now: in a run {name} is of one particle"
    if name in FORMER:
        return f"{name} is called {FORMER[name]} now"
    return f"{name}: one of {', '.join(COLUMNS)}"


class Named(dict[str, NDArray[Any]]):
    """Columns by name; the error for an unknown one has its name in a sweep."""

    def __missing__(self, name: str) -> NDArray[Any]:
        """Raise a KeyError that says which columns there are."""
        raise KeyError(no_column(name))


def empty(count: int, why: str = "") -> Columns:
    """Return rows without numbers, with the reason."""
    texts = {TOUCHES: "", REASON: why}
    found: Columns = {name: np.full(count, np.nan) for name in COLUMNS}
    return found | {name: np.full(count, text, dtype=object) for name, text in texts.items()}


def joined(parts: Sequence[Mapping[str, NDArray[Any]]]) -> Columns:
    """Concatenate rows."""
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def averaged(parts: Sequence[Columns]) -> Columns:
    """Return the means of rows over seeds, their standard errors, and the words of most seeds.

    A seed without a value does not count; for fewer than two values there is no error. Reasons have
    the number of their seeds.
    """
    names = [name for name in parts[0] if name not in TEXTS]
    found = {name: mean_and_error([part[name] for part in parts]) for name in names}
    columns: Columns = {name: mean for name, (mean, _) in found.items()}
    columns |= {f"{name}{ERROR}": error for name, (_, error) in found.items()}
    for name in TEXTS:
        columns[name] = np.empty(len(parts[0][name]), dtype=object)
        for row, texts in enumerate(zip(*(part[name] for part in parts), strict=True)):
            counts = Counter(texts).most_common()
            if name == TOUCHES or len(counts) == 1:
                columns[name][row] = counts[0][0]
            else:
                columns[name][row] = "; ".join(
                    f"{count} of {len(texts)} seeds: {why}" for why, count in counts if why
                )
    return columns


def mean_and_error(values: ArrayLike) -> tuple[Floats, Floats]:
    """Return the mean over seeds, the first axis, and its standard error s / √n.

    NaN does not count; the error of fewer than two values is NaN.

    >>> mean_and_error([[1.0], [2.0], [3.0], [float("nan")]])
    (array([2.]), array([0.57735027]))
    """
    table = np.asarray(values, dtype=np.float64)
    known = np.isfinite(table)
    count = known.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        mean = np.where(known, table, 0.0).sum(axis=0) / count
        squares = np.where(known, (table - mean) ** 2, 0.0).sum(axis=0)
        error = np.sqrt(np.where(count > 1, squares, np.nan) / (count - 1) / count)
    return np.asarray(mean), np.asarray(error)


FATES = {
    "time": "still under way when the run ended",
    "stopped": "still under way when the run was stopped",
    "unreleased": "never released",
    "settled": "came to rest elsewhere",
    "exit": "left the scene",
}
"""Fate of a lone particle that did not arrive, by the reason of its end."""


def rows(recording: Recording, variants: int = 1) -> Columns:
    """Return the rows of the variants of a recording: of one, or of a family of `variants`."""
    found, scene = empty(variants), recording.scene
    for name in found:
        if name in COLUMNS and lookup(name, scene.places):
            found[name] = measured(recording, name)
    found[TOUCHES] = touches(recording, variants)
    if scene.outgoing is None:
        return found
    # What became of those that did not arrive, (V, M), and whose slip went on after that.
    missed = np.isnan(at_first(recording, "arrival", "t")).reshape(variants, -1)
    every, ended = missed.shape[1], recording.ended.reshape(missed.shape)
    restless = ~missed & (ended != REASONS.index("settled"))
    if recording.machine.until != "settled":
        restless[:] = False
    ways = missed
    if every > 1 and missed.any():
        ways = fates(recording, missed.ravel()).reshape(missed.shape)
    for row in np.flatnonzero((missed | restless).any(axis=1)).tolist():
        fate = FATES.get(REASONS[ended[row, 0]])
        if every > 1 and missed[row].any():
            fate = told_fates(Counter(ways[row, missed[row]].tolist()))
        found[REASON][row] = "; ".join(
            f"{f'{some.sum()} of {every} particles' if every > 1 else 'it'} {what}"
            for some, what in (
                (missed[row], f"missed the outgoing belt: {fate}"),
                (
                    restless[row],
                    f"arrived, but never came to rest on a belt: {PAID} has only a part",
                ),
            )
            if some.any()
        )
    return found


LONGEST: Final = 6
"""Most surfaces that are named; longer sequences with the same beginning have the same name."""

NOTHING: Final = "nothing"
"""Word for a particle that meets no surface."""

RARE: Final = 0.02
"""A sequence is not reported for a smaller share of a crowd or of uncertain samples."""


def touches(recording: Recording, variants: int = 1) -> NDArray[Any]:
    """Return the surfaces that the particles of each variant meet, (V,) of str.

    Such as ``plate, outgoing``: the kind of an outcome. Numbers of one kind vary smoothly, while a
    mean over several kinds may be near to none of them. It ends with the landing, and impacts in a
    row on one surface count as one. For a crowd the sequences of more than `RARE` of it are listed,
    the most frequent one first, such as ``plate, outgoing | outgoing``.
    """
    # Particles, and the surfaces that each meets up to its landing.
    order = recording.which(Kind.IMPACT, Kind.LANDING, Kind.SETTLE)
    kind, surface, particle = recording.labels
    if np.count_nonzero(particle[order[1:]] < particle[order[:-1]]):
        order = order[sorted_by(particle[order], recording.count)]
    particle, surface, lands = particle[order], surface[order], kind[order] == Kind.LANDING
    landings = np.cumsum(lands) - lands
    kept = landings == landings[begins(particle, recording.count)]
    kept[1:] &= (particle[1:] != particle[:-1]) | (surface[1:] != surface[:-1])
    particle, surface = particle[kept], surface[kept]
    place = np.arange(len(particle)) - begins(particle, recording.count)
    # Short rows, one for each place, take a quarter of the memory.
    ways = np.full((LONGEST + 1, recording.count), -1, dtype=surface.dtype)
    near = place <= LONGEST
    ways[place[near], particle[near]] = surface[near]
    # A sequence as one number, as `np.unique` of rows takes ten times as long.
    taken, kinds, some = np.zeros(recording.count, dtype=np.int64), 1, len(recording.surfaces) + 1
    for met in ways[: place.max(initial=-1) + 1]:
        if kinds * some > np.iinfo(np.int64).max:
            found, taken = np.unique(taken, return_inverse=True)
            kinds = len(found)
        taken, kinds = taken * some, kinds * some
        taken += met
        taken += 1
    # Short numbers are sorted several times as fast.
    taken = taken.astype(np.min_scalar_type(kinds))
    _, example, taken = np.unique(taken, return_index=True, return_inverse=True)
    names = np.empty(len(example), dtype=object)
    for n, way in enumerate(ways[:, example].T.tolist()):
        surfaces = [recording.surfaces[k] for k in way if k >= 0]
        if len(surfaces) > LONGEST:
            surfaces[LONGEST - 1 :] = ["and so on"]
        names[n] = ", ".join(surfaces) or NOTHING
    table = taken.reshape(variants, -1)
    texts, alike = names[table[:, 0]], (table == table[:, :1]).all(axis=1)
    for row in np.flatnonzero(~alike).tolist():
        taken_here: list[int] = table[row].tolist()
        counts = Counter(taken_here).most_common()
        often = [names[way] for way, count in counts if count > RARE * len(taken_here)]
        texts[row] = " | ".join(often or [names[counts[0][0]]])
    return texts


SUFFIXES: Final = {".csv": "csv", ".parquet": "parquet"}
"""Endings of files, and the formats they stand for."""

PARQUET: Final = ("Parquet needs pyarrow", "parquet")
"""Message if it is missing, and its extra."""


def format_of(path: str | Path) -> str:
    """Return the format of a file by its ending; an `InputError` if it cannot be written."""
    if Path(path).is_dir():
        raise InputError(f"{path} is a folder, not a file")
    if not (folder := Path(path).parent).is_dir():
        raise InputError(f"{path}: there is no folder {folder}")
    found = SUFFIXES.get(Path(path).suffix.lower())
    if found is None:
        raise InputError(f"{path}: the name of a table ends with {' or '.join(SUFFIXES)}")
    if found == "parquet":
        library("pyarrow", *PARQUET)
    return found


def write(columns: Rows, path: str | Path, form: str) -> Path:
    """Write a table as "csv" or "parquet"."""
    if form == "csv":
        return write_csv(tuple(columns), [csv_columns(columns.values())], path)
    pa, parquet = library("pyarrow", *PARQUET), library("pyarrow.parquet", *PARQUET)
    table = pa.table({name: pa.array(values, from_pandas=True) for name, values in columns.items()})
    with whole(path) as unfinished:
        parquet.write_table(table, unfinished)
    return Path(path)


def write_csv(names: Sequence[str], texts: Iterable[str], path: str | Path) -> Path:
    """Write a head and texts of rows as a CSV file."""
    return write_lines(path, chain(csv_lines([names]), texts))


def synced(path: Path) -> None:
    """Make a written file, and its name, survive a power cut."""
    for place, flags in ((path, os.O_RDWR), (path.parent, os.O_RDONLY)):
        with suppress(PermissionError):  # Windows does not open folders.
            handle = os.open(place, flags)
            try:
                os.fsync(handle)
            finally:
                os.close(handle)


def columns_of(names: Sequence[str], text: str) -> dict[str, NDArray[Any]]:
    """Read columns written by `csv_columns`."""
    cells = list(zip(*csv.reader(io.StringIO(text, newline="")), strict=True))
    return {
        name: np.array(list(map(unquoted, column)), dtype=object)
        if name in TEXTS
        else np.array([float(cell) if cell else np.nan for cell in column])
        for name, column in zip(names, cells, strict=True)
    }


MOST_REASONS = 5
"""Reasons that are listed."""

PARTIAL = (
    "The outgoing belt's work, its slip heat and power are counted up to run.until. --set"
    " run.until=settled counts them until nothing slips on the belt, as the theory, solve and"
    " --uncertainty do."
)
"""Note for runs that may end before the slip does."""


@dataclass(frozen=True, eq=False, repr=False)
class Sweep(Shown):
    """Many variants of one scene.

    Attributes
    ----------
    title : str
        Of the scene.
    quantities : dict of str to Quantity
        Description of each varied key.
    columns : dict of str to ndarray, (N,)
        Read-only: the varied keys, then the results of each variant, see `COLUMNS` (NaN without a
        value), then ``touches``: the surfaces that particles meet, and ``reason``: why numbers are
        missing.
    shape : tuple of int or None
        Values of each key in a grid, whose last key runs fastest; None for samples.
    until : str or float
        The scene's ``run.until``, up to which ledgers count.
    repeat : int
        Seeds that each variant was run with; with several, columns are means, and ``NAME.error``
        is the standard error of the column ``NAME``.
    """

    title: str
    quantities: Mapping[str, Quantity]
    columns: Mapping[str, NDArray[Any]]
    shape: tuple[int, ...] | None
    until: str | float = "landed"
    repeat: int = 1

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", Named(self.columns))
        for values in self.columns.values():
            values.flags.writeable = False

    def __len__(self) -> int:
        return len(self.columns[REASON])

    def unit(self, column: str) -> str:
        """Return the unit of a column, "" for a pure number."""
        column = column.removesuffix(ERROR)
        return self.quantities[column].unit if column in self.quantities else COLUMNS[column].unit

    def frame(self) -> Any:
        """Return a pandas DataFrame; a varied key or a result is a column. Needs pandas."""
        return frame(self.columns)

    def to_csv(self, path: str | Path) -> Path:
        """Write a CSV file, whole or not at all; NaN is an empty cell."""
        return write(self.columns, path, "csv")

    def to_parquet(self, path: str | Path) -> Path:
        """Write a Parquet file, whole or not at all; NaN is null. Needs pyarrow."""
        return write(self.columns, path, "parquet")

    def sheet(self) -> Sheet:
        """Return the range of each column, and the reasons why rows have no numbers."""
        rows = []
        for name, values in self.columns.items():
            if name in TEXTS or name.endswith(ERROR) or not np.isfinite(values).any():
                continue
            unit = self.unit(name)
            known = values[np.isfinite(values)]
            low, high = float(known.min()), float(known.max())
            if name in self.quantities or low != high or low != 0.0:
                error: tuple[str, ...] = ("",) if self.repeat > 1 else ()
                if error and name not in self.quantities:
                    found = self.columns[f"{name}{ERROR}"]
                    found = found[np.isfinite(found)]
                    error = (number(float(f"{np.median(found):.2g}")) if len(found) else "-",)
                rows.append((name, unit, number(low), number(high), *error, f"{len(known):,}"))
        notes, errors = [], tuple[str, ...]()
        if self.repeat > 1:
            errors = ("± of most",)
            notes.append(
                f"Means over {self.repeat} seeds, the same for all variants, and the median of"
                " their standard errors."
            )
        if self.until != "settled" and np.any(np.nan_to_num(self.columns[HEAT])):
            notes.append(PARTIAL)
        ways = Counter(way for way in self.columns[TOUCHES].tolist() if way)
        if len(ways) > 1:
            told = [f"{count:,} touch {way}" for way, count in ways.most_common(MOST_REASONS)]
            told += [f"others go {len(ways) - MOST_REASONS:,} other ways"] * (len(ways) > len(told))
            notes.append("; ".join(told))
        reasons = Counter(reason for reason in self.columns[REASON].tolist() if reason)
        notes += [f"{count:,} × {reason}" for reason, count in reasons.most_common(MOST_REASONS)]
        if len(reasons) > MOST_REASONS:
            notes.append(f"and {len(reasons) - MOST_REASONS:,} other reasons")
        return Sheet(
            f"{self.title}: {many(len(self), 'variant', ',')}",
            ("", "", "least", "most", *errors, "rows"),
            tuple(rows),
            texts=2,
            notes=tuple(notes),
        )
