"""Where particles arrive, and where they end.

A particle *arrives* on a surface when it first touches it, or touches what lies on it. What lies on
a surface at an instant is found from the places of all particles: those that touch it, those that
touch these, and so on. A particle that has bounced off does not lie on the surface, and one that it
meets in the air has not arrived. If particles do not meet each other, to arrive is to touch the
surface itself.

The fate of a particle is its place when its track ends, or the way by which it has left.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.machine import Arcs, Machine, Pieces, Segments
from chutelab.results.record import Record, hermite, kept, turned
from chutelab.results.rows import EVENT, PARTICLES, Kind
from chutelab.util.arrays import Bools, Floats, Ints, put

TOUCH = 0.01
"""Gap, as a share of the smaller radius, up to which two touch: twice the largest gap of a lasting
contact in the contact engine, ten times the overlap that the pymunk engine allows."""

POINT = 1e-9
"""Distance up to which a mass point touches a surface, as a share of the size of the machine."""

CARRIED = 1e-3
"""m/s; a particle whose speed differs from the belt's by less rides with it: the slip counts as
none."""

LOOKS = 100
"""Evenly spaced times, besides impacts, at which particles that lie on a surface are searched."""

HALVINGS = 24
"""Bisections between two such times to find when a contact began."""


def fates(recording: Record, which: Bools | None = None) -> NDArray[Any]:
    """Return the fate of each particle, in words, (N,).

    With `which`, (N,), only of these if particles do not meet; of others it is "unreleased".

    ``on NAME``
        It touches a surface when its track ends, or lies on particles that do, or is carried by it
        in a bed. Of several surfaces the one that is fewest contacts away counts, belts first.
    ``off NAME left``, ``off NAME right``
        It came to a belt (not the incoming one) and has left the scene without meeting another
        surface: carried off, over the end of the belt that was nearer when it fell below the belt.
    ``fell left``, ``fell right``, ``fell below``, ``flew above``
        It has left the scene otherwise: beside the machine, below it, or (without gravity) above.
    ``in the air``
        It touches nothing when its track ends.
    ``unreleased``
        It was never released.
    """
    machine, count = recording.machine, recording.count
    said = np.full(count, "unreleased", dtype=object)
    asked = recording.released
    if which is not None and not machine.interact:
        asked = asked & which
    particles = np.flatnonzero(asked)
    if not len(particles):
        return said
    last = recording.knots.take(recording.offsets[particles + 1] - 1)
    left, bottom, right, top = machine.releases.exit_box[particles].T
    place, out = last["position"], recording.ended_by("exit")[particles]
    x, y = place.T
    gone = out | (x < left) | (x > right) | (y < bottom) | (y > top)
    if gone.any():
        said[particles[gone]] = _ways_out(recording, particles[gone], place[gone])
    stays, places, until = (every[~gone] for every in (particles, place, last["t"]))
    there, names, moves = Places(recording), machine.surfaces, moving(machine)
    home = np.full(len(stays), -1)
    if machine.landing >= 0:
        home[recording.ended_by("landed")[stays]] = machine.landing
    for first in (True, False):
        for n, name in enumerate(names):
            left = np.flatnonzero((home < 0) & (moves[name][stays] == first))
            if len(left):
                lies = there.bare(stays[left], places[left], name, until[left])
                home[left[lies]] = n
    if machine.interact:
        one, two = there.touching(stays, places, until)
        reached = -1
        while (now := int(np.count_nonzero(home >= 0))) > reached:
            reached, before = now, home.copy()
            for a, b in ((one, two), (two, one)):
                new = (before[a] >= 0) & (before[b] < 0)
                home[b[new]] = before[a[new]]
    if machine.releases.carried.any():
        # In a bed a particle is carried at its height, whatever it touches.
        rides = machine.releases.carried.copy()
        rides[recording.select(Kind.SEPARATION, surface="incoming")["particle"]] = False
        home[rides[stays] & ~recording.ended_by("landed")[stays]] = names.index("incoming")
    told = [*(f"on {name}" for name in names), "in the air"]
    said[stays] = np.array(told, dtype=object)[home]
    return said


def moving(machine: Machine) -> dict[str, Bools]:
    """Tell of each surface which particles' machines have it as a belt, (N,).

    Belts are the outgoing one, and all surfaces that move.
    """
    return {
        name: np.broadcast_to(
            sum(((p.speed != 0.0) & (p.surface == owner)).any(axis=-1) for p in machine.parts)
            + (owner == machine.landing)
            > 0,
            machine.count,
        )
        for owner, name in enumerate(machine.surfaces)
    }


def _ways_out(recording: Record, gone: Ints, ends: Floats) -> list[str]:
    """Return the way by which particles have left that end outside the scene, (n, 2), m."""
    machine = recording.machine

    def box(points: Floats) -> list[Floats]:
        """Return least and largest x and y of each one's machine, (n,) each."""
        both = np.stack([points.min(axis=-2), points.max(axis=-2)], axis=-2)
        return [*np.broadcast_to(both, (recording.count, 2, 2))[gone].reshape(-1, 4).T]

    left, _, right, top = box(
        machine.corners if machine.corners.size else machine.releases.position
    )
    x, y = ends.T
    high = np.where((y > top) & (machine.gravity == 0.0), "flew above", "fell below")
    said = np.where(x < left, "fell left", np.where(x > right, "fell right", high)).astype(object)
    touch = recording.select(Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
    # Rows are in the order of time, so the last one of a particle remains.
    met, when = np.full(recording.count, -1), np.full(recording.count, -np.inf)
    whose = touch["particle"]
    met[whose], when[whose] = touch["surface"], touch["t"]
    others = recording.surface_index(PARTICLES)
    since = np.full(len(gone), -np.inf)
    for name, moves in sorted(moving(machine).items()):
        if name == "incoming" or not moves[gone].any():
            continue
        came = arrivals(recording, name)["t"][gone]
        own = recording.surface_index(name)
        elsewhere = (when[gone] > came) & ~np.isin(met[gone], (own, others))
        carried = moves[gone] & (came > since) & ~elsewhere
        since = np.where(carried, came, since)
        points: list[Floats] = []
        for part in machine.parts:
            mine = part.of(part.surface == own)
            points += mine.ends if isinstance(mine, Segments) else [0.5 * np.add(*mine.boxes)]
        first, low, second, _ = box(np.concatenate(points, axis=-2))
        for n in np.flatnonzero(carried).tolist():
            track = recording.track(int(gone[n]))
            above = np.flatnonzero(track["position"][:, 1] >= low[n])
            where = track["position"][above[-1] if len(above) else -1, 0]
            side = "left" if where < 0.5 * (first[n] + second[n]) else "right"
            said[n] = f"off {name} {side}"
    return [str(one) for one in said]


def never(count: int, rows: np.dtype[Any] = EVENT) -> NDArray[Any]:
    """Return events (count,) that did not happen: all NaN."""
    event = np.zeros(1, dtype=rows)
    for name in EVENT.names or ():
        if EVENT[name].base.kind == "f":
            event[name] = np.nan
    return event.repeat(count)


def first_of(recording: Record, which: Ints) -> Ints:
    """Return the number of the first of some events, by index, of each particle, (N,), or -1."""
    index, particle = np.full(recording.count, -1), recording.labels[2][which]
    # Of several assignments the last one stays.
    index[particle[::-1]] = which[::-1]
    return index


def firsts(recording: Record, which: Ints) -> NDArray[Any]:
    """Return the first of some events, by index, of each particle, (N,); NaN without one."""
    if not len(which):
        return never(recording.count)
    index = first_of(recording, which)
    found, without = recording.events.take(index), np.flatnonzero(index < 0)
    put(found, without, never(len(without), found.dtype))
    return found


@kept
def arrivals(recording: Record, surface: str = "outgoing") -> NDArray[Any]:
    """Return each particle's arrival on a surface, (N,), dtype `EVENT`; NaN without one.

    For an arrival on other particles only time, place, the velocity before and `other` (the
    particle that it met, -1 for the surface itself) are meaningful. Not for a family.
    """
    if surface not in recording.surfaces:
        return never(recording.count)
    # All events on it count: a particle that slides onto it from a tangential chute has no impact.
    which = recording.which(surface=surface)
    if not recording.machine.interact:
        return firsts(recording, which)
    found, direct = never(recording.count), recording.events.take(which)
    there = Places(recording)
    met = np.concatenate([direct, recording.select(Kind.COLLISION)])
    # Nothing arrives before the first touch of the surface itself, which is always recorded.
    begin = float(direct["t"].min(initial=np.inf))
    met = met[met["t"] >= begin]
    met = met[np.argsort(met["t"], kind="stable")]
    if not len(met):
        return found
    looks = np.linspace(begin, float(recording.knots["t"].max(initial=begin)), LOOKS)
    times, one, two = (met[name].copy() for name in ("t", "particle", "other"))
    come = np.zeros(recording.count, dtype=bool)
    last = 0
    for before, look in zip(np.append(begin, looks[:-1]), looks, strict=True):
        if come.all():
            break
        now = int(np.searchsorted(times, look, side="right"))
        # Impacts between two that have arrived change nothing.
        between = np.arange(last, now)
        between = between[~(come[one[between]] & come[two[between]] & (two[between] >= 0))]
        some = (between, times[between], one[between], two[between])
        for row, t, i, j in zip(*(column.tolist() for column in some), strict=True):
            if j < 0:
                if not come[i]:
                    found[i], come[i] = met[row], True
            elif come[i] != come[j]:
                new, old = (j, i) if come[i] else (i, j)
                # Only particles that have arrived can lie there.
                particles, places = there.at(t, np.flatnonzero(come))
                if there.carries(old, t, particles, places, surface):
                    found[new] = met[row] if new == i else there.state(new, t, old)
                    come[new] = True
        last = now
        # Particles that came to lie there without a recorded impact.
        particles, places = there.at(look)
        lies = there.lying(look, particles, places, surface)
        for i in particles[lies & np.isnan(found["t"][particles])].tolist():
            found[i], come[i] = there.began(i, surface, before, look), True
    return found


class Places:
    """Places of particles at an instant, and which of them lie on a surface then."""

    def __init__(self, recording: Record) -> None:
        self.recording = recording
        self.radius = recording.radius
        knots = recording.knots
        self._pieces: dict[int, list[Pieces]] = {}
        self._movers = {mover.surface: mover for mover in recording.machine.movers}
        self._cornered = np.zeros(recording.count, dtype=bool)
        for kind, outline in enumerate(recording.machine.outlines):
            if outline is not None:
                self._cornered |= recording.machine.releases.kind == kind
        self._t0 = float(knots["t"].min(initial=0.0))
        self._span = 2.0 * (float(knots["t"].max(initial=0.0)) - self._t0) + 1.0

    @cached_property
    def _keys(self) -> Floats:
        """A number for each knot that rises from particle to particle, and along each track."""
        return self.recording.owner * self._span + (self.recording.knots["t"] - self._t0)

    @cached_property
    def _touch(self) -> Floats:
        """Gap up to which each particle touches a surface, (N,), m."""
        near = self.radius * (1.0 + TOUCH)
        if not self.radius.all() and (corners := self.recording.machine.corners).size:
            size = np.ptp(corners, axis=-2).max(axis=-1)
            near = np.where(self.radius > 0.0, near, POINT * size)
        return near

    def _cells(self, particles: Ints, t: Any, side: Any = "right") -> tuple[Ints, Floats]:
        """Return the interval of each track that holds t, and the share of it that has passed."""
        knots, offsets = self.recording.knots, self.recording.offsets
        left = np.searchsorted(self._keys, particles * self._span + (t - self._t0), side=side) - 1
        left = np.clip(left, offsets[particles], offsets[particles + 1] - 2)
        h = knots["t"][left + 1] - knots["t"][left]
        share = np.divide(t - knots["t"][left], h, out=np.ones_like(h), where=h > 0.0)
        return left, np.clip(share, 0.0, 1.0)

    def at(self, t: float, particles: Ints | None = None) -> tuple[Ints, Floats]:
        """Return the particles under way at t and their places, (n,) and (n, 2), m."""
        knots, offsets = self.recording.knots, self.recording.offsets
        particles = np.flatnonzero(self.recording.released) if particles is None else particles
        first, last = knots["t"][offsets[particles]], knots["t"][offsets[particles + 1] - 1]
        particles = particles[(first <= t) & (t <= last)]
        return particles, self.on(particles, t)

    def on(self, particles: Ints, t: Any) -> Floats:
        """Return the places of particles (n,) under way at t, s (one or (n,)), (n, 2), m."""
        return hermite(self.recording.knots, *self._cells(particles, t))[0]

    def belt_work(self, particles: Ints, t: Any) -> Floats:
        """Return the belt work of particles (n,) up to t, s (one or (n,)), (n,), J."""
        knots, offsets = self.recording.knots["entries"][:, 0], self.recording.offsets
        left, share = self._cells(particles, t, "left")
        booked = knots[left] + share * (knots[left + 1] - knots[left])
        return np.where(t < self.recording.knots["t"][offsets[particles]], 0.0, booked)

    def state(self, particle: int, t: float, other: int = -1) -> NDArray[Any]:
        """Return time, place and velocity of a particle just before t, as an event."""
        event, cells = never(1), self._cells(np.array([particle]), t, "left")
        event["position"], event["velocity_before"] = hermite(self.recording.knots, *cells)
        event["velocity_after"] = event["velocity_before"]
        event["t"], event["particle"], event["other"] = t, particle, other
        event["kind"], event["surface"] = Kind.COLLISION, len(self.recording.surfaces) - 1
        found: NDArray[Any] = event[0]
        return found

    def edges(self, particle: int, place: Floats, t: float) -> Segments:
        """Return the edges of a particle at a place (2,), m, at t, s; for a disk its centre.

        The centre is one edge of no length.
        """
        angle, some = 0.0, self.recording
        corners = some.machine.outlines[some.machine.releases.kind[particle]]
        if corners is None:
            corners = np.zeros((1, 2))
        else:
            angle = float(turned(some.knots, some.angle, *self._cells(np.array([particle]), t))[0])
        c, s = np.cos(angle), np.sin(angle)
        start = place + corners @ np.array([[c, s], [-s, c]])
        along = np.roll(start, -1, axis=0) - start
        length = np.hypot(*along.T)
        tangent = along / np.where(length > 0.0, length, 1.0)[:, None]
        none, owner = np.zeros(len(length)), np.zeros(len(length), dtype=np.int64)
        return Segments(
            start=start, tangent=tangent, length=length, speed=none, restitution=none,
            friction=none, surface=owner, appears=none - np.inf, vanishes=none + np.inf,
            one_sided=owner,
        )  # fmt: skip

    def bare(self, particles: Ints, places: Floats, surface: str, t: Any) -> Bools:
        """Return which particles touch a surface itself at t (s, one or (n,)), (n,)."""
        machine, owner = self.recording.machine, self.recording.surface_index(surface)
        gap, mover = np.full(len(particles), np.inf), self._movers.get(owner)
        if owner not in self._pieces:
            self._pieces[owner] = [one for one in machine.pieces if one.surface == owner]
        times = np.broadcast_to(np.asarray(t, dtype=np.float64), gap.shape)
        written = places if mover is None else mover.at_rest(places, times)
        for piece in self._pieces[owner]:
            # Of a family each has its own.
            piece = piece if self.recording.family is None else piece.of(particles)
            gap = np.where(piece.there(t), np.minimum(gap, piece.gap(written)), gap)
        radius = self.radius[particles]
        found = np.asarray(gap <= self._touch[particles])
        for n in np.flatnonzero(found & self._cornered[particles]).tolist():
            edges = self.edges(int(particles[n]), places[n], float(times[n]))
            found[n] = False
            for piece in (one for one in self._pieces[owner] if one.there(times[n])):
                # The nearest points are on a corner and the piece, or on an edge and an end or
                # centre.
                to = np.stack([*piece.ends, *([piece.center] if isinstance(piece, Arcs) else [])])
                to = to if mover is None else mover.carried(to, times[n])
                near = np.concatenate([edges.start, *(edges.nearest(point) for point in to)])
                near = near if mover is None else mover.at_rest(near, times[n])
                found[n] |= piece.gap(near).min() <= TOUCH * radius[n]
        return found

    def _meet(self, pair: Ints, places: Floats, t: float) -> bool:
        """Whether two near particles, one with corners, touch at places (2, 2), m."""
        a, b = (self.edges(int(k), place, t) for k, place in zip(pair, places, strict=True))
        gap = min(
            float(first.gap(second.start[:, None]).min()) for first, second in ((a, b), (b, a))
        )
        radius = self.radius[pair]
        return bool(gap <= radius[~self._cornered[pair]].sum() + TOUCH * radius.min())

    def touching(self, particles: Ints, places: Floats, t: Any) -> tuple[Ints, Ints]:
        """Return all pairs that touch at t (s, one or (n,)), by rows of `particles`, (p,) each."""
        radius, order = self.radius[particles], np.argsort(places[:, 0], kind="stable")
        x, reach = places[order, 0], 2.0 * radius.max(initial=0.0) * (1.0 + TOUCH)
        firsts, seconds = [], []
        for step in range(1, len(order)):
            near = np.flatnonzero(x[step:] - x[:-step] <= reach)
            if not len(near):
                break
            one, two = order[near], order[near + step]
            least = np.minimum(radius[one], radius[two])
            met = np.hypot(*(places[one] - places[two]).T) <= (
                radius[one] + radius[two] + TOUCH * least
            )
            firsts.append(one[met])
            seconds.append(two[met])
        none = np.zeros(0, dtype=np.int64)
        one, two = np.concatenate([none, *firsts]), np.concatenate([none, *seconds])
        times = np.broadcast_to(np.asarray(t, dtype=np.float64), radius.shape)
        met = ~(self._cornered[particles[one]] | self._cornered[particles[two]])
        for n in np.flatnonzero(~met).tolist():
            pair = [one[n], two[n]]
            met[n] = self._meet(particles[pair], places[pair], times[pair].min())
        return one[met], two[met]

    def lying(self, t: float, particles: Ints, places: Floats, surface: str) -> Bools:
        """Return which particles lie on a surface at t (s), or on what lies on it, (n,)."""
        lies = self.bare(particles, places, surface, t)
        one, two = self.touching(particles, places, t)
        many = -1
        while (now := int(np.count_nonzero(lies))) > many:
            many = now
            # A particle may be in several pairs; any one counts.
            lies[one[lies[two]]] = True
            lies[two[lies[one]]] = True
        return lies

    def carries(
        self, particle: int, t: float, particles: Ints, places: Floats, surface: str
    ) -> bool:
        """Whether one of `particles` lies on a surface at t (s), or on what lies on it."""
        radius = self.radius[particles]
        todo = np.flatnonzero(particles == particle).tolist()
        seen = np.zeros(len(particles), dtype=bool)
        seen[todo] = True
        while todo:
            k = todo.pop()
            if self.bare(particles[k : k + 1], places[k : k + 1], surface, t)[0]:
                return True
            room = radius + radius[k] + TOUCH * np.minimum(radius, radius[k])
            next_to = (np.hypot(*(places - places[k]).T) <= room) & ~seen
            cornered = next_to & (self._cornered[particles] | self._cornered[particles[k]])
            for m in np.flatnonzero(cornered).tolist():
                next_to[m] = self._meet(particles[[k, m]], places[[k, m]], t)
            seen |= next_to
            # The lowest one comes first: it is the nearest to the surface.
            near = np.flatnonzero(next_to)
            todo += near[np.argsort(-places[near, 1])].tolist()
        return False

    def began(self, particle: int, surface: str, before: float, after: float) -> NDArray[Any]:
        """Return when and how a particle that lies there `after` (s) arrived, as an event.

        The time is found to 2**-`HALVINGS` of the interval between `before` and `after`.
        """
        for _ in range(HALVINGS):
            middle = 0.5 * (before + after)
            particles, places = self.at(middle)
            lies = particle in particles and self.carries(
                particle, middle, particles, places, surface
            )
            before, after = (before, middle) if lies else (middle, after)
        return self.state(particle, after)
