"""Surfaces that cross: allowed, the first contact wins, but rarely what was meant."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Floats = NDArray[np.float64]

FIRST_WINS = "; surfaces may cross, the first contact wins"


def crossings(
    names: Sequence[str], rows: Floats, owner: Sequence[int], pulley: float | None
) -> list[str]:
    """Return a sentence for every two surfaces that cross.

    Parameters
    ----------
    names : sequence of str
        Of the surfaces.
    rows : ndarray, (S, 4)
        x and y of the first and of the second end of each segment, m.
    owner : sequence of int, (S,)
        Which surface a segment belongs to.
    pulley : float or None
        Radius of the drive pulley about the origin, m. The incoming belt, which lies on it, is
        surface 0 then.

    Notes
    -----
    Surfaces that only touch, as two that share an end do, do not cross.
    """
    found: dict[tuple[int, int], None] = {}
    for s, other in combinations(range(len(rows)), 2):
        if owner[s] != owner[other] and _cross(rows[s], rows[other]):
            found[owner[s], owner[other]] = None
    said = [f"{names[b]}: it crosses {names[a]}{FIRST_WINS}" for a, b in found]
    if pulley is not None:
        into = {o for row, o in zip(rows, owner, strict=True) if o != 0 and _reach(row) < pulley}
        said += [f"{names[o]}: it crosses the drive pulley{FIRST_WINS}" for o in sorted(into)]
    return said


def _cross(one: Floats, other: Floats) -> bool:
    """Tell whether the ends of each lie strictly on two sides of the other."""
    return _parts(one, other) and _parts(other, one)


def _parts(line: Floats, ends: Floats) -> bool:
    (x0, y0, x1, y1), (u0, v0, u1, v1) = line, ends
    first = (x1 - x0) * (v0 - y0) - (y1 - y0) * (u0 - x0)
    second = (x1 - x0) * (v1 - y0) - (y1 - y0) * (u1 - x0)
    return bool(first * second < 0.0)


def _reach(row: Floats) -> float:
    """Distance (m) of a segment from the origin."""
    start, along = row[:2], row[2:] - row[:2]
    share = np.clip(-(start @ along) / (along @ along), 0.0, 1.0)
    return float(np.hypot(*(start + share * along)))
