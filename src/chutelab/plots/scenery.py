"""The machine drawn to scale: pulley, belts, plate and free surfaces, in a window of interest."""

from __future__ import annotations

import json
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from chutelab import scene as scenes
from chutelab.machine import build
from chutelab.plots import style
from chutelab.plots.sampling import action, spread, subset, track_times
from chutelab.recording import Kind

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Text
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording
    from chutelab.scene import Scene

HALO = [withStroke(linewidth=3.0, foreground="white")]
"""Keeps text readable where a line runs behind it."""

NEARBY = 0.25
"""Share of the action's size around it within which surfaces are shown."""


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

    def clip(
        self, start: NDArray[np.float64], end: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]] | None:
        """Return the ends of the part of a straight line inside, None if it stays outside."""
        along = end - start
        low, high = 0.0, 1.0
        for axis, (lower, upper) in enumerate(
            ((self.left, self.right), (self.bottom, self.top))
        ):
            if along[axis] == 0.0:
                if not lower <= start[axis] <= upper:
                    return None
                continue
            shares = sorted((bound - start[axis]) / along[axis] for bound in (lower, upper))
            low, high = max(low, shares[0]), min(high, shares[1])
        return (start + low * along, start + high * along) if low < high else None


def scene_of(recording: Recording) -> Scene:
    """Return the validated scene that a recording carries."""
    return scenes.from_dict(json.loads(recording.scene), recording.title)


def machine_of(recording: Recording) -> Machine:
    """Return the machine that a recording was made on, resolved again from its scene."""
    return build(scene_of(recording))


def window_of(recording: Recording, machine: Machine) -> Window:
    """Return the window in which something happens, with room for labels.

    It holds particle 0 from separation (or release, without one) to its last event that is no
    exit, nearly all events of the others, the pulley, and what lies near of the surfaces.
    """
    points = [_path(recording), _crowd(recording)]
    if machine.pulley is not None:
        corner = np.full(2, machine.pulley.radius)
        points.append(np.array([-corner, corner]))
    core = _around(np.concatenate(points))
    near = core.padded(NEARBY, NEARBY, NEARBY, NEARBY)
    shown = [
        near.clip(start, end)
        for start, end in zip(machine.segments.start, machine.segments.end, strict=True)
    ]
    ends = [np.array(part) for part in shown[_first_free(machine) :] if part is not None]
    window = _around(np.concatenate([*points, *ends]))
    has_plate = "plate" in machine.surfaces
    return window.padded(0.12, 0.22 if has_plate else 0.06, 0.10, 0.12)


def _first_free(machine: Machine) -> int:
    """Index of the first segment after the incoming belt, which may be cut off anywhere."""
    return 0 if machine.pulley is None else 1


def _path(recording: Recording) -> NDArray[np.float64]:
    begin, end = action(recording)
    mine = recording.events[recording.events["particle"] == 0]
    mine = mine[(mine["kind"] != Kind.EXIT) & (mine["kind"] != Kind.RELEASE)]
    if len(mine) and mine["t"][-1] > begin:
        end = float(mine["t"][-1])
    position, _ = subset(recording, [0]).at(track_times(recording, begin, end))
    return position[:, 0]


def _crowd(recording: Recording) -> NDArray[np.float64]:
    """Middle 96 % of where the events of the other particles are, as a box's two corners."""
    events = recording.events
    others = events[
        (events["particle"] != 0) & ~np.isin(events["kind"], [int(Kind.RELEASE), int(Kind.EXIT)])
    ]
    if not len(others):
        return np.empty((0, 2))
    return np.asarray(np.quantile(others["position"], [0.02, 0.98], axis=0))


def _around(points: NDArray[np.float64]) -> Window:
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    least = 0.01 * max(right - left, top - bottom) or 0.1
    return Window(left, max(right, left + least), bottom, max(top, bottom + least))


def show_window(ax: Axes, window: Window) -> Window:
    """Set the limits of axes to a window at equal scales, filling the axes; return what is shown."""
    box = ax.get_window_extent()
    shown = window.fitted(box.width / box.height)
    ax.set_xlim(shown.left, shown.right)
    ax.set_ylim(shown.bottom, shown.top)
    ax.set_aspect("equal", adjustable="box")
    return shown


def draw_scene(ax: Axes, machine: Machine, window: Window | None = None) -> Axes:
    """Draw the machine's surfaces to scale, with their names.

    Parameters
    ----------
    ax : Axes
        Its limits are set to hold the window at equal scales.
    machine : Machine
        With one set of surfaces for all particles, segments (S,).
    window : Window, optional
        What to show, see `window_of`; by default all surfaces.
    """
    if window is None:
        ends = np.concatenate([machine.segments.start, machine.segments.end])
        if machine.pulley is not None:
            ends = np.concatenate([ends, [[machine.pulley.radius, -machine.pulley.radius]]])
        window = _around(ends).padded(0.1, 0.22, 0.1, 0.12)
    shown = show_window(ax, window)
    if machine.pulley is not None:
        _draw_pulley(ax, machine.pulley.radius)
    labelled: set[int] = set()
    for i, surface in enumerate(machine.segments.surface):
        start, end = machine.segments.start[i], machine.segments.end[i]
        name = machine.surfaces[surface]
        speed = float(machine.segments.speed[i])
        belt = name in ("incoming", "outgoing") or speed != 0.0
        ax.plot(
            *np.array([start, end]).T,
            color=style.BELT if belt else style.INK,
            linewidth=2.6,
            solid_capstyle="butt",
            zorder=2.0,
            gid=f"surface {name}",
        )
        part = shown.clip(start, end)
        if part is not None and surface not in labelled:
            labelled.add(int(surface))
            _label(ax, machine, i, name, part)
    return ax


def _draw_pulley(ax: Axes, radius: float) -> None:
    ax.add_patch(
        Circle((0.0, 0.0), radius, facecolor=style.STEEL_LIGHT, edgecolor=style.BELT, linewidth=2.0)
    )
    ax.plot([0.0], [0.0], marker="+", color=style.STEEL, markersize=7.0, zorder=1.5)


def _label(
    ax: Axes,
    machine: Machine,
    segment: int,
    name: str,
    part: tuple[NDArray[np.float64], NDArray[np.float64]],
) -> Text:
    """Name a surface on the side where no particle is expected."""
    speed = float(machine.segments.speed[segment])
    low, high = sorted(part, key=lambda point: (point[1], point[0]))
    gap = 7.0
    if name == "plate":
        sine, cosine = -machine.segments.tangent[segment][0], machine.segments.tangent[segment][1]
        angle = float(np.degrees(np.arctan2(sine, cosine))) + 0.0  # no -0
        text = f"plate, {angle:.3g}°\nε = {machine.segments.restitution[segment]:.3g}"
        where, offset = high, (gap, 0.0)
        across, along = "left", "top" if angle <= 0.0 else "bottom"
    elif name == "incoming":
        text = f"incoming belt\n{_motion(speed)}"
        where, offset = np.array([part[0][0], part[0][1]]), (4.0, -gap)
        across, along = "left", "top"
    elif name == "outgoing":
        text = f"outgoing belt, {_motion(speed)}"
        where, offset = np.array([max(part[0][0], part[1][0]), part[0][1]]), (-6.0, -gap)
        across, along = "right", "top"
    else:
        text = name if speed == 0.0 else f"{name}, {_motion(speed)}"
        where, offset = 0.5 * (low + high), (gap, -gap)
        across, along = "left", "top"
    return ax.annotate(
        text.replace("-", "−"),
        (float(where[0]), float(where[1])),
        xytext=offset,
        textcoords="offset points",
        fontsize=style.SMALL,
        color=style.BELT if name in ("incoming", "outgoing") or speed != 0.0 else style.INK,
        horizontalalignment=across,
        verticalalignment=along,
        path_effects=HALO,
        zorder=4.0,
    )


def _motion(speed: float) -> str:
    arrow = "→" if speed > 0.0 else "←"
    return f"{abs(speed):.3g} m/s {arrow}" if speed != 0.0 else "at rest"


def shown_particles(recording: Recording, at_most: int) -> NDArray[np.int64]:
    """Return the particles to draw: up to `at_most` released ones, particle 0 among them."""
    chosen = spread(recording.count, at_most)
    released = recording.offsets[1:] > recording.offsets[:-1]
    return chosen[released[chosen]]
