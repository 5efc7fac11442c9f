"""What moves in the scene: particle 0 with its velocity, the other particles, belts and pulley.

Each actor draws itself on axes, lists its `artists`, and `show`s one of the film's moments.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from chutelab.animate.arrows import Arrows
from chutelab.animate.palette import tint
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

MARKS = 5
"""Marks on a belt across the window; they move with it."""

HOLES = 3
"""Holes in the pulley; they turn with it."""


class Nominal:
    """Particle 0 with a short trail, its strobe dots at round times, and its velocity.

    Parameters
    ----------
    ax : Axes
        With its final limits.
    recording : Recording
        What happened.
    times : ndarray, shape (T,)
        The film's, s.
    trail : float
        s of the recording that the trail reaches back; 0: there is none.
    arrow : float
        m that an arrow is long for 1 m/s; 0: there is none.
    strobe : bool
        Whether strobe dots are drawn.
    """

    def __init__(
        self,
        ax: Axes,
        recording: Recording,
        times: Floats,
        *,
        trail: float,
        arrow: float,
        strobe: bool,
    ) -> None:
        begin, end = (float(recording.track(0)["t"][k]) for k in (0, -1))
        lone = subset(recording, [0])
        self.times = times
        self.position, self.velocity = (values[:, 0] for values in lone.at(times))
        filmed = times[(times >= begin) & (times <= end)]
        self.passed = np.union1d(filmed, track_times(recording, begin, end))
        self.path = lone.at(self.passed)[0][:, 0]
        self.step = strobe_step(recording)
        self.round = round_times(begin, end, self.step)
        self.stops = lone.at(self.round)[0][:, 0]
        self.reach = trail
        (self.trail,) = ax.plot([], [], color=style.TRACK, linewidth=2.0, animated=True)
        self.strobe = _rings(ax, animated=True)
        self.arrows = Arrows(ax, arrow)
        self.dot = _dots(ax, recording.particle.radius, style.STRIKE)
        self._strobes = strobe

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        artists: list[Artist] = [self.trail] if self.reach else []
        artists += [self.strobe] if self._strobes else []
        return [*artists, *self.arrows.artists, self.dot]

    def show(self, index: int) -> None:
        """Show the particle at a time index, nothing of it before release and after the end."""
        t, now = self.times[index], self.position[index]
        self.dot.set_data(*now[:, None])
        self.strobe.set_data(*self.stops[self.round <= t].T)
        self.arrows.show(now, self.velocity[index])
        here = slice(*np.searchsorted(self.passed, [t - self.reach, t], side="right"))
        self.trail.set_data(*self.path[here].T)

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return handles for a legend."""
        (dot,) = ax.plot([], [], "o", color=style.STRIKE, markersize=6.0, label="particle 0")
        handles = [dot]
        if self._strobes:
            handles.append(_rings(ax, animated=False))
            handles[-1].set_label(f"every {self.step:g} s")
        return [*handles, *self.arrows.legend(ax)]


class Crowd:
    """The other particles that are on stage during the film, evenly thinned out to `DRAWN`.

    Parameters
    ----------
    ax, recording, times, trail
        As of `Nominal`.
    """

    def __init__(self, ax: Axes, recording: Recording, times: Floats, *, trail: float) -> None:
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
        # A trail reaches back to the picture before at least.
        back = np.minimum(np.searchsorted(times, times - trail), np.arange(len(times)) - 1)
        self.since = np.maximum(back, 0) if trail else None
        light = tint(style.STREAM, 0.5)
        (self.trails,) = ax.plot([], [], color=light, linewidth=1.0, animated=True)
        self.dots = _dots(ax, recording.particle.radius, style.STREAM)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        if not len(self.particles):
            return []
        return [self.dots] if self.since is None else [self.trails, self.dots]

    def show(self, index: int) -> None:
        """Show the particles at a time index."""
        self.dots.set_data(*self.positions[index].T)
        if self.since is not None:
            trails = self.positions[self.since[index] : index + 1]
            # One line for all, that NaN breaks.
            gaps = np.full((1, *trails.shape[1:]), np.nan)
            self.trails.set_data(*np.concatenate([trails, gaps]).transpose(2, 1, 0).reshape(2, -1))

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return a handle that says how many of the particles are drawn; none for a lone one."""
        if self.count == 1:
            return []
        said = f"{self.count:,} particles"
        if self.thinned:
            said = f"{len(self.particles) + 1} of {self.count:,}"
        return ax.plot([], [], "o", color=style.STREAM, markersize=6.0, label=said)


class Drives:
    """Marks that run with the belts, and holes that turn with the pulley, clockwise at v0/R."""

    def __init__(self, ax: Axes, machine: Machine) -> None:
        self.machine = machine
        self.spacing = float(np.ptp(ax.get_xlim())) / MARKS
        pulley = machine.pulley
        size = 0.0 if pulley is None else min(_points(ax, 0.3 * pulley.radius), SMALLEST)
        (self.marks,) = ax.plot([], [], "o", markersize=3.2, color="white", animated=True)
        (self.holes,) = ax.plot([], [], "o", markersize=size, color=style.STEEL, animated=True)
        self.holes.set_markeredgewidth(0.0)
        self.marks.set_markeredgewidth(0.0)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [self.marks] if self.machine.pulley is None else [self.holes, self.marks]

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
            angles = pulley.speed * t / pulley.radius + 2.0 * np.pi / HOLES * np.arange(HOLES)
            rim = 0.6 * pulley.radius
            self.holes.set_data(rim * np.sin(angles), rim * np.cos(angles))


def _points(ax: Axes, length: float) -> float:
    """Return how many pt a length (m) is in the picture."""
    pixels = length * ax.get_window_extent().width / float(np.ptp(ax.get_xlim()))
    return pixels * 72.0 / ax.figure.dpi


def _dots(ax: Axes, radius: float, color: str) -> Line2D:
    """Return disks to scale (m), or of `SMALLEST` size."""
    (dots,) = ax.plot(
        [],
        [],
        "o",
        markersize=max(_points(ax, 2.0 * radius), SMALLEST),
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
