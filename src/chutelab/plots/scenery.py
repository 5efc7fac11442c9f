"""The machine drawn to scale: pulley, belts, plate and free surfaces, with their names."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.patches import Circle
from matplotlib.patheffects import withStroke

from chutelab.compare import scene_of
from chutelab.machine import build
from chutelab.plots import style
from chutelab.plots.sampling import spread
from chutelab.plots.window import Window, around

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.text import Annotation
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording

HALO = [withStroke(linewidth=3.0, foreground="white")]
"""Keeps text readable where a line runs behind it."""

TWO_LINES = 32.0
"""pt; height of two lines of small text."""


def machine_of(recording: Recording) -> Machine:
    """Return the machine that a recording was made on, resolved again from its scene."""
    return build(scene_of(recording))


def show_window(ax: Axes, window: Window) -> Window:
    """Set limits that hold a window at equal scales and fill the axes; return what is shown."""
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
        window = around(ends).padded(0.1, 0.22, 0.1, 0.12)
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
            _label(ax, machine, i, part, shown)
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
    part: tuple[NDArray[np.float64], NDArray[np.float64]],
    shown: Window,
) -> Annotation:
    """Name a surface at its part that is shown, on the side where no particle is expected."""
    name = machine.surfaces[machine.segments.surface[segment]]
    speed = float(machine.segments.speed[segment])
    tangent = machine.segments.tangent[segment]
    low, high = sorted(part, key=lambda point: (point[1], point[0]))
    gap = 7.0
    if name == "plate":
        angle = float(np.degrees(np.arctan2(-tangent[0], tangent[1]))) + 0.0  # no -0
        text = f"plate, {angle:.3g}°\nε = {machine.segments.restitution[segment]:.3g}"
        where, offset = high, (gap, 0.0)
        # Two lines need room above where they begin.
        room = TWO_LINES * ax.figure.dpi / 72.0 * shown.height / ax.get_window_extent().height
        if angle > 0.0 and high[1] > shown.top - room:
            where = low + (high - low) * max(0.0, shown.top - room - low[1]) / (high[1] - low[1])
        across, along = "left", "top" if angle <= 0.0 else "bottom"
    elif name == "incoming":
        text = f"incoming belt\n{_motion(speed)}"
        where, offset = np.array([shown.left, part[0][1]]), (4.0, -gap)
        across, along = "left", "top"
    elif name == "outgoing":
        text = f"outgoing belt, {_motion(speed)}"
        where, offset = np.array([max(part[0][0], part[1][0]), part[0][1]]), (-6.0, -gap)
        across, along = "right", "top"
    else:
        text = name if speed == 0.0 else f"{name}, {_motion(speed)}"
        down = np.array([tangent[1], -tangent[0]])
        down *= -1.0 if down[1] > 0.0 or (down[1] == 0.0 and down[0] < 0.0) else 1.0
        where, offset = 0.5 * (low + high), (gap * down[0], gap * down[1])
        across = "center" if abs(down[0]) < 0.2 else "right" if down[0] < 0.0 else "left"
        along = "top" if down[1] < -0.2 else "center"
    label = ax.annotate(
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
    _keep_inside(ax, label)
    return label


def _keep_inside(ax: Axes, label: Annotation) -> None:
    """Shift a name back over the edges of the axes."""
    box, frame = label.get_window_extent(), ax.get_window_extent()
    margin = 3.0
    right = max(frame.x0 + margin - box.x0, 0.0) + min(frame.x1 - margin - box.x1, 0.0)
    up = max(frame.y0 + margin - box.y0, 0.0) + min(frame.y1 - margin - box.y1, 0.0)
    x, y = label.xyann
    points = 72.0 / ax.figure.dpi
    label.xyann = (x + right * points, y + up * points)


def _motion(speed: float) -> str:
    arrow = "→" if speed > 0.0 else "←"
    return f"{abs(speed):.3g} m/s {arrow}" if speed != 0.0 else "at rest"


def shown_particles(recording: Recording, at_most: int) -> NDArray[np.int64]:
    """Return the particles to draw: up to `at_most` released ones, particle 0 among them."""
    chosen = spread(recording.count, at_most)
    released = recording.offsets[1:] > recording.offsets[:-1]
    return chosen[released[chosen]]
