"""Named numbers, and how texts show them."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

DIGITS = 4
"""Significant digits of numbers in texts: more than any tolerance here can tell apart."""


class Values:
    """Numbers by name, read as attributes; SI units unless an exercise says otherwise.

    Parameters
    ----------
    numbers : mapping of float
        The numbers; they cannot be changed later.

    Examples
    --------
    >>> given = Values({"v0": 2.0, "h": 0.5})
    >>> given.v0, given.text("from {h} m at {v0} m/s")
    (2.0, 'from 0.5 m at 2 m/s')
    """

    __slots__ = ("_numbers",)

    _numbers: dict[str, float]

    def __init__(self, numbers: Mapping[str, float]) -> None:
        object.__setattr__(self, "_numbers", {name: float(n) for name, n in numbers.items()})

    def __getattr__(self, name: str) -> float:
        if not name.startswith("_"):
            numbers = self._numbers
            if name in numbers:
                return numbers[name]
            raise AttributeError(f"no number {name!r} here; there are {', '.join(numbers)}")
        raise AttributeError(name)

    def __setattr__(self, name: str, value: object) -> None:
        raise AttributeError("these numbers are given; keep your own in variables of your own")

    def __getitem__(self, name: str) -> float:
        return self._numbers[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *self._numbers]

    def __repr__(self) -> str:
        return ", ".join(f"{name} = {shown(number)}" for name, number in self._numbers.items())

    def joined(self, more: Mapping[str, float]) -> Values:
        """Return these numbers and more."""
        return Values({**self._numbers, **more})

    def text(self, template: str) -> str:
        """Return a template with every ``{name}`` replaced by its number."""
        return template.format_map({name: shown(n) for name, n in self._numbers.items()})


def shown(number: float) -> str:
    """Return a number as texts show it.

    >>> shown(2.0), shown(0.0123456), shown(2.5e-07)
    ('2', '0.01235', '2.5e-7')
    """
    mantissa, _, power = f"{number:.{DIGITS}g}".partition("e")
    return f"{mantissa}e{int(power)}" if power else mantissa
