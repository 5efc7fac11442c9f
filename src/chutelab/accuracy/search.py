"""How exact the pymunk engine is: ever shorter steps, until that is enough or helps no more."""

from __future__ import annotations

from dataclasses import replace
from math import inf, isfinite
from typing import TYPE_CHECKING

from chutelab.accuracy.answers import Answer, apart, each, sizes, together
from chutelab.accuracy.disturbed import disturbed, with_step
from chutelab.accuracy.result import checked, judged
from chutelab.accuracy.rounding import EPS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.accuracy.result import Accuracy
    from chutelab.accuracy.runs import Runs
    from chutelab.accuracy.wanted import Wanted
    from chutelab.recording import Recording
    from chutelab.scene import Scene

STIR = 1e-9
"""Share by which inputs are changed to see how much that grows in a crowd."""

CHAOS = 1e4
"""Growth of a stir from which on a crowd is called chaotic: shorter steps would have to be shorter
by about as much. A handful of particles stays below 1e3, forty in a heap are above 1e5."""

RESTING = 1e-5
"""Share of the radius by which a particle that lies by itself overlaps what it lies on, at most;
in a crowd it is the slop of all contacts."""

BOOKED = 1e-6
"""Share of the energy turned over that contacts may misbook where pymunk parts what overlaps: at
most 4e-7 on the shipped scenes of one particle."""

SHORTEST = 1e-7
"""s; the shortest step a scene may have."""

MOST_STEPS = 50_000
"""Steps of one run; those before it take as many together."""

STALE = 0.9
"""Halving the step does not help where the difference falls by less than this factor."""

PATIENCE = 3
"""Halvings in a row that may not help before the search is given up."""

UNEVEN = 3.0
"""Error in differences once these have not fallen evenly: then a small one may be luck."""

CHAOTIC_RUNS = 4
"""Runs whose spread is taken: at a step, at half of it, and twice at that with stirred inputs."""


class Search:
    """Halves the step of the pymunk engine until that is enough, or does not help."""

    def __init__(self, scene: Scene, wanted: Wanted, runs: Runs) -> None:
        self.scene, self.wanted, self.runs = scene, wanted, runs

    def result(self, coarse: Recording) -> tuple[Recording, Accuracy]:
        """Return the last run and its accuracy, given a run at the scene's own step."""
        dt, before, least, stale, uneven = self.scene.run.dt, inf, inf, 0, False
        best: tuple[Recording, Accuracy] | None = None
        if 0.5 * dt < SHORTEST:
            # No shorter step to compare with: take a longer one.
            dt *= 2.0
            coarse = self.runs(with_step(self.scene, dt))
        while True:
            dt *= 0.5
            fine = self.runs(with_step(self.scene, dt))
            difference, which = self._apart(coarse, fine)
            stale = 0 if difference < STALE * least else stale + 1
            uneven |= isfinite(least) and stale > 0
            error = difference * max(_remaining(difference, before), UNEVEN if uneven else 1.0)
            found = self._accuracy(fine, error, which, dt)
            if found.met:
                return fine, found
            if best is None and self._crowd and self._chaotic(fine, dt):
                return self._spread(coarse, fine, dt)
            if best is None or _size(found) <= _size(best[1]):
                best = fine, found
            reason = self._hopeless(fine, dt, stale)
            if reason:
                how = f"{best[1].method}; {reason}"
                return best[0], replace(best[1], method=how, runs=self.runs.count)
            coarse, before, least = fine, difference, min(least, difference)

    def _apart(self, one: Recording, other: Recording) -> tuple[float, str]:
        return apart(*self._each(one, other), sizes(other), self.wanted.unit)

    def _each(self, one: Recording, other: Recording) -> tuple[list[Answer], list[Answer]]:
        return list(each(one)), list(each(other))

    def _accuracy(self, fine: Recording, error: float, which: str, dt: float) -> Accuracy:
        floor, where = _unseen(fine, self.wanted.unit, crowd=self._crowd)
        if error < floor:
            error, which = floor, where
        how = f"runs at steps of {2.0 * dt:.3g} and {dt:.3g} s"
        if not isfinite(error):
            how += f" differ in {which}"
        found = checked(fine, self.wanted, error, which, how)
        return judged(self.wanted, *found, runs=self.runs.count, dt=dt)

    @property
    def _crowd(self) -> bool:
        return self.scene.stream.interact and self.scene.stream.count > 1

    def _chaotic(self, fine: Recording, dt: float) -> bool:
        """Tell whether a stir that nobody would notice grows into something that one sees."""
        self.stirred = self.runs(disturbed(with_step(self.scene, dt), STIR))
        return apart(*self._each(self.stirred, fine), sizes(fine), "relative")[0] > CHAOS * STIR

    def _spread(self, coarse: Recording, fine: Recording, dt: float) -> tuple[Recording, Accuracy]:
        again = self.runs(disturbed(with_step(self.scene, dt), 2.0 * STIR))
        crowd = [list(together(run)) for run in (coarse, fine, self.stirred, again)]
        reached, which = _range(crowd, sizes(fine), self.wanted.unit)
        how = (
            f"chaotic: each particle's way depends on next to nothing (a stir of {STIR:g} grows"
            f" {CHAOS:g}-fold and more), so this is the spread of the mean landing"
            f" point{'' if self.wanted.unit == 'm' else ' and of the ledger'} over"
            f" {CHAOTIC_RUNS} runs, stirred a little, at steps of {2.0 * dt:.3g} and {dt:.3g} s"
        )
        return fine, judged(
            self.wanted, reached, which, how, runs=self.runs.count, dt=dt, chaotic=True
        )

    def _hopeless(self, fine: Recording, dt: float, stale: int) -> str:
        unseen, where = _unseen(fine, self.wanted.unit, crowd=self._crowd)
        if unseen > self.wanted.size:
            left = self.wanted.written(unseen)
            return f"the slop of contacts leaves {left} in the {where} at any step"
        if stale >= PATIENCE:
            return "a shorter step helps no more"
        if 0.5 * dt < SHORTEST:
            return f"a step may not be shorter than {SHORTEST:g} s"
        if 2.0 * fine.steps > MOST_STEPS:
            return f"half the step would take more than {MOST_STEPS:,} steps"
        return ""


def _unseen(fine: Recording, unit: str, *, crowd: bool) -> tuple[float, str]:
    """Return the error that no shorter step shows, and of what it is."""
    # The pymunk engine has run, so its package is loaded.
    from chutelab.stepper.solids import SLOP

    size = sizes(fine)["place"]
    if not fine.contacts:
        return (10.0 * EPS * size, "every place") if unit == "m" else (10.0 * EPS, "every answer")
    length = max(10.0 * EPS * size, (SLOP if crowd else RESTING) * fine.particle.radius)
    if unit == "m":
        return length, "places of contacts"
    share = length / size if size > 0.0 else 0.0
    return max((share, "places of contacts"), (BOOKED, "energy ledger"))


def _size(found: Accuracy) -> float:
    return inf if found.reached is None else found.reached


def _remaining(difference: float, before: float) -> float:
    """Return the error of the finer of two runs, in differences between them.

    With an error proportional to the step it is 1. If the differences fall by a factor q from step
    to step, what is still to come adds up to q / (1 - q) of the last.
    """
    if not isfinite(difference) or not isfinite(before) or before <= 0.0:
        return 2.0
    q = min(difference / before, STALE)
    return max(1.0, q / (1.0 - q))


def _range(
    crowd: Sequence[Sequence[Answer]], measured: dict[str, float], unit: str
) -> tuple[float, str]:
    """Return the largest difference between any two of several runs."""

    def pairs() -> Iterator[tuple[float, str]]:
        for k, one in enumerate(crowd):
            for other in crowd[:k]:
                yield apart(one, other, measured, unit)

    return max(pairs())
