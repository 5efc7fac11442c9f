"""What is asked for and cannot be done, and the packages without which nothing can."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


class Keyed(Protocol):
    """Something said of one key of a scene."""

    @property
    def key(self) -> str:
        """Full path of the key."""


T = TypeVar("T", bound=Keyed)


class DesignError(ValueError):
    """A question that makes no sense for the scene; says what was typed, and what is allowed."""

    def __init__(self, typed: str, allowed: str) -> None:
        super().__init__(f"{typed}: {allowed}")


def each_once(
    option: str, texts: Sequence[str], read: Callable[[str], T], ask: str, most: int
) -> tuple[T, ...]:
    """Read what an option takes, given 1 to `most` times, once for each key.

    Raises
    ------
    DesignError
        If it is not given, too often, or twice for one key; and what `read` raises.
    """
    if not texts:
        raise DesignError(option, ask)
    if len(texts) > most:
        raise DesignError(f"{option} {texts[most]}", f"at most {most} keys are allowed")
    found: dict[str, T] = {}
    for text in texts:
        one = read(text)
        if one.key in found:
            raise DesignError(f"{option} {text}", f"{one.key} is given already")
        found[one.key] = one
    return tuple(found.values())


def scipy(name: str) -> Any:
    """Return a module of SciPy, such as ``optimize``.

    Raises
    ------
    ImportError
        Without SciPy; says what to install.
    """
    try:
        return import_module(f"scipy.{name}")
    except ImportError as error:
        text = 'SciPy is needed: pip install "chutelab[design]"'
        raise ImportError(text) from error
