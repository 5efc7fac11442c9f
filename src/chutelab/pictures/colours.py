"""The colours of all pictures, pages and notebooks.

Those of Okabe and Ito (2008), "Color Universal Design": told apart by readers with any common
colour blindness.
"""

from __future__ import annotations

from typing import Final

BLUE: Final = "#0072B2"
SKY: Final = "#56B4E9"
GREEN: Final = "#009E73"
ORANGE: Final = "#E69F00"
VERMILION: Final = "#D55E00"
PURPLE: Final = "#CC79A7"
GREY: Final = "#8C8C8C"
"""Not theirs: seen on white and on black."""


def tint(colour: str, share: float, ground: str = "#FFFFFF") -> str:
    """Return a colour mixed with a ground.

    >>> tint("#0072B2", 0.5), tint("#000000", 0.25)
    ('#80B8D8', '#BFBFBF')
    """
    above, below = bytes.fromhex(colour[1:]), bytes.fromhex(ground[1:])
    mixed = (round(share * a + (1.0 - share) * b) for a, b in zip(above, below, strict=True))
    return "#" + bytes(mixed).hex().upper()
