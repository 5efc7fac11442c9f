"""``bench``: run time against error, and against the number of particles."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import folder

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence
    from pathlib import Path

    from chutelab.workprecision import Record, Size

CASES = ("transfer", "bounce", "belt", "independent", "interacting", "process")
METHODS = ("exact", "contact", "aligned", "fixed", "plain", "dop853")
MANY = ("independent", "interacting")
STREAMED = ("exact", "contact", "fixed")
"""Methods that are measured against the number of particles."""

REPEATS = 9


@click.command(short_help="Measure run time against error, and draw the diagram.")
@click.argument("cases", metavar="[CASE]...", nargs=-1, type=click.Choice(CASES))
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(METHODS),
    help="Only this method. May be repeated.",
)
@click.option(
    "--repeats",
    metavar="N",
    type=click.IntRange(1, 1000),
    default=REPEATS,
    show_default=True,
    help="Timed runs after the first, at most; fewer of what takes long.",
)
@click.option("--quick", is_flag=True, help="Few values of each parameter: about two minutes.")
@click.option(
    "--scaling",
    is_flag=True,
    help="Measure time and memory against the number of particles instead:"
    " 1 to a million independent, 10 to 3,000 interacting.",
)
@click.option(
    "--out",
    metavar="DIR",
    type=click.Path(),
    callback=folder,
    help="Write work-precision.tsv and .png (scaling.tsv and .png) into this folder.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def bench(
    cases: tuple[str, ...],
    methods: tuple[str, ...],
    repeats: int,
    quick: bool,
    scaling: bool,
    out: Path | None,
    as_json: bool,
) -> None:
    """Measure how long each method takes on each CASE, and how wrong it is.

    \b
    transfer     one particle: belt, plate, landing
    bounce       one particle, until infinitely many bounces are over
    belt         one particle: landing, slip, until the belt grips
    independent  1,000 particles that ignore each other
    interacting  1,000 particles that meet each other
    process      a whole `chutelab run`, beside a bare `import numpy`

    \b
    exact        the event-driven engine
    contact      the contact engine
    aligned      the pymunk engine, steps of a lone particle ending at contacts
    fixed        the pymunk engine, all steps alike (run.align = false)
    plain        Pymunk as most people write it: step, read, repeat
    dop853       SciPy's integrator with events (pip install "chutelab[bench]")

    How to read the diagram: a point is one run with one step or tolerance, further left is more
    accurate, further down is faster, and both axes count powers of ten. A line is a method: where
    it lies lower, take that method for the accuracy you need. A slope of -1 means that ten times
    the accuracy costs ten times the time; a point by itself at the far left has no error left to
    trade.

    Errors are relative to the closed form, the worst of all quantities and machines; of particles
    that meet each other, how deep they overlap. The first run is told apart from the median of the
    repeats (what is over in less than 20 ms runs several times in a row); imports are never timed.
    Memory is the peak of what Python and NumPy allocate.

    Measuring everything takes some minutes.
    """  # noqa: D301 - click wants the backspace
    from chutelab.cli import benchtables, console
    from chutelab.cli.output import destination
    from chutelab.cli.progress import progress
    from chutelab.workprecision import environment

    _judge(cases, methods, scaling=scaling)
    about = environment()
    with destination(out) as folder:
        with progress("measuring") as update:
            if scaling:
                sizes = _sizes(cases, methods, repeats, quick, update)
            else:
                records = _records(cases, methods, repeats, quick, update)
        if folder is not None:
            with progress("drawing"):
                if scaling:
                    _write_sizes(sizes, about, folder)
                else:
                    _write_records(records, about, folder)
    if scaling:
        told = {"sizes": [asdict(one) for one in sizes]}
        parts = list(benchtables.sizes(sizes))
    else:
        from chutelab.workprecision import claims

        said = claims(records)
        told = {
            "records": [asdict(one) for one in records],
            "claims": [asdict(one) for one in said],
        }
        parts = list(benchtables.records(records, said))
    if as_json:
        console.show_json({"format": 1, "environment": about, **told})
        return
    console.show(*parts, benchtables.environment(about))
    if out is not None:
        name = "scaling" if scaling else "work-precision"
        click.echo(f"wrote into {out}: {name}.tsv, {name}.png")


def _judge(cases: Sequence[str], methods: Sequence[str], *, scaling: bool) -> None:
    """Refuse what would measure nothing."""
    if not scaling:
        return
    if wrong := [case for case in cases if case not in MANY]:
        raise click.UsageError(f"--scaling is of {' and '.join(MANY)}, not of {wrong[0]}.")
    if methods and not set(methods) & set(STREAMED):
        raise click.UsageError(f"--scaling measures {', '.join(STREAMED)}, not {methods[0]}.")


def _records(
    cases: Sequence[str],
    methods: Sequence[str],
    repeats: int,
    quick: bool,
    update: Callable[[float], None] | None,
) -> list[Record]:
    from chutelab.workprecision import PROCESS, measure, whole_process

    names = [case for case in CASES if not cases or case in cases]
    chosen = [method for method in METHODS if not methods or method in methods]
    records = measure(
        [name for name in names if name != PROCESS],
        chosen,
        repeats=repeats,
        quick=quick,
        progress=update,
    )
    if PROCESS in names:
        records += whole_process(min(repeats, 3) if quick else repeats)
    return records


def _sizes(
    cases: Sequence[str],
    methods: Sequence[str],
    repeats: int,
    quick: bool,
    update: Callable[[float], None] | None,
) -> list[Size]:
    from chutelab.workprecision import scaling

    names = [case for case in MANY if not cases or case in cases]
    chosen = [method for method in METHODS if not methods or method in methods]
    return scaling(names, chosen, repeats=repeats, quick=quick, progress=update)


def _write_records(records: Sequence[Record], about: Mapping[str, str], folder: Path) -> None:
    from chutelab.plots.workprecision import workprecision
    from chutelab.workprecision import Record, to_tsv

    text = to_tsv(records, Record, about)
    (folder / "work-precision.tsv").write_text(text, encoding="utf-8")
    workprecision(records, about, path=folder / "work-precision.png")


def _write_sizes(sizes: Sequence[Size], about: Mapping[str, str], folder: Path) -> None:
    from chutelab.plots.workprecision import scaling
    from chutelab.workprecision import Size, to_tsv

    (folder / "scaling.tsv").write_text(to_tsv(sizes, Size, about), encoding="utf-8")
    scaling(sizes, about, path=folder / "scaling.png")
