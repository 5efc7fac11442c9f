"""Sliding and rolling along a round chute: speed, time and where it ends, in closed form.

With u = v² / (g ρ), ρ the radius of the centre's path, and θ the angle from the x axis round the
arc's centre, the chute presses with m g n, n = u - sin θ from inside and sin θ - u from outside.
Friction makes that a linear equation for u over the angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.theory.results import Arrays, Reason
from chutelab.util.arrays import Bools, Floats

HALVINGS = 64
"""Bisections of an angle: they exhaust a double's digits."""

LEAST = 1e-18
"""rad; a shorter motion is what bisection leaves of one that stands at once."""

LARGEST = 700.0
"""Largest exponent: what grows so far has left the chute, or come to rest, long before."""

_x = np.arange(-64, 65) / 16.0
_share = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(_x)))
_NODES = tuple(
    (float(share), float(rest), float(weight))
    for share, rest, weight in zip(
        _share, _share[::-1], np.pi / 16.0 * np.cosh(_x) * _share * _share[::-1], strict=True
    )
)
"""Double exponential quadrature of the time: shares of a piece from its two ends, and weights. It
takes 1/√u where u is 0 at an end; the last nodes are 1e-37 from there."""


@dataclass(frozen=True, eq=False)
class Slide(Arrays):
    """Where and how motions along a round chute end: read-only arrays of one shape.

    Attributes
    ----------
    angle : ndarray
        Angle that is reached, rad: the `end` that was asked for, unless `reason` says otherwise.
    speed, omega : ndarray
        Speed there, m/s, and angular velocity, counter-clockwise, rad/s.
    time : ndarray
        Time from the start to there, s.
    load : ndarray
        Normal force there over the weight.
    reason : ndarray of str
        Empty where the end is reached. "stops" and "lifts off" tell what happens at `angle`;
        "slips", that a body that rolls inside the chute loses its grip there, from where on there
        is no closed form. "outside the model: ..." goes with NaN.
    """

    angle: Floats
    speed: Floats
    omega: Floats
    time: Floats
    load: Floats
    reason: NDArray[np.str_]


def slide(
    *,
    radius: ArrayLike,
    start: ArrayLike,
    end: ArrayLike,
    speed: ArrayLike = 0.0,
    friction: ArrayLike = 0.0,
    inside: ArrayLike = True,
    particle_radius: ArrayLike = 0.0,
    spin: ArrayLike = False,
    inertia: ArrayLike = 0.5,
    gravity: ArrayLike = 9.81,
) -> Slide:
    """Slide or roll along an arc at rest, such as a curved chute, from an angle towards another.

    Parameters
    ----------
    radius : array_like
        Of the arc, m.
    start, end : array_like
        Angles from the x axis round the arc's centre, counter-clockwise, rad, at most 2π apart;
        -π/2 is its lowest point.
    speed : array_like
        At the start, towards the end, m/s, >= 0.
    friction : array_like
        Coulomb's µ, finite.
    inside : array_like of bool
        True: in the hollow of the arc. False: on its back, until it lifts off.
    particle_radius : array_like
        r >= 0, m; inside it is smaller than the arc's.
    spin : array_like of bool
        True: a body that turns freely. It rolls at the start, and as long as µ holds it; on the
        back of an arc it slips after that, with the spin it has.
    inertia : array_like
        I/(m r²) of one that does, 0 < I/(m r²) <= 1: 1/2 of a disk, 2/5 of a sphere.
    gravity : array_like
        g > 0, m/s².

    Returns
    -------
    Slide
        Arrays of the parameters' broadcast shape.

    Notes
    -----
    A body that slides has du/dθ = -2 cos θ - a (u - sin θ), a = 2 µ inside and counter-clockwise,
    with the sign changed once for the back and once for clockwise. The solution is
    u = [(a² - 2) sin θ - 3 a cos θ]/(1 + a²) + C exp(-a θ). For a chute see A. W. Roberts, An
    investigation of the gravity flow of noncohesive granular materials through discharge chutes,
    J. Eng. Ind. 91, 373-381, 1969. One that rolls has u = u0 - 2/(1 + k) (sin θ - sin θ0),
    k = I/(m r²), while `k/(1 + k) |cos θ| <= µ n`. The time is a quadrature, to about 1e-13.

    Examples
    --------
    A quarter of a circle without friction, down to its lowest point: v² = 2 g R.

    >>> found = slide(radius=1.0, start=-np.pi, end=-np.pi / 2, friction=[0.0, 0.3])
    >>> found.speed.round(3), found.load.round(3)
    (array([4.429, 2.602]), array([3.  , 1.69]))
    """
    numbers = (radius, start, end, speed, friction, particle_radius, inertia, gravity)
    arrays = [np.asarray(value, dtype=np.float64) for value in numbers]
    switches = [np.asarray(value, dtype=np.bool_) for value in (inside, spin)]
    whole = np.broadcast_arrays(*switches, *arrays)
    shape = whole[0].shape
    within, turns, *flat = (part.ravel() for part in whole)
    radius, start, end, speed, friction, r, inertia, gravity = flat
    reason = np.full(len(start), "", dtype=object)
    for what, holds in (
        ("0 <= particle_radius < inf", (r >= 0.0) & (r < np.inf)),
        ("0 < radius < inf", (radius > 0.0) & (radius < np.inf)),
        ("particle_radius < radius inside", ~within | (r < radius)),
        ("particle_radius > 0 with spin", ~turns | (r > 0.0)),
        ("|end - start| <= 2π", np.abs(end - start) <= 2.0 * np.pi),
        ("0 <= speed < inf", (speed >= 0.0) & (speed < np.inf)),
        ("0 <= friction < inf", (friction >= 0.0) & (friction < np.inf)),
        ("0 < inertia <= 1", (inertia > 0.0) & (inertia <= 1.0)),
        ("0 < gravity < inf", (gravity > 0.0) & (gravity < np.inf)),
    ):
        fault = Reason.OUTSIDE.because(f"{what} is required")
        reason[~holds & (reason == "")] = fault
    side = np.where(within, 1.0, -1.0)
    sense = np.where(end < start, -1.0, 1.0)
    rho = radius - side * r
    with np.errstate(all="ignore"):
        u = speed**2 / (gravity * rho)
        loose = side * (u - np.sin(start)) < 0.0
        reason[loose & (reason == "")] = Reason.OUTSIDE.because("it is off the chute at the start")
        fine = reason == ""
        way = np.where(fine, np.abs(end - start), np.nan)
        leg = _Leg(start, u, way, sense, side, friction, turns, inertia)
        x, u, pace = leg.end, leg.u_end, np.sqrt(gravity * rho)
        time, spun = leg.time * rho / pace, np.where(turns, np.sqrt(u), 0.0)
        angle = start + sense * x
        why = leg.why
        onward = turns & ~within & (why == "slips") & (sense * np.cos(angle) < 0.0)
        if onward.any():
            parts = (angle, u, way - x, sense, side, friction, np.zeros_like(turns), inertia)
            leg = _Leg(*(part[onward] for part in parts))
            angle[onward] += sense[onward] * leg.end
            u[onward], why[onward] = leg.u_end, leg.why
            time[onward] += leg.time * rho[onward] / pace[onward]
            spun[onward] += (friction / inertia)[onward] * leg.pressed
        speed = np.sqrt(u) * pace
        # Adding 0 turns -0 into 0.
        omega = np.where(turns, -side * sense * spun * pace / r, 0.0) + 0.0
        load = side * (u - np.sin(angle))
    reached = fine & (why == "")
    angle = np.where(reached, end, np.where(fine, angle, np.nan))
    reason = np.where(fine, why, reason)
    found = (np.where(fine, part, np.nan) for part in (angle, speed, omega, time, load))
    return Slide(*(part.reshape(shape) for part in (*found, reason.astype(np.str_))))


class _Leg:
    """Motion under one law from an angle on, over `way` at most: where it ends, and the time.

    Angles x >= 0 are counted from the start along the way. `time` is ∫ dx/√u, `pressed` is
    ∫ n/√u dx, both up to `end`.
    """

    def __init__(
        self,
        start: Floats,
        u: Floats,
        way: Floats,
        sense: Floats,
        side: Floats,
        friction: Floats,
        rolls: Bools,
        inertia: Floats,
    ) -> None:
        self.start, self.sense, self.side = start, sense, side
        # u = P sin θ + Q cos θ + C exp(-a θ), with a = 0 for one that rolls
        share = inertia / (1.0 + inertia)
        self.a = np.where(rolls, 0.0, 2.0 * friction * side * sense)
        square = 1.0 + self.a**2
        self.p = np.where(rolls, -2.0 / (1.0 + inertia), (self.a**2 - 2.0) / square)
        self.q = -3.0 * self.a / square
        place = np.zeros_like(u)

        def lost(x: Floats, u: Floats) -> tuple[Bools, Bools, Bools]:
            angle = start + sense * x
            load = side * (u - np.sin(angle))
            return u <= 0.0, load < 0.0, rolls & (friction * load < share * np.abs(np.cos(angle)))

        # u exp(a θ), n exp(a θ) and what is left of the grip of a body that rolls rise or fall all
        # the way from one of these angles to the next.
        least = np.arctan(friction * (3.0 + inertia) / (share * (1.0 + inertia)))
        turns = [place + 0.5 * np.pi, np.arctan2(sense, friction * side), least, -least]
        first = np.mod(sense * (np.stack(turns) - start), np.pi)
        marks = np.concatenate([place[None], first, first + np.pi, way[None]])
        marks = np.sort(np.minimum(marks, way), axis=0)

        def over(x: Floats) -> Bools:
            return np.asarray(np.logical_or.reduce(lost(x, self.u(place, u, x))))

        # The first of the pieces in whose course something is lost, then where.
        gone = np.array([(mark > 0.0) & over(mark) for mark in marks[1:]])
        index = np.argmax(gone, axis=0)
        low, high = (
            np.take_along_axis(part, index[None], axis=0)[0] for part in (marks[:-1], marks[1:])
        )
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = over(middle)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        at_once = lost(place, u)[2]
        self.end = np.where(at_once, 0.0, np.where(gone.any(axis=0), high, way))
        self.u_end = np.where(at_once, u, self.u(place, u, self.end))
        stops, lifts, slips = lost(self.end, self.u_end)
        stops &= ~at_once
        self.u_end = np.where(stops, 0.0, self.u_end)
        self.why = np.select([stops, lifts, slips], ["stops", "lifts off", "slips"], "")
        self.time, self.pressed = self._integrals(np.minimum(marks, self.end), u)

    def u(self, begin: Floats, u: Floats, step: Floats) -> Floats:
        """Return u a step from `begin`, where it is `u`; small differences are exact."""
        theta, half = self.start + self.sense * begin, 0.5 * self.sense * step
        rest = u - self.p * np.sin(theta) - self.q * np.cos(theta)
        swing = self.p * np.cos(theta + half) - self.q * np.sin(theta + half)
        grown = np.expm1(np.minimum(-2.0 * self.a * half, LARGEST))
        return np.asarray(u + 2.0 * np.sin(half) * swing + rest * grown)

    def _integrals(self, marks: Floats, u: Floats) -> tuple[Floats, Floats]:
        """Integrate 1/√u and n/√u, piece by piece between the marks (M, N)."""
        speeds = self.u(np.zeros_like(u), u, marks)
        speeds = np.where(marks < self.end, speeds, self.u_end)
        low, high, length = marks[:-1], marks[1:], np.diff(marks, axis=0)
        time, pressed = np.zeros((2, *u.shape))
        for share, rest, weight in _NODES:
            # From the nearer end of the piece.
            near, at, step = low, speeds[:-1], length * share
            if share > 0.5:
                near, at, step = high, speeds[1:], -length * rest
            there = self.u(near, at, step)
            moves = (length > LEAST) & (there > 0.0)
            each = np.where(moves, weight * length / np.sqrt(there), 0.0)
            load = self.side * (there - np.sin(self.start + self.sense * (near + step)))
            time += each.sum(axis=0)
            pressed += (load * each).sum(axis=0)
        return time, pressed
