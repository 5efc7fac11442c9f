"""The files of ``--out``: made in a folder of their own, then moved in, all of them or none.

- A recording's summary as tables for people.
"""

from __future__ import annotations

import json
import tempfile
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from rich import box
from rich.console import Group
from rich.table import Table
from rich.text import Text

from chutelab.cli.console import progress
from chutelab.cli.parameters import KINDS
from chutelab.cli.program import RefusedError
from chutelab.machine.releases import Squeeze, Waits, squeeze, waits
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.comparison import compare, scene_of
from chutelab.results.ledger import ledger
from chutelab.results.summary import rolling
from chutelab.studies.accuracy import Accuracy, Wanted
from chutelab.util.tables import Sheet, number, wrapped

if TYPE_CHECKING:
    from rich.console import RenderableType


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
            _write(recording, folder, kind, accuracy)


def _write(recording: Recording, folder: Path, kind: str, accuracy: Accuracy | None) -> None:
    match kind:
        case "png":
            from chutelab.pictures.plots import overlay

            overlay(recording, path=folder / "overlay.png")
        case "strobe":
            from chutelab.pictures.plots import strobe

            strobe(recording, path=folder / "strobe.png")
        case "gif" | "mp4" | "webm":
            from chutelab.pictures.animation import animate

            animate(recording, folder / f"lesson.{kind}")
        case "csv":
            recording.to_csv(folder)
        case "npz":
            recording.save(folder / "recording.npz")
        case "json":
            from chutelab.results.summary import summary

            text = json.dumps(summary(recording, accuracy), indent=1, allow_nan=False)
            (folder / "summary.json").write_text(text + "\n", encoding="utf-8")


STATIONS = 6
"""Contacts of particle 0 that are listed where no theory speaks of them."""


def report(recording: Recording, accuracy: Accuracy | None = None) -> list[RenderableType]:
    """Return what a run leaves to read: particle 0 beside the theory, the ledger, the accuracy."""
    compared = compare(recording).sheet()
    parts: list[RenderableType] = [_head(recording)]
    if compared.rows:
        parts.append(drawn(compared))
    parts += [Text(f"\n{note}") for note in compared.notes]
    if compared.notes and (way := _way(recording)).rows:
        parts.append(drawn(way))
    books = ledger(recording).sheet()
    parts += [drawn(books), Text("\n" + "\n".join(books.notes))]
    if (late := waits(scene_of(recording), recording)) is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_waited(late)))))
    released = recording.select(Kind.RELEASE)
    pressed = squeeze(scene_of(recording), released["t"], released["position"])
    if pressed is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_squeezed(pressed)))))
    if (left := rolling(recording)) is not None:
        parts.append(Text("\n" + "\n".join(wrapped(_rolling(**left)))))
    return parts if accuracy is None else [*parts, _reached(accuracy)]


def _way(recording: Recording) -> Sheet:
    """Return where and when particle 0 touched or left something first, as no theory says it."""
    own = recording.events[recording.events["particle"] == 0]
    own = own[np.isin(own["kind"], [Kind.SEPARATION, Kind.IMPACT, Kind.LANDING])][:STATIONS]
    rows = []
    for event in own:
        name = recording.surfaces[event["surface"]]
        what = "leaves" if event["kind"] == Kind.SEPARATION else "meets"
        numbers = (event["t"], *event["position"], *event["velocity_before"])
        rows.append((f"{what} {name}", *(number(float(value)) for value in numbers)))
    heads = ("", "t, s", "x, m", "y, m", "vx, m/s", "vy, m/s")
    return Sheet("Particle 0, its first contacts", heads, tuple(rows))


def drawn(sheet: Sheet) -> Group:
    """Return the table of a sheet under its title; its notes are left to the caller."""
    table = plain_table(sheet.columns, texts=sheet.texts)
    for row in sheet.rows:
        table.add_row(*row)
    table.add_section()
    for row in sheet.foot:
        table.add_row(*row)
    return titled(sheet.title, table)


def titled(title: str, table: Table) -> Group:
    """Return a table under its title, which may be wider than the table."""
    return Group(Text(f"\n{title}", style="bold"), table)


def plain_table(columns: Sequence[str], *, texts: int = 1, width: int | None = None) -> Table:
    """Return an empty table: `texts` columns of words, then numbers of at least `width`."""
    table = Table(box=box.SIMPLE_HEAD, show_edge=False, pad_edge=False, collapse_padding=True)
    for index, column in enumerate(columns):
        if index < texts:
            table.add_column(column, no_wrap=index == 0)
        else:
            table.add_column(column, justify="right", min_width=width)
    return table


def _head(recording: Recording) -> Text:
    one = recording.count == 1
    counted = Counter(recording.ended.tolist())
    endings = ", ".join(f"{counted[k]} {REASONS[k]}" for k in sorted(counted))
    rounds = "rounds" if recording.engine == "exact" else "steps"
    head = Text(recording.title, style="bold")
    head.append(
        f"\nengine {recording.engine}, {recording.count} particle{'' if one else 's'},"
        f" {recording.contacts} contact{'' if recording.contacts == 1 else 's'},"
        f" {recording.steps} {rounds}, {recording.seconds:.3g} s",
        style="not bold",
    )
    head.append(f"\nended: {endings}", style="not bold")
    return head


def _waited(late: Waits) -> str:
    """Say how many found their place taken, and how long."""
    said = []
    if late.particles:
        waited = "1 particle" if late.particles == 1 else f"{late.particles} particles"
        said.append(
            f"{waited} waited for a free place to be released, {number(late.longest)} s at most"
            f" and {number(late.mean)} s on average"
        )
    if late.never:
        said.append(f"{late.never} found no free place until the end")
    return "; ".join(said) + "."


def _squeezed(pressed: Squeeze) -> str:
    """Say how many ride into each other, how deep and why."""
    return (
        f"{pressed.particles} particles rode into others round the pulley,"
        f" {number(pressed.deepest)} m deep at most: adhesion carries all layers at one speed, the"
        f" lower ones on smaller circles, and v²/(g rho) = {pressed.grip:.3g} keeps the highest"
        " there past the top."
    )


def _rolling(particles: int, belt_work: float, belt_work_carried: float) -> str:
    """Say that free disks roll on the outgoing belt, and what carrying them would have cost."""
    disks = "1 disk rolls" if particles == 1 else f"{particles} disks roll"
    return (
        f"{disks} on the outgoing belt: nothing slips, and nothing is carried along. The belt has"
        f" paid {number(belt_work)} J, loads that are carried take {number(belt_work_carried)} J (a"
        " disk that arrives without turning takes a third of a carried load's work)."
    )


def _reached(accuracy: Accuracy) -> Text:
    """Say how accurate the run is, and how that is known."""
    wanted = Wanted(accuracy.asked, "m" if accuracy.unit == "m" else "relative")
    what = "relative error" if accuracy.unit == "relative" else "error of places"
    if accuracy.reached is None:
        said = f"cannot be told; asked for {wanted}"
    else:
        found = wanted.written(accuracy.reached)
        said = f"about {found} ({accuracy.worst}); asked for {wanted}"
    text = Text("\nAccuracy\n", style="bold")
    line = f"{what} {said}, {'reached' if accuracy.met else 'NOT REACHED'}"
    text.append("\n".join(wrapped(line)), style="not bold")
    how = f"how it is known: {accuracy.method}"
    text.append("\n" + "\n".join(wrapped(how)), style="not bold")
    return text
