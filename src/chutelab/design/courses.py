"""The course of a particle: which surfaces it touches, up to its landing."""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.recording import REASONS, Kind

if TYPE_CHECKING:
    from collections.abc import Sequence

    from chutelab.recording import Recording

MANY: Final = 6
"""Touches of one surface in a row from which on they are not counted: a particle that bounces to
rest does so a thousand times, and one more is no other course."""

LONGEST: Final = 6
"""Surfaces that are named: what is thrown to and fro longer goes by the same name."""


def course_of(recording: Recording) -> str:
    """Return the surfaces that particle 0 touches up to its first landing."""
    return courses_of(recording, 1)[0]


def courses_of(recording: Recording, count: int | None = None) -> list[str]:
    """Return the courses of the first `count` particles, of all by default.

    Such as ``plate, outgoing``, or ``plate, never lands (exit)``.
    """
    count = recording.count if count is None else count
    events = recording.events[recording.events["particle"] < count]
    events = events[np.isin(events["kind"], (Kind.IMPACT, Kind.LANDING))]
    events = events[np.argsort(events["particle"], kind="stable")]
    bounds = np.searchsorted(events["particle"], np.arange(count + 1)).tolist()
    surfaces, landed = events["surface"].tolist(), (events["kind"] == Kind.LANDING).tolist()
    known: dict[tuple[object, ...], str] = {}
    found = []
    for particle in range(count):
        start, stop = bounds[particle], bounds[particle + 1]
        last = next((i for i in range(start, stop) if landed[i]), None)
        touched = tuple(surfaces[start : stop if last is None else last + 1])
        end = "" if last is not None else REASONS[recording.ended[particle]]
        if (touched, end) not in known:
            names = _folded([recording.surfaces[surface] for surface in touched])
            if len(names) > LONGEST:
                names = [*names[: LONGEST - 1], "and so on"]
            known[touched, end] = ", ".join([*names, *([f"never lands ({end})"] if end else [])])
        found.append(known[touched, end])
    return found


def _folded(names: Sequence[str]) -> list[str]:
    """Write repeats as one."""
    out: list[tuple[str, int]] = []
    for name in names:
        if out and out[-1][0] == name:
            out[-1] = (name, out[-1][1] + 1)
        else:
            out.append((name, 1))
    return [name if times == 1 else f"{name} {_times(times)}" for name, times in out]


def _times(times: int) -> str:
    if times == 2:
        return "twice"
    return f"{times} times" if times < MANY else "many times"
