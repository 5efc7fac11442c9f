"""Tracks from the files that the video-analysis program Tracker exports.

Tracker (https://opensourcephysics.github.io/tracker-website) writes a line with the track's name
(older versions alone, newer ones over its columns), a line with the names of the columns, and a
line per frame; a frame without a mark has empty cells. Several tracks stand side by side under
``#multi:``, with the names over the first column of each. Separator and decimal mark are the
user's choice. Any other table with columns t, x and y does as well, also without their names, or
without times where the frames a second are known.
"""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from chutelab.scene import Fault, shipped
from chutelab.studies.measured.track import LARGEST, LEAST, MeasuredError, Placement, Track
from chutelab.util.errors import did_you_mean
from chutelab.util.files import first_bytes

LARGEST_FILE: Final = 20_000_000
"""Bytes; an hour of film at 50 frames a second is a quarter of it."""

SEPARATORS: Final = {"\t": "tabs", ";": "semicolons", ",": "commas", " ": "spaces"}
"""Tried in this order: a comma may be a decimal mark where a tab or a semicolon stands."""

_NUMBER: Final = re.compile(r"[+-]?(?:\d+(?:[.,]\d*)?|[.,]\d+)(?:[eE][+-]?\d+)?")

_EMPTY: Final = ("", "nan", "null", "na", "n/a", "-", "--")
"""Cells that mean no value, in small letters."""


def lines_of(path: Path) -> list[str]:
    """Return the lines of a text file; a `MeasuredError` if it is no text file."""
    try:
        data = first_bytes(path, LARGEST_FILE)
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise refused(path, "", f"cannot be read: {reason}") from None
    if len(data) > LARGEST_FILE:
        raise refused(path, "", f"too large for a track: at most {LARGEST_FILE // 10**6} MB")
    if data[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = data.decode("utf-16", errors="replace")
    else:
        if b"\0" in data:
            raise refused(path, "", "not a text file; a table with columns t, x, y is needed")
        try:
            text = data.decode("utf-8-sig")
        except UnicodeDecodeError:
            # Only a track's name can hold letters that are not ASCII: any 8-bit code will do.
            text = data.decode("latin-1")
    return re.split(r"\r\n|\r|\n", text)


def cells_of(line: str, separator: str) -> list[str]:
    """Split a line at a separator that is not in quotes; blanks around cells are cut off.

    >>> cells_of('0,02;"1,5"; 2', ";")
    ['0,02', '1,5', '2']
    """
    if separator == " ":
        return line.split()
    # One line at a time: a quote that is never closed must not swallow the rest of the file.
    try:
        rows = list(csv.reader([line], delimiter=separator, skipinitialspace=True))
    except csv.Error:
        # A cell too large for the reader, which is no number anyway.
        rows = [line.split(separator)]
    return [cell.strip() for cell in rows[0]] if rows else []


def number(cell: str) -> float | None:
    """Return the number in a cell, with decimal point or comma; None if there is none.

    >>> number("1,5E-1"), number("−0.5"), number("1.234,5")
    (0.15, -0.5, None)
    """
    cell = cell.replace("\N{MINUS SIGN}", "-")
    if len(cell) > 60 or not _NUMBER.fullmatch(cell):
        return None
    return float(cell.replace(",", "."))


def refused(source: object, place: str, allowed: str, value: object = None) -> MeasuredError:
    """Return the error that says what is wrong at a place of a file."""
    return MeasuredError(str(source), [Fault(place, value, allowed)])


LENGTHS: Final = {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1e3, "in": 0.0254, "ft": 0.3048}
TIMES: Final = {"s": 1.0, "sec": 1.0, "ms": 1e-3}
PIXELS: Final = ("px", "pixel", "pixels")

_COLUMN: Final = re.compile(
    r"(time|t|x|y)(?:\s*[(\[/]\s*(?P<bracket>[a-z]+)\s*[)\]]?|(?:\s+in\s+|_)(?P<plain>[a-z]+))?"
)
_POSITION: Final = re.compile(r"[1-9]\d{0,5}")
_WITH_UNIT: Final = re.compile(r"(.*\S)\s*[(\[]\s*([a-zA-Z]+)\s*[)\]]")

_HEADER_WITHIN: Final = 100
"""The names of the columns are searched in so many lines."""


@dataclass(frozen=True)
class _Columns:
    """Columns of a track's t, x and y in a line of `width` cells, and their units."""

    name: str
    cells: dict[str, int]
    units: dict[str, str]
    width: int


def find(name_or_path: str | Path) -> Path:
    """Return an existing file, or else the shipped track of this name.

    Raises a `MeasuredError` if there is neither.
    """
    path = Path(name_or_path)
    with suppress(OSError, ValueError):
        if str(name_or_path) and path.exists():
            return path
    folders = {scene.parent for scene in shipped().values()}
    tracks = {file.stem: file for one in folders for file in sorted((one / "data").glob("*.csv"))}
    if (name := str(name_or_path).removesuffix(".csv")) in tracks:
        return tracks[name]
    advice = did_you_mean(path.stem, tracks, f"shipped: {', '.join(tracks) or 'none'}")
    raise refused(name_or_path or '""', "", f"no such file, and no shipped track; {advice}")


def read(
    path: str | Path,
    *,
    scale: float | None = None,
    origin: tuple[float, float] = (0.0, 0.0),
    flip_y: bool = False,
    t0: float = 0.0,
    track: str | None = None,
    columns: Sequence[str | int] = (),
    fps: float | None = None,
) -> Track:
    """Read a track from a table with the columns t, x and y; others are ignored.

    A table without names of columns is accepted if it has just these three.

    Parameters
    ----------
    path
        A file, or the name of a shipped track.
    scale
        Metres per unit of the file; by default what the header's unit says (m, cm, mm, in, ft),
        metres if it names none. Columns in pixels need it.
    origin
        The pulley's axis, in the units of the file.
    flip_y
        Whether y is counted downward in the file.
    t0
        s; the time in the file at which particle 0 is released.
    track
        Which one, of a file that holds several.
    columns
        Columns of t, x and y: names, or numbers from 1; by default those with these names.
    fps
        Frames per second, of a table without times: each line is a frame, also one without a
        position. With three `columns` the first is the number of the frame.

    Returns
    -------
    Track
        Lines without a position are left out and counted.

    Raises
    ------
    MeasuredError
        Says file, line, column and value, and what is allowed.
    """
    source = find(path)
    if fps is not None and not 0.0 < fps <= LARGEST:
        raise refused(source, "fps", f"must be a number > 0 and <= {LARGEST:g}", fps)
    if columns and track is not None:
        raise refused(source, "", "track and columns both choose columns; give one of them")
    lines = lines_of(source)
    keys = ("x", "y") if fps is not None and len(columns) in (0, 2) else ("t", "x", "y")
    if columns:
        header, separator, found = _chosen(source, lines, keys, columns)
        tracks = [found]
    else:
        header, separator = _header(source, lines, keys)
        above = cells_of(lines[header - 1], separator) if header > 0 else []
        head = cells_of(lines[header], separator) if header >= 0 else list(keys)
        tracks = _tracks(head, above, keys)
    place = f"line {header + 1}" if header >= 0 else ""
    said = ", ".join(f'"{one.name}"' for one in tracks)
    if not tracks:
        raise refused(source, place, "each column x needs a column y after it")
    if track is None and len(tracks) > 1:
        raise refused(source, place, f"holds {len(tracks)} tracks; choose one of {said}")
    its = next((one for one in tracks if track in (None, one.name)), None)
    if its is None:
        raise refused(source, place, f"no such track; there are {said}", track)
    points, numbers, skipped = _rows(source, lines, header, separator, its)
    if len(points) < LEAST:
        text = f"{len(points)} points with a time and a position; at least {LEAST} are needed"
        raise refused(source, "", text)
    units = sorted({its.units["x"] or "m", its.units["y"] or "m"})
    if scale is None and set(units) & set(PIXELS):
        raise refused(source, place, "x and y are in pixels: a scale, metres per pixel, is needed")
    if scale is None and len(units) > 1:
        raise refused(source, place, f"x and y have different units: {', '.join(units)}")
    scale = LENGTHS[units[0]] if scale is None else scale
    table = np.array(points)
    return Track(
        name=its.name,
        source=str(source),
        seconds=TIMES[its.units["t"]] * table[:, 0] if fps is None else table[:, 0] / fps,
        points=table[:, 1:],
        lines=np.array(numbers),
        placement=Placement(scale, origin, flip_y, t0),
        skipped=skipped,
    )


def _header(source: Path, lines: Sequence[str], keys: Sequence[str]) -> tuple[int, str]:
    """Return the index of the line with the columns' names (-1 for none), and the separator."""
    best: tuple[int, set[str]] = (0, set())
    for index, line in enumerate(lines[:_HEADER_WITHIN]):
        for separator in SEPARATORS:
            if separator not in line:
                continue
            found = {name for cell in cells_of(line, separator) if (name := _named(cell)[0])}
            if found >= set(keys):
                if "t" in found - set(keys):
                    text = "has a column t, so no frames per second are needed; with the columns"
                    raise refused(source, f"line {index + 1}", f"{text} x,y chosen they are taken")
                return index, separator
            if len(found) > len(best[1]):
                best = index, found
    asked = ", ".join(keys)
    if len(best[1]) > 1:
        missing = ", ".join(sorted({*keys} - best[1]))
        raise refused(source, f"line {best[0] + 1}", f"no column {missing}; {asked} are needed")
    told = (line.strip() for line in lines)
    first = next((line for line in told if line and not line.startswith("#")), "")
    for separator in SEPARATORS:
        cells = cells_of(first, separator)
        if len(cells) == len(keys) and _numeric(cells):
            return -1, separator
    text = f"no line names the columns {asked}; choose them by name or number (--columns)"
    raise refused(
        source, "line 1" if first else "", text if first else f"empty; {text}", first or None
    )


def _numeric(cells: Sequence[str]) -> bool:
    """Whether cells hold numbers and nothing else; any may be empty."""
    return all(number(cell) is not None or cell.lower() in _EMPTY for cell in cells)


def _chosen(
    source: Path, lines: Sequence[str], keys: Sequence[str], columns: Sequence[str | int]
) -> tuple[int, str, _Columns]:
    """Return the line above the numbers (-1 for none), the separator, and the chosen columns."""
    wanted = [str(column).strip().lower() for column in columns]
    said, asked = ",".join(map(str, columns)), ",".join(keys)
    if len(wanted) != len(keys) or len(set(wanted)) < len(wanted):
        raise refused(source, "columns", f"must be {len(keys)} different ones, for {asked}", said)
    numbers = [int(one) - 1 for one in wanted if _POSITION.fullmatch(one)]
    for index, line in enumerate(lines[:_HEADER_WITHIN]):
        for separator in SEPARATORS:
            cells = cells_of(line, separator)
            if max(numbers, default=0) >= len(cells):
                continue
            if len(numbers) == len(keys):
                # The line above the first line of numbers may name units.
                picked = [cells[n] for n in numbers]
                if not _numeric(picked if any(picked) else cells):
                    continue
                header, above = index - 1, cells_of(lines[index - 1], separator) if index else []
                places = numbers
            else:
                header, above = index, cells
                names = [re.sub(_WITH_UNIT, r"\1", cell).lower() for cell in cells]
                lower = [cell.lower() for cell in cells]
                found = [
                    int(one) - 1 if _POSITION.fullmatch(one)
                    else lower.index(one) if one in lower
                    else names.index(one) if one in names
                    else None
                    for one in wanted
                ]  # fmt: skip
                places = [place for place in found if place is not None]
                if len(set(places)) < len(keys):
                    continue
            units = dict.fromkeys(("t", "x", "y"), "")
            for key, place in zip(keys, places, strict=True):
                unit = _WITH_UNIT.fullmatch(above[place]) if place < len(above) else None
                known = TIMES if key == "t" else {*LENGTHS, *PIXELS}
                units[key] = unit[2].lower() if unit and unit[2].lower() in known else ""
            its = dict(zip(keys, places, strict=True))
            units["t"] = units["t"] or "s"
            return header, separator, _Columns("", its, units, len(cells))
    text = (
        "no line has these columns, which are names in a line above the numbers, or numbers from 1"
    )
    raise refused(source, "columns", text, said)


def _named(cell: str) -> tuple[str, str]:
    """Return which column (t, x or y) a header's cell names, "" for another, and its unit.

    >>> _named("x (cm)"), _named("Time"), _named("v_{x}")
    (('x', 'cm'), ('t', ''), ('', ''))
    """
    match = _COLUMN.fullmatch(cell.lower())
    if match is None:
        return "", ""
    name, unit = match[1][0], match["bracket"] or match["plain"] or ""
    known = TIMES if name == "t" else {**LENGTHS, **dict.fromkeys(PIXELS, 1.0)}
    return (name, unit) if not unit or unit in known else ("", "")


def _tracks(header: Sequence[str], above: Sequence[str], keys: Sequence[str]) -> list[_Columns]:
    """Return the tracks that stand side by side: each x with the y that follows it."""
    named = [_named(cell) for cell in header]
    names = [name for name, _ in named]
    starts = [i for i, name in enumerate(names) if name == "x"]
    found = []
    for i, start in enumerate(starts):
        stop = starts[i + 1] if i + 1 < len(starts) else len(names)
        # One track may have its columns in any order; of several, y comes after x.
        y = next((k for k in range(start, stop) if names[k] == "y"), None)
        if y is None and len(starts) == 1:
            y = names.index("y")
        if y is None:
            continue
        cells = {"x": start, "y": y} | ({"t": names.index("t")} if "t" in keys else {})
        titles = above[: stop if len(starts) > 1 else None]
        title = next((cell for cell in reversed(titles) if cell), "").removesuffix(":")
        units = {key: named[cell][1] for key, cell in cells.items()}
        units["t"] = units.get("t") or "s"
        found.append(_Columns(title.lstrip("#").strip(), cells, units, len(header)))
    return found


def _rows(
    source: Path, lines: Sequence[str], header: int, separator: str, columns: _Columns
) -> tuple[list[tuple[float, ...]], list[int], int]:
    """Return time, x and y of each point, their lines, and how many lines have no position.

    Without a column of times, the time is the number of the line of numbers, from 0.
    """
    width, frame = columns.width, -1
    points: list[tuple[float, ...]] = []
    numbers: list[int] = []
    marks: set[str] = set()
    skipped = 0
    for line, text in enumerate(lines[header + 1 :], start=header + 2):
        if not text.strip() or text.lstrip().startswith("#"):
            continue
        place = f"line {line}"
        row = cells_of(text, separator)
        if len(row) > width and any(row[width:]):
            allowed = f"{len(row)} cells under {width} columns"
            if separator == ",":
                allowed += "; with decimal commas, export with tabs or semicolons between cells"
            raise refused(source, place, allowed, text.strip())
        row += [""] * (width - len(row))
        frame += 1
        wanted = {key: row[columns.cells[key]] for key in ("t", "x", "y") if key in columns.cells}
        if any(cell.lower() in _EMPTY for cell in wanted.values()):
            skipped += 1
            continue
        found = []
        for key, cell in wanted.items():
            value = number(cell)
            if value is None or abs(value) > LARGEST:
                allowed = f"must be a number from {-LARGEST:g} to {LARGEST:g}, or empty"
                raise refused(source, f"{place}, column {key}", allowed, cell)
            found.append(value)
        point = tuple(found) if "t" in wanted else (float(frame), *found)
        marks |= {mark for cell in wanted.values() for mark in ".," if mark in cell}
        if len(marks) > 1:
            allowed = (
                "decimal points and decimal commas in one file"
                f" (cells apart by {SEPARATORS[separator]})"
            )
            raise refused(source, place, allowed, text.strip())
        if points and point[0] <= points[-1][0]:
            last = f"{points[-1][0]:g} (line {numbers[-1]})"
            allowed = f"times must increase; the point before has {last}"
            raise refused(source, f"{place}, column t", allowed, point[0])
        points.append(point)
        numbers.append(line)
    return points, numbers, skipped
