"""One scene with many seeds: every quantity as mean ± standard error.

`repeat("stream", 12)["landing.x.mean"]` is one of them.

The numbers 0 to N - 1 are added to the seeds of the scene's streams, as in `sweep` and `solve`, so
that compared runs have the same draws.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass
from math import inf, sqrt
from time import monotonic
from typing import Any, Final, NamedTuple

import numpy as np

from chutelab.results.quantities import measured
from chutelab.scene import AnyScene, Scene, load
from chutelab.scene.quantities import Quantity, every
from chutelab.scene.units import with_unit
from chutelab.scene.variants import drawn, reseeded
from chutelab.studies.sweep import Crew, crew
from chutelab.studies.sweep.plan import alone
from chutelab.studies.sweep.rows import mean_and_error
from chutelab.util.arrays import Floats, Progress
from chutelab.util.errors import InputError
from chutelab.util.files import csv_text
from chutelab.util.tables import Sheet, Shown, many, plain, plus_minus


class Mean(NamedTuple):
    """A quantity over seeds."""

    mean: float
    error: float  # standard error of the mean, s / √n; NaN of fewer than two values
    spread: float  # standard deviation of one run, s
    runs: int  # n, seeds with a value

    def exact(self) -> Mean:
        """Return the mean without spread, for runs that agree to rounding."""
        return self._replace(error=0.0, spread=0.0)


ROUNDING: Final = 1e-12
"""A smaller relative spread over seeds counts as none."""


@dataclass(frozen=True, eq=False, repr=False)
class Repeats(Shown):
    """One scene with N seeds.

    Attributes
    ----------
    scene : Scene
        With its own seeds, those of the first run.
    numbers : tuple of int
        The number added to the seeds, for each run that counts.
    quantities : mapping of str to Quantity
        All quantities of the scene.
    values : mapping of str to ndarray, (N,)
        Each quantity of each run; NaN if it did not happen.
    faults : mapping of str to int
        Why runs are left out, and how many.
    asked : int
        Seeds that were asked for; fewer ran if time was up.
    """

    scene: Scene
    numbers: tuple[int, ...]
    quantities: Mapping[str, Quantity]
    values: Mapping[str, Floats]
    faults: Mapping[str, int]
    asked: int

    def __getitem__(self, name: str) -> Mean:
        """Return a quantity as mean and error; a KeyError if the scene does not have it."""
        values = self.values[name]
        mean, error = (float(one) for one in mean_and_error(values))
        count = int(np.isfinite(values).sum())
        return Mean(mean, error, error * sqrt(count), count)

    def __len__(self) -> int:
        return len(self.numbers)

    def shown(self) -> Iterator[tuple[Quantity, Mean]]:
        """Yield the quantities that happened, and are more than rounding in some run."""
        for name, row in self.quantities.items():
            whole = self.values.get(name.removesuffix("spread") + "mean", self.values[name])
            if np.any(np.abs(self.values[name]) > ROUNDING * np.abs(whole)):
                one = self[name]
                yield row, one if one.spread > ROUNDING * abs(one.mean) else one.exact()

    def sheet(self) -> Sheet:
        """Return each quantity as mean ± standard error, and the spread of one run."""
        rows = [
            (
                with_unit(row.name, row.unit), plus_minus(one.mean, one.error),
                f"{one.spread:.2g}", str(one.runs),
            )
            for row, one in self.shown()
        ]  # fmt: skip
        notes = [
            "± is the standard error of the mean, s / √n: two runs in three of as many other seeds"
            " give a mean within it. s is the standard deviation of one run."
        ]
        if len(self) < self.asked - sum(self.faults.values()):
            notes.append(f"Stopped: {len(self)} of {self.asked} seeds have run.")
        notes += [f"{many(count, 'seed')} left out: {why}" for why, count in self.faults.items()]
        title = f"{self.scene.title}: {many(len(self), 'seed')}"
        return Sheet(title, ("", "mean", "s", "n"), tuple(rows), notes=tuple(notes))

    def csv(self) -> str:
        """Return a row for each seed as CSV; an empty cell is a quantity that did not happen."""
        return csv_text({"seed": np.array(self.numbers), **self.values})

    def as_dict(self) -> dict[str, Any]:
        """Return all means as plain lists and floats, for JSON."""
        return {
            "format": 1,
            "scene": self.scene.title,
            "seeds": list(self.numbers),
            "asked": self.asked,
            "faults": dict(self.faults),
            "quantities": {
                name: {"unit": row.unit, **self[name]._asdict(), "values": plain(self.values[name])}
                for name, row in self.quantities.items()
            },
        }


def _one(scene: Scene) -> str | dict[str, float]:
    """Run a scene and return its quantities, or why it has none."""
    found = alone(scene)
    if isinstance(found, str):
        return found
    rows = every(scene.places, scene.count)
    return {row.name: float(measured(found, row.name)[0]) for row in rows}


def repeat(
    scene: AnyScene,
    count: int,
    *,
    jobs: int = 1,
    team: Crew | None = None,
    max_seconds: float = inf,
    progress: Progress | None = None,
) -> Repeats:
    """Run a scene with `count` seeds.

    Parameters
    ----------
    scene : Scene, str, path or mapping
        What `chutelab.load` takes.
    count : int
        Seeds; 0 to `count` - 1 are added to those of the scene's streams.
    jobs, team : int, Crew
        Processes to spread the runs over, 0 is one for each processor; or what
        `chutelab.studies.sweep.crew` gives.
    max_seconds : float
        After this time no further seed begins; what has run is returned.
    progress : callable, optional
        Called now and then with the share that is done, 0 to 1.

    Raises
    ------
    InputError
        If nothing is drawn in the scene, or no run has numbers.
    KeyboardInterrupt
        By Ctrl-C, with the finished runs as its ``repeats``, if there are any.
    """
    scene, ends = load(scene), monotonic() + max_seconds
    drawn(scene, count)
    found: dict[int, dict[str, float]] = {}
    faults: Counter[str] = Counter()
    if team is None:
        with crew(jobs) as team:
            return repeat(scene, count, team=team, max_seconds=max_seconds, progress=progress)
    work = ((number, reseeded(scene, number)) for number in range(count))
    results, interrupt = team.results(_one, work), None
    try:
        with closing(results):
            for number, one in results:
                if isinstance(one, str):
                    faults[one] += 1
                else:
                    found[number] = one
                if progress is not None:
                    progress((len(found) + faults.total()) / count)
                if monotonic() >= ends:
                    break
    except KeyboardInterrupt as error:
        if not found:
            raise
        interrupt = error
    if not found:
        raise InputError(f"no seed has numbers: {next(iter(faults))}", f"--repeat {count}")
    numbers = tuple(sorted(found))
    quantities = {row.name: row for row in every(scene.places, scene.count)}
    values = {name: np.array([found[n][name] for n in numbers]) for name in quantities}
    told = Repeats(scene, numbers, quantities, values, dict(faults), count)
    if interrupt is not None:
        interrupt.repeats = told  # type: ignore[attr-defined]
        raise interrupt
    return told
