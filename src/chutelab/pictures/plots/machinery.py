"""The machine and its particles to scale.

Pulleys, belts, plates, chutes, pegs and gates, with their names and their thickness; disks of any
size, boxes and polygons at their angles, and strings.

As in the live page, the surface that particles meet is the outer edge of a belt and the struck face
of a plate. Their thickness is drawn on the other side, and engines do not have it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, degrees, inf, pi
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import EllipseCollection, PolyCollection
from matplotlib.colors import to_rgba
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, PathPatch
from matplotlib.path import Path
from matplotlib.patheffects import withStroke
from matplotlib.transforms import Bbox

from chutelab.machine import Arcs, Machine, Pieces, Segments, placed
from chutelab.pictures.plots import style
from chutelab.pictures.plots.scenery import Window, around, drawn_tracks, motion, strings
from chutelab.pictures.plots.style import figures, named, say, stream_colours
from chutelab.results import Recording
from chutelab.util.arrays import Floats, Ints


def halo() -> list[withStroke]:
    """Return an effect that keeps text readable over lines."""
    return [withStroke(linewidth=3.0, foreground=style.GROUND)]


TWO_LINES = 32.0
"""pt; height of two lines of small text."""

THICK = (3.0, 8.0, 0.0165)
"""Thickness of belts: least and most, pt, and as a share of the axes' height."""

PLATE = 1.4
"""Thickness of plates, in thicknesses of belts."""

STRANDS = 4.5
"""Distance of the two strands of a belt without its own pulleys, in its thicknesses."""

HUB = 7.0
"""Least radius of a wheel with a hub, pt."""

HALF = 40
"""Points of half a circle."""

BEHIND = 0.7
"""Z-order of volumes: below all surfaces, above the grid."""


def thickness(ax: Axes) -> float:
    """Return the thickness of belts in these axes, pt."""
    least, most, share = THICK
    return min(most, max(least, share * ax.get_window_extent().height * 72.0 / ax.figure.dpi))


def draw_volumes(ax: Axes, machine: Machine, points: float) -> dict[int, float]:
    """Draw the volumes behind a machine's surfaces; 1 m is so many pt.

    Returns the distance of the strands of belts (m), by surfaces.
    """
    thick, deep = thickness(ax) / points, {}
    own = [piece for piece in machine.pieces if not is_passing(machine, piece)]
    for surface in sorted({int(piece.surface) for piece in own}):
        parts = [one for one in own if one.surface == surface]
        flat = [one for one in parts if isinstance(one, Segments)]
        wheels = [one for one in parts if isinstance(one, Arcs) and one.whole and one.speed]
        name = machine.surfaces[surface]
        centers, radius = np.array([one.center for one in wheels]), 0.0
        if machine.pulley is not None and surface == machine.pulley.surface:
            radius = machine.pulley.radius
            back = flat[0].start - radius * flat[0].normal(flat[0].at(0.0))
            centers = np.array([back, [0.0, 0.0]])
        elif flat and len(wheels) > 1:
            radius = float(wheels[0].radius)
        if radius:
            deep[surface] = 2.0 * radius
            _loop(ax, centers, radius, max(radius - 1.15 * thick, 0.4 * radius), thick, points)
        elif flat and (name == "outgoing" or flat[0].speed):
            # A belt without its own pulleys: a loop below its carrying side.
            for piece in flat:
                ends, length = piece.path(), float(piece.length)
                ends = ends[np.argsort(ends[:, 0])]
                way = (ends[1] - ends[0]) / length
                turn = min(0.5 * (STRANDS + 1.0) * thick, 0.25 * length)
                deep[surface] = 2.0 * turn
                axes = ends + turn * np.array([way[1], -way[0]])
                _loop(ax, axes, turn, max(turn - 1.6 * thick, 0.3 * turn), thick, points)
        for piece in flat if name in plates(machine) else ():
            # The steel is on the right of the struck face.
            face, back = piece.path(), PLATE * thick * piece.normal(piece.at(0.5 * piece.way))
            outline = _closed(np.concatenate([face, face[::-1] - back]))
            _add(ax, outline, style.STEEL_LIGHT, style.STEEL)
    return deep


def plates(machine: Machine) -> set[str]:
    """Return the names of a machine's plates."""
    return {plate.name or "plate" for plate in machine.scene.plates}


def _add(ax: Axes, outline: Path, face: str, edge: str) -> None:
    patch = PathPatch(outline, facecolor=face, edgecolor=edge, linewidth=0.7, zorder=BEHIND)
    ax.add_artist(patch)


def _stadium(axes: Floats, radius: float) -> Floats:
    """Return the outline of a loop round two axes (2, 2), m, counterclockwise."""
    way = axes[1] - axes[0]
    first = atan2(way[1], way[0]) - 0.5 * np.pi
    angles = first + np.linspace(0.0, np.pi, HALF)
    ends = [angles, angles + np.pi]
    around = [np.stack([np.cos(one), np.sin(one)], axis=-1) for one in ends]
    return np.concatenate([axes[1] + radius * around[0], axes[0] + radius * around[1]])


def _closed(points: Floats) -> Path:
    return Path(np.concatenate([points, points[:1]]), closed=True)


def _loop(ax: Axes, axes: Floats, radius: float, wheel: float, thick: float, points: float) -> None:
    """Draw a belt round two axes, its outer edge at one radius (m), on wheels of another."""
    outer, inner = _stadium(axes, radius), _stadium(axes, radius - thick)
    # An outline in the opposite direction is a hole.
    _add(ax, Path.make_compound_path(_closed(outer), _closed(inner[::-1])), style.BELT_BODY, "none")
    for center in axes:
        circle = Circle(tuple(center.tolist()), wheel, zorder=BEHIND + 0.1)
        circle.set(facecolor=style.STEEL_LIGHT, edgecolor=style.STEEL, linewidth=0.9)
        ax.add_artist(circle)
        if wheel * points > HUB:
            hub = Circle(tuple(center.tolist()), 0.16 * wheel, zorder=BEHIND + 0.3)
            hub.set(facecolor=style.STEEL, edgecolor=style.MUTED, linewidth=0.7)
            ax.add_artist(hub)


def pieces(machine: Machine) -> tuple[Pieces, ...]:
    """Return all pieces of a machine's surfaces but the drive pulley."""
    return machine.pieces if machine.pulley is None else machine.pieces[:-1]


def is_passing(machine: Machine, piece: Pieces) -> bool:
    """Whether a piece does not always exist, or moves."""
    return bool(piece.gate) or machine.mover(int(piece.surface)) is not None


def colour_of(machine: Machine, piece: Pieces) -> str:
    """Return the colour of a piece: that of a belt, or of a surface at rest."""
    name = machine.surfaces[piece.surface]
    moves = name in ("incoming", "outgoing") or piece.speed != 0.0
    color: str = style.BELT if moves else style.STRIKE if name in plates(machine) else style.WALL
    return color


def draw_piece(ax: Axes, machine: Machine, piece: Pieces, **look: Any) -> Circle | Line2D:
    """Draw a piece to scale, filled if it is a circle without releases inside."""
    color = look.pop("color", colour_of(machine, piece))
    gid = f"surface {machine.surfaces[piece.surface]}"
    if not (piece.whole and isinstance(piece, Arcs)):
        width = 1.6 if color == style.BELT else 2.6
        (line,) = ax.plot(*piece.path().T, color=color, lw=width, zorder=2.0)
        line.set(solid_capstyle="butt", gid=gid, **look)
        return line
    out = np.hypot(*(machine.releases.position - piece.center).T) >= piece.radius
    # The line must not make a small one look larger.
    radius = float(piece.radius)
    width = min(2.0, points_of(ax, 0.5 * radius))
    circle = Circle(tuple(piece.center.tolist()), radius if width == 2.0 else 0.75 * radius)
    circle.set(facecolor=style.STEEL_LIGHT if out.all() else "none", edgecolor=color)
    circle.set(linewidth=width, zorder=1.0, gid=gid, **look)
    ax.add_artist(circle)
    return circle


def points_of(ax: Axes, length: float) -> float:
    """Return a length (m) in pt of the picture."""
    pixels = length * ax.get_window_extent().width / float(np.ptp(ax.get_xlim()))
    return pixels * 72.0 / ax.figure.dpi


PASSAGE = 14.0
"""pt; length of the arrow at a surface that is solid from one side."""

AXIS = 7.0
"""pt; size of the cross on the axis of a pulley."""


def draw_scene(
    ax: Axes,
    machine: Machine,
    window: Window | None = None,
    *,
    small: bool = False,
    clear: Sequence[Floats] = (),
) -> Axes:
    """Draw the machine's surfaces to scale, with their names, but small with thinner lines only.

    Names keep clear of paths (P, 2), m, that are drawn later.

    Gates are dashed, and so are moving surfaces, at their places in the scene file. Surfaces that
    are solid from one side have an arrow in the direction in which they let particles through. The
    limits of the axes hold the window at equal scales; by default all surfaces.
    """
    if window is None:
        ends = machine.corners
        if machine.pulley is not None:
            ends = np.concatenate([ends, [[machine.pulley.radius, -machine.pulley.radius]]])
        window = around(ends).padded(0.1, 0.22, 0.1, 0.12)
    box = ax.get_window_extent()
    shown = window.fitted(box.width / box.height)
    ax.set(xlim=(shown.left, shown.right), ylim=(shown.bottom, shown.top))
    ax.set_aspect("equal", adjustable="box")
    deep = draw_volumes(ax, machine, points_of(ax, 1.0))
    found = pieces(machine)
    for piece in found:
        look: dict[str, Any] = {"linewidth": 1.3} if small and not piece.whole else {}
        if is_passing(machine, piece):
            look |= {"ls": (0, (2.2, 1.1)), "color": style.tint(colour_of(machine, piece), 0.5)}
        draw_piece(ax, machine, piece, **look)
        if piece.one_sided and not small:
            arrow = {"arrowstyle": "->", "color": style.STRIKE, "shrinkA": 0.0, "shrinkB": 0.0}
            middle, tail = _passage(piece)
            ax.annotate(
                "", middle.tolist(), tail.tolist(), textcoords="offset points", arrowprops=arrow,
                gid=f"passage {machine.surfaces[piece.surface]}",
            )  # fmt: skip
        driven = piece.whole and piece.speed != 0.0
        if driven and isinstance(piece, Arcs) and points_of(ax, float(piece.radius)) > AXIS:
            ax.plot(*piece.center, "+", color=style.STEEL, ms=AXIS, zorder=1.5)
    if anchors := [joint.anchor for joint in machine.joints if joint.anchor is not None]:
        ax.plot(*np.array(anchors).T, "o", color=style.WALL, ms=3.0, zorder=2.0, gid="anchors")
    if not small:
        names = _Names(ax, machine, found, shown, deep)
        names.lines += [(Path(ax.transData.transform(path)), False) for path in clear if len(path)]
        names.write()
    return ax


def _passage(piece: Pieces) -> tuple[Floats, Floats]:
    """Return the arrow of a one-sided piece: tip (m), tail from there (pt)."""
    middle = piece.at(0.5 * piece.way)
    return middle, -PASSAGE * piece.one_sided * piece.normal(middle)


def draw_moved(ax: Axes, machine: Machine, t: float, ghosts: Sequence[float] = ()) -> Axes:
    """Draw moving surfaces at a time (s), and in thin light lines at others."""
    for piece in pieces(machine):
        if mover := machine.mover(int(piece.surface)):
            color, name = colour_of(machine, piece), machine.surfaces[piece.surface]
            look: dict[str, Any] = {"color": style.tint(color, 0.3), "lw": 1.0, "zorder": 1.5}
            for ghost in ghosts:
                ax.plot(*mover.carried(piece.path(), ghost).T, gid=f"ghost {name}", **look)
            look = {"color": color, "lw": 1.8, "zorder": 2.1, "gid": f"last {name}"}
            ax.plot(*mover.carried(piece.path(), t).T, **look)
    return ax


PASSED = 13
"""Times of a run at whose places of moving surfaces there should be no names."""


def swept(recording: Recording) -> list[Floats]:
    """Return the pieces of moving surfaces at `PASSED` times, and tracks of particles on them.

    Each is a line (P, 2), m; there are none if nothing moves.
    """
    machine = recording.machine
    if not machine.movers:
        return []
    times = np.linspace(recording.t[0], recording.t[-1], PASSED)
    found = [
        mover.carried(piece.path(), time)
        for piece in pieces(machine)
        if (mover := machine.mover(int(piece.surface)))
        for time in times.tolist()
    ]
    tracks = (recording.track(i)["position"] for i in drawn_tracks(recording).tolist())
    return [*found, *tracks]


Spot = tuple[Floats, tuple[float, float], str, str]
"""Place of a name: a point (m), the offset from there (pt), and its alignment along both axes."""

GAP = 7.0
"""pt; between a surface and its name."""

SHARES = (0.5, 0.25, 0.75, 0.0, 1.0)
"""Places along a piece for its name, the best first."""

LOOKED_AT = 8
"""Most pieces of one surface that are tried for its name."""

FALL = 0.3
"""Share of the window's height below a gate in which falling particles would cross a name."""

FARTHER = (1.0, 2.5, 4.0)
"""Distances between a surface and its name, in gaps, the best first."""


class _Names:
    """Writes the name of each visible surface once, where it hides least.

    The axes have their limits and show the volumes behind surfaces; `found` are the machine's
    pieces, `shown` those in the picture, `deep` the distances of the strands of belts (m), by
    surfaces.
    """

    def __init__(
        self, ax: Axes, machine: Machine, found: Sequence[Pieces], shown: Window,
        deep: dict[int, float],
    ) -> None:  # fmt: skip
        self.ax, self.machine, self.shown, self.deep = ax, machine, shown, deep
        self.parts: dict[int, list[tuple[Pieces, Floats]]] = {}
        for piece in found:
            points = piece.path()
            if len(points) == 2:
                part = np.array(shown.clip(*points) or np.empty((0, 2)))
            else:
                part = points[shown.holds(points)]
            if len(part):
                self.parts.setdefault(int(piece.surface), []).append((piece, part))
        self.found = found
        self.plates = plates(machine)
        self.thick = thickness(ax)
        # Wheels and steel are filled; a belt has room between its strands.
        self.lines = [(Path(ax.transData.transform(line.get_xydata())), False) for line in ax.lines]
        for body in ax.patches:
            outline = body.get_path().transformed(body.get_patch_transform() + ax.transData)
            filled = to_rgba(body.get_edgecolor())[3] > 0.0
            self.lines += [(Path(corners), filled) for corners in outline.to_polygons()]
        # Particles fall below a gate.
        fall = np.array([[0.0, 0.0], [0.0, -FALL * shown.height]])
        for piece in found:
            if piece.gate:
                below = piece.at(0.5 * piece.way) + fall
                self.lines.append((Path(ax.transData.transform(below)), False))
            if piece.one_sided:
                middle, tail = _passage(piece)
                tip = ax.transData.transform(middle)
                self.lines.append((Path([tip, tip + tail * ax.figure.dpi / 72.0]), False))
        # Boxes round the particles at their release.
        starts = machine.releases.position
        reach = np.broadcast_to(machine.particle.radius, len(starts))[:, None]
        self.starts = [ax.transData.transform(starts + side * reach) for side in (-1.0, 1.0)]
        self.taken: list[Bbox] = []

    def write(self) -> None:
        """Write all names. One without room is left out."""
        frame, points = self.ax.get_window_extent().padded(-3.0), 72.0 / self.ax.figure.dpi
        for surface, parts in self.parts.items():
            color = colour_of(self.machine, parts[0][0])
            color = style.BELT_NAME if color == style.BELT else style.INK
            label = self.ax.annotate(
                style.plain(self._said(surface, parts[0][0])), (0.0, 0.0),
                xytext=(0.0, 0.0), textcoords="offset points", fontsize=style.SMALL,
                color=color, path_effects=halo(), zorder=5.0,
                gid=f"name {self.machine.surfaces[surface]}",
            )  # fmt: skip
            best: tuple[int, Spot, Bbox] | None = None
            for spot in self._spots(parts):
                self._put(label, spot)
                box, (where, offset, across, along) = label.get_window_extent(), spot
                # Move it back over the edges of the axes.
                right = max(frame.x0 - box.x0, 0.0) + min(frame.x1 - box.x1, 0.0)
                up = max(frame.y0 - box.y0, 0.0) + min(frame.y1 - box.y1, 0.0)
                offset = (offset[0] + right * points, offset[1] + up * points)
                spot, box = (where, offset, across, along), box.translated(right, up)
                # Lines, circles and releases that it would cover.
                on = (self.starts[1] > box.min) & (self.starts[0] < box.max)
                hides = sum(line.intersects_bbox(box, filled=whole) for line, whole in self.lines)
                hides += bool(on.all(axis=1).any())
                if box.count_overlaps(self.taken) or (best is not None and hides >= best[0]):
                    continue
                best = hides, spot, box
                if not hides:
                    break
            if best is None:
                label.remove()
                continue
            self._put(label, best[1])
            self.taken.append(best[2].padded(1.0))

    @staticmethod
    def _put(label: Any, spot: Spot) -> None:
        where, offset, across, along = spot
        label.xy, label.xyann = (float(where[0]), float(where[1])), offset
        label.set(ha=across, va=along)

    def _said(self, surface: int, piece: Pieces) -> str:
        """Return the text at a surface, a piece of which is shown."""
        called, speed = self.machine.surfaces[surface], float(piece.speed)
        if called in self.plates:
            x, y = piece.inward[0]
            angle = float(np.degrees(np.arctan2(-x, y))) + 0.0  # no -0
            values = [figures(one) for one in np.unique(piece.restitution).tolist()]
            return f"{named(called)}, {figures(angle)}°\nε = {' / '.join(values)}"
        if isinstance(piece, Segments):
            x, y = piece.tangent * np.sign(speed)
            moves = f"{figures(abs(speed))} m/s {ARROWS[round(4.0 / pi * np.arctan2(y, x)) % 8]}"
        else:
            moves = f"{figures(abs(speed))} m/s {'↻' if speed > 0.0 else '↺'}"
        if called in ("incoming", "outgoing"):
            return say(f"belt-{called}", moves=moves if speed else say("at-rest"))
        times = {(t, "closes") for one in self.found if one.surface == surface
                 if (t := one.appears) > -inf}  # fmt: skip
        times |= {(t, "opens") for one in self.found if one.surface == surface
                  if (t := one.vanishes) < inf}  # fmt: skip
        when = [say(what, time=figures(float(t), ".4g")) for t, what in sorted(times)]
        return ", ".join([named(called), *([moves] if speed else []), *when])

    def _spots(self, parts: list[tuple[Pieces, Floats]]) -> Iterator[Spot]:
        """Yield places for the name of a surface, the best first."""
        piece, part = parts[0]
        name = self.machine.surfaces[piece.surface]
        low, high = sorted((part[0], part[-1]), key=lambda point: (point[1], point[0]))
        if name in self.plates:
            x, y = piece.inward[0]
            angle = degrees(np.arctan2(-x, y))
            # Two lines need room above their beginning.
            room = TWO_LINES * self.ax.figure.dpi / 72.0
            room *= self.shown.height / self.ax.get_window_extent().height
            where = high
            if angle > 0.0 and high[1] > self.shown.top - room:
                share = max(0.0, self.shown.top - room - low[1]) / (high[1] - low[1])
                where = low + (high - low) * share
            along = "top" if angle <= 0.0 else "bottom"
            yield where, (GAP + PLATE * self.thick, 0.0), "left", along
        elif deep := self.deep.get(int(piece.surface)):
            # Between the strands, or else below the lower one.
            sides = [next(_beside(piece, part, share)) for share in SHARES]
            for where, down in sides:
                yield where + 0.5 * deep * down, (0.0, 0.0), "center", "center"
            for where, down in sides:
                yield _spot(where + deep * down, GAP, down)
        for farther in FARTHER:
            for piece, part in parts[:LOOKED_AT]:
                for share in SHARES:
                    for where, normal in _beside(piece, part, share):
                        yield _spot(where, farther * GAP, normal)
            corners = np.concatenate([part for _, part in parts])
            (left, bottom), (right_, top) = corners.min(axis=0), corners.max(axis=0)
            x, y = 0.5 * (left + right_), 0.5 * (bottom + top)
            for where, away in (
                ((x, bottom), (0.0, -1.0)), ((x, top), (0.0, 1.0)),
                ((right_, y), (1.0, 0.0)), ((left, y), (-1.0, 0.0)),
                ((left, bottom), (-0.7, -0.7)), ((right_, bottom), (0.7, -0.7)),
            ):  # fmt: skip
                yield _spot(np.array(where), farther * GAP, np.array(away))


def _beside(piece: Pieces, part: Floats, share: float) -> Iterator[tuple[Floats, Floats]]:
    """Yield a point at a share of a piece, and the directions for its name.

    The side where no particles are expected comes first: below.
    """
    if len(part) == 2:
        low, high = sorted(part, key=lambda point: (point[1], point[0]))
        where = 0.5 * (low + high) if share == 0.5 else low + share * (high - low)
        down = piece.normal(where)
        down = -down if down[1] > 0.0 or (down[1] == 0.0 and down[0] < 0.0) else down
    else:
        index = round(share * (len(part) - 1))
        if piece.whole:
            # The lowest point of a whole circle is at its middle.
            part = piece.path()[:-1]
            index = (int(part[:, 1].argmin()) + round((share - 0.5) * len(part))) % len(part)
        where = part[index]
        down = piece.normal(where)
    yield where, down
    if not piece.whole:
        yield where, -down


def _spot(where: Floats, gap: float, normal: Floats) -> Spot:
    """Return a spot that far (pt) from a point of a surface along its normal."""
    x, y = normal
    across = "center" if abs(x) < 0.05 else "right" if x < 0.0 else "left"
    along = "top" if y < -0.2 else "bottom" if y > 0.2 else "center"
    return where, (gap * x, gap * y), across, along


ARROWS = "→↗↑↖←↙↓↘"
"""Arrows for the direction of a straight surface, in eighths of a turn."""


class Bodies:
    """Some particles (n,) of one look, which can be moved: to scale, or magnified to be visible.

    Disks of one size are a line of markers, others a collection of circles; boxes and polygons are
    never magnified. The machine's largest disk has a diameter of at least `least` (pt), and others
    are magnified by the same factor. Disks have a white edge of `edge` (pt), which separates them
    where they overlap. The axes have their limits; "turned" is added to the `gid` of polygons.
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
            # The edge must not hide a small disk.
            edge = min(edge, 0.15 * float(sizes.min()))
            if np.ptp(sizes) == 0.0:
                (self._disks,) = ax.plot(
                    [], [], ls="none", marker="o", color=color, ms=sizes[0], mew=edge,
                    mec=style.GROUND, gid=gid, **look,
                )  # fmt: skip
            else:
                inches = sizes / 72.0
                self._disks = EllipseCollection(
                    inches, inches, np.zeros(len(sizes)), units="inches", offsets=np.empty((0, 2)),
                    offset_transform=ax.transData, facecolors=color, edgecolors=style.GROUND,
                    linewidths=edge, gid=gid, **look,
                )  # fmt: skip
                ax.add_collection(self._disks, autolim=False)
            self.artists.append(self._disks)
        if len(self._angular):
            self._polygons = PolyCollection(
                [], facecolors=color, edgecolors=style.GROUND, linewidths=0.5 * edge,
                gid=f"{gid} turned", **look,
            )  # fmt: skip
            ax.add_collection(self._polygons, autolim=False)
            self.artists.append(self._polygons)

    def move(self, position: Floats, angle: Floats) -> None:
        """Set the particles to places, (n, 2), m, and angles, (n,), rad; NaN hides one."""
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


LEAST = 1.5
"""pt; least diameter of the largest particle in a still picture."""

WHITE = 0.8
"""pt; edge that separates particles where they overlap."""


def draw_bodies(ax: Axes, recording: Recording, t: float, *, crowd: bool = False) -> Axes:
    """Draw all particles and joints at a time (s), in the colour of their stream.

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
