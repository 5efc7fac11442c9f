"""What the measured rows say, in sentences; every number is computed from the rows."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from chutelab.workprecision.fit import points, time_at
from chutelab.workprecision.methods import METHODS
from chutelab.workprecision.process import COMMANDS, PROCESS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.workprecision.records import Record

EQUAL_ERROR = 1e-4
"""The error at which methods are compared: a tenth of a millimetre in a metre."""

USUAL_STEP = 1e-3
"""s; the step of plain Pymunk with which exact and contact are compared, whatever its error."""

PAIRS = (
    ("exact", "plain"), ("contact", "plain"), ("aligned", "plain"),
    ("exact", "dop853"), ("contact", "dop853"),
)  # fmt: skip
"""Which methods are compared."""

RIGID = 0.01
"""Overlap in radii at which methods are compared on a crowd."""


@dataclass(frozen=True)
class Claim:
    """A sentence about a case, and the number in it.

    Attributes
    ----------
    case : str
        Which case.
    sentence : str
        For people.
    value : float or None
        The ratio of two times, above 1 where the first method is the faster one; seconds for the
        whole process; None where there is nothing to compare.
    """

    case: str
    sentence: str
    value: float | None


def claims(records: Sequence[Record]) -> list[Claim]:
    """Return what can be said of these rows; nothing about what was not measured."""
    cases = list(dict.fromkeys(one.case for one in records))
    found: list[Claim] = []
    for case in cases:
        if case == PROCESS:
            found += _whole_process(records)
            continue
        error = RIGID if case == "interacting" else EQUAL_ERROR
        for fast, slow in PAIRS:
            found += _at_equal_error(records, case, fast, slow, error)
        for method in ("exact", "contact"):
            found += _at_the_usual_step(records, case, method)
    return found


def _at_equal_error(
    records: Sequence[Record], case: str, fast: str, slow: str, error: float
) -> Iterator[Claim]:
    pair = [points(records, case, method) for method in (fast, slow)]
    if not all(pair):
        return
    times = [time_at(xy, error) for xy in pair]
    name, other = METHODS[fast].title, METHODS[slow].title
    what = f"an overlap of {error:g} r" if case == "interacting" else f"an error of {error:g}"
    if times[0] is None:
        best, time = min(pair[0])
        yield Claim(
            case, f"{name} does not reach {what}: at best {best:.1e}, in {_time(time)}", None
        )
    elif times[1] is None:
        best, time = min(pair[1])
        yield Claim(
            case,
            f"{other} does not reach {what}: at best {best:.1e}, in {_time(time)};"
            f" {name} does in {_time(times[0])}",
            None,
        )
    else:
        ratio = times[1] / times[0]
        yield Claim(
            case,
            f"at {what} {name} is {_faster(ratio)} {other}: {_time(times[0])}, {_time(times[1])}",
            ratio,
        )


def _at_the_usual_step(records: Sequence[Record], case: str, method: str) -> Iterator[Claim]:
    def usual(name: str) -> Record | None:
        """Return a method's run with that step, or its only one."""
        for one in records:
            if (one.case, one.method) == (case, name) and one.value in (None, USUAL_STEP):
                return one
        return None

    mine, plain = usual(method), usual("plain")
    if mine is None or plain is None or not mine.median or not plain.median:
        return
    if mine.error is None or plain.error is None:
        return
    ratio = plain.median / mine.median
    yield Claim(
        case,
        f"{method}, with an error of {mine.error:.0e}, is {_faster(ratio)} plain Pymunk at dt ="
        f" {USUAL_STEP:g} s, with one of {plain.error:.0e}",
        ratio,
    )


def _whole_process(records: Sequence[Record]) -> Iterator[Claim]:
    times = {one.method: one.median for one in records if one.case == PROCESS}
    run, bare = (times.get(method) for method in COMMANDS)
    if run is not None and bare is not None:
        yield Claim(
            PROCESS,
            f"a whole `chutelab run perpendicular --json` takes {_time(run)},"
            f" {_time(run - bare)} more than importing NumPy",
            run - bare,
        )


def _faster(ratio: float) -> str:
    if ratio >= 1.0:
        return f"{_figure(ratio)} times faster than"
    return f"{_figure(1.0 / ratio)} times slower than"


def _figure(ratio: float) -> str:
    """Return two digits: timings are not worth more."""
    return f"{float(f'{ratio:.1e}'):,.1f}" if ratio < 10.0 else f"{float(f'{ratio:.1e}'):,.0f}"


def _time(seconds: float) -> str:
    for unit, factor in (("s", 1.0), ("ms", 1e3)):
        if abs(seconds) * factor >= 1.0:
            return f"{seconds * factor:.3g} {unit}"
    return f"{seconds * 1e6:.3g} µs"
