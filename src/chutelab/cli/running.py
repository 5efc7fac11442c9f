"""``run``, ``show``, ``report``, ``live``: one scene simulated, a recording, a report, a page."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import inf, isfinite
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Annotated, Any, Literal

import click
from click.shell_completion import CompletionItem

from chutelab.cli.console import RefusedError, progress, say, show_json, tell
from chutelab.cli.console import show as show_parts
from chutelab.cli.options import (
    Coefficient,
    Count,
    Engine,
    FileName,
    Folder,
    Jobs,
    Repeat,
    SceneName,
    Seconds,
    Texts,
    check_file,
    command,
    destination,
    loaded_as_told,
    write_json,
)
from chutelab.util.errors import InputError
from chutelab.util.files import write_lines, writing
from chutelab.util.tables import wrapped

if TYPE_CHECKING:
    from rich.console import RenderableType

    from chutelab.results import Recording
    from chutelab.scene import Scene
    from chutelab.studies.accuracy import Accuracy, Wanted

KINDS = {
    "png": ("overlay.png",),
    "gif": ("lesson.gif",),
    "csv": ("events.csv", "trajectory.csv"),
    "npz": ("recording.npz",),
    "json": ("summary.json",),
    "mp4": ("lesson.mp4",),
    "webm": ("lesson.webm",),
    "strobe": ("strobe.png",),
    "sensors": ("sensors.csv", "sensors.png"),
    "loads": ("loads.csv", "loads.png"),
    "wear": ("wear.csv", "wear.png"),
}
"""The kinds that ``--only`` takes, and their files."""

LOADS = 0.01
"""s; bins of loads if ``--only`` asks for them and nothing gives their width."""

FILMS = ("gif", "mp4", "webm")
"""Kinds of the lesson picture; ``--format`` chooses one."""

PICTURED = {*FILMS, "png", "strobe", "sensors", "loads", "wear"}
"""Kinds that are drawn."""

USUAL = ("png", "gif", "csv", "npz", "json")
"""Kinds that are written without ``--only``."""

MOST_EVENTS, EVENT = 100_000, 240
"""Rows, and bytes per row (about): a longer events.csv is written only if ``--only`` asks for
it."""


def complete_kinds(incomplete: str) -> list[CompletionItem]:
    """Offer `KINDS` after the last comma."""
    before, comma, begun = incomplete.rpartition(",")
    return [CompletionItem(f"{before}{comma}{kind}") for kind in KINDS if kind.startswith(begun)]


@dataclass(kw_only=True)
class Output:
    """Output of ``run`` and ``show`` for a recording.

    ``--only`` and ``--format`` are refused if nothing is written, ``--format`` if there is no film,
    and a film that cannot be written here.

    --out DIR  Write pictures, tables and the recording into this folder.
    --only KINDS  With --out: write only some of
        png,gif,csv,npz,json,mp4,webm,strobe,sensors,loads,wear. The default is the first 5, without
        events.csv if it has more than 100,000 events. May be repeated.
    --format  With --out: write the animation in this format instead of as a GIF; mp4 and webm need
        the extra chutelab[video].
    --erosion K  With --only wear: Finnie's k, m³/J; wear.csv then has volumes in erosion_m3.
    --abrasion K  With --only wear: Archard's K/H, 1/Pa; wear.csv then has volumes in abrasion_m3.
    --no-energy  With --out: the animation without the energy ledger; the machine is larger.
    --dark  With --out: pictures and animation on a dark background, for a dark slide or page.
    --language  With --out: the language of pictures and animation. Names that the scene gives stay
        as they are, and so do titles, except those of shipped scenes. [default]
    --details  For experts: engine and steps, errors and residuals down to rounding, in the summary
        and in overlay.png; for many particles also particle 0.
    -q, --quiet  Print no summary and no progress bar.
    """

    out: Folder
    only: Annotated[Texts, complete_kinds]
    format_: Literal["gif", "mp4", "webm"] | None
    erosion: Coefficient
    abrasion: Coefficient
    no_energy: bool
    dark: bool
    details: bool
    json_: bool
    quiet: bool
    language: Literal["en", "de"] = "en"
    kinds: tuple[str, ...] = field(init=False)  # which of `KINDS`
    coefficients: dict[str, float] = field(init=False)  # coefficients of wear, if given

    def __post_init__(self) -> None:
        chosen = {kind.strip().lower() for value in self.only for kind in value.split(",")}
        if chosen - KINDS.keys():
            said = f"{','.join(self.only)!r}: choose from {','.join(KINDS)}"
            raise click.BadParameter(said, param_hint="'--only'")
        if self.out is None and (self.only or self.format_):
            option = "--only chooses among" if self.only else "--format is for one of"
            raise click.UsageError(f"{option} the files of --out DIR: give --out too.")
        kinds = tuple(kind for kind in KINDS if kind in (chosen or USUAL))
        if self.no_energy and (self.out is None or not {*FILMS}.intersection(kinds)):
            raise click.UsageError(
                "--no-energy is for the lesson picture: give --out DIR, with gif."
            )
        option = "--dark" if self.dark else f"--language {self.language}"
        looks = self.dark or self.language != "en"
        if looks and (self.out is None or not PICTURED.intersection(kinds)):
            pictures = ", ".join(kind for kind in KINDS if kind in PICTURED)
            raise click.UsageError(f"{option} is for pictures: give --out DIR, with {pictures}.")
        given = {"erosion": self.erosion, "abrasion": self.abrasion}
        self.coefficients = {key: k for key, k in given.items() if k is not None}
        for key in self.coefficients:
            if self.out is None or "wear" not in kinds:
                raise click.UsageError(f"--{key} is for wear.csv: give --out DIR, with wear.")
        if self.format_ is not None:
            others = set(kinds) - set(FILMS)
            if len(others) == len(kinds):
                raise click.UsageError(
                    f"--format {self.format_} is for the lesson picture, which --only"
                    f" {','.join(kinds)} leaves out: add gif to --only."
                )
            kinds = tuple(kind for kind in KINDS if kind == self.format_ or kind in others)
        self.kinds = kinds
        for kind in {"mp4", "webm"}.intersection(kinds):
            from chutelab.pictures.animation import need_video

            need_video(kind)

    @property
    def files(self) -> list[str]:
        """Names of the files."""
        return [name for kind in self.kinds for name in KINDS[kind]]

    def leaves_out(self, recording: Recording) -> bool:
        """Whether there are so many events that events.csv is written only on request."""
        return "csv" in self.kinds and not self.only and len(recording.events) > MOST_EVENTS

    def write(self, recording: Recording, folder: Path, accuracy: Accuracy | None = None) -> None:
        """Write the files into an existing folder."""
        if not PICTURED.intersection(self.kinds):
            self._write(recording, folder, accuracy)
            return
        from chutelab.pictures.plots import look

        with look(dark=self.dark, language=self.language):
            self._write(recording, folder, accuracy)

    def _write(self, recording: Recording, folder: Path, accuracy: Accuracy | None) -> None:
        for kind in self.kinds:
            path = folder / KINDS[kind][0]
            with progress(f"writing {' and '.join(KINDS[kind])}", quiet=self.quiet):
                if kind in FILMS:
                    from chutelab.pictures.animation import animate

                    animate(recording, path, energy=not self.no_energy)
                elif kind in ("png", "strobe"):
                    from chutelab.pictures import plots

                    if kind == "png":
                        plots.overlay(recording, path=path, details=self.details)
                    else:
                        plots.strobe(recording, path=path)
                elif kind == "csv":
                    tables = ("events", "trajectory")[self.leaves_out(recording) :]
                    recording.to_csv(folder, only=tables)
                elif kind in ("sensors", "loads", "wear"):
                    from chutelab.pictures.plots import measures

                    recording.to_csv(folder, only=[kind], coefficients=self.coefficients)
                    getattr(measures, kind)(recording).write(folder / f"{kind}.png")
                elif kind == "npz":
                    recording.save(path)
                else:
                    # The file has no computing time, so that the same run gives the same file.
                    write_json({**_summary(recording, accuracy), "seconds": None}, path)

    def tell(self, recording: Recording, accuracy: Accuracy | None = None) -> None:
        """Print the summary, what was written, and what was left out."""
        left_out = self.leaves_out(recording)
        if self.json_:
            show_json(_summary(recording, accuracy))
        elif not self.quiet:
            show_parts(*_report(recording, accuracy, details=self.details))
            if self.out is not None:
                files = [name for name in self.files if name != "events.csv" or not left_out]
                say(f"wrote into {self.out}: {', '.join(files)}")
        if recording.laws and (self.json_ or self.quiet):
            say("\n".join(map(str, recording.laws)), err=True)
        if self.out is not None and left_out and not self.quiet:
            many, kept = len(recording.events), self.out / "recording.npz"
            say(
                f"events.csv is left out: {many:,} events, about {many * EVENT / 1e6:.0f} MB;"
                f" chutelab show {kept} --out {self.out} --only csv writes it",
                err=self.json_,
            )
        if self.out is not None and "csv" in self.kinds and not self.quiet:
            from chutelab.results import storage

            if (few := storage.instants(recording)) < storage.SAMPLES:
                say(
                    f"trajectory.csv has {few} instants, not {storage.SAMPLES}: with more it would"
                    f" have over {storage.MOST_ROWS:,} rows",
                    err=self.json_,
                )

    def end(self, recording: Recording) -> None:
        """End the command with exit code 1 if the run broke a law."""
        if recording.laws:
            click.get_current_context().exit(1)


def _report(
    recording: Recording, accuracy: Accuracy | None, *, details: bool
) -> list[RenderableType]:
    """Return the report of a run: particle 0 beside the theory, the ledger, the accuracy.

    With `details` also the engine and its steps, and errors down to rounding.
    """
    from rich.text import Text

    from chutelab.results.summary import facts, sheets

    head = Text(recording.title, style="bold")
    head.append(f"\n{facts(recording, details=details)}", style="not bold")
    parts: list[RenderableType] = [head, *sheets(recording, details=details)]
    if accuracy is not None:
        from chutelab.studies.accuracy import written

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


@command("Simulate a scene and print a summary; write its files.")
def run(
    scene: SceneName,
    *,
    engine: Engine,
    dt: float | None,
    accuracy: str | None,
    max_seconds: Seconds | None,
    loads: float | None,
    set_: Texts,
    output: Output,
    partial: bool,
    repeat: Repeat | None,
    jobs: Jobs = 1,
) -> None:
    """Simulate SCENE, a scene file or the name of a shipped one, and print a summary.

    Without --out nothing is written. With --accuracy, --engine still chooses the engine, and --dt
    is the longest step that is tried. If the accuracy cannot be reached, results are printed and
    written all the same, and the exit code is 1.

    Every run is checked: numbers are finite, nothing is inside a surface or passes one, energy
    rises only by drives, no loss is negative, the ledger closes. If a run breaks a law, the summary
    and the files say so, and the exit code is 1. But if neither the scene nor --engine names an
    engine, another one runs instead, if it keeps the laws, and the summary says so.

    After --max-seconds the run stops, with exit code 0: summary and files have what was recorded
    until then, and particles that were still moving end as "stopped". Ctrl-C stops a run in the
    same way, with exit code 130; files are written if --out is given.

    With --repeat the scene runs with N seeds, and each quantity is a mean ± its standard error.
    --out then writes repeats.csv (a row for each seed), repeats.png and repeats.json. After
    --max-seconds, or Ctrl-C, no further seed begins.

    chutelab run stream --repeat 12 --jobs 0

    --accuracy A  Choose engine and step so that errors are at most this: relative, such as 1e-6, or
        a length, such as 1mm. The summary says which accuracy was reached.
    --max-seconds S  Stop the simulation after S seconds and keep what is recorded; the summary says
        so.
    --loads S  Record the load on each surface, in bins of S seconds: same as --set run.loads=S.
        Without it, --only loads uses 0.01 s.
    --partial  With --out: if the run gets stuck, write what was recorded until then.
    """
    from chutelab.engines.simulation import judged
    from chutelab.results import Recording
    from chutelab.results.recorder import StalledError

    wanted: Wanted | None = None
    if accuracy is not None:
        from chutelab.studies.accuracy import parse, reach, written

        try:
            wanted = parse(accuracy)
        except InputError as error:
            raise click.BadParameter(str(error), param_hint="'--accuracy'") from error
    if repeat is not None and (partial or accuracy or output.only or output.format_):
        raise click.UsageError(
            "--repeat tells many runs by their numbers: --accuracy, --partial, --only and --format"
            " are for one."
        )
    if jobs != 1 and repeat is None:
        raise click.UsageError("--jobs spreads the runs of --repeat N: give --repeat too.")
    if partial and output.out is None:
        raise click.UsageError("--partial keeps files of --out DIR: give --out too.")
    if max_seconds is not None and accuracy is not None:
        raise click.UsageError("--max-seconds ends one run, --accuracy makes several: give one.")
    if max_seconds is not None and not isfinite(max_seconds):
        raise click.UsageError(f"--max-seconds {max_seconds}: a finite number above 0 s.")
    began = perf_counter()
    loaded = loaded_as_told(scene, set_, engine, dt, loads)
    if "loads" in output.kinds and loaded.run.loads is None:
        loaded = loaded_as_told(scene, set_, engine, dt, LOADS)
    if "sensors" in output.kinds:
        from chutelab.results.sensors import need_sensors

        need_sensors(loaded)
    if max_seconds is not None:
        # The time limit includes reading the scene.
        max_seconds = max(max_seconds - (perf_counter() - began), 1e-9)
    if repeat is not None:
        _repeated(loaded, repeat, jobs, max_seconds, output)
        return
    reached: Accuracy | None = None
    stuck, interrupted = "", None
    with destination(output.out, output.files) as folder:
        try:
            with progress("simulating", quiet=output.quiet, left=True) as update:
                if wanted is None:
                    recording = judged(loaded, progress=update, max_seconds=max_seconds)
                else:
                    recording, reached = reach(loaded, wanted, update)
        except StalledError as stalled:
            kept = (
                "" if partial else "; add --out DIR --partial to keep what was recorded until then"
            )
            if kept or stalled.recording is None:
                raise click.ClickException(f"{stalled}{kept}") from stalled
            recording = Recording.of(stalled.recording)
            stuck = f"{stalled}; what is written ends there"
        except KeyboardInterrupt as error:
            if folder is None or not hasattr(error, "recording"):
                raise
            recording, interrupted = error.recording, error
            say(f"Interrupted: what was recorded is written to {output.out}.", err=True)
        if folder is not None:
            output.write(recording, folder, reached)
    if interrupted is not None:
        raise interrupted
    output.tell(recording, reached)
    if reached is not None and not reached.met:
        best = "how much was, cannot be told"
        if reached.reached is not None:
            best = f"{written(reached.reached, reached.unit)} was"
        stuck = f"the accuracy of {wanted} was not reached; {best}"
    if stuck:
        raise click.ClickException(stuck)
    output.end(recording)


REPEATED = ("repeats.csv", "repeats.png", "repeats.json")


def _repeated(
    scene: Scene, count: int, jobs: int, max_seconds: float | None, output: Output
) -> None:
    """Run a scene with many seeds; exit with 1 if some runs have no reliable numbers."""
    from chutelab.studies.repeats import repeat

    interrupted = None
    with destination(output.out, REPEATED) as folder:
        with progress(f"simulating {count} seeds", quiet=output.quiet, left=True) as update:
            limit = inf if max_seconds is None else max_seconds
            try:
                found = repeat(scene, count, jobs=jobs, max_seconds=limit, progress=update)
            except KeyboardInterrupt as error:
                if not hasattr(error, "repeats"):
                    raise
                found, interrupted = error.repeats, error
        if folder is not None:
            from chutelab.pictures.plots import look
            from chutelab.pictures.plots.studies import repeats

            write_lines(folder / REPEATED[0], [found.csv()])
            with look(dark=output.dark, language=output.language):
                repeats(found).write(folder / REPEATED[1])
            write_json(found.as_dict(), folder / REPEATED[2])
    wrote = f"wrote into {output.out}: {', '.join(REPEATED)}" if output.out else ""
    tell(found.as_dict(), found, as_json=output.json_, quiet=output.quiet, wrote=wrote)
    if interrupted is not None:
        raise interrupted
    if found.faults:
        click.get_current_context().exit(1)


@command("Print the summary of a recording.npz; make its files again.")
def show(recording: Path, *, output: Output) -> None:
    """Print the summary of RECORDING, a recording.npz; with --out make its files again."""
    from chutelab.results import Recording
    from chutelab.results.storage import RecordingError

    try:
        loaded = Recording.load(recording)
    except RecordingError as error:
        from chutelab.scene import shipped

        meant = ""
        if (inside := recording / KINDS["npz"][0]).is_file():
            meant = f"; did you mean {inside}?"
        elif recording.suffix == ".toml" or str(recording) in shipped():
            meant = f"; show takes a recording.npz; for a scene: chutelab run {recording}"
        raise RefusedError(f"{error}{meant}") from error
    with destination(output.out, output.files) as folder:
        if folder is not None:
            output.write(loaded, folder)
    output.tell(loaded)
    output.end(loaded)


@command("Open a scene as a live page, in which parts can be dragged.")
def live(
    scene: SceneName = "",
    *,
    set_: Texts,
    out: Path | None,
    language: Literal["en", "de"] = "en",
    quiet: bool,
) -> None:
    """Show SCENE as a live page: drag the plate, and path, numbers and ledger follow.

    Without SCENE the page is an empty picture with parts to build a machine from, and examples. The
    page cannot show mass points, and boxes and polygons with features that only the pymunk engine
    has for them; it then says what is left out, and shows the rest.

    The page is one HTML file with the contact engine in it, the same as in `chutelab run --engine
    contact`. Any browser opens it, from a memory stick or on a phone, without installation or
    network. An existing file is replaced. Without -o the page opens in your browser; if there is
    no browser, the command prints where the page is, with exit code 1.

    What the page offers is the [live] table of the scene: predict = true hides path and numbers
    until the learner has set a flag; controls, panels, ranges and presets say what can be changed
    and what is shown.

    chutelab live
    chutelab live inclined-40
    chutelab live inclined-40 --language de -o lab.html
    chutelab live perpendicular --set live.predict=true -o predict.html

    -o, --out, --output FILE  The file to write, such as lab.html; default: one in a temporary
        folder, which is then opened in the browser.
    --language  The language of the page; texts of the scene stay as they are. [default]
    -q, --quiet  Print nothing.
    """
    import webbrowser
    from tempfile import mkdtemp

    from chutelab.pictures.live import write

    check_file("-o", out)
    if set_ and not scene:
        raise click.UsageError("--set needs a SCENE")
    loaded = loaded_as_told(scene, set_) if scene else None
    name = f"{Path(scene).name.removesuffix('.toml') or 'machine'}.html"
    path = Path(mkdtemp(prefix="chutelab-")) / name if out is None else out
    with writing(str(path)):
        size = write(loaded, path, language=language, partly=True)
    if out is None and not webbrowser.open(path.absolute().as_uri()):
        raise click.ClickException(f"no browser could be opened; the page is {path}")
    if not quiet:
        done = "opened" if out is None else "wrote"
        say(f"{done} {path}, {size / 1000:.0f} kB")


@command("Write a report on a scene: two to four pages for a client, or a lab report's skeleton.")
def report(
    scene: SceneName,
    *,
    set_: Texts,
    engine: Engine,
    out: Annotated[Path, FileName(path_type=Path)],
    view: Literal["engineer", "teacher"] = "engineer",
    language: Literal["en", "de"] = "en",
    repeat: Annotated[int, Count(1, 1000)] = 1,
    quiet: bool,
) -> None:
    """Run SCENE and write a report: FILE.pdf or FILE.html, and its tables as CSV beside it.

    The engineer's view: the machine to scale, inputs with their sources, assumptions and what they
    leave out, results, the stream's envelope, loads, power beside ISO 5048 and DIN 22101, wear,
    sensitivities, and how to make it again. The teacher's view: the skeleton of a lab report, with
    empty boxes for the student. Tables go to FILE-tables/.

    chutelab report inclined-40 -o report.pdf
    chutelab report stream --repeat 5 -o report.html
    chutelab report perpendicular --view teacher -o lab.pdf

    -o, --out, --output FILE  The file to write, .pdf or .html; a PDF needs pip install
        "chutelab[pdf]". [required]
    --view VIEW  For whom: engineer or teacher. [default]
    --language LANGUAGE  The language of the teacher's view, en or de; the engineer's view is in
        English. [default]
    --repeat N  Results as mean ± standard error over N seeds. [default]
    -q, --quiet  Print nothing.
    """
    import shlex

    from chutelab.classroom import report as reports

    check_file("-o", out, (".pdf", ".html"))
    reports.check(out)
    loaded = loaded_as_told(scene, set_)
    options = [
        *(f"--set {shlex.quote(one)}" for one in set_),
        *[f"--engine {engine}"] * bool(engine),
    ]
    if language != "en" and view != "teacher":
        raise click.UsageError(f"--language {language} is for --view teacher.")
    options += [f"--view {view}"] * (view != "engineer") + [f"--repeat {repeat}"] * (repeat > 1)
    again = " ".join(["chutelab report", shlex.quote(scene), *options, f"-o {out.name}"])
    with progress("simulating", quiet=quiet):
        made = reports.report(
            loaded, view=view, runs=repeat, engine=engine, command=again, language=language
        )
    with progress("writing", quiet=quiet), writing(str(out)):
        files = made.write(out)
    if not quiet:
        say(f"wrote {out}, and {len(files) - 1} tables into {out.stem}-tables")
    if made.recording.laws:
        click.get_current_context().exit(1)
