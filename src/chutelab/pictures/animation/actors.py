"""Moving parts of the picture: particles, a velocity's arrow, belts, pulley, energy bars.

Each is a matplotlib artist that is made once, with a function that sets it to the film's moment of
an index. The energy ledger is two stacked bars of equal height: the energy put in, and where it is
now.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.text import Annotation

from chutelab.machine import Arcs, Machine, Pieces
from chutelab.machine.parts import Mover
from chutelab.pictures.animation.drawing import Arrows, Bar, Writing
from chutelab.pictures.plots import style
from chutelab.pictures.plots.machinery import (
    LEAST,
    WHITE,
    Bodies,
    colour_of,
    draw_piece,
    is_passing,
    pieces,
    points_of,
)
from chutelab.pictures.plots.scenery import (
    FINE,
    motion,
    nominal,
    one_of_many,
    places,
    spread,
    strings,
    strobe_times,
    track_times,
)
from chutelab.pictures.plots.style import figures, say, stream_colours, stream_handles
from chutelab.results import Recording
from chutelab.util.arrays import Bools, Floats, Ints

Moving = tuple[Artist, Callable[[int], object]]
"""A moving part, and the function that sets it to the moment of an index."""

SHAFT, HEAD = 1.3, 6.0
"""pt; width of an arrow's shaft, and length of its head."""

SEEN = 0.75
"""Least length of a component that is drawn, in heads of an arrow."""

DRAWN, DRAWN_ALL = 300, 3000
"""Most particles that are drawn, particle 0 included; and most if the picture shows all of them."""

SMALLEST = 6.0
"""pt; least diameter of the largest particle, even if to scale it would be smaller."""

MARKS, HOLES = 3, 3
"""Marks on a belt across the window, and holes in the pulley; they move with it."""


def line(ax: Axes, gid: str, points: Callable[[int], Floats], **look: Any) -> Moving:
    """Return a line, or dots, through points (P, 2), m, that depend on the index."""
    (drawn,) = ax.plot([], [], gid=gid, animated=True, **look)
    return drawn, lambda index: drawn.set_data(*points(index).T)


def seen(artist: Artist, there: Bools) -> Moving:
    """Return an artist that is visible at the moments of `there`, (T,)."""
    return artist, lambda index: artist.set_visible(bool(there[index]))


def bodies(
    ax: Axes,
    recording: Recording,
    particles: Ints,
    times: Floats,
    gid: str,
    color: str,
    edge: float,
) -> list[Moving]:
    """Return particles to scale, or larger to be visible, with a white edge (pt).

    If there are so many that all are shown together, they are not made larger.
    """
    few = recording.count <= DRAWN or not recording.machine.interact
    least = SMALLEST if few and not one_of_many(recording) else LEAST
    drawn = Bodies(ax, recording, particles, gid, color, least=least, edge=edge, animated=True)
    position, angle = motion(recording, particles, times)
    first, *others = drawn.artists
    moving: list[Moving] = [(first, lambda index: drawn.move(position[index], angle[index]))]
    return moving + [(artist, lambda _: None) for artist in others]


def trail(ax: Axes, recording: Recording, times: Floats, reach: float) -> Moving:
    """Return particle 0's path of the last `reach` seconds of the recording."""
    fine = FINE * float(np.ptp(ax.get_xlim()))
    passed = np.union1d(times, track_times(recording, fine=fine))
    path, _ = nominal(recording, passed)
    begun, _ = nominal(recording, np.maximum(times - reach, passed[0]))

    def behind(index: int) -> Floats:
        ends = [times[index] - reach, times[index]]
        later = path[slice(*np.searchsorted(passed, ends, side="right"))]
        return np.concatenate([begun[index : index + 1], later])

    return line(ax, "trail", behind, color=style.TRACK, lw=2.0)


def strobe(ax: Axes, recording: Recording, times: Floats) -> Moving:
    """Return the dots of particle 0 at round times."""
    stops = strobe_times(recording)
    dots, _ = nominal(recording, stops)
    return line(ax, "strobe", lambda index: dots[stops <= times[index]], **style.RINGS, ms=4.5)


def arrows(ax: Axes, position: Floats, velocity: Floats, length: float) -> Moving:
    """Return particle 0's velocity as an arrow over its two components, `length` m for 1 m/s.

    `position` and `velocity`, (T, 2), are those at the film's times.
    """
    points, colors = ax.figure.dpi / 72.0, [*style.VELOCITY.values(), style.INK]
    drawn = Arrows(ax, colors, SHAFT * points, (HEAD * points, 0.8 * HEAD * points), "arrows")
    # Components are drawn if both are large enough to be distinguished from the whole.
    two = length * np.abs(velocity).min(axis=1) > SEEN * HEAD / points_of(ax, 1.0)
    ways = length * velocity[:, None] * [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]
    ways[~two, :2] = 0.0

    def show(index: int) -> None:
        drawn.tails = np.repeat(position[index : index + 1], 3, axis=0)
        drawn.tips = drawn.tails + ways[index]

    return drawn, show


def crowd(
    ax: Axes, recording: Recording, times: Floats, reach: float
) -> tuple[list[Moving], list[Line2D]]:
    """Return the other particles in the colours of their streams, and their legend.

    They are evenly reduced to `DRAWN`, or to `DRAWN_ALL` if they meet, or are many. Trails reach
    back `reach` seconds of the recording, at least to the picture before; there are none with 0, or
    for more than `DRAWN` particles.
    """
    first, last = recording.ends()
    during = np.flatnonzero(recording.released)[(first["t"] <= times[-1]) & (last["t"] >= times[0])]
    others = during[during != 0]
    all_of_them = recording.machine.interact or one_of_many(recording)
    most = DRAWN_ALL if all_of_them else DRAWN
    particles = others[spread(len(others), most - 1)]
    thinned = len(particles) < len(others)
    count = figures(recording.count, ",")
    told = say("some", some=len(particles) + 1, count=count)
    said = told if thinned else say("all", count=count)
    streams, stream = recording.machine.streams, recording.machine.releases.stream
    if len(streams) == 1:
        dot: dict[str, Any] = {"ls": "none", "marker": "o", "ms": 6.0, "color": style.STREAM}
        handles = [Line2D([], [], **dot, label=said)] if recording.count > 1 else []
    else:
        handles = stream_handles(recording.machine)
    if not len(particles):
        return [], handles
    since = np.searchsorted(times, times - reach)
    moving: list[Moving] = []
    for i, color in enumerate(stream_colours(len(streams))):
        own = particles[stream[particles] == i]
        if not len(own):
            continue
        gid = "crowd" if len(streams) == 1 else f"crowd {streams[i]}"
        # White edges separate disks that overlap.
        moving += bodies(ax, recording, own, times, gid, color, WHITE)
        if reach and len(particles) < DRAWN:
            moving.insert(0, trails(ax, places(recording, own, times), since, color, gid))
    return moving, handles


def trails(ax: Axes, positions: Floats, since: Ints, color: str, gid: str) -> Moving:
    """Return the paths of particles from the pictures `since`, (T,), on, (T, n, 2)."""

    def behind(index: int) -> Floats:
        paths = positions[max(0, min(since[index], index - 1)) : index + 1]
        # One line for all, that NaN breaks.
        gaps = np.full((1, *paths.shape[1:]), np.nan)
        return np.concatenate([paths, gaps]).swapaxes(0, 1).reshape(-1, 2)

    light = style.tint(color, 0.5)
    return line(ax, gid.replace("crowd", "trails"), behind, color=light, lw=1.0)


def strung(ax: Axes, recording: Recording, times: Floats) -> list[Moving]:
    """Return the joints, if any are drawn."""
    if all(joint.kind == "pin" for joint in recording.machine.joints):
        return []
    paths, gap = strings(recording, times), np.full((1, 2), np.nan)

    def joined(index: int) -> Floats:
        return np.concatenate([part for path in paths(index) for part in (path, gap)])

    return [line(ax, "strings", joined, color=style.MUTED, lw=1.0)]


def gates(ax: Axes, machine: Machine, times: Floats) -> list[Moving]:
    """Return the pieces that move or do not always exist, at their places and times."""

    def shown(piece: Pieces) -> Moving:
        mover = machine.mover(int(piece.surface))
        if mover is not None:
            look = {"color": colour_of(machine, piece), "lw": 2.6, "solid_capstyle": "butt"}
            there, gid = piece.there(times), f"surface {machine.surfaces[piece.surface]}"

            def path(index: int) -> Floats:
                share = 1.0 if there[index] else np.nan
                return share * mover.carried(piece.path(), times[index])

            return line(ax, gid, path, **look)
        drawn = draw_piece(ax, machine, piece, animated=True)
        return seen(drawn, piece.there(times))

    return [shown(piece) for piece in pieces(machine) if is_passing(machine, piece)]


LEAVES = 2.0
"""In heights of a name: a surface that moves farther than this from its name takes it along."""


def names(ax: Axes, machine: Machine, times: Floats) -> list[Moving]:
    """Return the names on `ax` that move with their surfaces, upright, each on its side.

    The name of a surface that turns or shakes on the spot stays in place.
    """
    found = {label.get_gid(): label for label in ax.texts if isinstance(label, Annotation)}
    moving = []
    for mover in machine.movers:
        label = found.get(f"name {machine.surfaces[mover.surface]}")
        if label is not None and _leaves(ax, machine, mover, label, times):
            moving.append(_going(ax, mover, label, times))
    return moving


def _leaves(ax: Axes, machine: Machine, mover: Mover, label: Annotation, times: Floats) -> bool:
    """Whether a moving surface is ever far from its name."""
    places = np.concatenate([[label.xy], mover.at_rest(label.xy, times)])[:, None]
    own = [part.of(part.surface == mover.surface) for part in machine.parts]
    gaps = np.concatenate([part.gap(places) for part in own], axis=1).min(axis=1)
    return points_of(ax, float(gaps.max() - gaps[0])) > LEAVES * style.SMALL


def _going(ax: Axes, mover: Mover, label: Annotation, times: Floats) -> Moving:
    """Return a name that a moving surface carries, at its distance as written."""
    points = 72.0 / ax.figure.dpi
    box, tip = np.asarray(label.get_window_extent()), ax.transData.transform(label.xy)
    half, (right, up) = 0.5 * points * np.ptp(box, axis=0), points * (box.mean(axis=0) - tip)
    towards = np.arctan2(up, right) + np.append(0.0, mover.pose(times)[:, 2])
    sides = np.stack([np.cos(towards), np.sin(towards)], axis=-1)
    # From the middle of the text to its end on the side of the surface.
    ends = (half / np.maximum(np.abs(sides), 1e-9)).min(axis=1)
    beyond = np.hypot(right, up) - ends[0]
    offsets = (ends + beyond)[1:, None] * sides[1:] if beyond > 0.0 else np.zeros((len(times), 2))
    places = mover.carried(label.xy, times)
    label.set(ha="center", va="center", animated=True)

    def carry(index: int) -> None:
        label.xy, label.xyann = places[index].tolist(), offsets[index].tolist()

    return label, carry


def drives(ax: Axes, machine: Machine, times: Floats) -> list[Moving]:
    """Return marks that move with belts, and holes that turn with pulleys and rollers at v/R."""
    spacing = float(np.ptp(ax.get_xlim())) / MARKS
    driven = [
        piece
        for piece in pieces(machine)
        if piece.speed != 0.0 and machine.mover(int(piece.surface)) is None
    ]
    belts = [piece for piece in driven if not piece.whole]

    def marks(index: int) -> Floats:
        placed = [np.empty((0, 2))]
        for piece in belts:
            shift = float((piece.speed * times[index]) % spacing)
            placed.append(piece.at(np.arange(shift, float(piece.way), spacing)))
        return np.concatenate(placed)

    dots: dict[str, Any] = {"ls": "none", "marker": "o", "mew": 0.0}
    moving = [line(ax, "marks", marks, color=style.CLEAT, ms=3.2, **dots)]

    def turning(gid: str, wheel: Arcs) -> Moving:
        turned = wheel.speed * times / wheel.radius
        # Clockwise from the top.
        angles = turned[:, None] + 2.0 * np.pi / HOLES * np.arange(HOLES)
        out = np.stack([np.sin(angles), np.cos(angles)], axis=-1)
        holes = wheel.center + 0.6 * wheel.radius * out
        size = min(points_of(ax, 0.3 * float(wheel.radius)), SMALLEST)
        return line(ax, gid, lambda index: holes[index], color=style.STEEL, ms=size, **dots)

    if machine.pulley is not None:
        moving.insert(0, turning("holes", machine.pulley.rim.of(0)))
    moving += [
        turning(f"holes {machine.surfaces[piece.surface]}", piece)
        for piece in driven
        if piece.whole and isinstance(piece, Arcs)
    ]
    return moving


SIGNS = {
    "start": 1,
    "belt_work": 1,
    "kinetic": -1,
    "potential": -1,
    "spring": -1,
    "restitution_loss": -1,
    "friction_loss": -1,
    "damper_loss": -1,
    "residual": 1,
}
"""The ledger with everything on one side: start + belt work + residual - K - U - losses = 0."""

ROWS = 7
"""Rows of the ledger for which there is room at full height."""

BASE = 0.78
"""Share of a row above its text's base line."""


def stacks(balance: dict[str, Floats]) -> tuple[dict[str, Floats], dict[str, Floats]]:
    """Split a ledger into energy put in and energy now, all values positive.

    The ledger is that of `plots.scenery.energies`, J, (T,) each. An entry with the opposite sign
    changes sides: the work that a braking belt takes belongs to the energy now. Both sides have the
    same sum, see `SIGNS`.
    """
    signed = {name: sign * balance[name] for name, sign in SIGNS.items() if name in balance}
    put_in = {name: np.maximum(values, 0.0) for name, values in signed.items()}
    return put_in, {name: np.maximum(-values, 0.0) for name, values in signed.items()}


def bars(
    ax: Axes,
    column: tuple[float, float, float, float],
    balance: dict[str, Floats],
    *,
    drives: str,
) -> tuple[list[Bar], list[Writing]]:
    """Return two stacked bars on `ax`, and figures with their names in a column.

    The column's left, bottom, width and height are shares of the picture. The ledger is as for
    `stacks`; the highest bar sets the scale. The work of belts, drives, hinges, springs and hands
    is one block, with the name `drives`; "" if there is none. What a machine has none of has no
    row.
    """
    sides = stacks(balance)
    highest = float(np.max(sum(sides[0].values())))
    factor, unit = style.scaled(highest, "J")
    style.dress(ax)
    # At its place at once: Matplotlib would look for room between all labels.
    look: dict[str, Any] = {"fontsize": style.NORMAL, "fontweight": "bold"}
    ax.set_title(say("energy", unit=unit), loc="left", y=1.0, **look)
    ax.grid(visible=False, axis="x")
    ax.set(xlim=(-0.6, 1.6), ylim=(0.0, 1.06 * factor * highest or 1.0))
    ax.set_xticks([0, 1], [say("put-in"), say("is-now")], fontsize=style.SMALL)
    ax.tick_params(axis="x", length=0)
    drawn = []
    for left, side in zip((-0.4, 0.6), sides, strict=True):
        heights = {name: factor * values for name, values in side.items()}
        drawn.append(Bar(ax, left, left + 0.8, heights, [style.ENERGY[name] for name in heights]))
    picture, writings = ax.figure.canvas.figure, []
    left, bottom, width, height = column
    # Three digits of the highest bar, so that the rows add up to it.
    places = 1 if factor * highest >= 10.0 else 2
    rows = {}
    for name in sides[0]:
        shown = [round(factor * value, places) + 0.0 for value in balance[name].tolist()]
        absent = {
            "belt_work": not drives, "spring": not balance[name].any(),
            "damper_loss": not balance[name].any(), "residual": not any(shown),
        }  # fmt: skip
        if not absent.get(name, False):
            rows[name] = shown
    line = height / max(ROWS, len(rows))
    for row, (name, shown) in enumerate(rows.items()):
        told = drives if name == "belt_work" else say(f"ledger-{name}")
        said = [figures(value, f".{places}f") for value in shown]
        top = bottom + height - row * line
        key = Rectangle((left, top - 0.8 * line), 0.05 * width, 0.6 * line)
        key.set(color=style.ENERGY[name], transform=picture.transFigure)
        picture.add_artist(key)
        up = top - BASE * line
        picture.text(left + 0.08 * width, up, told, fontsize=style.SMALL)
        across, along = picture.transFigure.transform((left + width, 1.0 - up))
        writings.append(Writing(style.SMALL, picture.dpi, across, along, "rs", said))
    return drawn, writings
