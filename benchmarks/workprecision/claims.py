"""What the measured rows say, in sentences; every number is computed from the rows.

Slopes, exponents and times at an error come from lines through points on logarithmic axes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import exp, log

import numpy as np

from workprecision.measure import COMMANDS, PROCESS
from workprecision.methods import METHODS
from workprecision.records import Record, Size

Point = tuple[float, float]

ROUNDING = 1e-13
"""Errors below this are rounding: they do not follow the parameter any more."""

LEAST_SPAN = 3.0
"""Ratio of the largest to the smallest of the abscissae that a line is fitted through."""

SHARE = 0.5
"""Part of the sizes, the largest ones, to which an exponent is fitted; overheads rule the rest."""


def points(records: Sequence[Record], case: str, method: str) -> list[Point]:
    """Return (error, median time) of a method's runs that succeeded."""
    return [
        (one.error, one.median)
        for one in records
        if (one.case, one.method) == (case, method)
        and one.error is not None
        and one.median is not None
    ]


def slope(xy: Sequence[Point]) -> float | None:
    """Return the exponent p of y ∝ x^p by least squares in the logarithms.

    None through fewer than two points, or where x spans less than `LEAST_SPAN`.
    """
    if len(xy) < 2:
        return None
    x, y = np.array(xy, dtype=np.float64).T
    if x.min() <= 0.0 or x.max() < LEAST_SPAN * x.min():
        return None
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def work_slope(records: Sequence[Record], case: str, method: str) -> float | None:
    """Return p of time ∝ error^p: -1 where ten times the accuracy costs ten times the time."""
    return slope([(e, t) for e, t in points(records, case, method) if e > ROUNDING])


def order(records: Sequence[Record], case: str, method: str) -> float | None:
    """Return the order p of a method in a case: error ∝ parameter^p."""
    return slope(
        [
            (one.value, one.error)
            for one in records
            if (one.case, one.method) == (case, method)
            and one.value is not None
            and one.error is not None
            and one.error > ROUNDING
        ]
    )


def exponent(sizes: Sequence[Size], case: str, method: str, what: str = "median") -> float | None:
    """Return p of time (or memory) ∝ particles^p, fitted to the larger `SHARE` of the sizes."""
    xy = sorted(
        (float(one.particles), float(getattr(one, what)))
        for one in sizes
        if (one.case, one.method) == (case, method) and getattr(one, what) is not None
    )
    return slope(xy[-max(2, round(SHARE * len(xy))) :])


def time_at(xy: Sequence[Point], error: float) -> float | None:
    """Return the time (s) in which an error is reached; None if it never is.

    Only points count that no other beats in both; between two neighbours the line is straight on
    logarithmic axes. Where even the fastest point is better, its time is the answer.
    """
    front: list[Point] = []
    for e, t in sorted(xy, key=lambda point: (point[1], point[0])):
        if not front or e < front[-1][0]:
            front.append((e, t))
    if not front or front[-1][0] > error:
        return None
    if front[0][0] <= error:
        return front[0][1]
    after = next(k for k, (e, _) in enumerate(front) if e <= error)
    (e0, t0), (e1, t1) = front[after - 1], front[after]
    # An error of 0 has no logarithm; smaller than the smallest rounding it makes no difference.
    low = max(e1, 1e-300)
    share = (log(error) - log(e0)) / (log(low) - log(e0))
    return exp(log(t0) + share * (log(t1) - log(t0)))


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
