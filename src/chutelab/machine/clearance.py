"""Releases that overlap a surface: refused, or moved out where it is by rounding only."""

from __future__ import annotations

from math import hypot
from sys import float_info
from typing import TYPE_CHECKING

import numpy as np

from chutelab.machine.family import RefusedError
from chutelab.many import Value, larger, smaller, some
from chutelab.releases import ON_BELT, Releases, release_point
from chutelab.scene import Fault, SceneError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from chutelab.scene import Scene

    Floats = NDArray[np.float64]
    Row = tuple[Value, ...]

ROUNDING = 64.0 * float_info.epsilon
"""Share of the largest coordinate by which a contact may seem to overlap: the engines see to it."""


def cleared(
    scene: Scene,
    releases: Releases,
    rows: Sequence[Row],
    owner: Sequence[int],
    names: Sequence[str],
) -> Releases:
    """Return releases of which none lies in a surface.

    One less than `ON_BELT` inside, as one written with ten digits may be, is moved out.

    Parameters
    ----------
    scene : Scene
        For the radius, the drive pulley and messages.
    releases : Releases
        As drawn.
    rows : sequence of tuple of float
        Each segment's ends x0, y0, x1, y1, and more; arrays (N,) in a family.
    owner, names : sequence of int and of str
        Which surface a segment belongs to, and what surfaces are called.

    Raises
    ------
    SceneError
        If a particle starts further inside a surface.
    RefusedError
        If a particle of a family starts near one: each such scene has to be looked at by itself.
    """
    r: Value = scene.particle.radius
    if not some(r > 0.0):
        return releases
    # All start in one column, above the release point.
    x, low = release_point(scene)
    carried, drawn = bool(releases.carried[0]), releases
    for n, (x0, y0, x1, y1, *_) in enumerate(rows):
        if carried and owner[n] == 0:
            continue
        near = (larger(x0, x1) > x - r) & (smaller(x0, x1) < x + r) & (larger(y0, y1) > low - r)
        if some(near):
            near = near & (smaller(y0, y1) < _highest(scene, drawn, low) + r)
        if some(near):
            _one_by_one(scene, near)
            releases = _out(scene, releases, (x0, y0), (x1, y1), r, names[owner[n]])
    if scene.incoming is not None and not carried:
        reach = scene.incoming.pulley_radius + r
        high = _highest(scene, drawn, low)
        near = (abs(x) < reach) & (low < reach) & (high > -reach)
        if some(near):
            _one_by_one(scene, near)
            releases = _out(scene, releases, (0.0, 0.0), (0.0, 0.0), reach, "incoming")
    return releases


def _highest(scene: Scene, releases: Releases, low: Value) -> Value:
    """Return the height of the highest release, m."""
    return low if scene.members is not None else float(releases.position[:, 1].max())


def _one_by_one(scene: Scene, near: Value) -> None:
    """Refuse to look closer at scenes of a family."""
    if scene.members is not None:
        places = np.flatnonzero(np.broadcast_to(near, scene.members))
        raise RefusedError(dict.fromkeys(places.tolist(), ""))


def _out(
    scene: Scene,
    releases: Releases,
    start: tuple[float, float],
    end: tuple[float, float],
    reach: float,
    name: str,
) -> Releases:
    """Return releases at least `reach` (m) away from a segment, or from a point."""
    first, position = np.array(start), releases.position
    along = np.array(end) - first
    square = float(along @ along)
    share = np.clip((position - first) @ along / square, 0.0, 1.0) if square > 0.0 else 0.0
    away = position - first - np.multiply.outer(share, along)
    distance = np.hypot(away[:, 0], away[:, 1])
    depth = reach - distance
    worst = int(depth.argmax())
    size = max(map(abs, (*start, *end, *position[worst].tolist())))
    if depth[worst] <= ROUNDING * size:
        return releases
    if depth[worst] > max(ON_BELT, ROUNDING * size):
        far = hypot(*away[worst].tolist())
        allowed = (
            f"at least {reach:g} m from {name}: particle {worst} would start {far:.6g} m from it,"
            " inside; move stream.at, or the surface"
        )
        raise SceneError(scene.source, [Fault("stream.at", scene.stream.at, allowed)])
    moved = position + (np.maximum(depth, 0.0) / distance)[:, None] * away
    return Releases(releases.t, moved, releases.velocity, releases.carried)
