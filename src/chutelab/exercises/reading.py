"""What a student handed over: a number, nothing yet, or something to be kind about."""

from __future__ import annotations

import re
from math import isinf, isnan
from typing import Any

import numpy as np

_NUMBER = re.compile(r"\s*([-+−]?\d*[.,]?\d+(?:[eE][-+−]?\d+)?)\s*(.*)", re.DOTALL)
_LONGEST = 40
"""Characters of a student's text that are shown back."""


class Unreadable(Exception):  # noqa: N818 - nothing went wrong, it is only no number
    """Something that is not one number; its text says what to do."""


def number_of(answer: object) -> float | None:
    """Return the number that an answer is, None if nothing was attempted.

    Raises
    ------
    Unreadable
        If it is something else, with a kind text.
    """
    try:
        return _read(answer)
    except Unreadable:
        raise
    except OverflowError:
        raise Unreadable("That is infinite, or nearly so. Was something multiplied?") from None
    except Exception:  # a student's object may raise anything
        kind = type(answer).__name__[:_LONGEST]
        raise Unreadable(f"That is a {kind}, and one number is asked for.") from None


def _read(answer: Any) -> float | None:
    if answer is None or answer is Ellipsis:
        return None
    if isinstance(answer, (bool, np.bool_)):
        raise Unreadable(
            f"That is {bool(answer)}, the result of a comparison. A number is asked for."
        )
    if isinstance(answer, (str, bytes)):
        return _text(answer if isinstance(answer, str) else answer.decode("utf-8", "replace"))
    if isinstance(answer, (complex, np.complexfloating)) and not isinstance(answer, float):
        raise Unreadable(
            "That is a complex number. Was there the square root of something negative?"
        )
    if isinstance(answer, (list, tuple, np.ndarray)):
        return _several(answer)
    if callable(answer):
        raise Unreadable(
            "That is a function, not its result. Call it, with its numbers in parentheses."
        )
    return _finite(float(answer))


def _finite(value: float) -> float:
    if isnan(value):
        raise Unreadable(
            "That is NaN, not a number: somewhere on the way something had no answer, such as the"
            " arccos of more than 1 or 0 / 0. Print the steps one by one."
        )
    if isinf(value):
        raise Unreadable("That is infinite. Was something divided by zero?")
    return value


def _several(answer: Any) -> float | None:
    items = answer.ravel().tolist() if isinstance(answer, np.ndarray) else list(answer)
    if len(items) > 1:
        raise Unreadable(
            f"Those are {len(items)} values, and one number is asked for. Pick it, with [0] say."
        )
    return _read(items[0]) if items else None


def _text(text: str) -> float | None:
    if not text.strip(" \t\n.?…_-"):
        return None
    found = _NUMBER.match(text)
    if found is None:
        short = text.strip()[:_LONGEST]
        raise Unreadable(f"That is text (“{short}”). Give a number, without quotes.")
    bare = found[1].replace(",", ".").replace("−", "-")[:_LONGEST]
    if found[2].strip():
        raise Unreadable(
            "That is text with a unit in it. Give the number alone, without quotes and unit, in the"
            " unit that is asked for."
        )
    raise Unreadable(f"That is text. Give the number without quotes: {bare}.")
