"""`Track`: measured points, in the world and beside the simulation."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np

from chutelab.engines.simulation import simulate
from chutelab.results import Recording
from chutelab.scene import AnyScene, Fault, Scene, SceneError, load
from chutelab.scene.units import write_size
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.tables import Sheet, Shown, many


class MeasuredError(SceneError):
    """A measured track, or a fit to it, that cannot be used; its text says where and why."""


LARGEST: Final = 1e9
"""Bound on numbers of a file and its placement: far from overflow when residuals are squared."""


@dataclass(frozen=True)
class Placement:
    """Transformation of a file's numbers to positions in the world and times of the simulation.

    x = scale (x_file - origin_x), y = ± scale (y_file - origin_y), t = t_file - t0.

    Attributes
    ----------
    scale : float
        Metres per unit of the file.
    origin : tuple of float
        The pulley's axis (the world's origin), in the units of the file.
    flip_y : bool
        Whether y is counted downward in the file, as pixels are.
    t0 : float
        s; the time in the file at which particle 0 is released, t = 0 of the simulation.

    Raises
    ------
    MeasuredError
        If the scale is not above 0, or a number is not finite or beyond `LARGEST`.
    """

    scale: float = 1.0
    origin: tuple[float, float] = (0.0, 0.0)
    flip_y: bool = False
    t0: float = 0.0

    def __post_init__(self) -> None:
        faults = []
        most = f"{LARGEST:g}"
        if not 0.0 < self.scale <= LARGEST:
            allowed = f"must be a number > 0 and <= {most}, metres per unit"
            faults.append(Fault("scale", self.scale, allowed))
        if len(self.origin) != 2 or not all(abs(value) <= LARGEST for value in self.origin):
            allowed = f"must be two numbers, X and Y, from -{most} to {most}"
            faults.append(Fault("origin", self.origin, allowed))
        if not abs(self.t0) <= LARGEST:
            faults.append(Fault("t0", self.t0, f"must be a number from -{most} to {most}, seconds"))
        if faults:
            raise MeasuredError("placement", faults)


@dataclass(frozen=True, eq=False, repr=False)
class Track(Shown):
    """Measured points of one particle; arrays are read-only.

    Attributes
    ----------
    name, source : str
        The track's name in the file, "" without one; the file.
    seconds : ndarray, shape (P,)
        Times as the file has them, s, ascending.
    points : ndarray, shape (P, 2)
        Positions as the file has them, in its units.
    lines : ndarray, shape (P,)
        Line of the file that each point stands in, from 1.
    placement : Placement
        Their placement in the world.
    skipped : int
        Lines without a position, which were left out.
    """

    name: str
    source: str
    seconds: Floats
    points: Floats
    lines: Ints
    placement: Placement = field(default=Placement())
    skipped: int = 0

    def __post_init__(self) -> None:
        for name, kind in (("seconds", np.float64), ("points", np.float64), ("lines", np.int64)):
            values = np.array(getattr(self, name), dtype=kind)
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    def __len__(self) -> int:
        return len(self.seconds)

    @property
    def t(self) -> Floats:
        """Times on the simulation's clock, s, shape (P,)."""
        return self.seconds - self.placement.t0

    @property
    def position(self) -> Floats:
        """Positions in the world, m, shape (P, 2)."""
        placement = self.placement
        up = -1.0 if placement.flip_y else 1.0
        return (self.points - placement.origin) * (placement.scale * np.array([1.0, up]))

    @property
    def x(self) -> Floats:
        """Forward from the pulley's axis, m, shape (P,)."""
        return self.position[:, 0]

    @property
    def y(self) -> Floats:
        """Up from the pulley's axis, m, shape (P,)."""
        return self.position[:, 1]

    def placed(self, **changes: Any) -> Track:
        """Return the track with some attributes of its `Placement` changed."""
        return replace(self, placement=replace(self.placement, **changes))

    def said(self) -> str:
        """Describe it in one sentence."""
        named = f'"{self.name}"' if self.name else "track"
        text = f"{named} of {self.source}: {len(self)} points"
        if self.skipped:
            text += f", {many(self.skipped, 'line')} without a position"
        return text

    def sheet(self) -> Sheet:
        """Return the extent of the points, on the simulation's clock and in the world."""
        columns = (("time, s", self.t), ("x, m", self.x), ("y, m", self.y))
        rows = tuple((name, f"{v.min():.4g}", f"{v.max():.4g}") for name, v in columns)
        return Sheet(self.said(), ("", "least", "most"), rows)


ROUNDING = 1e-9
"""s; a time this close to release or end counts as on it."""

LEAST = 3
"""Least number of points for a comparison."""


@dataclass(frozen=True, eq=False, repr=False)
class Residuals(Shown):
    """Measured minus simulated positions of particle 0, SI units.

    Attributes
    ----------
    track : Track
        The measured points, P of them.
    recording : Recording
        The simulation.
    simulated : ndarray, shape (P, 2)
        Positions of particle 0 at the times of the points, m; NaN before its release and after its
        end.
    """

    track: Track
    recording: Recording
    simulated: Floats

    @property
    def used(self) -> Bools:
        """Which points lie within the simulated time, shape (P,)."""
        return np.asarray(np.isfinite(self.simulated[:, 0]))

    @property
    def values(self) -> Floats:
        """Measured minus simulated position, m, shape (P, 2); NaN where there is no simulation."""
        return self.track.position - self.simulated

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean square of the residuals in x and in y, m."""
        x, y = np.sqrt(np.mean(self.values[self.used] ** 2, axis=0)).tolist()
        return x, y

    @property
    def mean(self) -> tuple[float, float]:
        """Mean residuals in x and in y, m: the offset of the points as a whole."""
        x, y = np.mean(self.values[self.used], axis=0).tolist()
        return x, y

    @property
    def worst(self) -> int:
        """Index of the point with the largest residual."""
        return int(np.nanargmax(np.hypot(*self.values.T)))

    def left_out(self) -> str:
        """Name the points outside the simulated time, "" if there are none."""
        begin, end = ends(self.recording)
        parts = []
        for outside, where in (
            (self.track.t < begin - ROUNDING, f"before the release at {begin:.4g} s"),
            (self.track.t > end + ROUNDING, f"after the end at {end:.4g} s"),
        ):
            lines = self.track.lines[outside]
            if len(lines):
                span = f"line {lines[0]}" if len(lines) == 1 else f"lines {lines[0]} to {lines[-1]}"
                parts.append(f"{many(len(lines), 'point')} {where} ({span})")
        return " and ".join(parts)

    def sheet(self) -> Sheet:
        """Return root mean squares, means and the worst point, and what was left out."""
        i = self.worst
        where = self.track.position[i]
        rows = [
            (name, *(write_size(float(value), "m") for value in (x, y, np.hypot(x, y))))
            for name, (x, y) in (
                ("RMS", self.rms),
                ("mean", self.mean),
                ("worst point", self.values[i]),
            )
        ]
        notes = [
            f"{int(self.used.sum())} of {len(self.track)} points compared; the worst one is line"
            f" {self.track.lines[i]}: {self.track.t[i]:.4g} s, x = {where[0]:.4g} m, y ="
            f" {where[1]:.4g} m"
        ]
        if left_out := self.left_out():
            notes.append(f"left out: {left_out}")
        title = "Measured - simulated, particle 0"
        return Sheet(title, ("", "x", "y", "together"), tuple(rows), notes=tuple(notes))


def residuals(scene: AnyScene, track: Track) -> Residuals:
    """Simulate a scene and lay a measured track over its particle 0.

    Raises
    ------
    SceneError
        If the scene cannot be run.
    MeasuredError
        If fewer than three points lie within the simulated time.
    """
    return over(run(load(scene)), track)


def over(recording: Recording, track: Track) -> Residuals:
    """Lay a measured track over particle 0 of a finished run; raises as `residuals` does."""
    begin, end = ends(recording)
    clock, within = track.t, inside(recording, track)
    if within.sum() < LEAST:
        text = (
            f"{int(within.sum())} of {len(track)} points lie within the simulated time,"
            f" {begin:.4g} to {end:.4g} s; they were measured at {clock[0]:.4g} to"
            f" {clock[-1]:.4g} s. t0 moves their clock, and can be fitted"
        )
        raise MeasuredError(track.source, [Fault("column t", None, text)])
    simulated = np.where(within[:, None], follow(recording, clock), np.nan)
    return Residuals(track, recording, simulated)


def inside(recording: Recording, track: Track) -> Bools:
    """Return which points were measured between release and end of particle 0, shape (P,)."""
    begin, end = ends(recording)
    return np.asarray((track.t >= begin - ROUNDING) & (track.t <= end + ROUNDING))


def run(scene: Scene) -> Recording:
    """Simulate the motion of particle 0; without the others if they do not interact."""
    if scene.count > 1 and not scene.crowded:
        scene = scene.alone()
    return simulate(scene)


def ends(recording: Recording) -> tuple[float, float]:
    """Return when particle 0 is released and when it ends, s."""
    clock = recording.track(0)["t"]
    return float(clock[0]), float(clock[-1])


def follow(recording: Recording, times: Floats) -> Floats:
    """Return positions (T, 2) of particle 0 at times (T,), extrapolated linearly beyond its track.

    A fit moves release and end a little; with NaN there, its sum of squares would jump.
    """
    within = np.clip(times, *ends(recording))
    if recording.count > 1:
        recording = replace(
            recording,
            knots=recording.track(0),
            offsets=recording.offsets[:2],
            ended=recording.ended[:1],
        )
    position, velocity = recording.at(within)
    onward: Floats = position[:, 0] + velocity[:, 0] * (times - within)[:, None]
    return onward


STEPS = 2000
"""Number of times tried; a fit from the best one refines it."""

POINTS = 200
"""Most points that are used for this, evenly spread."""


def best_t0(recording: Recording, track: Track) -> float:
    """Return the t0 (s, in the time of the file) that brings track and simulation closest.

    The sum has the square of each point's distance, limited to the size of the track, and a little
    more than that outside the simulated time, so that it is not better to move points before the
    release or after the end. The track's t0 is kept if no other is better.
    """
    begin, end = ends(recording)
    some = slice(None, None, 1 + len(track) // POINTS)
    seconds, position = track.seconds[some], track.position[some]
    reach = float(np.ptp(position, axis=0).max())
    now = track.placement.t0
    tried = np.append(np.linspace(seconds[0] - end, seconds[-1] - begin, STEPS), now)
    # Linear interpolation between so many samples is far more accurate than the points.
    moments = np.linspace(begin, end, 4 * STEPS)
    path = follow(recording, moments)
    clock = seconds - tried[:, None]
    x, y = (np.interp(clock, moments, path[:, axis]) for axis in (0, 1))
    squares = np.minimum((x - position[:, 0]) ** 2 + (y - position[:, 1]) ** 2, reach**2)
    outside = (clock < begin) | (clock > end)
    costs = np.where(outside, 1.01 * reach**2, squares).sum(axis=1)
    best = int(np.argmin(costs))
    return float(tried[best]) if costs[best] < costs[-1] else now
