"""What commands leave: files of ``--out``, all of them or none, and a recording's summary."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.shell_completion import CompletionItem

from chutelab.cli.console import progress, say, show, show_json
from chutelab.cli.parameters import json_option, out_option
from chutelab.cli.program import RefusedError
from chutelab.util.files import check, refuse_other, together, writing
from chutelab.util.tables import plain, wrapped

if TYPE_CHECKING:
    from rich.console import RenderableType

    from chutelab.results import Recording
    from chutelab.studies.accuracy import Accuracy

PICTURES = (".png", ".svg", ".pdf")
"""What pictures may be written as, by suffix."""

KINDS = {
    "png": ("overlay.png",),
    "gif": ("lesson.gif",),
    "csv": ("events.csv", "trajectory.csv"),
    "npz": ("recording.npz",),
    "json": ("summary.json",),
    "mp4": ("lesson.mp4",),
    "webm": ("lesson.webm",),
    "strobe": ("strobe.png",),
}
"""What ``--only`` takes, and the files it stands for."""

FILMS = ("gif", "mp4", "webm")
"""Those that are the lesson picture; ``--format`` chooses one."""

USUAL = ("png", "gif", "csv", "npz", "json")
"""Those that are written unless ``--only`` chooses."""

MOST_EVENTS, EVENT = 100_000, 240
"""Rows and bytes a row, about: of more events.csv is left out unless ``--only`` asks for it."""


@contextmanager
def destination(folder: Path | None, names: Iterable[str] = ()) -> Iterator[Path | None]:
    """Give an empty folder to write to; at the end its files move to `folder`, which is made.

    To be entered before a long run: refused at once is what cannot be written to, is no folder, or
    has folders in it that are called like the files, `names`. None stays None.
    """
    if folder is None:
        yield None
        return
    try:
        for name in names:
            refuse_other(folder / name)
        with together(folder) as unfinished:
            yield unfinished
    except OSError as error:
        named = Path(error.filename or folder)
        if named not in (folder, *folder.parents) and folder not in named.parents:
            raise
        reason = error.strerror or str(error)
        raise RefusedError(f"--out {folder}: cannot be written to: {reason}") from error


def check_file(option: str, path: Path | None, suffixes: Sequence[str] = ()) -> None:
    """Refuse, before anything runs, the file of an option if it cannot be written.

    So if it does not end in one of `suffixes`, if there are some.
    """
    if path is None:
        return
    if suffixes and path.suffix.lower() not in suffixes:
        raise RefusedError(f"{option} {path}: give a name that ends in {' or '.join(suffixes)}")
    with writing(f"{option} {path}".strip()):
        check(path)


@dataclass(frozen=True)
class Output:
    """What ``run`` and ``show`` leave of a recording, see `output_options`."""

    out: Path | None  # folder of the files; None writes nothing
    kinds: tuple[str, ...]  # which of `KINDS`
    chosen: bool  # by ``--only``
    as_json: bool
    quiet: bool  # no bar, and no summary but as JSON
    details: bool  # engine, steps, and errors down to rounding

    @property
    def files(self) -> list[str]:
        """Names of the files."""
        return [name for kind in self.kinds for name in KINDS[kind]]

    def leaves_out(self, recording: Recording) -> bool:
        """Tell whether there are so many events that events.csv is not written unasked."""
        return "csv" in self.kinds and not self.chosen and len(recording.events) > MOST_EVENTS

    def write(self, recording: Recording, folder: Path, accuracy: Accuracy | None = None) -> None:
        """Write the files into an existing folder."""
        for kind in self.kinds:
            path = folder / KINDS[kind][0]
            with progress(f"writing {' and '.join(KINDS[kind])}", quiet=self.quiet):
                if kind in FILMS:
                    from chutelab.pictures.animation import animate

                    animate(recording, path)
                elif kind in ("png", "strobe"):
                    from chutelab.pictures import plots

                    if kind == "png":
                        plots.overlay(recording, path=path, details=self.details)
                    else:
                        plots.strobe(recording, path=path)
                elif kind == "csv":
                    tables = ("events", "trajectory")[self.leaves_out(recording) :]
                    recording.to_csv(folder, only=tables)
                elif kind == "npz":
                    recording.save(path)
                else:
                    # Only what is printed tells how long it took: the same run, the same file.
                    write_json({**_summary(recording, accuracy), "seconds": None}, path)

    def tell(self, recording: Recording, accuracy: Accuracy | None = None) -> None:
        """Print the summary, what was written, and what was left out."""
        left_out = self.leaves_out(recording)
        if self.as_json:
            show_json(_summary(recording, accuracy))
        elif not self.quiet:
            show(*_report(recording, accuracy, details=self.details))
            if self.out is not None:
                files = [name for name in self.files if name != "events.csv" or not left_out]
                say(f"wrote into {self.out}: {', '.join(files)}")
        if recording.laws and (self.as_json or self.quiet):
            say("\n".join(map(str, recording.laws)), err=True)
        if self.out is not None and left_out and not self.quiet:
            many, kept = len(recording.events), self.out / "recording.npz"
            say(
                f"events.csv is left out: {many:,} events, about {many * EVENT / 1e6:.0f} MB;"
                f" chutelab show {kept} --out {self.out} --only csv writes it",
                err=self.as_json,
            )
        if self.out is not None and "csv" in self.kinds and not self.quiet:
            from chutelab.results import storage

            if (few := storage.instants(recording)) < storage.SAMPLES:
                say(
                    f"trajectory.csv has {few} instants, not {storage.SAMPLES}: with more it would"
                    f" have over {storage.MOST_ROWS:,} rows",
                    err=self.as_json,
                )

    def end(self, recording: Recording) -> None:
        """End the command with exit code 1 if the run broke a law."""
        if recording.laws:
            click.get_current_context().exit(1)


def _report(
    recording: Recording, accuracy: Accuracy | None, *, details: bool
) -> list[RenderableType]:
    """Return what a run leaves to read: particle 0 beside the theory, the ledger, the accuracy.

    With `details` also the engine and its steps, and errors down to rounding.
    """
    from rich.text import Text

    from chutelab.results.summary import facts, sheets
    from chutelab.studies.accuracy import written

    head = Text(recording.title, style="bold")
    head.append(f"\n{facts(recording, details=details)}", style="not bold")
    parts: list[RenderableType] = [head, *sheets(recording, details=details)]
    if accuracy is not None:
        what = "relative error" if accuracy.unit == "relative" else "error of places"
        said = "cannot be told"
        if accuracy.reached is not None:
            said = f"about {written(accuracy.reached, accuracy.unit)} ({accuracy.worst})"
        met = "reached" if accuracy.met else "NOT REACHED"
        found = wrapped(f"{what} {said}; asked for {written(accuracy.asked, accuracy.unit)}, {met}")
        how = wrapped(f"how it is known: {accuracy.method}")
        parts += [Text("\nAccuracy", style="bold"), Text("\n".join([*found, *how]))]
    return parts


def _summary(recording: Recording, accuracy: Accuracy | None) -> dict[str, Any]:
    from chutelab.results.summary import summary

    return summary(recording, None if accuracy is None else vars(accuracy))


def _complete_kinds(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    """Offer `KINDS` after the last comma."""
    before, comma, begun = incomplete.rpartition(",")
    return [CompletionItem(f"{before}{comma}{kind}") for kind in KINDS if kind.startswith(begun)]


def _kinds(
    _ctx: click.Context, _parameter: click.Parameter, values: tuple[str, ...]
) -> tuple[str, ...] | None:
    if not values:
        return None
    asked = {kind.strip().lower() for value in values for kind in value.split(",")}
    if asked - KINDS.keys():
        raise click.BadParameter(f"{','.join(values)!r}: choose from {','.join(KINDS)}")
    return tuple(kind for kind in KINDS if kind in asked)


def output_options(command: Callable[..., None]) -> Callable[..., None]:
    """Add ``--out``, ``--only``, ``--format``, ``--details``, ``--json``, ``--quiet``: an `Output`.

    Refused are ``--only`` and ``--format`` where nothing is written, ``--format`` where there is no
    film, and a film that cannot be written here.
    """

    @out_option("Write pictures, tables and the recording into this folder.")
    @click.option(
        "--only",
        metavar="KINDS",
        multiple=True,
        callback=_kinds,
        shell_complete=_complete_kinds,
        help=f"With --out: only some of {','.join(KINDS)}; without, the first"
        f" {len(USUAL)}, but no events.csv of more than {MOST_EVENTS:,} events. May be repeated.",
    )
    @click.option(
        "--format",
        "film",
        type=click.Choice(FILMS),
        help="With --out: the lesson picture as this instead of a GIF; mp4 and webm need the"
        " extra chutelab[video].",
    )
    @click.option(
        "--details",
        is_flag=True,
        help="For experts: engine and steps, errors and residuals down to rounding, in the summary"
        " and in overlay.png; of a crowd particle 0, too.",
    )
    @json_option("Print one JSON object instead of tables.")
    @click.option("--quiet", "-q", is_flag=True, help="Print no summary and no progress bar.")
    @wraps(command)
    def told(
        out: Path | None,
        only: tuple[str, ...] | None,
        film: str | None,
        details: bool,
        as_json: bool,
        quiet: bool,
        **others: Any,
    ) -> None:
        if out is None:
            for option, given in (("--only chooses among", only), ("--format is for one of", film)):
                if given is not None:
                    raise click.UsageError(f"{option} the files of --out DIR: give --out too.")
        kinds = USUAL if only is None else only
        if film is not None:
            if not set(kinds) & set(FILMS):
                raise click.UsageError(
                    f"--format {film} is for the lesson picture, which --only {','.join(kinds)}"
                    " leaves out: add gif to --only."
                )
            kinds = tuple(kind for kind in KINDS if kind == film or kind in set(kinds) - set(FILMS))
        for kind in {"mp4", "webm"}.intersection(kinds):
            from chutelab.pictures.animation import need_video

            need_video(kind)
        command(**others, output=Output(out, kinds, only is not None, as_json, quiet, details))

    return told


def write_json(value: Any, path: Path) -> None:
    """Write one JSON object into a file, see `chutelab.util.tables.plain`."""
    path.write_text(json.dumps(plain(value), indent=1, allow_nan=False) + "\n", encoding="utf-8")
