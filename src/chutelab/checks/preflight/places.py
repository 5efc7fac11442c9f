"""What may surprise about where things lie: releases in loops and beyond walls, narrow gaps."""

from __future__ import annotations

from collections.abc import Iterator
from math import cos, radians
from typing import Final

import numpy as np

from chutelab.checks.preflight.results import Advice
from chutelab.machine import Machine, build
from chutelab.scene import Plate, Scene, SceneError
from chutelab.scene.units import write_size
from chutelab.util.arrays import Bools, Floats, Ints

GRAINS: Final = 3.0
"""Diameters of the largest grain: through a narrower gap a stream may jam."""

CELLS: Final = 64
"""Cells along each side of a box whose parts are looked for."""


def places(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Yield what may surprise about a machine and where its particles start."""
    yield from _in_loops(scene, machine)
    yield from _beyond_walls(scene, machine)
    if machine.interact:
        yield from _narrow(scene, machine)


def _in_loops(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of releases between the carrying and the returning side of a conveyor."""
    for belt in scene.conveyor:
        way = np.subtract(belt.to, belt.from_)
        (x, y), (dx, dy) = (machine.releases.position - belt.from_).T, way / np.hypot(*way)
        along, aside = x * dx + y * dy, np.abs(x * dy - y * dx)
        inside = (along > 0.0) & (along < np.hypot(*way)) & (aside < belt.pulley_radius)
        if inside.any():
            yield Advice(
                f"{belt.name}: {np.count_nonzero(inside)} of {machine.count} particles start inside"
                " its loop, and fall on its returning side",
                "a release above its carrying side",
                {},
            )


def _narrow(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of a plate whose lower end leaves a crowd little room above a belt."""
    lines = machine.segments
    largest = 2.0 * float(np.max(machine.particle.radius))
    belts = [n for n, name in enumerate(machine.surfaces) if name == "outgoing"]
    belts += [machine.surfaces.index(belt.name) for belt in scene.conveyor]
    for number, plate in enumerate(scene.plates):
        name = plate.name or "plate"
        (end,) = lines.start[lines.surface == machine.surfaces.index(name)]
        for k in np.flatnonzero(np.isin(lines.surface, belts)):
            belt = lines.of(k)
            gap = float(belt.gap(end))
            # Surfaces that cross are another warning.
            if not 0.0 < gap < GRAINS * largest or belt.away(end)[1] <= 0.0:
                continue
            path = f"{scene.head('plate', number)}.below"
            settings = {path: _shorter(machine, plate, name, GRAINS * largest - gap)}
            try:
                build(scene.with_values({**settings, "expect": None}))
            except SceneError:
                settings = {}
            yield Advice(
                f"{name}: its lower end leaves {write_size(gap, 'm')} above"
                f" {machine.surfaces[lines.surface[k]]}, less than {GRAINS:.0f} grains of up to"
                f" {write_size(largest, 'm')}: a stream may jam there",
                f"{path} = {settings[path]:g}" if settings else "a lower belt, or smaller grains",
                settings,
            )


def _shorter(machine: Machine, plate: Plate, name: str, room: float) -> float:
    """Return plate.below (m) for an end that is higher by some room, rounded down to 1 mm."""
    lines = machine.segments
    (length,) = lines.length[lines.surface == machine.surfaces.index(name)]
    below = length - plate.above - room / cos(radians(plate.angle_deg))
    return float(np.floor(1e3 * below) / 1e3)


def _beyond_walls(scene: Scene, machine: Machine) -> Iterator[Advice]:
    """Warn of a `fill` that walls cut into parts: what starts in the smaller ones is outside."""
    starts = machine.releases
    walls, owner = _walls(machine)
    for number, stream in enumerate(scene.streams):
        if stream.fill is None:
            continue
        low, high = np.array(stream.fill)
        mine = starts.position[starts.stream == number]
        parts, blocked = _parts(low, high, walls)
        column, row = np.clip((mine - low) / (high - low) * CELLS, 0, CELLS - 1).astype(int).T
        counts = np.bincount(parts[row, column], minlength=CELLS * CELLS)
        outside = len(mine) - counts.max()
        if not outside:
            continue
        held = counts[parts] > 0
        names = {
            machine.surfaces[owner[wall]]
            for (a, b), wall in blocked
            if parts[a] != parts[b] and (held[a] or held[b])
        }
        path = f"{scene.head('stream', number)}.fill"
        yield Advice(
            f"{path} reaches through {' and '.join(sorted(names))}: {outside} of {len(mine)}"
            " particles start beyond",
            f"if it is meant, leave it; or a smaller {path}, or fewer particles",
            {},
        )


def _walls(machine: Machine) -> tuple[Floats, Ints]:
    """Return what is there at t = 0 as straight pieces: ends (P, 2, 2), m, and surfaces (P,)."""
    found = [(np.empty((0, 2, 2)), np.empty(0, dtype=np.int64))]
    for part in machine.parts:
        for piece in map(part.of, np.flatnonzero(part.there(0.0))):
            path = piece.path()
            ends = np.stack([path[:-1], path[1:]], axis=1)
            found.append((ends, np.full(len(ends), piece.surface)))
    walls, owner = zip(*found, strict=True)
    return np.concatenate(walls), np.concatenate(owner)


Side = tuple[tuple[int, int], tuple[int, int]]
"""Two cells (row, column) beside each other."""


def _parts(low: Floats, high: Floats, walls: Floats) -> tuple[Ints, list[tuple[Side, int]]]:
    """Return into which parts walls cut a box: a number for each cell (row, column).

    Cells beside each other are in one part unless a wall runs between their middles. Also those
    pairs of cells, and which wall.
    """
    scaled = (walls - low) / (high - low) * CELLS - 0.5  # middles are whole numbers
    open_: list[Bools] = []
    blocked: list[tuple[Side, int]] = []
    lines = np.arange(CELLS)[:, None]
    for axis in (0, 1):
        (a, c), (b, d) = scaled[:, 0].T[[axis, 1 - axis]], scaled[:, 1].T[[axis, 1 - axis]]
        crosses = (np.minimum(c, d) <= lines) & (lines < np.maximum(c, d))
        at, wall = np.nonzero(crosses)
        share = (at - c[wall]) / (d[wall] - c[wall])
        between = np.floor(a[wall] + share * (b[wall] - a[wall])).astype(int)
        inside = (between >= 0) & (between < CELLS - 1)
        free = np.ones((CELLS, CELLS - 1), dtype=bool)
        free[at[inside], between[inside]] = False
        open_.append(free)
        found = (at[inside].tolist(), between[inside].tolist(), wall[inside].tolist())
        for line, k, which in zip(*found, strict=True):
            pair = ((line, k), (line, k + 1)) if axis == 0 else ((k, line), (k + 1, line))
            blocked.append((pair, which))
    return _labelled(open_[0], open_[1].T), blocked


def _labelled(across: Bools, up: Bools) -> Ints:
    """Return numbers of cells (n, n), the same for those that open sides connect."""
    label = np.arange(CELLS * CELLS).reshape(CELLS, CELLS)
    while True:
        before = label.copy()
        for one, other, side in (
            (label[:, :-1], label[:, 1:], across), (label[:-1], label[1:], up)
        ):  # fmt: skip
            np.copyto(one, np.minimum(one, other), where=side)
            np.copyto(other, np.minimum(one, other), where=side)
        if (label == before).all():
            return label
