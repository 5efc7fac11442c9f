"""Runs, counted, with the progress of all of them together."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.simulation import simulate

if TYPE_CHECKING:
    from collections.abc import Callable

    from chutelab.recording import Recording
    from chutelab.scene import Scene

    Progress = Callable[[float], None]


class Runs:
    """Runs scenes, counts them, and passes the progress on."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self.count = 0

    def __call__(self, scene: Scene) -> Recording:
        """Run a scene once more."""
        recording = simulate(scene, progress=None if self._progress is None else self._share)
        self.count += 1
        return recording

    def _share(self, share: float) -> None:
        # Half of what is left for each run, because nobody knows how many there will be.
        if self._progress is not None:
            self._progress(1.0 - 0.5**self.count * (1.0 - 0.5 * share))
