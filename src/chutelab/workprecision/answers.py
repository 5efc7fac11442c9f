"""What every method has to say about a case, and how far that is from the reference.

An *answer* holds one array (N,) for each quantity, NaN where a particle did not get so far. The
quantities of a transfer carry the paper's symbols and count as the paper counts: y2, y3 down, x3
back from the plate.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.compare import relative_error
from chutelab.recording import Kind

if TYPE_CHECKING:
    from collections.abc import Mapping

    from chutelab.recording import Recording

Floats = NDArray[np.float64]
Answer = dict[str, Floats]

TRANSFER = ("t2", "y2", "t3", "x3", "v3x", "v3y")
"""Time and fall to the plate; from there time and way back to the landing, landing velocity."""

GRIP = ("t_grip", "x_grip")
"""Time (s) and way forward (m) from the landing to the end of the slip."""

REST = ("t_rest", "y_rest")
"""Time (s) from the release, and height (m), at which a bouncing particle lies still."""


class MissedError(ValueError):
    """A particle never got to where the case ends."""


@dataclass(frozen=True, eq=False)
class Reference:
    """What an answer should be, and by what errors are measured.

    Attributes
    ----------
    values : dict of ndarray, (N,)
        By quantity.
    sizes : dict of float
        Scale of each quantity, as `chutelab.compare.relative_error` takes it.
    """

    values: Answer
    sizes: Mapping[str, float]


def of_transfer(recording: Recording) -> Answer:
    """Read the `TRANSFER` quantities of all particles off a recording."""
    left, hit, down = (
        _first(recording, kind, surface)
        for kind, surface in (
            (Kind.SEPARATION, "incoming"),
            (Kind.IMPACT, "plate"),
            (Kind.LANDING, "outgoing"),
        )
    )
    return {
        "t2": hit["t"] - left["t"],
        "y2": left["y"] - hit["y"],
        "t3": down["t"] - hit["t"],
        "x3": hit["x"] - down["x"],
        "v3x": -down["vx"],
        "v3y": -down["vy"],
    }


def of_grip(recording: Recording) -> Answer:
    """Read the `TRANSFER` and `GRIP` quantities off a recording of lone particles."""
    down = _first(recording, Kind.LANDING, "outgoing")
    held = _last(recording, Kind.STICK, "outgoing")
    return {
        **of_transfer(recording),
        "t_grip": held["t"] - down["t"],
        "x_grip": held["x"] - down["x"],
    }


def of_rest(recording: Recording) -> Answer:
    """Read the `REST` quantities off a recording."""
    begin = _first(recording, Kind.RELEASE, None)
    still = _last(recording, Kind.STICK, None)
    return {"t_rest": still["t"] - begin["t"], "y_rest": still["y"]}


def _first(recording: Recording, kind: Kind, surface: str | None) -> Answer:
    return _columns(recording, kind, surface, last=False)


def _last(recording: Recording, kind: Kind, surface: str | None) -> Answer:
    return _columns(recording, kind, surface, last=True)


def _columns(recording: Recording, kind: Kind, surface: str | None, *, last: bool) -> Answer:
    """Return time, place and incoming velocity of one event of each particle, (N,) each."""
    events = recording.select(kind, surface=surface)
    if last:
        events = events[::-1]
    events = recording.first(events)
    sources = {
        "t": events["t"],
        "x": events["position"][:, 0],
        "y": events["position"][:, 1],
        "vx": events["velocity_before"][:, 0],
        "vy": events["velocity_before"][:, 1],
    }
    columns = {name: np.full(recording.count, np.nan) for name in sources}
    for name, values in sources.items():
        columns[name][events["particle"]] = values
    return columns


def worst(answer: Answer, reference: Reference) -> tuple[float, str]:
    """Return the largest relative error of all particles and quantities, and whose it is.

    Raises
    ------
    MissedError
        If a particle has no answer where the reference has one.
    """
    largest, name = 0.0, ""
    for quantity, expected in reference.values.items():
        found = np.asarray(answer[quantity], dtype=np.float64)
        lost = int(np.count_nonzero(np.isfinite(expected) & ~np.isfinite(found)))
        if lost:
            who = "it" if len(expected) == 1 else f"{lost:,} of {len(expected):,}"
            raise MissedError(f"{who} never {_MISSED[quantity]}")
        size = reference.sizes[quantity]
        for one, other in zip(found.tolist(), expected.tolist(), strict=True):
            error = relative_error(one, other, size)
            if not error <= largest:
                largest, name = error, quantity
    return largest, name


_MISSED = (
    dict.fromkeys(("t2", "y2"), "met the plate")
    | dict.fromkeys(("t3", "x3", "v3x", "v3y"), "landed on the belt")
    | dict.fromkeys(GRIP, "got as fast as the belt")
    | dict.fromkeys(REST, "came to rest")
)
