"""The numbers of a variant: as simulated, and as the analytic parabola has them."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, degrees, hypot, isfinite, nan
from typing import TYPE_CHECKING

from chutelab.agreement.measure import measure
from chutelab.scene.measures import unit_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.page.runs import Run, Study

LABELS = {
    "separation.t": "Leaves pulley at",
    "phi1_deg": "Angle past the top",
    "impact.t": "Strikes the plate at",
    "impact.y": "Height of that",
    "v2": "Speed before",
    "v2r": "Speed after",
    "landing.t": "Lands at time",
    "landing.x": "Lands at x",
    "landing.vx": "Landing, forward",
    "landing.vy": "Landing, upward",
}
"""Of particle 0, under the names of `chutelab.scene.measures`."""

CROWD = {
    "landing.count": "Particles landed",
    "landing.t.mean": "Lands at time, mean",
    "landing.x.mean": "Lands at x, mean",
    "landing.x.spread": "Lands at x, spread",
    "landing.vx.mean": "Landing, forward, mean",
}
"""Of a stream."""

BOOKS = {
    "contacts": "Contacts",
    "ledger.belt_work": "Belt work in the run",
    "ledger.restitution_loss": "Lost in rebounds",
    "ledger.friction_loss": "Slip heat",
    "ledger.residual": "Residual",
}
"""Of all particles together."""

MOST_FREE = 3
"""Free surfaces whose first impact is listed."""


@dataclass(frozen=True)
class Figure:
    """One row of numbers.

    Attributes
    ----------
    group : str
        Whose number it is, where there are several particles.
    name : str
        As `chutelab.scene.measures` has it.
    label, unit : str
        For people; "degrees" for angles.
    simulated, analytic : tuple of float or None
        One for each variant of the study; None where it did not happen, or nothing is known.
    """

    group: str
    name: str
    label: str
    unit: str
    simulated: tuple[float | None, ...]
    analytic: tuple[float | None, ...]


def figures(study: Study) -> tuple[Figure, ...]:
    """Return the rows of a study that have a number in any variant."""
    first = study.sound[0]
    surfaces = first.recording.surfaces[:-1]
    labels = dict(LABELS)
    for name in _free(surfaces):
        labels[f"impact.{name}.t"] = f"Strikes “{name}” at"
        labels[f"impact.{name}.x"] = f"Strikes “{name}” at x"
    crowd = max(run.recording.count for run in study.sound) > 1
    rows = [("First particle" if crowd else "", *row) for row in labels.items()]
    books = [("All particles" if crowd else "", *row) for row in BOOKS.items()]
    if crowd:
        rows = [("All particles", *row) for row in CROWD.items()] + books + rows
    else:
        rows += books
    found = []
    for group, name, label in rows:
        unit = unit_of(name, surfaces)
        if unit is None:
            continue
        # Without its outgoing belt a scene has other books, and no landing.
        runs = [None if outcome.fault else outcome.run for outcome in study.outcomes]
        simulated = tuple(_simulated(run, name) for run in runs)
        analytic = tuple(_analytic(run).get(name) for run in runs)
        if any(value is not None for value in simulated):
            found.append(Figure(group, name, label, unit, simulated, analytic))
    return tuple(found)


def _free(surfaces: Sequence[str]) -> list[str]:
    return [s for s in surfaces if s not in ("incoming", "plate", "outgoing")][:MOST_FREE]


def _simulated(run: Run | None, name: str) -> float | None:
    value = nan if run is None else measure(run.recording, name, run.scene)
    return value if isfinite(value) else None


def _analytic(run: Run | None) -> dict[str, float]:
    """Return what the arcs say: where and how fast each of them begins and ends."""
    if run is None or not run.arcs:
        return {}
    known = {"separation.t": run.began, "phi1_deg": degrees(atan2(*run.arcs[0].position))}
    ends = []
    for arc in run.arcs:
        (where,), (pace,) = (values.tolist() for values in arc.at([arc.end]))
        ends.append((run.began + arc.end, *where, *pace))
    t, _, y, vx, vy = ends[0]
    known |= {"impact.t": t, "impact.y": y, "v2": hypot(vx, vy)}
    if len(ends) > 1:
        t, x, _, vx, vy = ends[1]
        known |= {"landing.t": t, "landing.x": x, "landing.vx": vx, "landing.vy": vy}
        known["v2r"] = hypot(*run.arcs[1].velocity)
    return known
