"""Particles to scale: disks of any size, boxes and polygons turned as they are, and strings."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.lines import Line2D

from chutelab.machine import Machine
from chutelab.pictures import BLUE, GREEN, ORANGE, PURPLE
from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import points_of
from chutelab.pictures.plots.scenery import places, stays, subset
from chutelab.results import Recording
from chutelab.util.arrays import Floats, Ints

HUES = (style.STREAM, PURPLE, ORANGE, BLUE, GREEN)
"""Of streams: orange, that of what is known analytically, as late as may be."""


def stream_colours(count: int) -> list[str]:
    """Return a colour for each stream; from the sixth on they are darker, then they repeat."""
    every = [*HUES, *(style.tint(hue, 0.6, "#000000") for hue in HUES)]
    return [every[i % len(every)] for i in range(count)]


LONGEST = 20
"""Characters of a stream's name in a legend."""


def stream_handles(machine: Machine) -> list[Line2D]:
    """Return what a legend needs to name the streams, unless it is particle 0 alone."""
    colours = stream_colours(len(machine.streams))
    sizes = np.bincount(machine.releases.stream, minlength=len(colours))
    return [
        Line2D(
            [], [], ls="none", marker="o", ms=6.0, color=color, label=style.plain(name[:LONGEST])
        )
        for i, (name, color) in enumerate(zip(machine.streams, colours, strict=True))
        if i or sizes[0] > 1
    ]


class Bodies:
    """Some particles of one look, which can be moved: to scale, or magnified so as to be seen.

    Disks of one size are a line of markers, others a collection of circles; boxes and polygons are
    never magnified.

    Parameters
    ----------
    ax : Axes
        With its limits set.
    recording : Recording
        Whose particles.
    particles : ndarray of int, (n,)
        Which.
    gid, color : str
        Of the artists; polygons have "turned" added to theirs.
    least : float
        pt; the machine's largest disk is drawn at least so large, and others magnified alike.
    edge : float
        pt; width of the white edge of disks, which tells them apart where they overlap.
    """

    def __init__(
        self,
        ax: Axes,
        recording: Recording,
        particles: Ints,
        gid: str,
        color: str,
        *,
        least: float,
        edge: float,
        zorder: float = 2.0,
        animated: bool = False,
    ) -> None:
        machine = recording.machine
        outlines = [machine.outlines[kind] for kind in machine.releases.kind[particles]]
        angular = np.array([outline is not None for outline in outlines], dtype=bool)
        self._outlines = [outline for outline in outlines if outline is not None]
        self._round, self._angular = np.flatnonzero(~angular), np.flatnonzero(angular)
        self.artists: list[Line2D | EllipseCollection | PolyCollection] = []
        look: dict[str, Any] = {"zorder": zorder, "animated": animated}
        self._disks: Line2D | EllipseCollection | None = None
        self._polygons: PolyCollection | None = None
        if len(self._round):
            largest = float(np.max(machine.particle.radius))
            sizes = np.broadcast_to(machine.particle.radius, machine.count)[particles[self._round]]
            share = sizes / largest if largest else np.ones(len(sizes))
            sizes = share * max(points_of(ax, 2.0 * largest), least)
            # No edge shall hide a small disk.
            edge = min(edge, 0.15 * float(sizes.min()))
            if np.ptp(sizes) == 0.0:
                (self._disks,) = ax.plot(
                    [], [], ls="none", marker="o", color=color, ms=sizes[0], mew=edge, mec="white",
                    gid=gid, **look,
                )  # fmt: skip
            else:
                inches = sizes / 72.0
                self._disks = EllipseCollection(
                    inches, inches, np.zeros(len(sizes)), units="inches", offsets=np.empty((0, 2)),
                    offset_transform=ax.transData, facecolors=color, edgecolors="white",
                    linewidths=edge, gid=gid, **look,
                )  # fmt: skip
                ax.add_collection(self._disks, autolim=False)
            self.artists.append(self._disks)
        if len(self._angular):
            self._polygons = PolyCollection(
                [], facecolors=color, edgecolors="white", linewidths=0.5 * edge,
                gid=f"{gid} turned", **look,
            )  # fmt: skip
            ax.add_collection(self._polygons, autolim=False)
            self.artists.append(self._polygons)

    def move(self, position: Floats, angle: Floats) -> None:
        """Set the particles to places, (n, 2), m, and angles, (n,), rad; NaN: it is not there."""
        if isinstance(self._disks, Line2D):
            self._disks.set_data(*position[self._round].T)
        elif self._disks is not None:
            self._disks.set_offsets(position[self._round])
        if self._polygons is not None:
            there = [
                placed(outline, position[i], angle[i])
                for outline, i in zip(self._outlines, self._angular.tolist(), strict=True)
                if np.isfinite(position[i, 0])
            ]
            self._polygons.set_verts(there)


def placed(outline: Floats, position: Floats, angle: float) -> Floats:
    """Return the corners of an outline, turned counterclockwise (rad) and moved, (n, 2), m."""
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(position + outline @ np.array([[cosine, sine], [-sine, cosine]]))


def motion(recording: Recording, particles: Ints, times: Floats) -> tuple[Floats, Floats]:
    """Return where particles are seen, (T, n, 2), and how far turned, (T, n), if that is seen."""
    position = places(recording, particles, times)
    if all(outline is None for outline in recording.machine.outlines):
        return position, np.zeros(position.shape[:2])
    some = subset(recording, particles)
    angle = some.at(times).angle
    for i in np.flatnonzero(stays(recording)[particles]).tolist():
        end = some.track(i)["t"][-1]
        angle[times > end, i] = some.at([end]).angle[0, i]
    return position, angle


HANGING = np.linspace(0.0, 1.0, 13)
"""Shares of a slack string's way at which it is drawn."""


def strings(recording: Recording, times: Floats) -> Callable[[int], list[Floats]]:
    """Return the function that gives the strings at the time of an index, (P, 2) each, m.

    A slack one sags between its ends.
    """
    threads = recording.machine.threads
    ends = places(recording, [thread.particle for thread in threads], times)

    def drawn(index: int) -> list[Floats]:
        found = []
        for thread, end in zip(threads, ends[index], strict=True):
            way = end - thread.anchor
            # Pulled down at its middle it would be twice as deep there.
            sag = np.sqrt(max(thread.length**2 - float(way @ way), 0.0))
            path = thread.anchor + HANGING[:, None] * way
            path[:, 1] -= 2.0 * HANGING * (1.0 - HANGING) * sag
            found.append(path)
        return found

    return drawn


LEAST = 1.5
"""pt; the smallest diameter that the largest particle of a still picture is drawn with."""

WHITE = 0.8
"""pt; the edge that tells particles apart where they overlap."""


def draw_bodies(ax: Axes, recording: Recording, t: float, *, crowd: bool = False) -> Axes:
    """Draw all particles and strings as they are at a time (s), in the colour of their stream.

    Unless they are a `crowd`, particle 0 has a colour of its own.
    """
    machine = recording.machine
    released = np.flatnonzero(recording.released)
    drawn = [
        (f"stream {machine.streams[i]}", color, released[machine.releases.stream[released] == i])
        for i, color in enumerate(stream_colours(len(machine.streams)))
    ]
    if not crowd:
        drawn.append(("particle 0", style.STRIKE, released[released == 0]))
    for gid, color, particles in drawn:
        look: dict[str, Any] = {"least": LEAST, "edge": WHITE, "zorder": 4.0}
        position, angle = motion(recording, particles, np.array([t]))
        Bodies(ax, recording, particles, gid, color, **look).move(position[0], angle[0])
    for path in strings(recording, np.array([t]))(0):
        ax.plot(*path.T, color=style.MUTED, lw=1.0, zorder=3.5, gid="string")
    return ax
