"""`reach`: run a scene until it is accurate enough, and say how accurate it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from chutelab.accuracy.rounding import rounding
from chutelab.accuracy.runs import Runs
from chutelab.accuracy.search import Search
from chutelab.accuracy.wanted import Wanted, parse

if TYPE_CHECKING:
    from chutelab.accuracy.result import Accuracy
    from chutelab.accuracy.runs import Progress
    from chutelab.recording import Recording
    from chutelab.scene import Scene


def reach(
    scene: Scene, wanted: Wanted | str | float, progress: Progress | None = None
) -> tuple[Recording, Accuracy]:
    """Run a scene until it is accurate enough, or cannot be made so.

    The scene's ``run.engine`` and ``run.dt`` are kept to: auto takes the exact engine where it
    can, and dt is the longest step that is tried.

    Parameters
    ----------
    scene : Scene
        From `chutelab.load`.
    wanted : Wanted, str or float
        Such as ``"1mm"`` or ``1e-6``.
    progress : callable, optional
        Called now and then with the share that is done; how many runs it takes is not known
        beforehand.

    Returns
    -------
    Recording, Accuracy
        The most accurate run, and how accurate it is.

    Raises
    ------
    AccuracyError
        If that cannot be asked for.
    SceneError
        As `chutelab.simulate`.

    Notes
    -----
    Estimates, not bounds. exact: the effect of a change of the inputs by 1e-12, scaled to their
    rounding and one more rounding for each round. pymunk: the difference from a run at half the
    step, on the assumption that the error is proportional to the step, or falls more slowly if
    three runs say so. Either is at least the error against theory, where theory answers.
    """
    if not isinstance(wanted, Wanted):
        wanted = parse(wanted if isinstance(wanted, str) else repr(float(wanted)))
    runs = Runs(progress)
    first = runs(scene)
    if first.engine == "exact":
        return first, rounding(scene, first, wanted, runs)
    return Search(scene, wanted, runs).result(first)
