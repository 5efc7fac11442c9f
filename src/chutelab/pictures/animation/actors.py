"""What moves in the picture: particles, the arrow of a velocity, belts, pulley, energy bars.

Each actor draws itself on axes, lists its `artists`, and `show`s one of the film's moments. The
energy ledger is two stacked bars of equal height: what was put in, and where it is now.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Polygon, Rectangle

from chutelab.machine import Machine
from chutelab.pictures.animation.palette import Label, Lettering, Pixels, tint
from chutelab.pictures.plots import style
from chutelab.pictures.plots.scenery import round_times, strobe_step, subset, track_times
from chutelab.results import Recording
from chutelab.util.arrays import Floats

LONGEST = 0.10
"""Share of the picture's width that the arrow of the highest speed is long."""

SHAFT, HEAD = 1.5, 7.0
"""pt; width of an arrow's shaft, and length of its head."""

COMPONENT = 0.7
"""Share of that for the arrow of a component."""

SEEN = 0.75
"""Heads that a component must be long to be drawn, beside an arrow that it hardly differs from."""


class Arrows:
    """Three arrows that start at one point; the velocity lies over its components.

    Parameters
    ----------
    ax : Axes
        With its final limits, at equal scales.
    scale : float
        m that an arrow is long for 1 m/s; 0: none are drawn.
    """

    def __init__(self, ax: Axes, scale: float) -> None:
        self.scale = scale
        self._point = float(np.ptp(ax.get_xlim())) / ax.get_window_extent().width
        self._point *= ax.figure.dpi / 72.0
        colours = {**style.VELOCITY, "v": style.INK}
        self.arrows = {
            name: Polygon(np.zeros((1, 2)), facecolor=colour, linewidth=0.0, animated=True)
            for name, colour in colours.items()
        }
        for arrow in self.arrows.values():
            ax.add_patch(arrow)

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        return [arrow for arrow in self.arrows.values() if self.scale and arrow.get_visible()]

    def show(self, position: Floats, velocity: Floats) -> None:
        """Let the arrows start at a position, m, and show a velocity, m/s; none if it is NaN."""
        along = self.scale * velocity
        parts = {"vx": along * (1.0, 0.0), "vy": along * (0.0, 1.0), "v": along}
        least = SEEN * COMPONENT * HEAD * self._point
        # A component is drawn where there are two of them.
        two = bool((np.abs(along) > least).all())
        for name, part in parts.items():
            self.arrows[name].set_visible(bool(np.hypot(*part) > 0.0) and (two or name == "v"))
            if self.arrows[name].get_visible():
                width = self._point * (1.0 if name == "v" else COMPONENT)
                self.arrows[name].set_xy(position + outline(part, SHAFT * width, HEAD * width))

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return a handle for a legend; none without arrows."""
        if not self.scale:
            return []
        return ax.plot([], [], color=style.INK, linewidth=2.0, label="velocity")


def outline(along: Floats, shaft: float, head: float) -> Floats:
    """Return the corners (7, 2) of an arrow from the origin, its head no longer than itself.

    >>> outline(np.array([4.0, 0.0]), 1.0, 2.0).tolist()[:4]
    [[0.0, 0.5], [2.0, 0.5], [2.0, 0.8], [4.0, 0.0]]
    """
    length = float(np.hypot(*along))
    head = min(head, length)
    neck, half = length - head, 0.4 * head
    x = np.array([0.0, neck, neck, length, neck, neck, 0.0])
    y = np.array([0.5 * shaft, 0.5 * shaft, half, 0.0, -half, -0.5 * shaft, -0.5 * shaft])
    tangent = along / length
    return np.asarray(x[:, None] * tangent + y[:, None] * np.array([-tangent[1], tangent[0]]))


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


SIGNS = {
    "start": 1,
    "belt_work": 1,
    "kinetic": -1,
    "potential": -1,
    "restitution_loss": -1,
    "friction_loss": -1,
    "residual": 1,
}
"""The ledger with everything on one side: start + belt work + residual - K - U - losses = 0."""

BASE = 0.78
"""Share of a row above the line that its text stands on."""


def stacks(books: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Split a ledger into what was put in and where it is, all values positive.

    An entry of the other sign changes sides: work that a braking belt takes out belongs to where
    the energy is. Both sides add up to the same, see `SIGNS`.

    Parameters
    ----------
    books : dict of float
        J, at one time, as `chutelab.pictures.plots.scenery.energies` names them.
    """
    put_in, is_now = {}, {}
    for name, sign in SIGNS.items():
        value = sign * books[name]
        put_in[name], is_now[name] = max(value, 0.0), max(-value, 0.0)
    return put_in, is_now


class Bars:
    """Two bars with a column of figures beneath; `show` moves them to one time.

    Parameters
    ----------
    ax, table : Axes
        For the bars, and for the list of names and values under them.
    books : dict of ndarray, shape (T,)
        J, see `chutelab.pictures.plots.scenery.energies`; the highest bar sets the scale.
    """

    def __init__(self, ax: Axes, table: Axes, books: dict[str, Floats]) -> None:
        self.books = books
        heights = [sum(stacks(self._at(i))[0].values()) for i in range(len(books["start"]))]
        self.factor, self.unit = style.scaled(max(heights), "J")
        self.ax = style.dress(ax, title=f"Energy, {self.unit}")
        ax.grid(visible=False, axis="x")
        ax.set_xlim(-0.6, 1.6)
        ax.set_ylim(0.0, 1.06 * self.factor * max(heights) or 1.0)
        ax.set_xticks([0, 1], ["put in", "is now"], fontsize=style.SMALL)
        ax.tick_params(axis="x", length=0)
        self.heights: tuple[dict[str, float], dict[str, float]] = ({}, {})
        table.set_axis_off()
        table.set_xlim(0.0, 1.0)
        table.set_ylim(len(SIGNS), 0.0)
        lettering = Lettering(style.SMALL, ax.figure.dpi)
        high = ax.figure.bbox.height
        self.values = {}
        for row, name in enumerate(SIGNS):
            table.add_patch(Rectangle((0.0, row + 0.2), 0.05, 0.6, color=style.ENERGY[name]))
            table.text(0.08, row + BASE, style.ENERGY_LABEL[name], fontsize=style.SMALL)
            right, up = table.transData.transform((1.0, row + BASE))
            self.values[name] = Label(lettering, right, high - up)

    def show(self, index: int) -> None:
        """Set the bars and figures to the books at a time index."""
        now = self._at(index)
        put_in, is_now = (
            {name: self.factor * value for name, value in side.items()} for side in stacks(now)
        )
        self.heights = put_in, is_now
        for name, label in self.values.items():
            label.text = (
                style.scientific(now[name], "J")
                if name == "residual"
                else f"{round(self.factor * now[name], 1) + 0.0:.1f}".replace("-", "−")
            )

    def paint(self, pixels: Pixels) -> None:
        """Paint bars and figures onto a picture, (height, width), in whole pixels."""
        for x, heights in zip((0.0, 1.0), self.heights, strict=True):
            edges = np.cumsum([0.0, *heights.values()])
            across, up = self.ax.transData.transform(
                np.column_stack([np.resize([x - 0.4, x + 0.4], len(edges)), edges])
            ).T
            columns = slice(round(across[0]), round(across[1]))
            rows = np.rint(len(pixels) - up).astype(int)
            for name, top, bottom in zip(heights, rows[1:], rows, strict=False):
                pixels[top:bottom, columns] = _COLOURS[name]
        for label in self.values.values():
            label.paint(pixels)

    def _at(self, index: int) -> dict[str, float]:
        return {name: float(self.books[name][index]) for name in SIGNS}


def _pixel(colour: str) -> np.uint32:
    """Return an opaque pixel, red in the lowest byte."""
    return np.uint32(int.from_bytes(bytes.fromhex(colour.removeprefix("#")) + b"\xff", "little"))


_COLOURS = {name: _pixel(colour) for name, colour in style.ENERGY.items()}
