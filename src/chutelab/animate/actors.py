"""What moves in the scene: particle 0 with its track, the other particles, belts and pulley.

Each actor draws itself on axes, lists its `artists`, and `show`s one moment.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.plots import style
from chutelab.plots.sampling import round_times, strobe_step, subset, track_times

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording

    Floats = NDArray[np.float64]

DRAWN = 300
"""Particles that are drawn at most, particle 0 included."""

SMALLEST = 6.0
"""pt; the diameter a particle is drawn with if to scale it would be smaller."""

MARKS = 14
"""Marks on a belt across the window; they move with it."""


class Nominal:
    """Particle 0, its track so far, and strobe dots at round times."""

    def __init__(self, ax: Axes, recording: Recording) -> None:
        track = recording.track(0)
        begin, end = float(track["t"][0]), float(track["t"][-1])
        self.recording = subset(recording, [0])
        self.times = track_times(recording, begin, end)
        self.path = self.recording.at(self.times)[0][:, 0]
        self.step = strobe_step(recording)
        self.round = round_times(begin, end, self.step)
        self.stops = self.recording.at(self.round)[0][:, 0]
        (self.trail,) = ax.plot([], [], color=style.TRACK, linewidth=1.6, animated=True)
        self.strobe = _rings(ax, animated=True)
        self.dot = _dots(ax, recording.particle.radius, style.STRIKE)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [self.trail, self.strobe, self.dot]

    def show(self, t: float) -> None:
        """Show the particle at time t (s), nothing of it before release and after the end."""
        now = self.recording.at([t])[0][0]
        self.dot.set_data(*now.T)
        self.trail.set_data(*np.concatenate([self.path[self.times < t], now]).T)
        self.strobe.set_data(*self.stops[self.round <= t].T)

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return handles for a legend."""
        (dot,) = ax.plot([], [], "o", color=style.STRIKE, markersize=6.0, label="particle 0")
        ring = _rings(ax, animated=False)
        ring.set_label(f"every {self.step:g} s")
        return [dot, ring]


class Crowd:
    """The other particles that are on stage during the film, evenly thinned out to `DRAWN`."""

    def __init__(self, ax: Axes, recording: Recording, times: Floats) -> None:
        self.count = recording.count
        sizes = np.diff(recording.offsets)
        released = np.flatnonzero(sizes > 0)
        first, last = recording.ends()
        during = released[(first["t"] <= times[-1]) & (last["t"] >= times[0])]
        others = during[during != 0]
        keep = np.linspace(0, max(len(others) - 1, 0), min(len(others), DRAWN - 1))
        self.particles = others[np.unique(keep.astype(np.int64))]
        self.thinned = len(others) > len(self.particles)
        self.positions = subset(recording, self.particles).at(times)[0]
        self.dots = _dots(ax, recording.particle.radius, style.STREAM)

    @property
    def artists(self) -> list[Artist]:
        """What moves."""
        return [self.dots]

    def show(self, index: int) -> None:
        """Show the particles at a time index."""
        self.dots.set_data(*self.positions[index].T)

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return a handle that says how many of the particles are drawn; none for a lone one."""
        if self.count == 1:
            return []
        drawn = f"{len(self.particles) + 1} of " if self.thinned else ""
        said = f"{drawn}{self.count:,} particles"
        return ax.plot([], [], "o", color=style.STREAM, markersize=6.0, label=said)


class Drives:
    """Marks that run with the belts, and a spoke that turns with the pulley, clockwise at v0/R."""

    def __init__(self, ax: Axes, machine: Machine) -> None:
        self.machine = machine
        self.spacing = float(np.ptp(ax.get_xlim())) / MARKS
        (self.marks,) = ax.plot([], [], "o", markersize=1.8, color="white", animated=True)
        (self.spoke,) = ax.plot([], [], color=style.STEEL, linewidth=1.6, animated=True)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [self.spoke, self.marks]

    def show(self, t: float) -> None:
        """Show belts and pulley at time t, s."""
        segments, marks = self.machine.segments, [np.empty((0, 2))]
        for i in np.flatnonzero(segments.speed):
            shift = (segments.speed[i] * t) % self.spacing
            along = np.arange(shift, segments.length[i], self.spacing)
            marks.append(segments.start[i] + along[:, None] * segments.tangent[i])
        self.marks.set_data(*np.concatenate(marks).T)
        pulley = self.machine.pulley
        if pulley is not None:
            angle = pulley.speed * t / pulley.radius
            rim = 0.9 * pulley.radius * np.array([np.sin(angle), np.cos(angle)])
            self.spoke.set_data([-rim[0], rim[0]], [-rim[1], rim[1]])


def _dots(ax: Axes, radius: float, color: str) -> Line2D:
    """Return disks to scale (m), or of `SMALLEST` size."""
    pixels = 2.0 * radius * ax.get_window_extent().width / float(np.ptp(ax.get_xlim()))
    (dots,) = ax.plot(
        [],
        [],
        "o",
        markersize=max(pixels * 72.0 / ax.figure.dpi, SMALLEST),
        markeredgewidth=0.4,
        markeredgecolor="white",
        markerfacecolor=color,
        animated=True,
    )
    return dots


def _rings(ax: Axes, *, animated: bool) -> Line2D:
    (rings,) = ax.plot(
        [],
        [],
        "o",
        markersize=4.5,
        markerfacecolor="white",
        markeredgecolor=style.TRACK,
        animated=animated,
    )
    return rings
