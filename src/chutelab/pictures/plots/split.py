"""The velocity at an impact, split along a surface and into it: before, and what is left after."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes

from chutelab.pictures.plots import style
from chutelab.pictures.plots.style import Picture
from chutelab.results import Kind, Recording
from chutelab.util.arrays import Floats

SIZE = (7.2, 3.9)
"""Width and height of the picture, inches."""

ALONG, INTO = style.TRACK, style.STRIKE
"""Colours of the component along the surface, and of the one into it."""

LETTERS = 14.0
"""pt; of symbols."""


def split_velocity(
    recording: Recording, path: str | Path | None = None, *, surface: str = "plate"
) -> Picture:
    """Draw the velocities before and after the first impact on a surface, and how they split.

    They are to scale, with the theory's symbols and no number: v_2 before and v_2' after, v_t along
    the surface, v_n into it, φ_2 between surface and v_2, α between surface and the vertical.

    Raises
    ------
    ValueError
        If no particle hits that surface.
    OSError
        If the file cannot be written.
    """
    impacts = recording.select(Kind.IMPACT, surface=surface)
    if not len(impacts):
        raise ValueError(f"no particle hits a surface {surface!r}")
    before, after = impacts[0]["velocity_before"], impacts[0]["velocity_after"]
    segments = recording.machine.segments
    tangent = segments.tangent[segments.surface == impacts[0]["surface"]][0]
    tangent = tangent if tangent @ before > 0.0 else -tangent
    normal = np.array([-tangent[1], tangent[0]])
    normal = normal if normal @ before < 0.0 else -normal
    speed, here = float(np.hypot(*before)), np.zeros(2)
    figure = Picture(SIZE)
    left, right = (figure.add_axes((place, 0.02, 0.48, 0.96)) for place in (0.01, 0.51))
    for ax in (left, right):
        ax.set_aspect("equal")
        ax.set_axis_off()
        ends = np.outer([-1.2 * speed, 1.2 * speed], tangent)
        ax.plot(*ends.T, color=style.INK, lw=4.0, solid_capstyle="butt", gid="surface")
    into = normal * (normal @ before)
    _arrow(left, -before, here, style.INK, "$v_2$", -before / speed, 0.0)
    _arrow(left, -before, -into, ALONG, "$v_t$", normal)
    _arrow(left, -into, here, INTO, "$v_n$", tangent)
    _angle(left, here, -tangent, -before, 0.6 * speed, r"$\varphi_2$")
    back = normal * (normal @ after)
    _arrow(right, here, after, style.INK, "$v_2'$", after / np.hypot(*after), 1.0)
    _arrow(right, back, after, ALONG, "$v_t' = v_t$", normal)
    _arrow(right, here, back, INTO, r"$v_n' = \varepsilon v_n$", (normal - tangent) / 2.0**0.5, 1.0)
    foot = min(ends.tolist(), key=lambda end: end[1])
    leaning, up = -np.array(foot), np.array([0.0, 1.0])
    if abs(leaning[0]) > 1e-9 * speed:
        line = np.stack([foot, foot + 0.9 * speed * up])
        right.plot(*line.T, color=style.MUTED, lw=1.0, ls="--")
        _angle(right, np.array(foot), up, leaning, 0.6 * speed, r"$\alpha$")
    for ax in (left, right):
        ax.set(xlim=(-1.25 * speed, 1.25 * speed), ylim=(-1.25 * speed, 1.25 * speed))
    figure.write(path)
    return figure


def _pair(place: Floats) -> tuple[float, float]:
    return float(place[0]), float(place[1])


def _arrow(
    ax: Axes, tail: Floats, tip: Floats, color: str, said: str, aside: Floats, at: float = 0.5
) -> None:
    """Draw an arrow, and its symbol on the side to which `aside` points, at a share of its way."""
    look = {"arrowstyle": "-|>", "color": color, "lw": 2.2, "shrinkA": 0.0, "shrinkB": 0.0}
    ax.annotate("", _pair(tip), _pair(tail), arrowprops={**look, "mutation_scale": 14.0})
    across, up = (0 if abs(part) < 0.3 else int(np.sign(part)) for part in aside)
    ax.annotate(
        said,
        _pair(tail + at * (tip - tail)),
        _pair((8.0 if across else 13.0) * aside),
        textcoords="offset points",
        color=color,
        fontsize=LETTERS,
        ha=("center", "left", "right")[across],
        va=("center", "bottom", "top")[up if across else 0],
    )


def _angle(ax: Axes, at: Floats, one: Floats, other: Floats, radius: float, said: str) -> None:
    """Draw the arc of the angle between two directions, with its symbol inside."""
    first, second = (float(np.arctan2(*direction[::-1])) for direction in (one, other))
    turn = (second - first + np.pi) % (2.0 * np.pi) - np.pi
    angles = first + turn * np.linspace(0.0, 1.0, 40)
    arc = at + radius * np.stack([np.cos(angles), np.sin(angles)], axis=-1)
    ax.plot(*arc.T, color=style.MUTED, lw=1.2)
    middle = first + 0.5 * turn
    x, y = at + 0.72 * radius * np.array([np.cos(middle), np.sin(middle)])
    ax.text(x, y, said, color=style.MUTED, fontsize=LETTERS, ha="center", va="center")
