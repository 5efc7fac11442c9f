"""``sweep``: many variants of a scene, a row for each."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click
from click.shell_completion import CompletionItem

from chutelab.cli import console
from chutelab.cli.output import PICTURES, check_file
from chutelab.cli.parameters import (
    engine_option,
    file_option,
    jobs_option,
    json_option,
    loaded_as_told,
    scene_argument,
    set_option,
)
from chutelab.cli.program import RefusedError
from chutelab.util.files import write_lines, writing

if TYPE_CHECKING:
    from chutelab.scene import Scene
    from chutelab.studies.design.uncertainty import Uncertainty


def _complete_column(
    _ctx: click.Context, _parameter: click.Parameter, incomplete: str
) -> list[CompletionItem]:
    from chutelab.scene.quantities import COLUMNS

    return [
        CompletionItem(name, help=row.meaning)
        for name, row in COLUMNS.items()
        if name.startswith(incomplete)
    ]


class _Listing(click.Command):
    """A command whose help ends with the columns of a sweep."""

    def format_epilog(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the columns; the registry is loaded for this help only."""
        from chutelab.scene.quantities import COLUMNS
        from chutelab.scene.units import with_unit

        with formatter.section("Columns"):
            formatter.write_dl(
                [(n, with_unit(row.meaning, row.unit)) for n, row in COLUMNS.items()]
            )


@click.command(cls=_Listing, short_help="Simulate many variants of a scene; a row for each.")
@scene_argument
@click.option(
    "--vary",
    "varies",
    metavar="KEY=FROM:TO:COUNT",
    multiple=True,
    help="A key of the scene and its values, such as plate.angle_deg=0:60:61 or"
    " incoming.speed=2,4. May be repeated: all combinations are simulated.",
)
@click.option(
    "--uncertainty",
    "uncertain",
    metavar="KEY=VALUE±SPREAD",
    multiple=True,
    help="Instead of --vary: what is not exactly known, such as plate.restitution=0.5±0.05, where"
    " 0.05 is the standard deviation (with :uniform at the end the half-width). Says how uncertain"
    " that makes landing and belt work, for each kind of outcome, and which key matters most.",
)
@click.option(
    "--sample",
    metavar="N",
    type=int,
    help="Draw N samples from ranges, --vary KEY=FROM:TO, instead of a grid.",
)
@click.option(
    "--design",
    type=click.Choice(["lhs", "sobol"]),
    default="lhs",
    help="How samples are drawn: a Latin hypercube, or Sobol points.",
)
@click.option("--seed", type=int, default=0, help="Seed of the samples.", show_default=True)
@engine_option
@set_option
@file_option("--out", text="Write all rows into this file, .csv or .parquet.")
@click.option(
    "--resume", is_flag=True, help="Go on with an interrupted sweep that was to write this file."
)
@file_option("--plot", text="Draw one or two varied keys into this file: lines, or a heat map.")
@click.option(
    "--of",
    "column",
    metavar="COLUMN",
    default="landing.vx.mean",
    show_default=True,
    shell_complete=_complete_column,
    help="What to draw.",
)
@jobs_option(1, "Spread the work over N processes")
@click.option("--scheduler", metavar="ADDRESS", help="Spread it over a Dask cluster instead.")
@json_option("Print one JSON object with all columns.")
@click.option("--quiet", "-q", is_flag=True, help="Print no summary and no progress bar.")
def sweep(
    scene: str,
    varies: tuple[str, ...],
    uncertain: tuple[str, ...],
    sample: int | None,
    design: str,
    seed: int,
    engine: str | None,
    overrides: tuple[str, ...],
    out: Path | None,
    resume: bool,
    plot: Path | None,
    column: str,
    jobs: int,
    scheduler: str | None,
    as_json: bool,
    quiet: bool,
) -> None:
    """Simulate all variants of SCENE and say what happened in each.

    A variant that is impossible, or misses the outgoing belt, is a row with its reason. Rows that
    are finished are kept beside --out FILE until all are: --resume goes on after an interruption,
    and writes the same file as a sweep that was not interrupted. Rows that were changed meanwhile
    are refused, and so is a file that another sweep is writing.

    Columns are the varied keys, then those below, in SI units, then touches (the surfaces that
    particles meet, in order, up to the landing; bounces in a row on one count once) and reason
    (why there are no numbers, or not all). Maps are hatched where no particle meets the plate.

    With --uncertainty, statistics are also told by what is touched: a stream that misses the plate
    in half of all cases has two kinds of outcome, and their mean may be near to neither.

    What the ledger has is counted up to run.until, which is the landing unless said: a slip that
    goes on after it is not in it. With --set run.until=settled it is, as it always is in belt_work
    and slip_heat, of chutelab solve and with --uncertainty.
    """
    from chutelab.studies.sweep import (
        COLUMNS,
        LostWorkersError,
        crew,
        no_column,
        planned,
        sweep_to,
        swept_by,
    )

    wrote = "\n".join(f"wrote {path}" for path in (out, plot) if path is not None)
    if bool(varies) == bool(uncertain):
        raise click.UsageError("Give either --vary, what to vary, or --uncertainty.")
    if scheduler is not None and jobs != 1:
        raise click.UsageError("--jobs and --scheduler: give one of them.")
    if resume and out is None:
        raise click.UsageError("--resume goes on with the file of --out: give --out too.")
    if uncertain:
        if resume or scheduler is not None or jobs != 1:
            raise click.UsageError("--resume, --jobs and --scheduler go with --vary only.")
        from chutelab.studies.design.uncertainty import as_dict

        loaded = loaded_as_told(scene, overrides, engine)
        spread = _propagated(loaded, uncertain, sample, seed, out, plot, quiet)
        console.tell(as_dict(spread), spread, as_json=as_json, quiet=quiet, wrote=wrote)
        return
    loaded = loaded_as_told(scene, overrides)
    if column not in COLUMNS:
        raise RefusedError(f"--of {no_column(column)}")
    check_file("--plot", plot, PICTURES)
    check_file("--out", out)
    try:
        plan = planned(loaded, varies, sample=sample, design=design, seed=seed, engine=engine)
        varied = sum(len(set(vary.values)) > 1 for vary in plan.varies)
        if plot is not None and varied > 2:
            raise RefusedError(f"--plot draws one or two varied keys, not {varied}")
        what = f"{plan.count:,} variants"
        with (
            _unlogged() if scheduler else nullcontext(),
            crew(jobs, scheduler) as team,
            console.progress(what, quiet=quiet, left=True) as update,
        ):
            if out is None:
                found = swept_by(plan, team, progress=update)
            else:
                found = sweep_to(plan, out, team, resume=resume, progress=update)
    except LostWorkersError as error:
        raise click.ClickException(". ".join(filter(None, (str(error), _kept(out))))) from error
    except KeyboardInterrupt:
        if said := _kept(out):
            console.say(f"\n{said}", err=True)
        raise
    if plot is not None:
        from chutelab.pictures.plots.studies import sweep_figure

        with writing(f"--plot {plot}"):
            sweep_figure(found, column).write(plot)
    told = {"scene": found.title, "variants": len(found), "columns": found.columns}
    console.tell(told, found, as_json=as_json, quiet=quiet, wrote=wrote)


def _propagated(
    scene: Scene,
    given: Sequence[str],
    samples: int | None,
    seed: int,
    out: Path | None,
    plot: Path | None,
    quiet: bool,
) -> Uncertainty:
    """Propagate uncertain inputs; write all samples as CSV, and a picture, where asked for."""
    from chutelab.studies import design
    from chutelab.studies.design.uncertainty import SAMPLES

    check_file("--out", out, (".csv",))
    check_file("--plot", plot, PICTURES)
    count = SAMPLES if samples is None else samples
    with console.progress("propagating", quiet=quiet) as meter:
        found = design.uncertainty(scene, given, samples=count, seed=seed, progress=meter)
    with writing():
        if out is not None:
            write_lines(out, [found.csv()])
        if plot is not None:
            from chutelab.pictures.plots.studies import spread

            spread(found).write(plot)
    return found


@contextmanager
def _unlogged() -> Iterator[None]:
    """Keep Dask from logging tracebacks of what is said in one message here."""
    before = logging.root.manager.disable
    logging.disable()
    try:
        yield
    finally:
        logging.disable(before)


def _kept(out: Path | None) -> str:
    """Say where the finished rows are, if there are some."""
    from chutelab.studies.sweep.part import part_of

    if out is None or not part_of(out).exists():
        return ""
    return f"{part_of(out)} has the finished rows; --resume goes on."
