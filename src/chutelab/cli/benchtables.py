"""What ``bench`` measured, as tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from rich.console import RenderableType

    from chutelab.workprecision import Claim, Record, Size


def records(rows: Sequence[Record], said: Sequence[Claim]) -> Iterator[RenderableType]:
    """Return a table for each case of ``bench``, and what follows from them."""
    from rich.text import Text

    from chutelab.workprecision import cases as known

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


def sizes(rows: Sequence[Size]) -> Iterator[RenderableType]:
    """Return a table for each case and method of ``--scaling``, with the fitted exponents."""
    from chutelab.cli.report import plain_table, titled
    from chutelab.workprecision import METHODS as KNOWN
    from chutelab.workprecision.fit import exponent

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


def environment(about: Mapping[str, str]) -> RenderableType:
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
