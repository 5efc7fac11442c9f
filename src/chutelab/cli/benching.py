"""``bench``: run time against error, and against the number of particles, as tables."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from chutelab.cli.parameters import folder

if TYPE_CHECKING:
    from rich.console import RenderableType

    from chutelab.checks.workprecision import Claim, Record, Size


def record_tables(rows: Sequence[Record], said: Sequence[Claim]) -> Iterator[RenderableType]:
    """Return a table for each case of ``bench``, and what follows from them."""
    from rich.text import Text

    from chutelab.checks.workprecision import cases as known

    titles = {name: (case.title, f"error: {case.error}") for name, case in known().items()}
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


def _table(title: str, rows: Sequence[Record], *, crowd: bool) -> RenderableType:
    from chutelab.cli.report import plain_table, titled

    beside = ["worst", "residual", "shift"] if crowd else ["of", "runs"]
    table = plain_table(["method", "at", "first", "median", "error", "memory", *beside])
    for column in table.columns:
        column.no_wrap = True
    for one, before in zip(rows, [None, *rows], strict=False):
        last = [_digits(one.overlap), _digits(one.residual), _length(one.place_shift)]
        if not crowd:
            last = [one.quantity, "" if one.median is None else str(one.repeats)]
        table.add_row(
            "" if before is not None and before.method == one.method else one.method,
            _at(one),
            _time(one.first),
            _time(one.median),
            "failed" if one.failed else _digits(one.error),
            _bytes(one.memory),
            *last,
        )
    return titled(title, table)


def _at(one: Record, lead: str = "") -> str:
    """Return the parameter of a record, "" without one."""
    return "" if one.value is None else f"{lead}{one.parameter} {one.value:.0e}"


def _digits(value: float | None) -> str:
    return "" if value is None else f"{value:.1e}"


def _length(value: float | None) -> str:
    return "" if value is None else f"{1e3 * value:.3g} mm"


def size_tables(rows: Sequence[Size]) -> Iterator[RenderableType]:
    """Return a table for each case and method of ``--scaling``, with the fitted exponents."""
    from chutelab.checks.workprecision import METHODS as KNOWN
    from chutelab.checks.workprecision.claims import exponent
    from chutelab.cli.report import plain_table, titled

    for case, method in dict.fromkeys((one.case, one.method) for one in rows):
        table = plain_table(
            ["particles", "events", "first", "median", "runs", "an event", "memory", ""], texts=0
        )
        for one in rows:
            if (one.case, one.method) != (case, method):
                continue
            each = one.median / one.events if one.median and one.events else None
            table.add_row(
                f"{one.particles:,}",
                "" if one.events is None else f"{one.events:,}",
                _time(one.first),
                _time(one.median),
                str(one.repeats) if one.median is not None else "",
                _time(each),
                _bytes(one.memory),
                one.failed,
            )
        powers = (exponent(rows, case, method, what) for what in ("median", "memory"))
        fitted = ", ".join(
            f"{name} ∝ N^{power:.2f}"
            for name, power in zip(("time", "memory"), powers, strict=True)
            if power is not None
        )
        yield titled(f"{case.capitalize()}, {KNOWN[method].title}: {fitted or 'too few'}", table)


def environment_table(about: Mapping[str, str]) -> RenderableType:
    """Return the line that says where it was measured."""
    from rich.text import Text

    return Text(
        "\nmeasured on " + ", ".join(f"{key} {value}" for key, value in about.items()),
        style="italic",
    )


def _time(seconds: float | None) -> str:
    if seconds is None:
        return ""
    for unit, factor in (("s", 1.0), ("ms", 1e3), ("µs", 1e6)):
        if seconds * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e9:.0f} ns"


def _bytes(size: int | None) -> str:
    if size is None:
        return ""
    value: float = size
    for unit in ("B", "kB", "MB"):
        if value < 999.5:
            return f"{value:.3g} {unit}"
        value /= 1e3
    return f"{value:.3g} GB"


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
    from chutelab.cli import console
    from chutelab.cli.console import progress
    from chutelab.cli.output import destination
    from chutelab.util.versions import environment

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
        parts = list(size_tables(sizes))
    else:
        from chutelab.checks.workprecision import claims

        said = claims(records)
        told = {
            "records": [asdict(one) for one in records],
            "claims": [asdict(one) for one in said],
        }
        parts = list(record_tables(records, said))
    if as_json:
        console.show_json({"format": 1, "environment": about, **told})
        return
    console.show(*parts, environment_table(about))
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
    from chutelab.checks.workprecision import PROCESS, measure, whole_process

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
    from chutelab.checks.workprecision import scaling

    names = [case for case in MANY if not cases or case in cases]
    chosen = [method for method in METHODS if not methods or method in methods]
    return scaling(names, chosen, repeats=repeats, quick=quick, progress=update)


def _write_records(records: Sequence[Record], about: Mapping[str, str], folder: Path) -> None:
    from chutelab.checks.workprecision import Record, to_tsv
    from chutelab.pictures.plots.workprecision import workprecision

    text = to_tsv(records, Record, about)
    (folder / "work-precision.tsv").write_text(text, encoding="utf-8")
    workprecision(records, about, path=folder / "work-precision.png")


def _write_sizes(sizes: Sequence[Size], about: Mapping[str, str], folder: Path) -> None:
    from chutelab.checks.workprecision import Size, to_tsv
    from chutelab.pictures.plots.workprecision import scaling

    (folder / "scaling.tsv").write_text(to_tsv(sizes, Size, about), encoding="utf-8")
    scaling(sizes, about, path=folder / "scaling.png")
