"""Run time against error, and against the number of particles, beside plain Pymunk and DOP853.

    python benchmarks/work_precision.py --help

Everything takes some minutes, --quick about two. `chutelab bench` does less: the engines on one
scene.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict
from pathlib import Path

import click
from rich.console import RenderableType
from rich.text import Text

import workprecision as wp
from chutelab.checks.workprecision import REPEATS, environment, measured_on
from chutelab.cli.console import progress, show, show_json
from chutelab.cli.options import FolderName, destination
from chutelab.cli.scenes import duration
from chutelab.util.files import tsv_text
from chutelab.util.tables import Sheet
from workprecision import picture
from workprecision.claims import exponent

CASES = (*wp.cases(), wp.PROCESS)
MANY = tuple(wp.RUNS)
STREAMED = tuple(dict.fromkeys(method for runs in wp.RUNS.values() for method in runs))
"""Methods that are measured against the number of particles."""


def record_tables(rows: Sequence[wp.Record], said: Sequence[wp.Claim]) -> Iterator[RenderableType]:
    """Return a table for each case of ``bench``, and what follows from them."""
    titles = {name: (case.title, f"error: {case.error}") for name, case in wp.cases().items()}
    titles["process"] = (
        "Whole process",
        "run: chutelab run perpendicular --json; numpy: python -c 'import numpy'",
    )
    for case in dict.fromkeys(one.case for one in rows):
        title, note = titles[case]
        mine = [one for one in rows if one.case == case]
        yield _table(title, mine, crowd=case == "interacting")
        failed = [
            f"{one.method} failed{_at(one, ' at ')}: {one.failed}" for one in mine if one.failed
        ]
        yield Text("\n".join([note, *failed]), style="italic")
    if said:
        yield Text("\nWhat the rows say", style="bold")
        yield Text("\n".join(f"{claim.case}: {claim.sentence}" for claim in said))


def _table(title: str, rows: Sequence[wp.Record], *, crowd: bool) -> RenderableType:
    beside = ["worst", "residual", "shift"] if crowd else ["of", "runs"]
    cells = []
    for one, before in zip(rows, [None, *rows], strict=False):
        last = [_digits(one.overlap), _digits(one.residual), _length(one.place_shift)]
        if not crowd:
            last = [one.quantity, "" if one.median is None else str(one.repeats)]
        row = (
            "" if before is not None and before.method == one.method else one.method,
            _at(one),
            duration(one.first),
            duration(one.median),
            "failed" if one.failed else _digits(one.error),
            _bytes(one.memory),
            *last,
        )
        cells.append(row)
    heads = ("method", "at", "first", "median", "error", "memory", *beside)
    return Sheet(title, heads, tuple(cells))


def _at(one: wp.Record, lead: str = "") -> str:
    """Return the parameter of a record, "" without one."""
    return "" if one.value is None else f"{lead}{one.parameter} {one.value:.0e}"


def _digits(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _length(value: float | None) -> str:
    return "" if value is None else f"{1e3 * value:.3g} mm"


def size_tables(rows: Sequence[wp.Size]) -> Iterator[RenderableType]:
    """Return a table for each case and method of ``--scaling``, with the fitted exponents."""
    for case, method in dict.fromkeys((one.case, one.method) for one in rows):
        cells = []
        for one in rows:
            if (one.case, one.method) != (case, method):
                continue
            each = one.median / one.events if one.median and one.events else None
            row = (
                f"{one.particles:,}",
                "" if one.events is None else f"{one.events:,}",
                duration(one.first),
                duration(one.median),
                str(one.repeats) if one.median is not None else "",
                duration(each),
                _bytes(one.memory),
                one.failed,
            )
            cells.append(row)
        powers = (exponent(rows, case, method, what) for what in ("median", "memory"))
        fitted = ", ".join(
            f"{name} ∝ N^{power:.2f}"
            for name, power in zip(("time", "memory"), powers, strict=True)
            if power is not None
        )
        title = f"{case.capitalize()}, {wp.METHODS[method].title}: {fitted or 'too few'}"
        heads = ("particles", "events", "first", "median", "runs", "an event", "memory", "")
        yield Sheet(title, heads, tuple(cells), texts=0, tail=1)


def _bytes(size: int | None) -> str:
    if size is None:
        return ""
    value: float = size
    for unit in ("B", "kB", "MB"):
        if value < 999.5:
            return f"{value:.3g} {unit}"
        value /= 1e3
    return f"{value:.3g} GB"


@click.command
@click.argument("cases", metavar="[CASE]...", nargs=-1, type=click.Choice(CASES))
@click.option(
    "--method",
    "methods",
    multiple=True,
    type=click.Choice(list(wp.METHODS)),
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
    type=FolderName(),
    help="Write work-precision.tsv and .png (scaling.tsv and .png) into this folder.",
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of tables.")
def main(
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
    """
    if scaling:
        _judge(cases, methods)
    names = [name for name in (MANY if scaling else CASES) if not cases or name in cases]
    chosen = [method for method in wp.METHODS if not methods or method in methods]
    about = environment()
    name = "scaling" if scaling else "work-precision"
    with destination(out) as into:
        with progress("measuring") as update:
            if scaling:
                rows = wp.scaling(names, chosen, repeats=repeats, quick=quick, progress=update)
            else:
                rows = _records(names, chosen, repeats, quick=quick, progress=update)
        if into is not None:
            text = tsv_text(rows, wp.Size if scaling else wp.Record, about)
            (into / f"{name}.tsv").write_text(text, encoding="utf-8")
            draw = picture.scaling if scaling else picture.workprecision
            draw(rows, about).write(into / f"{name}.png")
    said = [] if scaling else wp.claims(rows)
    if as_json:
        told = {"sizes" if scaling else "records": [asdict(one) for one in rows]}
        if not scaling:
            told["claims"] = [asdict(one) for one in said]
        show_json({"format": 1, "environment": about, **told})
        return
    show(
        *(size_tables(rows) if scaling else record_tables(rows, said)),
        Text(f"\n{measured_on(about)}"),
    )
    if out is not None:
        click.echo(f"wrote into {out}: {name}.tsv, {name}.png")


def _judge(cases: Sequence[str], methods: Sequence[str]) -> None:
    """Refuse what --scaling would not measure."""
    if wrong := [case for case in cases if case not in MANY]:
        raise click.UsageError(f"--scaling is of {' and '.join(MANY)}, not of {wrong[0]}.")
    if methods and not set(methods) & set(STREAMED):
        raise click.UsageError(f"--scaling measures {', '.join(STREAMED)}, not {methods[0]}.")


def _records(
    names: Sequence[str],
    methods: Sequence[str],
    repeats: int,
    *,
    quick: bool,
    progress: Callable[[float], None] | None,
) -> list[wp.Record]:
    timed = [name for name in names if name != wp.PROCESS]
    records = wp.measure(timed, methods, repeats=repeats, quick=quick, progress=progress)
    if wp.PROCESS in names:
        records += wp.whole_process(min(repeats, 3) if quick else repeats)
    return records


if __name__ == "__main__":
    main()
