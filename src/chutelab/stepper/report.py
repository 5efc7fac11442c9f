"""Progress, told now and then."""

from __future__ import annotations

from time import perf_counter
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

PAUSE = 0.05
"""s between two reports of progress."""


class Report:
    """Passes progress on, but not more often than `PAUSE`."""

    def __init__(self, progress: Callable[[float], None] | None) -> None:
        self._progress = progress
        self._next = perf_counter() + PAUSE
        self.done, self.part = 0.0, 1.0

    def __call__(self, share: float) -> None:
        """Tell the share (0 to 1) of the present part that is done."""
        if self._progress is not None and perf_counter() >= self._next:
            self._progress(self.done + self.part * share)
            self._next = perf_counter() + PAUSE

    def last(self) -> None:
        """Tell that everything is done."""
        if self._progress is not None:
            self._progress(1.0)
