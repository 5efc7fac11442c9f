"""Where a lone particle leaves the drive pulley, and how fast: adhesion, finite friction, spin.

With u = v² / (g Rc), Rc = R + r the radius of the centre's path and φ the angle from the top, the
normal force is m g w, w = cos φ - u, and the particle leaves where w = 0. While it slips forward
on the pulley, w' = 2 µ w - 3 sin φ; while it slips back, w' = -2 µ w - 3 sin φ. A belt that rises
at β meets the pulley at φ = -β.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from chutelab.util.arrays import Bools, Floats, Ints
from chutelab.util.trig import arc_cos, atan2, sin_cos

MOST_ROUNDS = 100
"""Newton rounds; fewer than 20 are ever used, as it starts within e² of the root."""

MOST_FRICTION = 1e100
"""Squares safely; by far too large to tell from infinity once slip has begun."""

HALVINGS = 60
"""Bisections of an angle: they exhaust a double's digits."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
PANELS = 24
"""Quadrature of the spin: panels halve towards the onset of slip, where 1/√u may be nearly singular
at low belt speed; 12 nodes on each give 1e-16 even for a singularity at the onset itself."""

FAULTS = (
    "",
    "it does not get up the incoming belt",
    "it does not get over the pulley",
    "it slips back on the pulley, which has no closed form for a body that turns",
)
"""Why there is no separation, by `Separation.fault`; all on belts that rise."""


@dataclass(frozen=True, eq=False)
class Separation:
    """State of the centre where the pulley is left, arrays of one shape.

    φ1 is the angle from the top of the pulley, rad, its cosine and sine are each to full relative
    precision; v1 is the speed, m/s, and `rim` is r ω, m/s, ω counter-clockwise: the velocity of the
    lowest point relative to the centre. Thrown up from a rising belt, it may come down on the
    pulley again after the time `again`, s, inf if not. `fault` is an index into `FAULTS`, and
    where it is not 0 all else is NaN.
    """

    phi1: Floats
    cos: Floats
    sin: Floats
    v1: Floats
    rim: Floats
    again: Floats
    fault: Ints


def separation(
    *,
    speed: Floats,
    ride_radius: Floats,
    gravity: Floats,
    friction: Floats,
    spin: Bools,
    inertia: ArrayLike = 0.5,
    incline: ArrayLike = 0.0,
    ride_length: ArrayLike = 0.0,
) -> Separation:
    """Separate from the pulley after a ride that starts on the belt, with its speed and no spin.

    All are (N,), or numbers where there is a default: v0 (m/s), Rc (m), g (m/s²), µ of belt and
    pulley, whether it turns, and I/(m r²) then; the angle β at which the belt rises (rad), and the
    way on it before it meets the pulley (m), which matters where it slides or rolls on an incline.
    Infinite µ is adhesion: carried at v0, not turning, Eq. (2).

    Adhesion and the onset of slip are closed forms, the separation after slip is Newton's to the
    last bit or two. The spin of a slipping disk is a quadrature, to about 1e-14.
    """
    unit = gravity * ride_radius  # v² at u = 1
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        belt = speed**2 / unit
    start = np.minimum(belt, 1.0)
    # Eq. (2), generalised to Rc
    cos = start.copy()
    sin = np.sqrt((1.0 - cos) * (1.0 + cos))
    count = len(speed)
    never, sound = np.full(count, np.inf), np.zeros(count, dtype=np.int64)
    left = Separation(atan2(sin, cos), cos, sin, speed.copy(), np.zeros(count), never, sound)
    slips = (start < 1.0) & np.isfinite(friction)
    if not (slips.any() or np.any(incline)):
        return left
    k, beta, way = (
        np.broadcast_to(np.asarray(part, dtype=np.float64), (count,))
        for part in (inertia, incline, ride_length)
    )
    tilted = beta != 0.0
    ride = _Ride(np.zeros(count), start, belt, np.zeros(count, dtype=np.bool_), start, left.rim)
    if tilted.any():
        numbers = (part[tilted] for part in (speed, gravity, ride_radius, friction, k, beta, way))
        with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
            there, onward, slips[tilted] = _inclined(*numbers, spin=spin[tilted])
        ride = _Ride(*(part.copy() for part in vars(ride).values()))
        for whole, part in ((left, there), (ride, onward)):
            for name, values in vars(part).items():
                getattr(whole, name)[tilted] = values
    if slips.any():
        slip = _Slip(ride.of(slips), friction[slips], spin[slips], k[slips])
        root = slip.separation()
        phi1 = slip.onset + root
        left.phi1[slips] = phi1
        left.cos[slips] = np.cos(phi1)
        left.sin[slips] = np.sin(phi1)
        left.v1[slips] = np.sqrt(unit[slips] * np.cos(phi1))
        left.rim[slips] = np.where(spin[slips], np.sqrt(unit[slips]) * slip.rim(root), 0.0)
    return left


@dataclass(frozen=True, eq=False)
class _Ride:
    """How rides on the pulley begin, (N,): at the angle `begin`, on a belt with u = `belt`.

    Held, a particle has u = start + gain (1 - cos φ), see `_Slip`. One that `slips` forward at the
    begin has u = `entry` there, and its rim `rim` times sqrt(g Rc).
    """

    begin: Floats
    start: Floats
    belt: Floats
    slips: Bools
    entry: Floats
    rim: Floats

    def of(self, which: Bools) -> _Ride:
        """Return some of them."""
        return _Ride(*(part[which] for part in vars(self).values()))


def _normal(x: Floats, begin: Floats, pressed: Floats, swell: Floats, friction: Floats) -> Floats:
    """Return w, the normal force over m g, at the angle x after slip begins with w = `pressed`.

    Written in differences from there, so that short slips lose no digits. `swell` is the factor of
    e^{2 µ x} times 1 + 4 µ²; with -µ it is the law of slip backward.
    """
    half, middle = np.sin(0.5 * x), begin + 0.5 * x
    change = (
        12.0 * friction * np.cos(middle) * half
        - 6.0 * np.sin(middle) * half
        + swell * np.expm1(2.0 * friction * x)
    )
    return pressed + change / (1.0 + 4.0 * friction**2)


def _inclined(
    speed: Floats,
    gravity: Floats,
    radius: Floats,
    friction: Floats,
    inertia: Floats,
    incline: Floats,
    length: Floats,
    *,
    spin: Bools,
) -> tuple[Separation, _Ride, Bools]:
    """Follow rides on belts that rise or fall: where they end, how they go on, which go on to slip.

    Of those that do, the separation is still to be found; it is NaN where there is a fault.
    """
    unit, endless = gravity * radius, np.isinf(friction)
    friction, turns = np.where(endless, 0.0, friction), spin & ~endless
    (sin, cos), rises = sin_cos(incline), incline > 0.0
    # Held, friction bears this share of the weight along the path, and the rest accelerates.
    share = np.where(turns, inertia / (1.0 + inertia), 1.0)
    slides = ~endless & (np.abs(sin) * share > friction * cos)
    pull = np.where(slides, sin - np.sign(sin) * friction * cos, (1.0 - share) * sin)
    square = speed**2 - 2.0 * gravity * pull * length
    arrives = square > 0.0
    v = np.where(pull == 0.0, speed, np.sqrt(np.where(arrives, square, np.nan)))
    # Rolling, the rim makes up for the speed; sliding, friction turns it at its own rate.
    rate = np.where(slides, np.sign(sin) * friction * cos / inertia, pull)
    rim = np.where(turns, rate * 2.0 * gravity * length / (speed + v), 0.0)
    belt, u = speed**2 / unit, v**2 / unit
    lifts = u >= cos
    up = gravity * (v * sin + np.sqrt(np.maximum(cos * (unit - v**2 * cos), 0.0)))
    hops = lifts & rises & (v**2 * cos < unit)
    again = np.where(hops, 2.0 * (v**2 - unit * cos) / up, np.inf)

    # On the pulley the load is less: it may slip at once, forward or back.
    forward = ~lifts & ~rises & slides
    back = ~lifts & rises & (slides | (~endless & (sin * share > friction * (cos - u))))
    phi1 = np.where(lifts, -incline, arc_cos(np.where(lifts, 1.0, u)))
    gain = np.where(turns, 2.0 / (1.0 + inertia), 0.0)
    start = np.where(turns & ~slides, u - gain * (1.0 - cos), np.minimum(belt, u))
    begin = -incline
    fault = np.where(arrives, 0, 1)
    fault = np.where(arrives & turns & back, 3, fault)
    fault = np.where(arrives & ~lifts & ~back & rises & (start <= 0.0), 2, fault)
    slips = ~lifts & ~endless & (fault == 0)
    dragged = slips & back
    if dragged.any():
        at, u_there, leaves = _slip_back(*(a[dragged] for a in (begin, u, belt, friction)))
        stops = np.isnan(at)
        fault[dragged] = np.where(stops, 2, 0)
        slips[dragged] = ~stops & ~leaves
        phi1[dragged], begin[dragged] = at, at
        v[dragged] = np.sqrt(unit[dragged] * u_there)
        start[dragged] = np.minimum(belt[dragged], 1.0)
    bad = fault != 0
    phi1, v, rim = (np.where(bad, np.nan, part) for part in (phi1, v, rim))
    sin, cos = sin_cos(phi1)
    left = Separation(phi1, cos, sin, v, rim, again, fault)
    return left, _Ride(begin, start, belt, forward, u, rim / np.sqrt(unit)), slips


def _slip_back(
    begin: Floats, u: Floats, belt: Floats, friction: Floats
) -> tuple[Floats, Floats, Bools]:
    """Slip back on the pulley from φ = `begin` < 0: angle and u at the end, and if it leaves there.

    Otherwise it has the belt's speed again there. NaN if it comes to a stop before.
    """
    pressed = np.cos(begin) - u
    swell = (1.0 + 4.0 * friction**2) * pressed - 3.0 * np.cos(begin)
    swell += 6.0 * friction * np.sin(begin)

    def normal(x: Floats) -> Floats:
        return _normal(x, begin, pressed, swell, -friction)

    def bisect(low: Floats, high: Floats, passed: Callable[[Floats], Bools]) -> Floats:
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = passed(middle)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        return high

    # u falls to its only minimum, before the top, and then rises as long as it is pressed.
    least = bisect(
        np.zeros_like(u), -begin, lambda x: np.sin(begin + x) + friction * normal(x) >= 0.0
    )
    stops = np.cos(begin + least) - normal(least) <= 0.0

    def at_speed(x: Floats) -> Bools:
        return np.asarray(np.cos(begin + x) - normal(x) >= belt)

    x = bisect(least, 0.5 * np.pi - begin, lambda x: at_speed(x) | (normal(x) <= 0.0))
    there, leaves = begin + x, ~at_speed(x)
    u = np.where(leaves, np.cos(there), belt)
    return np.where(stops, np.nan, there), np.where(stops, np.nan, u), leaves


class _Slip:
    """The slipping part of the ride; angles x are counted from its onset.

    With k = I/(m r²), a body that turns rolls, u = u0 + 2/(1 + k) (1 - cos φ), until
    sin φ = (1 + 1/k) µ w; for a free disk, k = 1/2, these are 4/3 and 3. One that does not turn
    holds on until sin φ = µ w, at constant u. Put together, both read sin φ = G (cos φ - K).
    """

    def __init__(self, ride: _Ride, friction: Floats, spin: Bools, inertia: Floats) -> None:
        self.ride = ride
        start = ride.start
        self.inertia = inertia
        self.friction = friction = np.minimum(friction, MOST_FRICTION)
        self.gain = np.where(spin, 2.0 / (1.0 + inertia), 0.0)
        fall = np.where(spin, (3.0 + inertia) / (1.0 + inertia), 1.0)  # of w, over that of cos φ
        need = np.where(spin, (1.0 + inertia) / inertia, 1.0)  # sin φ over µ w at the onset
        grip = np.where(spin, (3.0 + inertia) / inertia, 1.0) * friction
        k = np.where(spin, ((1.0 + inertia) * start + 2.0) / (3.0 + inertia), start)
        # 1 - K
        short = np.where(spin, (1.0 + inertia) / (3.0 + inertia), 1.0) * (1.0 - start)
        # In T = tan(φ/2) the onset is a quadratic; this form of its root does not cancel.
        base = 1.0 + np.hypot(1.0, grip * np.sqrt(short * (1.0 + k)))
        tangent = grip * short / base
        self.onset = 2.0 * np.arctan(tangent)
        self.cos_onset = np.cos(self.onset)
        self.fallen = 2.0 * tangent**2 / (1.0 + tangent**2)  # 1 - cos φ at the onset
        # w at the onset, sin φ / µ or less, in a form that is right for µ = 0 too.
        self.pressed = fall * 2.0 * short / (base * (1.0 + tangent**2))
        turn = 6.0 * need - 4.0
        self.swell = (1.0 - turn * friction**2) * self.pressed - 3.0 * self.cos_onset
        # With endless grip it would leave at cos φ = K; slip makes it faster, so it leaves earlier.
        last = np.sqrt(short / (1.0 + k))
        latest = 2.0 * np.arctan((last - tangent) / (1.0 + last * tangent))
        late = ride.slips | (ride.begin > self.onset)
        if late.any():
            latest = self._slip_at_once(late, latest)
        # From the slope at the onset x <= 1/µ as well, which keeps the exponential below e².
        with np.errstate(divide="ignore"):
            self.latest = np.minimum(latest, 1.0 / friction)

    def _slip_at_once(self, late: Bools, latest: Floats) -> Floats:
        """Let some slip from where they come on the pulley, at less than which they do leave."""
        ride, begin = self.ride, self.ride.begin
        cos = np.cos(begin)
        fallen = 2.0 * np.sin(0.5 * begin) ** 2
        u = np.where(ride.slips, ride.entry, ride.start + self.gain * fallen)
        swell = (1.0 + 4.0 * self.friction**2) * (cos - u) - 3.0 * cos
        swell -= 6.0 * self.friction * np.sin(begin)
        self.onset = np.where(late, begin, self.onset)
        self.cos_onset = np.where(late, cos, self.cos_onset)
        self.fallen = np.where(late, fallen, self.fallen)
        self.pressed = np.where(late, cos - u, self.pressed)
        self.swell = np.where(late, swell, self.swell)
        last = np.arccos(np.where(late, u, 1.0)) - begin
        return np.where(late, last, latest)

    def normal(self, x: Floats) -> Floats:
        """Return w, the normal force over m g."""
        return _normal(x, self.onset, self.pressed, self.swell, self.friction)

    def separation(self) -> Floats:
        """Return x where w = 0.

        w falls and is concave, so Newton from the right comes down monotonically.
        """
        x = self.latest
        for _ in range(MOST_ROUNDS):
            w = self.normal(x)
            slope = 2.0 * self.friction * w - 3.0 * np.sin(self.onset + x)
            lower = np.maximum(x - w / np.where(slope < 0.0, slope, -np.inf), 0.0)
            if not (lower < x).any():
                break
            x = np.minimum(x, lower)
        return x

    def rim(self, root: Floats) -> Floats:
        """Return r ω / sqrt(g Rc) of a body that turns at the separation `root`."""
        ride = self.ride
        gained = self.gain * self.fallen
        risen = np.sqrt(ride.start + gained)
        rolled = -(ride.start - ride.belt + gained) / (risen + np.sqrt(ride.belt))
        rolled = np.where(ride.slips, ride.rim, rolled)
        edges = np.append(0.0, 0.5 ** np.arange(PANELS, -1, -1))
        total = np.zeros_like(root)
        for low, high in pairwise(edges):
            for node, weight in zip(NODES, WEIGHTS, strict=True):
                x = root * (0.5 * (low + high) + 0.5 * (high - low) * node)
                w = self.normal(x)
                u = np.cos(self.onset + x) - w
                share = np.divide(w, np.sqrt(u), out=np.zeros_like(w), where=u > 0.0)
                total += 0.5 * (high - low) * weight * share
        spun: Floats = rolled - 1.0 / self.inertia * self.friction * root * total
        return spun
