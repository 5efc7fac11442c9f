"""Types of arrays and of callbacks, each named once."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]

Numbers = Floats | float
"""A number, or an array (N,) where a family of scenes differs in it."""

Progress = Callable[[float], None]
"""Called now and then with the share of the work that is done, 0 to 1. One that an engine calls may
raise `results.recorder.EnoughError`: the run ends there, with what is recorded."""

Watch = Callable[[], None]
"""Called now and then in work that may take long; what it raises ends the work."""


def unwatched() -> None:
    """Let the work go on, whatever it takes."""
