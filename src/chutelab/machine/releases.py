"""Where, when and how fast each particle of the stream starts."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from math import acos, degrees, floor, inf, prod, sqrt
from typing import Any

import numpy as np

from chutelab.scene import Fault, Scene, SceneError, Stream
from chutelab.scene.conflicts import beside
from chutelab.util.arrays import Bools, Floats, Ints, Numbers, Watch, unwatched
from chutelab.util.tables import number
from chutelab.util.trig import RADIANS, hypot, sin_cos

TRIES = 1000
"""Draws of a height that may overlap an earlier particle before it has to wait for its place."""

DEEP = 0.01
"""Share of the radius. Riders of one layer that touch, 2 r of arc apart, are by r³/(3 ρ²) nearer on
the chord: by less than this where r < ρ/6."""


@dataclass(frozen=True, eq=False)
class Releases:
    """Start of each particle, read-only arrays.

    Attributes
    ----------
    t : ndarray, (N,)
        s, ascending.
    position, velocity : ndarray, (N, 2)
        m, m/s.
    carried : ndarray of bool, (N,)
        Rides the incoming belt by adhesion, at radius R + r + h round the pulley, until separation.
    stream : ndarray of int, (N,)
        Whose it is: particles of the first stream come first, then those of the next.
    kind : ndarray of int, (N,)
        Its row in the machine's tables of pairs; of a family each has a row of its own.
    """

    t: Floats
    position: Floats
    velocity: Floats
    carried: Bools
    stream: Ints
    kind: Ints

    def __post_init__(self) -> None:
        for array in vars(self).values():
            array.flags.writeable = False


FIELDS = tuple(field.name for field in fields(Releases))


def up_belt(scene: Scene) -> tuple[float, float]:
    """Return the direction in which the incoming belt runs, (cos β, sin β)."""
    assert scene.incoming is not None
    if not np.count_nonzero(scene.incoming.incline_deg):
        return 1.0, 0.0
    sine, cosine = sin_cos(scene.incoming.incline_deg * RADIANS)
    return cosine, sine


def release_point(scene: Scene, stream: int = 0) -> tuple[float, float]:
    """Return the nominal release point of a stream, m; on the belt exactly at the riding height."""
    its, belt = scene.streams[stream], scene.incoming
    if belt is None:
        assert its.at is not None
        return its.at
    radius = scene.particles[scene.kinds[stream]].radius
    riding = belt.pulley_radius + radius
    if its.at is not None and not on_belt(scene, stream):
        return its.at
    cosine, sine = up_belt(scene)
    along = -belt.length if its.at is None else its.at[0] * cosine + its.at[1] * sine
    return along * cosine - riding * sine, along * sine + riding * cosine


def release_velocity(scene: Scene, stream: int = 0) -> tuple[float, float]:
    """Return the nominal release velocity of a stream, m/s."""
    its = scene.streams[stream]
    if its.velocity is not None:
        return its.velocity
    if its.fill is not None:
        return 0.0, 0.0
    assert scene.incoming is not None
    speed, (cosine, sine) = scene.incoming.speed, up_belt(scene)
    # 0 is a number, also where the speeds of a family are an array.
    return speed * cosine, speed * sine if np.count_nonzero(sine) else 0.0


def on_belt(scene: Scene, stream: int = 0) -> bool:
    """Tell whether a stream is released on the incoming belt."""
    its, belt = scene.streams[stream], scene.incoming
    if belt is None or its.fill is not None or its.to is not None:
        return False
    if its.at is None:
        return True
    riding = belt.pulley_radius + scene.particles[scene.kinds[stream]].radius
    return beside(*its.at, riding, belt.length, belt.incline_deg)


@dataclass(frozen=True)
class Squeeze:
    """Riders by adhesion that get into each other round the pulley.

    All layers of a bed have the belt's speed, the lower ones on smaller circles: where the pulley
    does not throw them off at its top, they turn ahead, into what rides above them.
    """

    particles: int  # how many are in another by more than `DEEP`
    deepest: float  # overlap of the worst two, m
    grip: float  # v²/(g ρ) of the highest rider: it stays on the pulley until cos φ is this

    def __str__(self) -> str:
        return (
            f"{self.particles} particles ride into others round the pulley,"
            f" {number(self.deepest)} m deep at most: adhesion carries all layers at one speed, the"
            f" lower ones on smaller circles, and v²/(g rho) = {self.grip:.3g} keeps the highest"
            f" there for {degrees(acos(self.grip)):.3g}°, past the top"
        )


def squeeze(
    scene: Scene, t: Floats, position: Floats, radius: Numbers | None = None
) -> Squeeze | None:
    """Return which particles ride into others; None if none does.

    A ride that something ends early counts as if it went on. Two that would be in each other on the
    belt already do not count: one of them waits.

    Parameters
    ----------
    scene : Scene
        What is released, and where.
    t, position : ndarray, (N,) and (N, 2)
        When and where riders are released, s and m: planned, or of a run.
    radius : float or ndarray, (N,), optional
        Of the riders, m; by default that of the first kind of particles.
    """
    belt = scene.incoming
    if belt is None or not len(t) or not isinstance(belt.friction, str):
        return None
    if not scene.crowded or belt.speed == 0.0 or scene.gravity == 0.0:
        return None
    (cosine, sine), (x, y) = up_belt(scene), position.T
    along, rho = x * cosine + y * sine, y * cosine - x * sine
    top = t - along / belt.speed
    grip = belt.speed**2 / (scene.gravity * rho)
    turn = np.arccos(np.minimum(grip, 1.0)) + np.radians(belt.incline_deg)
    turn = np.where(grip >= cosine, 0.0, turn)
    order = np.argsort(top)
    top, rho = top[order], rho[order]
    radii = np.broadcast_to(scene.particle.radius if radius is None else radius, t.shape)[order]
    leaves = top + rho * turn[order] / belt.speed
    depth = np.zeros(len(top))
    for lag in range(1, len(top)):
        # The later one is on the pulley from its own top, both are until one leaves.
        begin, end = top[lag:], np.minimum(leaves[:-lag], leaves[lag:])
        if (begin >= leaves[:-lag]).all():
            break
        mine, its, reach = rho[:-lag], rho[lag:], radii[:-lag] + radii[lag:]
        waits_for = np.hypot(belt.speed * (begin - top[:-lag]), mine - its) < reach
        angle = belt.speed * np.array(
            [(now - top[:-lag]) / mine - (now - begin) / its for now in (begin, end)]
        )
        angle = np.where(angle[1] > 0.0, angle.min(axis=0), 0.0)
        apart = np.hypot(mine - its, 2.0 * np.sqrt(mine * its) * np.sin(0.5 * angle))
        found = np.where((begin < end) & ~waits_for, reach - apart, 0.0)
        depth[:-lag] = np.maximum(depth[:-lag], found)
        depth[lag:] = np.maximum(depth[lag:], found)
    particles = int(np.count_nonzero(depth > DEEP * radii))
    return Squeeze(particles, float(depth.max()), float(grip.min())) if particles else None


@dataclass(frozen=True, eq=False)
class Draw:
    """What was drawn of one stream: its releases, and radii (n,), m, if they differ."""

    releases: Releases
    radius: Floats | None


def _releases(
    scene: Scene, n: int, t: Floats, position: Floats, velocity: Floats, carried: bool
) -> Releases:
    """Return the releases of stream n, of which all are carried or none."""
    every = len(t)
    rides = np.empty(every, dtype=bool)
    stream, kind = np.empty((2, every), dtype=np.int64)
    rides[:], stream[:], kind[:] = carried, n, np.arange(every) if scene.shape else scene.kinds[n]
    return Releases(t, position, velocity, rides, stream, kind)


Clear = Callable[[Floats, float], Bools]
"""Tells which of some places (n, 2), m, a disk of a radius (m) can be in: not in any surface."""


def draw(scene: Scene, clear: Clear, watch: Watch = unwatched) -> tuple[Releases, Floats | None]:
    """Draw the releases of a scene; the same scene and seed give the same numbers.

    Of a family each scene has one particle. Particles that meet start where no other of their
    stream is, as far as the bed has room: an engine lets the others wait until their place is free.

    Parameters
    ----------
    scene : Scene
        What is released.
    clear : callable
        Which places a packed box may use.
    watch : callable, optional
        Called now and then; what it raises ends the drawing.

    Returns
    -------
    releases : Releases
        Of all streams, one after the other.
    radius : ndarray, (N,), or None
        Radii, m; None if all particles are alike.

    Raises
    ------
    SceneError
        If a box has not room for all.
    """
    drawn: list[Draw] = []
    for n, stream in enumerate(scene.streams):
        if stream.fill is None:
            drawn.append(_draw(scene, n, watch))
        else:
            drawn.append(_pour(scene, n, drawn, clear, watch))
    if len(drawn) == 1:
        return drawn[0].releases, drawn[0].radius
    releases = Releases(
        *(np.concatenate([getattr(one.releases, name) for one in drawn]) for name in FIELDS)
    )
    alike = len({particle.radius for particle in scene.particles}) == 1
    if alike and all(one.radius is None for one in drawn):
        return releases, None
    radii = [
        np.full(len(one.releases.t), scene.particles[kind].radius)
        if one.radius is None
        else one.radius
        for one, kind in zip(drawn, scene.kinds, strict=True)
    ]
    return releases, np.concatenate(radii)


def _dice(scene: Scene, n: int) -> np.random.Generator:
    seed = scene.streams[n].seed
    return np.random.default_rng([seed, n] if n else seed)


def _radii(scene: Scene, n: int, rng: np.random.Generator) -> Floats | None:
    """Draw radii from the range of a stream's kind, m; the first has the mean."""
    particle = scene.particles[scene.kinds[n]]
    if particle.span is None:
        return None
    radii = rng.uniform(*particle.span, scene.streams[n].count)
    radii[0] = particle.radius
    return radii


def _draw(scene: Scene, n: int, watch: Watch) -> Draw:
    """Draw the releases of one stream, at a point or along a line."""
    stream, particle = scene.streams[n], scene.particles[scene.kinds[n]]
    every = stream.count * prod(scene.shape)
    # Those of each scene of a family follow another.
    t = np.arange(every) % stream.count / stream.rate
    if stream.at_once:
        t = np.zeros(every)
    if stream.start:
        t += stream.start
    position, velocity = np.empty((2, every, 2))
    velocity[:, 0], velocity[:, 1] = release_velocity(scene, n)
    height, radii = np.zeros(every), None
    crowded = stream.count > 1 and scene.crowded
    # The first one has no spread. Making a generator takes as long as all other preparations.
    spread = stream.bed_height > 0.0 or stream.speed_spread > 0.0
    if stream.count > 1 and (crowded or spread or stream.to or particle.span):
        rng = _dice(scene, n)
        height = stream.bed_height * rng.random(every)
        height[0] = 0.0
        faster = stream.speed_spread * rng.uniform(-1.0, 1.0, every)
        faster[0] = 0.0
        x, y = release_velocity(scene, n)
        speed = float(hypot(x, y))
        velocity += faster[:, None] * ((x / speed, y / speed) if speed > 0.0 else (1.0, 0.0))
        radii = _radii(scene, n, rng)
    if stream.to is not None:
        assert stream.at is not None
        share = np.linspace(0.0, 1.0, every)
        if not stream.at_once and every > 1:
            share[1:] = rng.random(every - 1)
        begin, end = np.array(stream.at), np.array(stream.to)
        position = begin + share[:, None] * (end - begin)
        return Draw(_releases(scene, n, t, position, velocity, False), radii)
    rides = on_belt(scene, n)
    adheres = rides and scene.incoming is not None and isinstance(scene.incoming.friction, str)
    cosine, sine = up_belt(scene) if rides else (1.0, 0.0)
    if crowded:
        fall = 0.0 if adheres else 0.5 * scene.gravity
        lowest = 0.0 if rides else -inf
        # Seen from the belt, if it rises.
        along = np.stack([
            velocity[:, 0] * cosine + velocity[:, 1] * sine,
            velocity[:, 1] * cosine - velocity[:, 0] * sine,
        ], axis=1)  # fmt: skip
        each = np.full(every, particle.radius) if radii is None else radii
        _spread_apart(stream, t, height, along, each, fall, lowest, rng, watch)
    if rides and radii is not None:
        height += radii - particle.radius
    x, low = release_point(scene, n)
    position[:, 0], position[:, 1] = x - sine * height, low + cosine * height
    return Draw(_releases(scene, n, t, position, velocity, adheres), radii)


PITCH = 2.04
"""Distance of neighbours in a packed box, in radii of the largest."""

JITTER = 0.01
"""How far a place in it is moved at random each way, in the same unit: no pile is that even."""


HANDFUL = 4096
"""Places of a box that are looked at together; what is above the particles never is."""

LOOKS = 1_000_000
"""Places of a box that are looked at, at most, and `TRIES` more for each particle."""


def _packed(stream: Stream, largest: float, rng: np.random.Generator) -> Iterator[Floats]:
    """Yield the places of a stream's box (n, 2), m, from below, a handful at a time.

    They are in rows, every other one shifted by half a pitch.
    """
    assert stream.fill is not None
    (left, bottom), (right, top) = stream.fill
    pitch, room = PITCH * largest, largest * (1.0 + JITTER)
    rise = pitch * sqrt(0.75)
    rows = max(0, floor((top - bottom - 2.0 * room) / rise) + 1)
    across = max(0, floor((right - left - 2.0 * room) / pitch) + 1)
    most = min(rows * across, LOOKS + TRIES * stream.count)
    for first in range(0, most, HANDFUL):
        begin, along = divmod(first, across)
        row, column = divmod(along + np.arange(min(HANDFUL, most - first)), across)
        row += begin
        x, y = column * pitch, row * rise
        x += 0.5 * pitch * (row % 2)
        places = np.stack([left + room + x, bottom + room + y], axis=1)
        places = places[places[:, 0] <= right - room]
        places += JITTER * largest * rng.uniform(-1.0, 1.0, places.shape)
        yield places


def _away(places: Floats, others: Floats, reach: Floats) -> Bools:
    """Tell which places (n, 2), m, are at least a reach (k,) away from each of others (k, 2)."""
    free, most = np.ones(len(places), dtype=bool), reach.max(initial=0.0)
    low, high = places.min(axis=0) - most, places.max(axis=0) + most
    near = ((others >= low) & (others <= high)).all(axis=1).nonzero()[0]
    # Neighbours are side by side along the longer side of the places' box.
    axis = int(np.argmax(high - low))
    near = near[others[near, axis].argsort(kind="stable")]
    line, there = others[near, axis], places[:, axis]
    first, last = line.searchsorted(there - most), line.searchsorted(there + most, side="right")
    many = last - first
    place = np.arange(len(places)).repeat(many)
    other = near[np.arange(len(place)) + (first - (many.cumsum() - many)).repeat(many)]
    free[place[hypot(*(places[place] - others[other]).T) < reach[other]]] = False
    return free


def _pour(scene: Scene, n: int, before: Sequence[Draw], clear: Clear, watch: Watch) -> Draw:
    """Pack a stream's box, as far up as it takes."""
    stream, particle = scene.streams[n], scene.particles[scene.kinds[n]]
    rng = _dice(scene, n)
    radii = _radii(scene, n, rng)
    largest = particle.radius if particle.span is None else particle.span[1]
    others, reach = np.empty((0, 2)), np.empty(0)
    for kind, one in zip(scene.kinds, before, strict=False):
        other = scene.particles[kind].radius if one.radius is None else one.radius
        others = np.concatenate([others, one.releases.position])
        reach = np.concatenate([reach, np.broadcast_to(largest + other, len(one.releases.t))])
    found, count = [np.empty((0, 2))], 0
    for places in _packed(stream, largest, rng):
        watch()
        places = places[clear(places, largest)]
        if len(others) and len(places):
            places = places[_away(places, others, reach)]
        found.append(places)
        count += len(places)
        if count >= stream.count:
            break
    if count < stream.count:
        several = f"[{n}]" * (len(scene.streams) > 1)
        fewer = f", or stream{several}.count = {count} at most" if count else ""
        allowed = (
            f"a larger box{fewer}: {count or 'none'} of radius {largest:.4g} m have room in it,"
            " away from all surfaces"
        )
        value = [list(corner) for corner in stream.fill or ()]
        raise SceneError(scene.source, [Fault(f"stream{several}.fill", value, allowed)])
    velocity = np.empty((stream.count, 2))
    velocity[:] = release_velocity(scene, n)
    t = np.full(stream.count, stream.start)
    position = np.concatenate(found)[: stream.count].copy()
    return Draw(_releases(scene, n, t, position, velocity, False), radii)


def _spread_apart(
    stream: Stream,
    t: Floats,
    height: Floats,
    velocity: Floats,
    radius: Floats,
    fall: float,
    lowest: float,
    rng: np.random.Generator,
    watch: Watch,
) -> None:
    """Redraw heights, in place, so that no particle starts inside one released before it.

    If no height is free, the last draw is kept, and the release is delayed.

    Earlier particles are taken to have moved on at their release velocity, and to have fallen by
    ``fall`` (m/s²) times their age squared, but not below ``lowest`` (m above the lowest layer).
    """
    # What may still be in the way: what has moved on by a diameter, or has fallen below the bed
    # by one, stays away for good.
    close = np.zeros(0, dtype=np.int64)
    diameter = 2.0 * radius.max()
    for i in range(1, stream.count) if stream.bed_height > 0.0 else ():
        watch()
        close = np.append(close, i - 1)
        age = t[i] - t[close]
        dx = velocity[close, 0] * age
        dy = height[close] + velocity[close, 1] * age - fall * age**2
        sinks = velocity[close, 1] <= 2.0 * fall * age
        near = (np.abs(dx) < diameter) & ~(sinks & (np.maximum(dy, lowest) <= -diameter))
        close, dx, dy = close[near], dx[near], np.maximum(dy[near], lowest)
        reach = radius[close] + radius[i]
        if np.all(dx**2 + (dy - height[i]) ** 2 >= reach**2):
            continue
        height[i] = _free_height(dx, dy, reach, stream.bed_height, rng)


SURELY = 1e-6
"""Share of a distance by which a height must be nearer than that to be taken whatever rounds."""


def _free_height(
    dx: Floats, dy: Floats, reach: Floats, bed: float, rng: np.random.Generator
) -> float:
    """Draw heights up to `bed` until one is a `reach` away from all at (dx, dy), m.

    After `TRIES` the last one is kept as it is. The generator then stands where drawing one after
    the other would have left it.
    """
    aside, square, drawn = dx**2, reach**2, 0
    half = np.sqrt(np.maximum(square - aside, 0.0)) - SURELY * reach
    # What is surely taken, from `low` to `top`: intervals that overlap are as good as one.
    order = (dy - half)[half > 0.0].argsort()
    low, top = ((dy + side * half)[half > 0.0][order] for side in (-1.0, 1.0))
    top = np.maximum.accumulate(top)
    while drawn < TRIES:
        # Few at first, which mostly will do.
        tried = bed * rng.random(min(max(8, 7 * drawn), TRIES - drawn))
        drawn += len(tried)
        below = low.searchsorted(tried)
        taken = np.concatenate([[-inf], top])[below] > tried
        for n in (~taken).nonzero()[0].tolist():
            last = drawn - len(tried) + n + 1 == TRIES
            if last or np.all(aside + (dy - tried[n]) ** 2 >= square):
                generator: Any = rng.bit_generator
                generator.advance(n + 1 - len(tried))
                return float(tried[n])
    return float(tried[-1])
