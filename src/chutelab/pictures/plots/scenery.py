"""Choices for pictures of a recording: particles, times, energies, part of the world."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import astuple, dataclass, replace
from math import floor, isnan, log10
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.core import number as layout_number
from chutelab.machine.parts import Mover
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.arrival import arrivals
from chutelab.results.ledger import ledger
from chutelab.results.quantities import each
from chutelab.results.stream import FEWEST
from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.errors import InputError

STRUCK = (Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
"""Kinds of events in which something is hit."""


def subset(recording: Recording, particles: Sequence[int] | Ints) -> Recording:
    """Return the recording of some particles only; its events are left out."""
    begin, end = (recording.offsets[np.asarray(particles, dtype=np.int64) + n] for n in (0, 1))
    offsets = np.concatenate([[0], np.cumsum(end - begin)]).astype(np.int64)
    rows = np.arange(offsets[-1]) + np.repeat(begin - offsets[:-1], end - begin)
    return replace(
        recording,
        knots=recording.knots[rows],
        offsets=offsets,
        ended=recording.ended[np.asarray(particles, dtype=np.int64)],
        events=recording.events[:0],
        angle=recording.angle[rows] if len(recording.angle) else recording.angle,
    )


def nominal(recording: Recording, times: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions and velocities of particle 0, (T, 2) each, as `Recording.at` does."""
    position, velocity = subset(recording, [0]).at(times)
    return position[:, 0], velocity[:, 0]


def spread(count: int, at_most: int) -> Ints:
    """Return up to `at_most` particle indices, evenly spread, particle 0 among them."""
    return np.unique(np.linspace(0, count - 1, min(count, at_most)).astype(np.int64))


def round_step(span: float, wanted: int) -> float:
    """Return the step of 1, 2 or 5 times a power of ten that divides a span into about `wanted`.

    >>> round_step(0.6, 10), round_step(3.0, 10)
    (0.05, 0.2)
    """
    exact = span / wanted
    power = floor(log10(exact))
    mantissa = exact / 10.0**power
    # Geometric means are the borders between 1, 2, 5 and 10.
    borders = ((1, 2**0.5), (2, 10**0.5), (5, 50**0.5), (10, 10.0))
    factor = next(factor for factor, border in borders if mantissa <= border)
    return float(f"{factor}e{power}")


def round_times(begin: float, end: float, step: float) -> Floats:
    """Return the multiples of a step from `begin` to `end`, s."""
    slack = 1e-9 * step
    return step * np.arange(np.ceil((begin - slack) / step), np.floor((end + slack) / step) + 1.0)


def action(recording: Recording) -> tuple[float, float]:
    """Return the beginning and end of particle 0's action, s.

    It begins at its separation from the incoming belt, or at its release without a separation; an
    `InputError` if it was never released.
    """
    track = recording.track(0)
    if not len(track):
        end = float(np.max(recording.machine.end_time))
        text = "more: pictures follow particle 0, for which no place was free up to then"
        raise InputError(text, "run.until", end, recording.machine.scene.source)
    begin = float(each(recording, "separation.t")[0])
    return float(track["t"][0]) if isnan(begin) else begin, float(track["t"][-1])


def struck_by_nominal(recording: Recording) -> NDArray[Any]:
    """Return the events in which particle 0 hits something or is hit."""
    struck = recording.select(*STRUCK)
    one, other = struck["particle"], struck["other"]
    return np.asarray(struck[(one == 0) | (other == 0)])


def strobe_step(recording: Recording) -> float:
    """Return the round time between strobe dots, s, chosen for the time until the last impact.

    It is chosen for a tenth of the track if that is longer: a run may end as the action begins.
    """
    begin, end = action(recording)
    clock = recording.track(0)["t"]
    struck = struck_by_nominal(recording)["t"]
    last = float(struck[-1]) if len(struck) and struck[-1] > begin else end
    return round_step(max(last - begin, 0.1 * float(clock[-1] - clock[0]), 1e-3), 10)


def strobe_times(recording: Recording) -> Floats:
    """Return the round times at which particle 0 has a strobe dot, s."""
    clock = recording.track(0)["t"]
    return round_times(float(clock[0]), float(clock[-1]), strobe_step(recording))


FINE = 2e-4
"""Share of the visible extent by which a drawn line may miss the curve."""


def track_times(
    recording: Recording,
    begin: float | None = None,
    end: float | None = None,
    *,
    particle: int = 0,
    fine: float | None = None,
) -> Floats:
    """Return times for drawing a track: straight lines between them miss it by `fine`.

    They are its knots, the moments just before jumps, which are thus drawn vertically, and equal
    parts of each piece, as many as its curvature requires: over a time h a chord misses a curve by
    at most h²/8 times its largest acceleration, and a cubic has that at one of its ends. By default
    `fine` (m) is the share `FINE` of the track's extent, and the whole track is drawn, else from
    `begin` to `end`, s.
    """
    track = recording.track(particle)
    t, place, velocity = track["t"], track["position"], track["velocity"]
    if fine is None:
        fine = FINE * float(np.ptp(place, axis=0).max())
    h, way = np.diff(t), np.diff(place, axis=0)
    first, last = h[:, None] * velocity[:-1], h[:, None] * velocity[1:]
    bent = np.maximum(
        np.hypot(*(6.0 * way - 4.0 * first - 2.0 * last).T),
        np.hypot(*(6.0 * way - 2.0 * first - 4.0 * last).T),
    )
    parts = np.ceil(np.sqrt(bent / 8.0 / max(fine, 1e-300)))
    parts = np.clip(parts, 1, 500).astype(np.int64)
    number = np.arange(parts.sum()) - np.repeat(np.cumsum(parts) - parts, parts)
    even = np.repeat(t[:-1], parts) + number * np.repeat(h / parts, parts)
    jumps = np.nextafter(t[1:][h == 0.0], -np.inf)
    times = np.unique(np.concatenate([even, t[-1:], jumps[jumps >= t[0]]]))
    if begin is None and end is None:
        return times
    ends = [t[0] if begin is None else begin, t[-1] if end is None else end]
    return np.union1d(times[(times > ends[0]) & (times < ends[1])], ends)


def path_of(recording: Recording, particle: int, fine: float) -> Floats:
    """Return the points of a line that misses a particle's track by about `fine` (m), (P, 2)."""
    times = track_times(recording, particle=particle, fine=fine)
    place = subset(recording, [particle]).at(times)[0][:, 0]
    # A track at rest or creeping has thousands of knots in one place.
    cell = np.floor(place / fine)
    kept = np.append(np.any(cell[1:] != cell[:-1], axis=1), True)
    kept[0] = True
    return np.asarray(place[kept])


def upright(times: Floats, jumps: Floats) -> Floats:
    """Return ascending times with the jumps between the first and last, and just before each."""
    jumps = jumps[(jumps >= times[0]) & (jumps <= times[-1])]
    before = np.nextafter(jumps, -np.inf)
    return np.unique(np.concatenate([times, jumps, before[before >= times[0]]]))


def energies(recording: Recording, times: Floats) -> dict[str, Floats]:
    """Return the ledger at times (T,), J, with positive potential energy, for stacking.

    It is `Recording.energy_at` with ``start``, kinetic and potential energy at the release of all
    particles released so far. Potential energy is relative to the lowest point of the particles
    that stay in the scene (of all, if it were negative otherwise).
    """
    balance = recording.energy_at(times)
    first, _ = recording.ends()
    order, indices = np.argsort(first["t"], kind="stable"), np.flatnonzero(recording.released)
    at_release = np.concatenate(
        [[0.0], np.cumsum(sum(recording.energies(first[order], indices[order])))]
    )
    released = np.searchsorted(first["t"][order], times, side="right")
    masses = recording.mass[indices][order]
    weight = np.concatenate([[0.0], np.cumsum(masses)])[released] * recording.gravity
    heights = recording.machine.height(recording.knots["position"])
    stays = recording.ended != REASONS.index("exit")
    staying = heights[np.repeat(stays, np.diff(recording.offsets))]
    lowest = float(heights.min(initial=np.inf))
    for zero in (float(staying.min()) if len(staying) else lowest, lowest):
        lifted = balance["potential"] - weight * zero
        if (lifted >= 0.0).all():
            break
    balance["potential"] = np.maximum(lifted, 0.0)
    balance["start"] = at_release[released] - weight * zero
    hung = [one for one in recording.machine.movers if one.hinge]
    if hung and "hinges" not in paid_by(recording):
        balance |= {"spring": np.zeros_like(times), "damper_loss": np.zeros_like(times)}
        for one in hung:
            _hang(balance, one, recording, times)
    return balance


def _hang(balance: dict[str, Floats], mover: Mover, recording: Recording, times: Floats) -> None:
    """Add hinges to a ledger at times (T,), J.

    Of its energy, and of the losses at its damper and stops, contacts have given as much as they
    lost; the rest is its motor's work, in the row of all drives.
    """
    hinge = mover.hinge
    assert hinge is not None
    own, t = hinge.states, hinge.states["t"]
    stopped = np.zeros_like(times)
    if len(recording.stopped):
        taken = recording.stopped[recording.swings["surface"] == mover.surface]
        stopped = np.interp(times, t, taken)
    # Gauss's rule of three points is exact for the square of a parabola, the rate between states.
    places, weights = np.polynomial.legendre.leggauss(3)
    within = t[:-1, None] + 0.5 * np.diff(t)[:, None] * (1.0 + places)
    power = hinge.damper * hinge.at(within)[1] ** 2
    lost = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(t) * (power @ weights))])
    angle, rate = hinge.at(times)
    up = recording.machine.up
    now = hinge.energies(angle, rate, recording.gravity, up)
    begun = hinge.energies(own["angle"][0], own["rate"][0], recording.gravity, up)
    damped, lowest = np.interp(times, t, lost), -recording.gravity * float(np.hypot(*hinge.moment))
    for name, energy in zip(("kinetic", "potential", "spring"), now, strict=True):
        balance[name] = balance[name] + energy
    balance["potential"] -= lowest
    balance["damper_loss"] = balance["damper_loss"] + damped
    balance["restitution_loss"] = balance["restitution_loss"] + stopped
    balance["start"] = balance["start"] + sum(begun) - lowest
    balance["belt_work"] = balance["belt_work"] + sum(now) - sum(begun) + damped + stopped


def flow(recording: Recording) -> dict[str, Floats]:
    """Return the times of releases, arrivals and final exits of particles, s.

    Arrivals and exits are those of the particles that have them.
    """
    first, last = recording.ends()
    come = arrivals(recording)["t"]
    gone = recording.ended[recording.released] == REASONS.index("exit")
    return {"released": first["t"], "arrived": come[np.isfinite(come)], "left": last["t"][gone]}


MANY = 60
"""With at least so many particles, some may be outside the window."""


def as_crowd(recording: Recording) -> bool:
    """Whether pictures are about all particles, and show particle 0 only on request."""
    return recording.count >= FEWEST


def one_of_many(recording: Recording) -> bool:
    """Whether pictures show the motion of all particles, not the path of particle 0.

    They do if there are many, and no conveyor brings them one after the other.
    """
    return recording.count > MANY and recording.machine.pulley is None


def bodily(recording: Recording) -> bool:
    """Whether all particles are shown: `one_of_many`, boxes, polygons, on strings or movers.

    With a conveyor, the path of particle 0 says more than its place on a surface that moves.
    """
    machine = recording.machine
    corners = any(outline is not None for outline in machine.outlines)
    carried = bool(machine.movers) and machine.pulley is None
    return one_of_many(recording) or corners or bool(machine.joints) or carried


def stays(recording: Recording) -> Bools:
    """Return which particles are still shown after their end, (N,): of many, those at rest."""
    return np.asarray(recording.ended_by("settled") & (recording.count > MANY))


def places(recording: Recording, particles: Sequence[int] | Ints, times: Floats) -> Floats:
    """Return the places of some particles, (T, n, 2), m; NaN when they are not shown."""
    some = subset(recording, particles)
    position = some.at(times)[0]
    for i in np.flatnonzero(stays(recording)[np.asarray(particles, dtype=np.int64)]).tolist():
        last = some.track(i)[-1]
        position[times > last["t"], i] = last["position"]
    return position


STREAM_TRACKS, FEW_TRACKS = 60, 12
"""Most tracks that are drawn: for a stream, and for many particles at once."""


def drawn_tracks(recording: Recording) -> Ints:
    """Return the particles whose tracks are drawn; particle 0 is the first."""
    chosen = spread(recording.count, FEW_TRACKS if one_of_many(recording) else STREAM_TRACKS)
    return chosen[recording.released[chosen]]


def paid_by(recording: Recording) -> tuple[str, ...]:
    """Return what gives or takes energy in pictures, beside the release: one row for all of it.

    First "drives", "belt_work" or "hinges" (with drives), then "springs" of joints, and "pushes" by
    hand. What a hand does to plates that it turns, and in Pymunk the loss at stops, is known only
    for whole runs. Then hinges have no energies of their own, but give or take energy.
    """
    machine = recording.machine
    hinges = [one.hinge for one in machine.movers if one.hinge]
    untold = not len(recording.stopped)
    driven = any(one.hinge is None or any(one.hinge.motor) for one in machine.movers)
    given = {
        "hinges": any(one.steered or (untold and np.isfinite(one.stops).any()) for one in hinges),
        "drives": driven,
        "belt_work": any(piece.speed for piece in machine.pieces),
    }
    forces = {"springs": len(recording.springs), "pushes": ledger(recording).push_work}
    first = [name for name, there in given.items() if there][:1]
    return (*first, *(name for name, there in forces.items() if there))


POSES = 61
"""Times of a run at which the extent of moving surfaces is computed."""

NEARBY, FAR = 0.35, 1.0
"""Margins around the action, in shares of its size: within the first, ends of belts are shown;
within the second, ends of surfaces at rest, and later events."""


@dataclass(frozen=True)
class Window:
    """The part of the world that is shown, m."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def width(self) -> float:
        """Extent in x, m."""
        return self.right - self.left

    @property
    def height(self) -> float:
        """Extent in y, m."""
        return self.top - self.bottom

    def padded(self, left: float, right: float, bottom: float, top: float) -> Window:
        """Return a window extended by shares of its own larger side."""
        size = max(self.width, self.height)
        shifts = np.array([-left, right, -bottom, top]) * size
        return Window(*(np.array(astuple(self)) + shifts).tolist())

    def fitted(self, aspect: float) -> Window:
        """Return the smallest window of that width / height which holds this one, centred."""
        width = max(self.width, aspect * self.height)
        height = max(self.height, self.width / aspect)
        x, y = 0.5 * (self.left + self.right), 0.5 * (self.bottom + self.top)
        return Window(x - width / 2, x + width / 2, y - height / 2, y + height / 2)

    def joined(self, other: Window) -> Window:
        """Return the smallest window that holds both."""
        least, most = np.sort([astuple(self), astuple(other)], axis=0).tolist()
        return Window(least[0], most[1], least[2], most[3])

    def holds(self, points: Floats) -> Bools:
        """Return which points, (..., 2), are inside."""
        x, y = points[..., 0], points[..., 1]
        return np.asarray(
            (x >= self.left) & (x <= self.right) & (y >= self.bottom) & (y <= self.top)
        )

    def nearest(self, points: Floats) -> Floats:
        """Return the nearest places inside to points, (..., 2)."""
        return np.clip(points, (self.left, self.bottom), (self.right, self.top))

    def clip(self, start: Floats, end: Floats) -> tuple[Floats, Floats] | None:
        """Return the ends of the part of a straight line inside, None if it stays outside."""
        along = end - start
        low, high = 0.0, 1.0
        for axis, (lower, upper) in enumerate(((self.left, self.right), (self.bottom, self.top))):
            if abs(along[axis]) < 1e-300:  # no displacement, and a division by it may overflow
                if not lower <= start[axis] <= upper:
                    return None
                continue
            shares = sorted((bound - start[axis]) / along[axis] for bound in (lower, upper))
            low, high = max(low, shares[0]), min(high, shares[1])
        return (start + low * along, start + high * along) if low < high else None


def window_of(recording: Recording) -> Window:
    """Return the window of the action, with room for labels; `[view]` overrides it.

    It holds particle 0 from separation (or release, without one) to its landing (or last impact),
    the pulley, the places where the others are released and strike something, and the ends of
    surfaces near there. Of later motion, and of the fall of particles that leave, it holds as much
    as does not make everything else small. If particle 0 is not the important one, see `bodily`, or
    there are several streams, it holds all particles.
    """
    machine, many = recording.machine, one_of_many(recording)
    if (view := recording.scene.view) is not None:
        return Window(view.from_[0], view.to[0], view.from_[1], view.to[1])
    crowd = _crowd(recording, 0 if many else 1)
    path, tail, fall = (crowd, crowd[:0], crowd[:0]) if many else _path(recording)
    together = bodily(recording) or len(machine.streams) > 1
    points = [np.concatenate([path, crowd]) if together else path]
    if bodily(recording):
        # All particles that come to rest, such as those at the foot of a heap, which few strike.
        stays = recording.ended[recording.released] != REASONS.index("exit")
        points.append(recording.ends()[1]["position"][stays])
        tracks = [recording.track(i)["position"] for i in drawn_tracks(recording).tolist()]
        fall = np.concatenate([fall, *tracks])
    for joint in machine.joints:
        anchors = [] if joint.anchor is None else [np.array([joint.anchor])]
        points += [*anchors, recording.track(joint.particle)["position"]]
    if machine.pulley is not None:
        corner = np.full(2, machine.pulley.radius)
        points.append(np.array([-corner, corner]))
    core = around(np.concatenate(points))
    far = core.padded(*[FAR] * 4)
    points.append(far.nearest(np.concatenate([tail, crowd])))
    near = around(np.concatenate(points)).padded(*[NEARBY] * 4)
    # The incoming belt, segment 0, may be cut off anywhere.
    free = slice(0 if machine.pulley is None else 1, None)
    ends = np.stack([machine.segments.start[free], machine.segments.end[free]], axis=1)
    still = (machine.segments.speed[free] == 0.0)[:, None]
    points.append(ends[near.holds(ends) | (still & far.holds(ends))])
    for part in machine.parts[1:]:
        points.append(part.corners[near.holds(part.corners)])
    times = np.linspace(recording.t[0], recording.t[-1], POSES) if machine.movers else ()
    for mover in machine.movers:
        for pieces in machine.parts:
            own = pieces.of(pieces.surface == mover.surface).corners
            placed = np.concatenate([mover.carried(own, time) for time in times])
            points.append(placed[far.holds(placed)])
    points.append(around(np.concatenate(points)).padded(*[NEARBY] * 4).nearest(fall))
    # Names are left of the pulley and behind the plate.
    left = 0.06 if machine.pulley is None else 0.24
    right = 0.22 if "plate" in machine.surfaces else 0.06
    held = np.concatenate(points)
    # Large particles are shown whole.
    reach = 1.1 * float(np.max(machine.particle.radius))
    whole = around(np.concatenate([held - reach, held + reach]))
    return around(held).padded(left, right, 0.10, 0.12).joined(whole)


def _path(recording: Recording) -> tuple[Floats, Floats, Floats]:
    """Return particle 0's positions up to landing or last impact, from there on, and as it falls.

    A falling particle has left the scene and touched nothing since.
    """
    begin, end = action(recording)
    events = recording.events[recording.events["particle"] == 0]
    gone = events["kind"] == Kind.EXIT
    events = events[~gone & (events["t"] > begin)]
    rests = float(events["t"][-1]) if gone.any() and len(events) else end
    struck = struck_by_nominal(recording)
    # Impacts before that, on the way to the end of a ramp, do not count.
    struck = struck[struck["t"] > begin]
    landed = struck["t"][struck["kind"] == Kind.LANDING]
    last = landed[0] if len(landed) else struck["t"][-1] if len(struck) else rests
    times = track_times(recording, begin, end)
    position, _ = nominal(recording, times)
    first, left = times <= last, times > rests
    return position[first], position[~first & ~left], position[left]


def _crowd(recording: Recording, begin: int) -> Floats:
    """Corners of boxes around impacts and releases of particles from number `begin` on.

    With many, the middle 96 % of the impacts count. Releases count unless a belt carries the
    particles from there. Collisions below all surfaces count at their bottom.
    """
    events = recording.events[recording.events["particle"] >= begin]
    left = events[events["kind"] == Kind.SEPARATION]
    left = left[left["surface"] == recording.surface_index("incoming")]
    carried = np.isin(events["particle"], left["particle"])
    released = events["position"][~carried & (events["kind"] == Kind.RELEASE)]
    struck = events["position"][np.isin(events["kind"], STRUCK)]
    strays = 0.02 if recording.count > MANY else 0.0
    bottom = recording.machine.releases.exit_box[:, 1].min() + layout_number("EXIT_MARGIN")
    corners = [
        np.quantile(places, [share, 1.0 - share], axis=0)
        for places, share in ((released, 0.0), (struck, strays))
        if len(places)
    ]
    found = np.concatenate([np.empty((0, 2)), *corners])
    return np.asarray(np.maximum(found, [-np.inf, bottom]))


def around(points: Floats) -> Window:
    """Return the smallest window that holds points, (P, 2), and is not without extent."""
    (left, bottom), (right, top) = points.min(axis=0), points.max(axis=0)
    least = 0.01 * max(right - left, top - bottom) or 0.1
    return Window(left, max(right, left + least), bottom, max(top, bottom + least))


def motion(recording: Recording, particles: Ints, times: Floats) -> tuple[Floats, Floats]:
    """Return the places of particles, (T, n, 2), and angles, (T, n), if visible."""
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
"""Shares of a slack string's length at which points are drawn."""


COIL = 0.05
"""Half of a spring's width, as a share of its length at rest."""


def strings(recording: Recording, times: Floats) -> Callable[[int], list[Floats]]:
    """Return the function that gives the joints at the time of an index, (P, 2) each, m.

    A slack string sags along gravity between its ends, a spring is a zigzag; pins are left out.
    """
    # A string over a pulley has two parts, equally slack.
    joints = [joint for joint in recording.machine.joints if joint.kind != "pin"]
    joints += [
        replace(joint, particle=joint.other, other=joint.particle) for joint in joints if joint.over
    ]
    own = places(recording, [joint.particle for joint in joints], times)
    far = places(recording, [max(joint.other, 0) for joint in joints], times)
    length = np.full(own.shape[:2], [joint.length for joint in joints])
    for n, joint in enumerate(joints):
        if joint.over:
            one, other = (np.hypot(*(end[:, n] - joint.over).T) for end in (own, far))
            length[:, n] = 0.5 * (joint.length + one - other)
        if joint.anchor is not None:
            far[:, n] = joint.anchor

    def drawn(index: int) -> list[Floats]:
        found = []
        for joint, begin, end, long in zip(
            joints, far[index], own[index], length[index], strict=True
        ):
            way = end - begin
            path = begin + HANGING[:, None] * way
            if joint.kind == "string":
                # If it were pulled down at its middle, it would be twice as deep there.
                sag = np.sqrt(max(long**2 - float(way @ way), 0.0))
                path -= (2.0 * HANGING * (1.0 - HANGING) * sag)[:, None] * recording.machine.up
            elif joint.kind == "spring":
                across = np.array([-way[1], way[0]]) / (np.hypot(*way) or 1.0)
                path[2:-2:2] += COIL * joint.length * across
                path[3:-2:2] -= COIL * joint.length * across
            found.append(path)
        return found

    return drawn
