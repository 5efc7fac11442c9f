"""All cases, and how they are chosen."""

from __future__ import annotations

from difflib import get_close_matches
from fnmatch import fnmatch
from typing import TYPE_CHECKING

from chutelab.stress import drawn, extremes, geometry, lasting, symmetric

if TYPE_CHECKING:
    from collections.abc import Collection

    from chutelab.stress.case import Case


def cases(*, full: bool = False) -> tuple[Case, ...]:
    """Return the quick set, or all."""
    found = (
        *extremes.CASES,
        *geometry.CASES,
        *lasting.cases(),
        *symmetric.cases(),
        *drawn.cases(),
    )
    return found if full else tuple(case for case in found if not case.full)


def chosen(names: Collection[str], *, full: bool = False) -> tuple[Case, ...]:
    """Return the cases whose names match one of some patterns (``*`` for anything).

    A case that is named is run, whether it is one of the quick set or not.

    Raises
    ------
    ValueError
        If a pattern matches nothing.
    """
    if not names:
        return cases(full=full)
    known = cases(full=True)
    for pattern in names:
        if not any(_matches(case, pattern) for case in known):
            near = get_close_matches(pattern, [case.name for case in known], n=3)
            advice = f"did you mean {' or '.join(near)}? " if near else ""
            raise ValueError(
                f"no case is called {pattern!r}; {advice}chutelab stress --full --list"
                f" names all {len(known)}, and * stands for anything"
            )
    return tuple(c for c in known if any(_matches(c, pattern) for pattern in names))


def _matches(case: Case, pattern: str) -> bool:
    return case.name == pattern or fnmatch(case.name, pattern)
