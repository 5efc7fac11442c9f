"""Where a function of one key is 0: all roots in a range, and none that is only a jump."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.design.pieces import Change
from chutelab.design.scalar import bounded, bracketed

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.design.evaluation import Floats
    from chutelab.design.pieces import Piece, Scan

    Function = Callable[[float], float]

CLOSE: Final = 1e-9
"""What counts as 0, relative to the size of the two sides: far above rounding (1e-15), far below
any jump worth the name."""

EXACT: Final = 1e-3
"""Share of that which is 0 at an end of the range, where no change of sign can be closed in on."""

LIMIT: Final = 100.0
"""The same for the end of a piece, to which a function may come as steeply as a square root does: a
rounding from it, it still is the root of a rounding away."""

SAME: Final = 1e-8
"""Share of the range within which two roots are one."""


@dataclass(frozen=True, eq=False)
class Roots:
    """What a range holds.

    Attributes
    ----------
    at : tuple of float
        Values of the key at which the two sides are equal, ascending.
    everywhere : tuple of (float, float)
        Ranges in which they are equal throughout.
    jumps : tuple of Change
        Where one side jumps over the other: no solutions.
    nearest : float
        The value at which they differ least; NaN if they have none anywhere.
    off : float
        By how much they differ there.
    """

    at: tuple[float, ...]
    everywhere: tuple[tuple[float, float], ...]
    jumps: tuple[Change, ...]
    nearest: float
    off: float


def roots(found: Scan, function: Function, scale: float) -> Roots:
    """Find where a function is 0.

    Parameters
    ----------
    found : Scan
        Of two quantities, whose difference the function is.
    function : callable
        The difference of the two at a value of the key.
    scale : float
        Size of the quantities.
    """
    at: list[float] = []
    everywhere: list[tuple[float, float]] = []
    jumps = [
        change
        for change, before, after in _borders(found)
        if before * after < 0.0 and min(abs(before), abs(after)) > CLOSE * scale
    ]
    best = (np.inf, np.nan)
    for piece in found.pieces:
        f = piece.values[:, 0] - piece.values[:, 1]
        flat, rest = _flat(piece.x, f, CLOSE * scale)
        everywhere += flat
        for x, values in rest:
            best = min(best, _least(x, values, function))
            for root in _in_piece(x, values, function, CLOSE * scale, found.ends):
                off = abs(function(root))
                border = root in (piece.x[0], piece.x[-1])
                if off <= CLOSE * scale * (LIMIT if border else 1.0):
                    at.append(root)
                else:
                    jumps.append(_inside(root, function, piece))
    at = _distinct(sorted(at), function, float(np.ptp(found.x)))
    if at:
        best = min((abs(function(root)), root) for root in at)
    return Roots(
        tuple(at), tuple(everywhere), tuple(sorted(jumps, key=lambda jump: jump.low)),
        best[1], best[0],
    )  # fmt: skip


def _borders(found: Scan) -> list[tuple[Change, float, float]]:
    """Return the changes with the function before and after each."""
    out = []
    for change in found.changes:
        sides = []
        for x in (change.low, change.high):
            row = found.values[np.searchsorted(found.x, x)]
            sides.append(float(row[0] - row[1]))
        out.append((change, sides[0], sides[1]))
    return out


def _flat(
    x: Floats, f: Floats, tolerance: float
) -> tuple[list[tuple[float, float]], list[tuple[Floats, Floats]]]:
    """Split off runs of three points and more at which the function is 0 throughout."""
    zero = np.abs(f) <= tolerance
    edges = np.flatnonzero(np.diff(np.concatenate([[False], zero, [False]]).astype(int)))
    flat, rest, start = [], [], 0
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        if last - first >= 3:
            flat.append((float(x[first]), float(x[last - 1])))
            rest.append((x[start:first], f[start:first]))
            start = last
    rest.append((x[start:], f[start:]))
    return flat, [(a, b) for a, b in rest if len(a)]


def _least(x: Floats, f: Floats, function: Function) -> tuple[float, float]:
    """Return the least |f| of a piece, and where it is."""
    size = np.abs(f)
    if np.isnan(size).all():
        return np.inf, np.nan
    i = int(np.nanargmin(size))
    best = (float(size[i]), float(x[i]))
    low, high = x[max(i - 1, 0)], x[min(i + 1, len(x) - 1)]
    if low < high and np.isfinite(size[max(i - 1, 0) : i + 2]).all():
        place, least = bounded(lambda value: abs(function(value)), low, high)
        best = min(best, (least, place))
    return best


def _in_piece(
    x: Floats, f: Floats, function: Function, tolerance: float, span: tuple[float, float]
) -> list[float]:
    """Return where a function that is smooth changes sign, or touches 0."""
    ends = [
        i for i in (0, len(x) - 1) if abs(f[i]) <= tolerance * (EXACT if x[i] in span else LIMIT)
    ]
    out = [float(x[i]) for i in {*np.flatnonzero(f == 0.0), *ends}]
    signs = np.sign(f)
    out += [
        bracketed(function, x[i], x[i + 1])
        for i in np.flatnonzero(signs[:-1] * signs[1:] < 0.0).tolist()
    ]
    for i in range(1, len(x) - 1):
        size = np.abs(f[i - 1 : i + 2])
        one_side = bool(np.all(f[i - 1 : i + 2] > 0.0) or np.all(f[i - 1 : i + 2] < 0.0))
        if one_side and size[1] <= size[0] and size[1] <= size[2] and size[1] < size.max():
            out += _touching(function, float(np.sign(f[i])), x[i - 1 : i + 2], tolerance)
    return out


def _touching(function: Function, sign: float, x: Floats, tolerance: float) -> list[float]:
    """Look between three points for a hidden pair of roots, or one where it only touches 0."""
    place, least = bounded(lambda value: sign * function(value), x[0], x[2])
    if least < -tolerance:
        return [bracketed(function, x[0], place), bracketed(function, place, x[2])]
    return [place] if least <= tolerance else []


def _inside(root: float, function: Function, piece: Piece) -> Change:
    """Return the jump that a bracket closed in on, though the course stays."""
    step = 1e-12 * max(abs(root), float(np.ptp(piece.x)))
    low, high = max(root - step, float(piece.x[0])), min(root + step, float(piece.x[-1]))
    return Change(low, high, function(low), function(high), (piece.course, piece.course))


def _distinct(values: list[float], function: Function, width: float) -> list[float]:
    """Keep the best of what is the same root, seen from two sides."""
    out: list[float] = []
    for value in values:
        if out and value - out[-1] <= SAME * width:
            out[-1] = min(out[-1], value, key=lambda x: abs(function(x)))
        else:
            out.append(value)
    return out
