"""A run's quantities by name, such as ``landing.x.mean``, and who waited for a place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import degrees, nan
from typing import Any

import numpy as np

from chutelab.machine.releases import schedule
from chutelab.results.comparison import observed
from chutelab.results.ledger import ledger
from chutelab.results.recording import REASONS, Kind, Recording
from chutelab.scene import Scene
from chutelab.util.arrays import Floats

_STATISTICS: dict[str, Callable[[Floats], Any]] = {
    "mean": np.mean, "spread": np.std, "min": np.min, "max": np.max,
}  # fmt: skip


def measure(recording: Recording, name: str, scene: Scene) -> float:
    """Return a quantity of a recording, in the unit its name has; NaN if it did not happen.

    Parameters
    ----------
    recording : Recording
        The run.
    name : str
        Such as ``x2``, ``landing.x.mean`` or ``ledger.by_surface.plate.restitution_loss``. A
        name without statistic is particle 0's; ``spread`` is the standard deviation.
    scene : Scene
        The recording's, `recording.scene`.

    Raises
    ------
    KeyError
        If there is no quantity of that name.
    """
    match name.split("."):
        case ["contacts"]:
            return float(recording.contacts)
        case ["ended", "t", *statistic]:
            released = np.flatnonzero(np.diff(recording.offsets) > 0)
            return _of_column(released, recording.ends()[1]["t"], statistic)
        case ["ended", ending]:
            return float(np.count_nonzero(recording.ended == REASONS.index(ending)))
        case ["ledger", *entry]:
            return _booked(recording, entry)
        case ["separation" | "impact" | "landing" as event, *column]:
            return _of_event(recording, event, column)
        case [symbol]:
            values = observed(recording, scene)
            if symbol.endswith("_deg"):
                return degrees(values[symbol.removesuffix("_deg")])
            return values[symbol]
    raise KeyError(name)


def _of_event(recording: Recording, event: str, column: list[str]) -> float:
    kind, surface = {
        "separation": (Kind.SEPARATION, "incoming"),
        "impact": (Kind.IMPACT, "plate"),
        "landing": (Kind.LANDING, "outgoing"),
    }[event]
    if event == "impact" and column[0] in recording.surfaces:
        surface, column = column[0], column[1:]
    first = recording.first(recording.select(kind, surface=surface))
    if column == ["count"]:
        return float(len(first))
    key = column[0]
    if key == "t":
        values = first["t"]
    elif key in ("x", "y"):
        values = first["position"][:, "xy".index(key)]
    else:
        when = "after" if key.endswith("_after") else "before"
        values = first[f"velocity_{when}"][:, "xy".index(key[1])]
    return _of_column(first["particle"], values, column[1:])


def _of_column(particle: Any, values: Floats, statistic: list[str]) -> float:
    """Return particle 0's value, or a statistic of all."""
    if statistic:
        return float(_STATISTICS[statistic[0]](values)) if len(values) else nan
    own = values[particle == 0]
    return float(own[0]) if len(own) else nan


def _booked(recording: Recording, entry: list[str]) -> float:
    books = ledger(recording)
    match entry:
        case ["by_surface", surface, name]:
            return books.by_surface[surface][name]
        case [stored, end]:
            return float(getattr(books, stored)[("start", "end").index(end)])
    return float(getattr(books, entry[0]))


@dataclass(frozen=True)
class Waits:
    """Particles that were released late because their place was taken.

    Attributes
    ----------
    particles : int
        How many waited and were released.
    longest, mean : float
        How long these waited, s; 0 if none did.
    never : int
        How many were due, and found no place until the end of the run.
    """

    particles: int
    longest: float
    mean: float
    never: int


def waits(scene: Scene, recording: Recording) -> Waits | None:
    """Return who waited for its place in a run of a scene; None if nobody did."""
    due = schedule(scene)[: recording.count]
    # The pymunk engine releases at the beginning of a step: up to a step late is not waiting.
    least = (1.0 + 1e-6) * scene.run.dt if recording.engine == "pymunk" else 1e-9
    released = recording.select(Kind.RELEASE)
    late = released["t"] - due[released["particle"]]
    late = late[late > least]
    missing = np.diff(recording.offsets) == 0
    end = recording.knots["t"].max(initial=0.0)
    never = int(np.count_nonzero(due[missing] < end - scene.run.dt))
    if not len(late) and not never:
        return None
    longest, mean = (float(late.max()), float(late.mean())) if len(late) else (0.0, 0.0)
    return Waits(len(late), longest, mean, never)
