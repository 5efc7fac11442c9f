"""What a run answers, and how far two runs are apart.

The answers of a run are: place, time and velocity of every particle's separation, of its first
impact on each surface and of its landing, with the impulses of these two; its place at the end
(where that is not a matter of definition); and the entries of the energy ledger. In a crowd no
particle's own way can be computed for long; its answers are the mean landing point and the
ledger.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, isfinite
from typing import TYPE_CHECKING

import numpy as np

from chutelab.compare import scales, scene_of
from chutelab.ledger import ledger
from chutelab.recording import ENTRIES, REASONS, Kind
from chutelab.theory import predict

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from chutelab.recording import Floats, Recording


@dataclass(frozen=True, eq=False)
class Answer:
    """One answer of a run.

    Attributes
    ----------
    name : str
        What it is.
    kind : {"place", "time", "speed", "energy", "number"}
        What kind of quantity.
    values : ndarray, (N,) or (N, 2)
        One a particle, or one for all, SI; NaN where it did not happen.
    """

    name: str
    kind: str
    values: Floats


def each(recording: Recording) -> Iterator[Answer]:
    """Yield what happens to each particle, and the ledger."""
    kinds = ((Kind.SEPARATION, "separation"), (Kind.IMPACT, "impact"), (Kind.LANDING, "landing"))
    for kind, what in kinds:
        for surface in recording.surfaces[:-1]:
            events = recording.first(recording.select(kind, surface=surface))
            if not len(events):
                continue
            where = f"{what} on {surface}" if kind == Kind.IMPACT else what
            for name, quantity, column in (
                (f"place of the {where}", "place", "position"),
                (f"time of the {where}", "time", "t"),
                (f"velocity at the {where}", "speed", "velocity_before"),
            ):
                values = np.full((recording.count, *events[column].shape[1:]), np.nan)
                values[events["particle"]] = events[column]
                yield Answer(name, quantity, values)
            if kind != Kind.SEPARATION:
                values = np.full((recording.count, 2), np.nan)
                pushed = [events["normal_impulse"], events["tangential_impulse"]]
                values[events["particle"]] = np.transpose(pushed) / recording.particle.mass
                yield Answer(f"impulse per mass of the {where}", "speed", values)
    yield Answer("place of the end", "place", _ends(recording))
    yield Answer("number of particles that end so", "number", recording.ended.astype(np.float64))
    yield from _booked(recording)


def _ends(recording: Recording) -> Floats:
    """Return where particles are at the end of a run of given length, or lie at rest, (N, 2).

    Others end where they do because a run has to stop somewhere.
    """
    scene = scene_of(recording)
    driven = {free.name for free in scene.surface if free.speed != 0.0}
    driven |= {name for name in ("incoming", "outgoing") if getattr(scene, name) is not None
               and getattr(scene, name).speed != 0.0}  # fmt: skip
    still = [k for k, name in enumerate(recording.surfaces[:-1]) if name not in driven]
    settled = recording.select(Kind.SETTLE)
    told = recording.ended == REASONS.index("time")
    told[settled["particle"][np.isin(settled["surface"], still)]] = True
    told &= np.diff(recording.offsets) > 0
    out = np.full((recording.count, 2), np.nan)
    out[told] = recording.knots["position"][recording.offsets[1:][told] - 1]
    return out


def _booked(recording: Recording) -> Iterator[Answer]:
    books = ledger(recording)
    for entry in ENTRIES:
        yield Answer(entry.replace("_", " "), "energy", np.array([getattr(books, entry)]))


def together(recording: Recording) -> Iterator[Answer]:
    """Yield what can be said of a crowd as a whole."""
    landed = recording.first(recording.select(Kind.LANDING))
    if len(landed):
        yield Answer("mean landing point", "place", landed["position"][:, :1].mean(axis=0))
    else:
        last = recording.ends()[1]["position"]
        yield Answer("mean end point", "place", last.mean(axis=0, keepdims=True))
    yield from _booked(recording)


def sizes(recording: Recording) -> dict[str, float]:
    """Return what each kind of answer is measured by: as in `chutelab.compare`, where it can be.

    Otherwise by the extent of the way, its duration and the highest speed; energies always by the
    energy that was turned over.
    """
    scene = scene_of(recording)
    known = scales(scene, predict(scene))
    knots = recording.knots
    place = knots["position"]
    extent = float(np.hypot(*np.ptp(place, axis=0))) if len(place) else 0.0
    lasted = float(np.ptp(knots["t"])) if len(place) else 0.0
    fastest = float(np.hypot(*knots["velocity"].T).max()) if len(place) else 0.0
    return {
        "place": known["length"] if isfinite(known["length"]) else extent,
        "time": known["time"] if isfinite(known["time"]) else lasted,
        "speed": known["speed"] if isfinite(known["speed"]) else fastest,
        "energy": ledger(recording).turned_over,
        "number": 1.0,
    }


def apart(
    one: Sequence[Answer], other: Sequence[Answer], measured: dict[str, float], unit: str
) -> tuple[float, str]:
    """Return how far the answers of two runs are apart at most, and which one is.

    Parameters
    ----------
    one, other : sequence of Answer
        Of two runs.
    measured : dict of float
        From `sizes`; relative differences are to these, or to the value where that is larger.
    unit : {"relative", "m"}
        "m": places only, m.

    Returns
    -------
    float, str
        inf if not the same things happen in both.
    """
    if [a.name for a in one] != [a.name for a in other]:
        return inf, "what happens at all"
    worst, which = 0.0, "every answer"
    for mine, its in zip(one, other, strict=True):
        if not np.array_equal(np.isnan(mine.values), np.isnan(its.values)):
            return inf, mine.name
        difference, value = np.abs(mine.values - its.values), np.abs(its.values)
        if difference.ndim > 1:
            difference, value = (np.hypot(*pair.T) if pair.shape[1] == 2 else pair[:, 0]
                                 for pair in (difference, value))  # fmt: skip
        if mine.kind == "number":
            if np.any(difference > 0.0):
                return inf, mine.name
            continue
        if unit == "m":
            if mine.kind != "place":
                continue
            size: Floats | float = 1.0
        else:
            scale = measured[mine.kind]
            size = np.maximum(value, scale) if scale > 0.0 else np.where(value > 0.0, value, 1.0)
        with np.errstate(invalid="ignore"):
            largest = float(np.nanmax(difference / size, initial=0.0))
        if largest > worst:
            worst, which = largest, mine.name
    return worst, which
