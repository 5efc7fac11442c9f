"""What moves in the picture: particles, the arrow of a velocity, belts, pulley, energy bars.

Each actor draws itself on axes, lists its `artists`, and `show`s one of the film's moments. The
energy ledger is two stacked bars of equal height: what was put in, and where it is now.
"""

from __future__ import annotations

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.font_manager import FontProperties, findfont
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from PIL import ImageDraw, ImageFont

from chutelab.machine import Machine
from chutelab.pictures.plots import style
from chutelab.pictures.plots.scenery import (
    nominal,
    spread,
    strobe_step,
    strobe_times,
    subset,
    track_times,
)
from chutelab.results import Recording
from chutelab.util.arrays import Floats

LONGEST = 0.10
"""Share of the picture's width that the arrow of the highest speed is long."""

SHAFT, HEAD = 1.3, 6.0
"""pt; width of an arrow's shaft, and length of its head."""

SEEN = 0.75
"""Heads that a component must be long to be drawn, beside an arrow that it hardly differs from."""

DRAWN = 300
"""Particles that are drawn at most, particle 0 included."""

SMALLEST = 6.0
"""pt; the diameter a particle is drawn with if to scale it would be smaller."""

MARKS = 3
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
        self.times = times
        self.position, self.velocity = nominal(recording, times)
        clock = recording.track(0)["t"]
        filmed = times[(times >= clock[0]) & (times <= clock[-1])]
        self.passed = np.union1d(filmed, track_times(recording))
        self.path, _ = nominal(recording, self.passed)
        self.step = strobe_step(recording)
        self.round = strobe_times(recording)
        self.stops, _ = nominal(recording, self.round)
        self.reach = trail
        (self.trail,) = ax.plot([], [], color=style.TRACK, linewidth=2.0, animated=True)
        (self.strobe,) = ax.plot([], [], **style.RINGS, ms=4.5, animated=True)
        self.arrow = arrow
        # In m/s, `arrow` m long for each: two components and the whole, over them. Heads of short
        # arrows shrink with them.
        self.arrows = ax.quiver(
            *np.zeros((4, 3)),
            color=[*style.VELOCITY.values(), style.INK],
            angles="xy",
            scale_units="xy",
            scale=1.0 / (arrow or 1.0),
            units="dots",
            width=SHAFT * ax.figure.dpi / 72.0,
            minlength=0.0,
            headwidth=0.8 * HEAD / SHAFT,
            headlength=HEAD / SHAFT,
            headaxislength=HEAD / SHAFT,
            zorder=2.0,
            animated=True,
        )
        self.least = SEEN * HEAD / _points(ax, 1.0)
        self.dot = _dots(ax, recording.particle.radius, style.STRIKE, 0.4)
        self._strobes = strobe

    @property
    def artists(self) -> list[Artist]:
        """What moves, from back to front."""
        artists: list[Artist] = [self.trail] if self.reach else []
        artists += [self.strobe] if self._strobes else []
        artists += [self.arrows] if self.arrow else []
        return [*artists, self.dot]

    def show(self, index: int) -> None:
        """Show the particle at a time index, nothing of it before release and after the end."""
        t, now = self.times[index], self.position[index]
        self.dot.set_data(*now[:, None])
        self.strobe.set_data(*self.stops[self.round <= t].T)
        vx, vy = self.velocity[index]
        # Components are drawn where there are two that can be told from the whole.
        two = self.arrow * min(abs(vx), abs(vy)) > self.least
        self.arrows.set_offsets([now] * 3)
        self.arrows.set_UVC([vx * two, 0.0, vx], [0.0, vy * two, vy])
        here = slice(*np.searchsorted(self.passed, [t - self.reach, t], side="right"))
        self.trail.set_data(*self.path[here].T)

    def legend(self, ax: Axes) -> list[Line2D]:
        """Return handles for a legend."""
        (dot,) = ax.plot([], [], "o", color=style.STRIKE, markersize=6.0, label="particle 0")
        handles = [dot]
        if self._strobes:
            handles += ax.plot([], [], **style.RINGS, ms=4.5, label=f"every {self.step:g} s")
        if self.arrow:
            handles += ax.plot([], [], color=style.INK, linewidth=2.0, label="velocity")
        return handles


class Crowd:
    """The other particles that are on stage during the film, evenly thinned out to `DRAWN`.

    Parameters
    ----------
    ax, recording, times, trail
        As of `Nominal`.
    """

    def __init__(self, ax: Axes, recording: Recording, times: Floats, *, trail: float) -> None:
        self.count = recording.count
        released = np.diff(recording.offsets) > 0
        first, last = recording.ends()
        during = released.nonzero()[0][(first["t"] <= times[-1]) & (last["t"] >= times[0])]
        others = during[during != 0]
        self.particles = others[spread(len(others), DRAWN - 1)]
        self.thinned = len(others) > len(self.particles)
        self.positions = subset(recording, self.particles).at(times)[0]
        # A trail reaches back to the picture before at least.
        back = np.minimum(np.searchsorted(times, times - trail), np.arange(len(times)) - 1)
        self.since = np.maximum(back, 0) if trail else None
        light = style.tint(style.STREAM, 0.5)
        (self.trails,) = ax.plot([], [], color=light, linewidth=1.0, animated=True)
        # Told apart where they overlap.
        self.dots = _dots(ax, recording.particle.radius, style.STREAM, 0.8)

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
        (self.marks,) = ax.plot([], [], "o", ms=3.2, mew=0.0, color="white", animated=True)
        (self.holes,) = ax.plot([], [], "o", ms=size, mew=0.0, color=style.STEEL, animated=True)

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


def _dots(ax: Axes, radius: float, color: str, edge: float) -> Line2D:
    """Return disks to scale (m), or of `SMALLEST` size, with a white edge (pt)."""
    size = max(_points(ax, 2.0 * radius), SMALLEST)
    (dots,) = ax.plot([], [], "o", color=color, ms=size, mew=edge, mec="white", animated=True)
    return dots


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


class Writing:
    """A text that changes from frame to frame, by Pillow.

    Matplotlib lays a changed text out anew, which for the eight of a frame takes 3.3 ms, ten times
    as long as Pillow.

    Parameters
    ----------
    size, dpi : float
        pt, and pixels to the inch.
    x, y : float
        Its place, pixels from the left and the top.
    anchor : str
        What of it is there, as Pillow names it, such as "rs": the right end of the base line.
    """

    def __init__(self, size: float, dpi: float, x: float, y: float, anchor: str) -> None:
        path = findfont(FontProperties())
        self.font = ImageFont.truetype(
            path, size * dpi / 72.0, layout_engine=ImageFont.Layout.BASIC
        )
        self.place, self.anchor = (round(x), round(y)), anchor
        self.text = ""

    def paint(self, draw: ImageDraw.ImageDraw) -> None:
        """Write it onto a picture."""
        draw.text(
            self.place, self.text, style.INK, self.font, self.anchor, spacing=0.35 * self.font.size
        )


def stacks(books: dict[str, Floats]) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Split a ledger into what was put in and where it is, all values positive.

    An entry of the other sign changes sides: work that a braking belt takes out belongs to where
    the energy is. Both sides add up to the same, see `SIGNS`.

    Parameters
    ----------
    books : dict of ndarray, shape (T,)
        J, as `chutelab.pictures.plots.scenery.energies` names them.
    """
    signed = {name: sign * books[name] for name, sign in SIGNS.items()}
    put_in = {name: np.maximum(values, 0.0) for name, values in signed.items()}
    return put_in, {name: np.maximum(-values, 0.0) for name, values in signed.items()}


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
        self.stacks = stacks(books)
        highest = float(np.max(sum(self.stacks[0].values())))
        self.factor, self.unit = style.scaled(highest, "J")
        self.ax = style.dress(ax, title=f"Energy, {self.unit}")
        ax.grid(visible=False, axis="x")
        ax.set_xlim(-0.6, 1.6)
        ax.set_ylim(0.0, 1.06 * self.factor * highest or 1.0)
        ax.set_xticks([0, 1], ["put in", "is now"], fontsize=style.SMALL)
        ax.tick_params(axis="x", length=0)
        table.set_axis_off()
        table.set_xlim(0.0, 1.0)
        table.set_ylim(len(SIGNS), 0.0)
        dpi, high = ax.figure.dpi, ax.figure.bbox.height
        self.values = {}
        for row, name in enumerate(SIGNS):
            table.add_patch(Rectangle((0.0, row + 0.2), 0.05, 0.6, color=style.ENERGY[name]))
            table.text(0.08, row + BASE, style.ENERGY_LABEL[name], fontsize=style.SMALL)
            right, up = table.transData.transform((1.0, row + BASE))
            self.values[name] = Writing(style.SMALL, dpi, right, high - up, "rs")

    def show(self, index: int) -> None:
        """Set the bars and figures to the books at a time index."""
        self.heights = [
            {name: self.factor * float(values[index]) for name, values in side.items()}
            for side in self.stacks
        ]
        for name, writing in self.values.items():
            value = float(self.books[name][index])
            shown = f"{round(self.factor * value, 1) + 0.0:.1f}".replace("-", "−")
            writing.text = style.scientific(value, "J") if name == "residual" else shown

    def paint(self, draw: ImageDraw.ImageDraw, high: int) -> None:
        """Paint the bars onto a picture that is so many pixels high, in whole pixels."""
        for x, heights in zip((0.0, 1.0), self.heights, strict=True):
            base = 0.0
            for name, height in heights.items():
                corners = self.ax.transData.transform([(x - 0.4, base), (x + 0.4, base + height)])
                (left, bottom), (right, top) = np.rint(corners).astype(int).tolist()
                base += height
                if top > bottom:
                    # Pillow paints the last pixel too.
                    box = (left, high - top, right - 1, high - bottom - 1)
                    draw.rectangle(box, fill=style.ENERGY[name])
