"""What was probably meant by a name that nothing has."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable


def did_you_mean(
    word: str, known: Iterable[str], otherwise: str, *, most: int = 1, cutoff: float = 0.6
) -> str:
    """Ask for the names that are most like a word, up to `most`; say something else if none is.

    >>> did_you_mean("hod", ["hood", "floor"], "there are hood, floor")
    'did you mean hood?'
    >>> did_you_mean("x", ["hood", "floor"], "there are hood, floor")
    'there are hood, floor'
    """
    near = difflib.get_close_matches(word, list(known), n=most, cutoff=cutoff)
    return f"did you mean {' or '.join(near)}?" if near else otherwise
