"""How measured positions respond to parameters, and which parameters they cannot tell."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.scene import SceneError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from chutelab.measured.parameters import Parameter
    from chutelab.measured.track import Floats

STEP = 1e-6
"""Of a parameter's size. Tracks of the exact engine are smooth to rounding, so a difference over
this step is right to about 1e-9, and next to no point lies within it of an impact."""

SINGULAR = 1e-6
"""Least singular value, relative to the largest, of a Jacobian with columns of equal length: far
above what differences leave of zero, far below what noise would let anybody measure."""

UNMOVED = 1e-7
"""m; a parameter that moves the points by no more when it changes by its own size has no effect."""

PART = 0.1
"""Share of a combination of parameters from which on a parameter is named as belonging to it."""


def jacobian(
    function: Callable[[Floats], Floats],
    values: Floats,
    steps: Floats,
    parameters: Sequence[Parameter],
) -> Floats:
    """Return the derivatives of `function` by differences, (M, p); one-sided at a bound.

    A column is 0 where the scene refuses a step to either side.

    Parameters
    ----------
    function : callable
        Values (p,) to residuals (M,).
    values, steps : ndarray, shape (p,)
        Where, and how far to go to each side.
    """
    columns = []
    for k, parameter in enumerate(parameters):
        sides = []
        for step in (-steps[k], steps[k]):
            moved = values.copy()
            moved[k] = np.clip(values[k] + step, parameter.low, parameter.high)
            try:
                sides.append((moved[k], function(moved)))
            except SceneError:
                sides.append((values[k], function(values)))
        (low, before), (high, after) = sides
        columns.append((after - before) / ((high - low) or 1.0))
    return np.stack(columns, axis=1)


def without_effect(derivatives: Floats, parameters: Sequence[Parameter]) -> list[str]:
    """Say which parameters do not move the points at all.

    Parameters
    ----------
    derivatives : ndarray, shape (M, p)
        See `jacobian`.
    """
    moves = np.linalg.norm(derivatives, axis=0) / np.sqrt(len(derivatives))
    return [
        f"{parameter.key} does not move the particle where it was measured: leave it out"
        for parameter, move in zip(parameters, moves, strict=True)
        if move * parameter.size < UNMOVED
    ]


def inseparable(derivatives: Floats, parameters: Sequence[Parameter]) -> list[str]:
    """Say which combinations of parameters the points cannot tell, though each moves them.

    Parameters
    ----------
    derivatives : ndarray, shape (M, p)
        See `jacobian`.
    """
    directions = derivatives / np.linalg.norm(derivatives, axis=0)
    _, values, vectors = np.linalg.svd(directions, full_matrices=False)
    said = []
    for value, vector in zip(values, vectors, strict=True):
        if value < SINGULAR * values[0]:
            *first, last = (
                parameter.key
                for parameter, share in zip(parameters, vector, strict=True)
                if abs(share) > PART
            )
            said.append(
                f"{', '.join(first)} and {last} cannot be told apart: a change of one moves these"
                " points as a change of the others does; fit fewer of them"
            )
    return said
