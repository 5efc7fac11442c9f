"""Results as a table: the worst of each run, tab-separated text, plain values for JSON."""

from __future__ import annotations

from dataclasses import asdict, dataclass, fields
from itertools import groupby
from math import inf, isfinite
from typing import TYPE_CHECKING, Any

from chutelab.files import whole
from chutelab.stress.harness import Result

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence
    from pathlib import Path


@dataclass(frozen=True)
class Run:
    """All laws of one case on one engine at one step.

    Attributes
    ----------
    worst : Result
        The law that comes nearest to its bound, or goes furthest beyond it.
    failed : tuple of Result
        The laws that are broken.
    kept : int
        How many are kept.
    laws : int
        How many it was judged by.
    """

    worst: Result
    failed: tuple[Result, ...]
    kept: int
    laws: int


def exhausted(result: Result) -> float:
    """Return how much of its bound a figure uses up: 1 is the limit, above it the law is broken."""
    if result.figure is None or result.bound is None:
        return 0.0 if result.holds else inf
    part, whole_ = (result.bound, result.figure) if result.least else (result.figure, result.bound)
    if whole_ > 0.0:
        return part / whole_
    return 0.0 if result.holds else inf


def runs(results: Iterable[Result]) -> Iterator[Run]:
    """Gather the results of each run, which follow each other."""
    for _, group in groupby(results, key=lambda r: (r.case, r.engine, r.dt)):
        laws = list(group)
        failed = tuple(law for law in laws if law.broken)
        kept = [law for law in laws if law.holds]
        yield Run(max(failed or kept or laws, key=exhausted), failed, len(kept), len(laws))


def plain(result: Result) -> dict[str, Any]:
    """Return a result as JSON has it: what is no finite number is null."""
    return {
        key: None if isinstance(value, float) and not isfinite(value) else value
        for key, value in asdict(result).items()
    }


def write(results: Sequence[Result], path: str | Path) -> None:
    """Write one line a result, with a header, whole or not at all."""
    names = [field.name for field in fields(Result)]
    with whole(path) as unfinished, unfinished.open("w", encoding="utf-8") as file:
        file.write("\t".join(names) + "\n")
        for result in results:
            file.write("\t".join(_cell(getattr(result, name)) for name in names) + "\n")


def _cell(value: object) -> str:
    if value is None:
        return ""
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())
