"""The files of ``--out``: made in a folder of their own, then moved in, all of them or none."""

from __future__ import annotations

import json
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from chutelab.cli.console import progress
from chutelab.cli.parameters import FILMS, KINDS
from chutelab.cli.program import RefusedError
from chutelab.util.tables import plain

if TYPE_CHECKING:
    from chutelab.results import Recording
    from chutelab.studies.accuracy import Accuracy


PICTURES = (".png", ".svg", ".pdf")
"""What pictures may be written as, by suffix."""


@contextmanager
def destination(folder: Path | None, names: Iterable[str] = ()) -> Iterator[Path | None]:
    """Give an empty folder to write to; at the end its files move to `folder`, which is made.

    To be entered before a long run, so that a folder that cannot be written to is refused at once.
    None stays None.

    Parameters
    ----------
    names : iterable of str
        Of files that may be written: none may be the name of a folder in there.

    Raises
    ------
    RefusedError
        If the folder cannot be written to, or is none.
    """
    if folder is None:
        yield None
        return
    try:
        anchor = folder
        while not anchor.exists():
            anchor = anchor.parent
        if not anchor.is_dir():
            raise RefusedError(f"--out {folder}: {anchor} is a file, not a folder")
        for name in names:
            if (folder / name).is_dir():
                raise RefusedError(f"--out {folder}: {folder / name} is a folder, not a file")
        with tempfile.TemporaryDirectory(prefix=".chutelab-", dir=anchor) as unfinished:
            yield Path(unfinished)
            folder.mkdir(parents=True, exist_ok=True)
            for file in sorted(Path(unfinished).iterdir()):
                file.replace(folder / file.name)
    except OSError as error:
        reason = error.strerror or str(error)
        raise RefusedError(f"--out {folder}: cannot be written to: {reason}") from error


def files_of(kinds: Sequence[str]) -> list[str]:
    """Return the names of the files that some of `KINDS` stand for."""
    return [name for kind in kinds for name in KINDS[kind]]


def check_file(option: str, path: Path | None, suffixes: Sequence[str] = ()) -> None:
    """Refuse, before anything runs, a file that cannot be written.

    Parameters
    ----------
    option : str
        What it was given with.
    path : Path or None
        The file; None is no file, which will do.
    suffixes : sequence of str
        Those allowed, with their points; none allows any.

    Raises
    ------
    RefusedError
        If the name ends otherwise, or it is a folder, or is in none.
    """
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise RefusedError(f"{option} {path}: give a name that ends in {' or '.join(suffixes)}")
    if path.is_dir():
        raise RefusedError(f"{option} {path}: it is a folder, not a file")
    if not path.parent.is_dir():
        raise RefusedError(f"{option} {path}: there is no folder {path.parent}")


@contextmanager
def writing(what: str = "", instead: str = "") -> Iterator[None]:
    """Turn a file that cannot be written into a message.

    Parameters
    ----------
    what : str
        What the message calls it; by default what the error does.
    instead : str
        What to give in its place, if something can be given.

    Raises
    ------
    RefusedError
        From an OSError.
    """
    try:
        yield
    except OSError as error:
        name = what or error.filename
        advice = f"; give {instead}" if instead else ""
        said = f"cannot be written: {error.strerror or error}{advice}"
        raise RefusedError(f"{name}: {said}" if name else said) from error


def write(
    recording: Recording,
    folder: Path,
    kinds: Sequence[str],
    *,
    quiet: bool,
    accuracy: Accuracy | None = None,
) -> None:
    """Write the files of the given `KINDS` into an existing folder."""
    for kind in kinds:
        with progress(f"writing {' and '.join(KINDS[kind])}", quiet=quiet):
            if kind in FILMS:
                from chutelab.pictures.animation import animate

                animate(recording, folder / KINDS[kind][0])
            elif kind in ("png", "strobe"):
                from chutelab.pictures import plots

                draw = plots.overlay if kind == "png" else plots.strobe
                draw(recording, path=folder / KINDS[kind][0])
            elif kind == "csv":
                recording.to_csv(folder)
            elif kind == "npz":
                recording.save(folder / KINDS[kind][0])
            else:
                from chutelab.results.summary import summary

                reached = None if accuracy is None else vars(accuracy)
                write_json(summary(recording, reached), folder / KINDS[kind][0])


def write_json(value: Any, path: Path) -> None:
    """Write one JSON object into a file, see `chutelab.util.tables.plain`."""
    path.write_text(json.dumps(plain(value), indent=1, allow_nan=False) + "\n", encoding="utf-8")
