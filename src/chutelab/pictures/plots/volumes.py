"""What lies behind the surfaces: loops of belts, pulleys and rollers, the steel of plates.

As in the live page, the surface that particles meet is the outer edge of a belt and the struck face
of a plate; what is drawn of their thickness lies on the other side, and no engine knows of it.
"""

from __future__ import annotations

from itertools import groupby
from math import atan2

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path

from chutelab.machine import Arcs, Machine, Pieces, Segments
from chutelab.pictures.plots import style
from chutelab.util.arrays import Floats

THICK = (3.0, 8.0, 0.0165)
"""Thickness of belts: at least and at most so many pt, and as a share of the axes' height."""

PLATE = 1.4
"""Thickness of plates in that of belts."""

STRANDS = 4.5
"""Of a belt without pulleys of its own: distance of its two strands in its thickness."""

HUB = 7.0
"""pt of radius from which on a wheel has a hub."""

HALF = 40
"""Points of half a circle."""

BEHIND = 0.7
"""Their z-order: below all surfaces, above the grid."""


def thickness(ax: Axes) -> float:
    """Return how thick belts are in these axes, pt."""
    least, most, share = THICK
    return min(most, max(least, share * ax.get_window_extent().height * 72.0 / ax.figure.dpi))


def draw_volumes(ax: Axes, machine: Machine, points: float) -> None:
    """Draw what lies behind a machine's surfaces, where a length of 1 m is so many pt."""
    thick = thickness(ax) / points
    own = [piece for piece in machine.pieces if not piece.gate]
    for surface, parts in groupby(sorted(own, key=lambda one: int(one.surface)), _surface):
        pieces = list(parts)
        flat = [one for one in pieces if isinstance(one, Segments)]
        wheels = [one for one in pieces if isinstance(one, Arcs) and one.whole and one.speed]
        name = machine.surfaces[surface]
        if machine.pulley is not None and surface == machine.pulley.surface:
            back = flat[0].start - machine.pulley.radius * flat[0].normal(flat[0].at(0.0))
            _loop(ax, np.array([back, [0.0, 0.0]]), machine.pulley.radius, thick, points)
        elif flat and len(wheels) > 1:
            centers = np.array([one.center for one in wheels])
            _loop(ax, centers, float(wheels[0].radius), thick, points)
        elif flat and (name == "outgoing" or flat[0].speed):
            for piece in flat:
                _belt(ax, piece, thick, points)
        for piece in flat if name in plates(machine) else ():
            _add(ax, _behind(piece, PLATE * thick), style.STEEL_LIGHT, style.STEEL)


def _surface(piece: Pieces) -> int:
    return int(piece.surface)


def plates(machine: Machine) -> set[str]:
    """Return the names of a machine's plates."""
    return {plate.name or "plate" for plate in machine.scene.plates}


def _add(ax: Axes, outline: Path, face: str, edge: str, width: float = 0.7) -> None:
    patch = PathPatch(outline, facecolor=face, edgecolor=edge, linewidth=width, zorder=BEHIND)
    ax.add_patch(patch)


def _behind(piece: Segments, deep: float) -> Path:
    """Return the outline of a body of some depth (m) behind a piece: on its right."""
    along = piece.path()
    down = -deep * piece.normal(piece.at(0.5 * piece.way))
    return _closed(np.concatenate([along, along[::-1] + down]))


def _stadium(axes: Floats, radius: float) -> Floats:
    """Return the outline of a loop round two axes (2, 2), m, counterclockwise."""
    way = axes[1] - axes[0]
    first = atan2(way[1], way[0]) - 0.5 * np.pi
    angles = first + np.linspace(0.0, np.pi, HALF)
    ends = [angles, angles + np.pi]
    around = [np.stack([np.cos(one), np.sin(one)], axis=-1) for one in ends]
    return np.concatenate([axes[1] + radius * around[0], axes[0] + radius * around[1]])


def _ring(ax: Axes, axes: Floats, radius: float, thick: float) -> None:
    """Draw a belt that lies round two axes, its outer edge at a radius (m)."""
    outer, inner = _stadium(axes, radius), _stadium(axes, radius - thick)
    # What runs backward is a hole.
    _add(ax, Path.make_compound_path(_closed(outer), _closed(inner[::-1])), style.BELT_BODY, "none")


def _closed(points: Floats) -> Path:
    return Path(np.concatenate([points, points[:1]]), closed=True)


def _loop(ax: Axes, axes: Floats, radius: float, thick: float, points: float) -> None:
    """Draw a belt round two wheels."""
    _ring(ax, axes, radius, thick)
    for center in axes:
        _wheel(ax, center, max(radius - 1.15 * thick, 0.4 * radius), points)


def _belt(ax: Axes, piece: Segments, thick: float, points: float) -> None:
    """Draw a belt without pulleys of its own: a loop below what it carries."""
    ends = piece.path()
    ends = ends[np.argsort(ends[:, 0])]
    way = (ends[1] - ends[0]) / float(piece.length)
    down = np.array([way[1], -way[0]])
    turn = min(0.5 * (STRANDS + 1.0) * thick, 0.25 * float(piece.length))
    axes = ends + turn * down
    _ring(ax, axes, turn, thick)
    for center in axes:
        _wheel(ax, center, max(turn - 1.6 * thick, 0.3 * turn), points)


def _wheel(ax: Axes, center: Floats, radius: float, points: float) -> None:
    """Draw a wheel of steel."""
    circle = Circle(tuple(np.asarray(center).tolist()), radius, zorder=BEHIND + 0.1)
    circle.set(facecolor=style.STEEL_LIGHT, edgecolor=style.STEEL, linewidth=0.9)
    ax.add_patch(circle)
    if radius * points > HUB:
        hub = Circle(tuple(np.asarray(center).tolist()), 0.16 * radius, zorder=BEHIND + 0.3)
        hub.set(facecolor=style.STEEL, edgecolor=style.MUTED, linewidth=0.7)
        ax.add_patch(hub)
