"""The part of the world that is shown: where something happens."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from chutelab.plots.sampling import STRUCK, action, struck_by_nominal, subset, track_times
from chutelab.recording import Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording

MANY = 60
"""Particles from which on some may stray out of the window."""

NEARBY = 0.35
"""Share of the action's size around it within which the ends of surfaces are shown."""

FAR = 1.0
"""Share of the action's size around it within which what happens later is shown."""


@dataclass(frozen=True)
class Window:
    """The part of the world that is shown, m."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Extent in x, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Extent in y, m."""
        return self.top - self.bottom

    def padded(self, left: float, right: float, bottom: float, top: float) -> Window:
        """Return a window larger by shares of its own larger side."""
        size = max(self.width, self.height)
        return Window(
            self.left - left * size,
            self.right + right * size,
            self.bottom - bottom * size,
            self.top + top * size,
        )

    def fitted(self, aspect: float) -> Window:
        """Return the smallest window of that width / height which holds this one, centred."""
        width = max(self.width, aspect * self.height)
        height = max(self.height, self.width / aspect)
        x, y = 0.5 * (self.left + self.right), 0.5 * (self.bottom + self.top)
        return Window(x - width / 2, x + width / 2, y - height / 2, y + height / 2)

    def holds(self, points: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Tell which points, (..., 2), lie inside."""
        x, y = points[..., 0], points[..., 1]
        return np.asarray(
            (x >= self.left) & (x <= self.right) & (y >= self.bottom) & (y <= self.top)
        )

    def clip(
        self, start: NDArray[np.float64], end: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the ends of the part of a straight line inside, None if it stays outside."""
        along = end - start
        low, high = 0.0, 1.0
        for axis, (lower, upper) in enumerate(((self.left, self.right), (self.bottom, self.top))):
            if along[axis] == 0.0:
                if not lower <= start[axis] <= upper:
                    return None
                continue
            shares = sorted((bound - start[axis]) / along[axis] for bound in (lower, upper))
            low, high = max(low, shares[0]), min(high, shares[1])
        return (start + low * along, start + high * along) if low < high else None


def window_of(recording: Recording, machine: Machine) -> Window:
    """Return the window in which something happens, with room for labels.

    It holds particle 0 from separation (or release, without one) to its landing (or last impact),
    the pulley, and ends of surfaces that are near; of what comes later, and of nearly all impacts
    of the other particles, as much as does not make all else small.
    """
    path, tail = _path(recording)
    points = [path]
    if machine.pulley is not None:
        corner = np.full(2, machine.pulley.radius)
        points.append(np.array([-corner, corner]))
    core = around(np.concatenate(points))
    far = core.padded(*[FAR] * 4)
    later = np.concatenate([tail, _crowd(recording)])
    points.append(np.clip(later, (far.left, far.bottom), (far.right, far.top)))
    near = around(np.concatenate(points)).padded(*[NEARBY] * 4)
    # The incoming belt, segment 0, may be cut off anywhere.
    free = slice(0 if machine.pulley is None else 1, None)
    ends = np.concatenate([machine.segments.start[free], machine.segments.end[free]])
    points.append(ends[near.holds(ends)])
    # Names stand left of the pulley and behind the plate.
    left = 0.06 if machine.pulley is None else 0.24
    right = 0.22 if "plate" in machine.surfaces else 0.06
    return around(np.concatenate(points)).padded(left, right, 0.10, 0.12)


def _path(recording: Recording) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return particle 0's positions up to landing or last impact, and from there to its end."""
    begin, end = action(recording)
    mine = recording.events[recording.events["particle"] == 0]
    gone = mine["kind"] == Kind.EXIT
    mine = mine[~gone & (mine["t"] > begin)]
    # Of what leaves the scene nobody needs to see the fall after its last event.
    if gone.any() and len(mine):
        end = float(mine["t"][-1])
    struck = struck_by_nominal(recording)
    # What it struck before, on the way to the end of a ramp, is not where it goes.
    struck = struck[struck["t"] > begin]
    landed = struck["t"][struck["kind"] == Kind.LANDING]
    last = landed[0] if len(landed) else struck["t"][-1] if len(struck) else end
    times = track_times(recording, begin, end)
    position = subset(recording, [0]).at(times)[0][:, 0]
    return position[times <= last], position[times > last]


def _crowd(recording: Recording) -> NDArray[np.float64]:
    """Corners of the box around where the others strike something, or the middle 96 % of many.

    Where they are released counts too if no belt carries them from there.
    """
    events = recording.events
    carried = np.isin(events["particle"], recording.select(Kind.SEPARATION)["particle"])
    counts = np.isin(events["kind"], [int(kind) for kind in STRUCK])
    counts |= ~carried & (events["kind"] == Kind.RELEASE)
    others = events[counts & (events["particle"] != 0)]
    if not len(others):
        return np.empty((0, 2))
    strays = 0.02 if recording.count > MANY else 0.0
    return np.asarray(np.quantile(others["position"], [strays, 1.0 - strays], axis=0))


def around(points: NDArray[np.float64]) -> Window:
    """Return the smallest window that holds points, (P, 2), and is not without extent."""
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    least = 0.01 * max(right - left, top - bottom) or 0.1
    return Window(left, max(right, left + least), bottom, max(top, bottom + least))
