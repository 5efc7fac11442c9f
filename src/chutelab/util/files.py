"""Files that are written whole or not at all; tables in them; versions of packages.

It does not import NumPy, so that commands without it start at once.
"""

from __future__ import annotations

import csv
import os
import re
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import fields
from errno import EINVAL, EISDIR, ENOENT, ENOTDIR
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final

from chutelab.util.errors import InputError, installed, printable
from chutelab.util.signals import held

_ASIDE: Final = ".chutelab-unfinished-"
"""Beginning of the names of folders in which files are made before they are moved to their
place."""

_OLD: Final = 3600.0
"""s after which a folder that no process holds counts as left over by a killed program."""


@contextmanager
def aside(folder: Path, target: Path | None = None) -> Iterator[Path]:
    """Give an empty folder for files that will be moved to `folder`; removed at the end.

    It is inside `folder`, or its nearest existing parent, so that a move is an atomic rename. Enter
    it before long work, since a folder that cannot be written to is refused at once. KILL and power
    cuts leave it behind; the next one in the same place removes it, see `_remove_left_over`.

    Raises an `OSError`; for a file in here, or without a name, it has the name of `target`, by
    default `folder`.
    """
    import shutil
    import tempfile

    made = ""
    try:
        anchor = next((path for path in (folder, *folder.parents) if path.exists()), folder)
        if not anchor.is_dir():
            raise NotADirectoryError(ENOTDIR, f"{anchor} is a file, not a folder", str(folder))
        # Left-over folders of killed programs are old and their lock is free. Not on Windows.
        for path in anchor.glob(f"{_ASIDE}????????"):
            with suppress(OSError):
                if time.time() - path.lstat().st_mtime > _OLD and not path.is_symlink():
                    with _held(path) as free:
                        if free:
                            shutil.rmtree(path)
        with tempfile.TemporaryDirectory(prefix=_ASIDE, dir=anchor) as made, _held(Path(made)):
            yield Path(made)
    except OSError as error:
        names = [str(name) for name in (error.filename, error.filename2) if name is not None]
        if not names or any(_ASIDE in name for name in names):
            raise OSError(
                error.errno, error.strerror or str(error), str(target or folder)
            ) from error
        raise


@contextmanager
def together(folder: Path) -> Iterator[Path]:
    """Give an empty folder to make files and folders in; at the end its files move to `folder`.

    `folder` is made if necessary; other files in it stay. A signal waits until all have moved.

    Raises an `OSError` like `aside`, or if something that is not a file is in the place of one;
    then none is moved.
    """
    with aside(folder) as made:
        yield made
        files = sorted(path.relative_to(made) for path in made.rglob("*") if path.is_file())
        for file in files:
            refuse_other(folder / file)
        with held():
            folder.mkdir(parents=True, exist_ok=True)
            for file in files:
                target = folder / file
                target.parent.mkdir(parents=True, exist_ok=True)
                (made / file).replace(target)


def first_bytes(path: Path, most: int) -> bytes:
    """Read a file, up to one byte more than `most`, so that larger ones are noticed.

    A named pipe is refused, since perhaps no process ever writes to it.
    """
    if path.is_fifo() and Path(os.path.realpath(path)).exists():
        raise OSError(EINVAL, "it is a pipe, not a file", str(path))
    with path.open("rb") as file:
        return file.read(most + 1)


@contextmanager
def _held(folder: Path) -> Iterator[bool]:
    """Lock a folder until the process ends, in whatever way; return whether it was free."""
    try:
        import fcntl
    except ImportError:  # Windows
        yield False
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:  # another process holds it, or the file system has no locks
            yield False
        else:
            yield True
    finally:
        os.close(descriptor)


@contextmanager
def whole(path: str | Path) -> Iterator[Path]:
    """Give a path to write to; it becomes `path` at the end, or is removed after an exception.

    If `path` is a link, its target is written. Only files are replaced: a rename would replace a
    device, such as /dev/null, or a pipe by a file.
    """
    with _beside(Path(path)) as unfinished:
        yield unfinished
        unfinished.replace(os.path.realpath(path))


def check(path: str | Path) -> None:
    """Raise the OSError that `whole` would raise at once; write nothing."""
    with _beside(Path(path)):
        pass


@contextmanager
def writing(what: object = "", instead: str = "") -> Iterator[None]:
    """Turn the OSError of a file that cannot be written into an `InputError`.

    It calls the file `what`, by default as in the error, and says what to give `instead`. If an
    error names two files, as in copying, the second is the one that is written.
    """
    try:
        yield
    except OSError as error:
        name = str(what or error.filename2 or error.filename or "")
        advice = f"; give {instead}" if instead else ""
        said = f"cannot be written: {error.strerror or error}{advice}"
        raise InputError(said, file=name) from error


def refuse_other(path: Path) -> None:
    """Raise an OSError if something other than a file is there."""
    if path.is_dir():
        raise IsADirectoryError(EISDIR, f"{path} is a folder, not a file", str(path))
    if path.exists() and not path.is_file():
        raise OSError(EINVAL, f"{path} is a device or a pipe, not a file", str(path))


@contextmanager
def _beside(path: Path) -> Iterator[Path]:
    refuse_other(path)
    real = Path(os.path.realpath(path))
    if not real.parent.exists():
        raise FileNotFoundError(ENOENT, f"there is no folder {path.parent}", str(path))
    with aside(real.parent, path) as folder:
        yield folder / real.name


_FORMULA: Final = r"((?:\A|[;\t\r\n])[\s\"']*)({}[=+\-@\uff1d\uff0b\uff0d\uff20])"
"""Text that a spreadsheet takes for a formula, at the start of a cell, or after a semicolon or tab
that may separate cells; the last four are the =, +, - and @ of Japanese keyboards."""

_BARE: Final = re.compile(_FORMULA.format(""))
_QUOTED: Final = re.compile(_FORMULA.format("'"))


def harmless(cell: object) -> object:
    """Return a cell with a quote before text that a spreadsheet would take for a formula.

    Numbers stay as they are, also those given as text.

    >>> harmless("=1+1"), harmless("a;=1+1"), harmless("-0.5"), harmless(-0.5)
    ("'=1+1", "a;'=1+1", '-0.5', -0.5)
    """
    if not isinstance(cell, str) or not cell:
        return cell
    try:
        float(cell)
    except ValueError:
        return _BARE.sub(r"\1'\2", cell)
    return cell


def unquoted(cell: str) -> str:
    """Return the text from which `harmless` made this cell."""
    return _QUOTED.sub(lambda found: found[1] + found[2].removeprefix("'"), cell)


def csv_lines(
    rows: Iterable[Iterable[object]], *, separator: str = ",", decimal: str = ".", end: str = "\n"
) -> Iterator[str]:
    r"""Yield rows as lines of CSV, cells quoted where they must be.

    None is an empty cell, numbers keep all bits; no text is a formula, see `harmless`.

    >>> list(csv_lines([("t", "what"), (0.1, "a, b"), (1, None)]))
    ['t,what\n', '0.1,"a, b"\n', '1,\n']
    """
    # `writerow` returns what `write` does: the line.
    # Cells are quoted only for line ends that the writer uses itself, so it uses both.
    out = csv.writer(SimpleNamespace(write=str), delimiter=separator, lineterminator="\r\n")

    def cell(value: object) -> object:
        is_number = isinstance(value, float) and decimal != "."
        return str(value).replace(".", decimal) if is_number else harmless(value)

    return (out.writerow(map(cell, row)).removesuffix("\r\n") + end for row in rows)


def write_lines(path: str | Path, texts: Iterable[str], *, errors: str = "strict") -> Path:
    """Write lines, each with its end, to a UTF-8 file, whole or not at all."""
    with (
        whole(path) as unfinished,
        unfinished.open("w", encoding="utf-8", errors=errors, newline="") as file,
    ):
        file.writelines(texts)
    return Path(path)


def csv_text(columns: Mapping[str, Any]) -> str:
    """Return named columns, arrays of one length, as CSV; see `csv_columns`."""
    return "".join(csv_lines([columns])) + csv_columns(columns.values())


def csv_columns(columns: Iterable[Any]) -> str:
    r"""Return columns, arrays of one length of floats or of objects, as the lines of CSV.

    Numbers have the fewest digits that keep all bits, whole ones no point; NaN is an empty cell.
    Columns of other objects are written by `csv_lines`.

    >>> import numpy as np
    >>> csv_columns([np.array([0.1, 2.0, np.nan]), np.array(["a", "=b", "a"], dtype=object)])
    "0.1,a\n2,'=b\n,a\n"
    """
    # Imported here, as that takes a while; it writes shortest digits in a seventh of the time of
    # `repr`.
    from pydantic_core import to_json

    cells, known = [], dict[bytes, list[str]]()
    for column in columns:
        values = column.tolist()
        if column.dtype.kind != "f":
            # After another cell, as a line of one empty cell is written with quotes.
            each = {one: next(csv_lines([(None, one)]))[1:-1] for one in dict.fromkeys(values)}
            cells.append([each[one] for one in values])
            continue
        # Several columns may have the same numbers, and digits take the most time.
        bits = column.tobytes()
        if bits not in known:
            text = to_json(values).decode()[1:-1].replace("Infinity", "inf") + ","
            known[bits] = text.replace(".0,", ",").replace("NaN,", ",").split(",")[:-1]
        cells.append(known[bits])
    return "".join([f"{line}\n" for line in map(",".join, zip(*cells, strict=True))])


def tsv_text(rows: Sequence[object], kind: type, about: Mapping[str, str]) -> str:
    """Return rows of a dataclass as tab-separated values.

    Lines ``# key: value`` with the origin of the figures come first, then the names of the columns.
    """
    names = [field.name for field in fields(kind)]
    cells = [[getattr(row, name) for name in names] for row in rows]
    head = "".join(f"# {key}: {printable(value)}\n" for key, value in about.items())
    return head + "".join(csv_lines([names, *cells], separator="\t"))


def version_of(package: str) -> str | None:
    """Return the version of a package; None if it is not installed.

    >>> version_of("no such package") is None
    True
    """
    version, _ = installed().get(package.lower(), (None, None))
    return version


def own_version() -> str:
    """Return chutelab's version, if it is known."""
    return version_of("chutelab") or "unknown (not installed)"
