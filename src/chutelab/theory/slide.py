"""Sliding and rolling on a round surface in closed form: a chute, and the top of a pulley.

With u = v² / (g ρ), ρ the radius of the centre's path, and θ the angle from the x axis round the
arc's centre, the normal force is m g n, n = u - sin θ from inside and sin θ - u from outside. With
friction this is a linear differential equation for n over the angle.

`slide` follows a motion along a chute at rest. `separation` follows the ride round the drive
pulley, with φ the angle from its top: a belt that rises at β meets it at φ = -β; the particle may
slip backwards at first, then grips or rolls, then slips forwards, and leaves where n = 0.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.util.arrays import Bools, Floats, Ints, Numbers, arc_cos, sin_cos

HALVINGS = 64
"""Bisections of an angle, enough for all digits of a double."""

LEAST = 1e-18
"""rad; a shorter motion is rounding: the body does not move."""

LARGEST = 700.0
"""Largest exponent; before it is reached the body has left the surface, or come to rest."""


class Reason(StrEnum):
    """First words of every non-empty `Transfer.reason`, up to its colon.

    The statement of each reason, which a simulation can confirm:

    OUTSIDE
        The equations do not describe this parameter or scene. It says nothing about the motion.
    EARLY
        The named surface is touched during the ride or in the first flight, and that contact is not
        the impact on the struck face of the plate. It is the first one after the release.
    NO_IMPACT
        Neither the ride nor the free flight from the pulley ever touches the plate; where the
        impact on its unbounded line should place the outgoing belt, there is no such impact.
    SECOND
        After the rebound, and before the landing, the named surface is the first to be touched.
    MISSES
        After the rebound the fall does not end on the upper face of the finite belt, and nothing
        is touched on the way down to its level. Below that, the disk may still clip the belt's end.
    """

    OUTSIDE = "outside the model"
    EARLY = "early contact"
    NO_IMPACT = "no impact"
    SECOND = "second contact"
    MISSES = "misses the outgoing belt"

    def because(self, what: str) -> str:
        """Return the full reason.

        Examples
        --------
        >>> Reason.SECOND.because("pulley")
        'second contact: pulley'
        """
        return f"{self.value}: {what}"

    @classmethod
    def of(cls, reason: object) -> Reason | None:
        """Return the class of a full reason, None for the empty one.

        Examples
        --------
        >>> Reason.of("no impact: passes below")
        <Reason.NO_IMPACT: 'no impact'>
        """
        text = str(reason)
        return cls(text.partition(":")[0]) if text else None


@dataclass(frozen=True, eq=False)
class Arrays:
    """A result of read-only arrays, copied on entry."""

    def __post_init__(self) -> None:
        for field in fields(self):
            array = np.array(getattr(self, field.name))
            array.flags.writeable = False
            object.__setattr__(self, field.name, array)


class Answers:
    """Results of N motions, stage by stage, and the reasons where they end."""

    def __init__(self, count: int) -> None:
        self.values: dict[str, Floats] = {}
        self.reason = np.full(count, "", dtype=object)
        self.fine = np.full(count, True)

    def fail(self, where: Bools, reason: str) -> None:
        """Set a reason where there is none yet."""
        if where.any():
            self.reason[where & self.fine] = reason
            self.fine &= ~where

    def require(self, rules: dict[str, Bools]) -> None:
        """Set a reason for parameters that break a rule; NaN breaks every rule."""
        for rule, holds in rules.items():
            if not holds.all():
                self.fail(~holds, Reason.OUTSIDE.because(f"{rule} is required"))

    def keep(self, **values: Floats) -> None:
        """Store results of a stage for motions without a reason so far."""
        self.values |= {name: np.where(self.fine, v, np.nan) for name, v in values.items()}


_x = np.arange(-64, 65) / 16.0
_share = 1.0 / (1.0 + np.exp(-np.pi * np.sinh(_x)))
_NODES = tuple(
    zip(_share, _share[::-1], np.pi / 16.0 * np.cosh(_x) * _share * _share[::-1], strict=True)
)
"""Double exponential quadrature of the time: shares of a piece from its two ends, and weights. It
handles 1/√u with u = 0 at an end; the last nodes are 1e-37 from there."""


class Leg:
    """Motion under one law from an angle on: its end and the reason for it; arrays (N,).

    Angles x >= 0 are counted from `start` in the direction of motion. With σ = 1 counter-clockwise
    and -1 clockwise, s = 1 inside and -1 outside, b = 2 µ s,

        n = A sin θ + B cos θ + C exp(-b x), A = -3 s/(1 + b²), B = σ b A.

    A body that rolls, k = I/(m r²), has b = 0 and 1 + 2/(1 + k) instead of 3, as long as friction
    carries its share of the weight: k/(1 + k) |cos θ| <= µ n. Infinite k is a body carried at
    constant speed.

    Parameters
    ----------
    start, u, load : ndarray
        θ (rad), u and n at the beginning.
    way : ndarray
        Largest x, rad.
    sense, side, friction : ndarray
        σ, s and µ; -µ if the surface is faster than the body that slides on it.
    rolls : ndarray of bool
        Whether it rolls, or is carried.
    inertia : ndarray
        k of a body that rolls.
    limit : ndarray
        u at which a body that the surface accelerates has the surface's speed.

    Attributes
    ----------
    end, u, gained, load : ndarray
        x, u, its growth and n at the end.
    why : ndarray of str
        "stops", "lifts off", "slips" or "holds" (it has the surface's speed); "" at `way`.
    """

    def __init__(
        self,
        start: Floats,
        u: Floats,
        load: Floats,
        way: Floats,
        *,
        sense: Floats,
        side: Floats,
        friction: Floats,
        rolls: Bools,
        inertia: Floats,
        limit: Numbers = np.inf,
    ) -> None:
        self.start, self.sense, self.side = start, sense, side
        gives = np.where(rolls, 1.0 / (1.0 + inertia), 1.0)
        self.b = np.where(rolls, 0.0, 2.0 * friction * side)
        self.A = -side * (1.0 + 2.0 * gives) / (1.0 + self.b**2)
        self.B = sense * self.b * self.A
        place = np.zeros_like(u)

        def lost(x: Floats) -> tuple[Bools, ...]:
            there, pressed = self.ahead(place, u, load, x)
            across = np.cos(start + sense * x)
            grip = friction * pressed < (1.0 - gives) * np.abs(across)
            fast = (there >= limit) & (-sense * across > friction * pressed)
            return there <= 0.0, pressed < 0.0, rolls & grip, fast

        # u exp(b x), n exp(b x) and the margin of the grip of a rolling body are monotone between
        # these angles.
        least = np.arctan2(friction * (1.0 + 2.0 * gives), 1.0 - gives)
        turns = [place + 0.5 * np.pi, np.arctan2(sense, friction * side), least, -least]
        first = np.mod(sense * (np.stack(turns) - start), np.pi)
        self.marks = np.concatenate([place[None], first, first + np.pi, way[None]])
        self.marks = np.sort(np.minimum(self.marks, way), axis=0)
        # The first piece in which one of them falls to 0, then the place.
        gone = np.array([(mark > 0.0) & np.any(lost(mark), axis=0) for mark in self.marks[1:]])
        index = np.argmax(gone, axis=0)[None]
        low, high = (np.take_along_axis(part, index, axis=0)[0]
                     for part in (self.marks[:-1], self.marks[1:]))  # fmt: skip
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            beyond = np.any(lost(middle), axis=0)
            low, high = np.where(beyond, low, middle), np.where(beyond, middle, high)
        at_once = lost(place)[2]
        self.end = np.where(at_once, 0.0, np.where(gone.any(axis=0), high, way))
        stops, lifts, slips, fast = lost(self.end)
        stops &= ~at_once
        causes = ["stops", "lifts off", "slips", "holds"]
        self.why = np.select([stops, lifts, slips, fast], causes, "")
        self.u, self.load = self.ahead(place, u, load, self.end)
        self.u = np.where(stops, 0.0, self.u)
        self.gained = self.ahead(place, place, load, self.end)[0]
        # At the onset of slip friction gives the load more accurately than a difference.
        bears = (1.0 - gives) * np.abs(np.cos(start + sense * self.end))
        self.load = np.where(slips & ~at_once, bears / friction, self.load)
        self._states = np.stack(self.ahead(place, u, load, self.marks))

    def ahead(self, x: Floats, u: Floats, load: Floats, step: Floats) -> tuple[Floats, Floats]:
        """Return u and n a step beyond x, where they are known; small differences are exact."""
        theta, half = self.start + self.sense * x, 0.5 * self.sense * step
        sine = 2.0 * np.sin(half) * np.cos(theta + half)
        cosine = -2.0 * np.sin(half) * np.sin(theta + half)
        rest = load - self.A * np.sin(theta) - self.B * np.cos(theta)
        grown = np.expm1(np.minimum(-self.b * step, LARGEST))
        change = self.A * sine + self.B * cosine + rest * grown
        return u + (sine + self.side * change), load + change

    def integrals(self) -> tuple[Floats, Floats]:
        """Return ∫ dx/√u and ∫ n/√u dx up to the end."""
        marks = np.minimum(self.marks, self.end)
        there = np.stack([self.u, self.load])
        states = np.where(self.marks < self.end, self._states, there[:, None])
        length = np.diff(marks, axis=0)
        pieces = np.flatnonzero((length > LEAST).any(axis=1))
        length = length[pieces]
        time, pressed = np.zeros((2, *self.end.shape))
        for share, rest, weight in _NODES:
            # Measured from the nearer end of the piece.
            near = pieces + (share > 0.5)
            step = length * (-rest if share > 0.5 else share)
            u, load = states[:, near]
            u, load = self.ahead(marks[near], u, load, step)
            moves = (length > LEAST) & (u > 0.0)
            each = np.where(moves, weight * length / np.sqrt(u), 0.0)
            time += each.sum(axis=0)
            pressed += (load * each).sum(axis=0)
        return time, pressed


@dataclass(frozen=True, eq=False)
class Slide(Arrays):
    """Ends of motions along a round chute: read-only arrays of one shape.

    Attributes
    ----------
    angle : ndarray
        Angle reached, rad: the `end` asked for, unless there is a `reason`.
    speed, omega : ndarray
        Speed there, m/s, and angular velocity, counter-clockwise, rad/s.
    time : ndarray
        Time from the start to there, s.
    load : ndarray
        Normal force there over the weight.
    reason : ndarray of str
        Empty where the end is reached. "stops" and "lifts off" name the event at `angle`; "slips"
        means that a body rolling inside the chute loses its grip there, after which there is no
        closed form. "outside the model: ..." goes with NaN.
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
        True: inside the arc. False: outside, until it lifts off.
    particle_radius : array_like
        r >= 0, m; inside it must be smaller than the arc's.
    spin : array_like of bool
        True: a body that rotates freely. It rolls at the start, as long as µ suffices; outside an
        arc it slips after that, with the spin that it has.
    inertia : array_like
        I/(m r²) if it rotates, 0 < I/(m r²) <= 1: 1/2 of a disk, 2/5 of a sphere.
    gravity : array_like
        g > 0, m/s².

    Returns
    -------
    Slide
        Arrays of the parameters' broadcast shape.

    Notes
    -----
    A body that slides has du/dθ = -2 cos θ - a (u - sin θ), a = 2 µ inside and counter-clockwise,
    with the sign changed once for outside and once for clockwise. The solution is u = [(a² - 2) sin
    θ - 3 a cos θ]/(1 + a²) + C exp(-a θ). For a chute see A. W. Roberts, An investigation of the
    gravity flow of noncohesive granular materials through discharge chutes, J. Eng. Ind. 91,
    373-381, 1969. One that rolls has u = u0 - 2/(1 + k) (sin θ - sin θ0), k = I/(m r²), while `k/(1
    + k) |cos θ| <= µ n`. The time is a quadrature, to about 1e-13.

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
    found = Answers(len(start))
    found.require(
        {
            "0 <= particle_radius < inf": (r >= 0.0) & (r < np.inf),
            "0 < radius < inf": (radius > 0.0) & (radius < np.inf),
            "particle_radius < radius inside": ~within | (r < radius),
            "particle_radius > 0 with spin": ~turns | (r > 0.0),
            "|end - start| <= 2π": np.abs(end - start) <= 2.0 * np.pi,
            "0 <= speed < inf": (speed >= 0.0) & (speed < np.inf),
            "0 <= friction < inf": (friction >= 0.0) & (friction < np.inf),
            "0 < inertia <= 1": (inertia > 0.0) & (inertia <= 1.0),
            "0 < gravity < inf": (gravity > 0.0) & (gravity < np.inf),
        }
    )
    side = np.where(within, 1.0, -1.0)
    sense = np.where(end < start, -1.0, 1.0)
    rho = radius - side * r
    with np.errstate(all="ignore"):
        u = speed**2 / (gravity * rho)
        load = side * (u - np.sin(start))
        found.fail(load < 0.0, Reason.OUTSIDE.because("it is off the chute at the start"))
        fine = found.fine
        way = np.where(fine, np.abs(end - start), np.nan)
        about = {"sense": sense, "side": side, "friction": friction, "inertia": inertia}
        leg = Leg(start, u, load, way, rolls=turns, **about)
        x, u, load, why, pace = leg.end, leg.u, leg.load, leg.why, np.sqrt(gravity * rho)
        time = leg.integrals()[0]
        spun = np.where(turns, np.sqrt(u), 0.0)
        angle = start + sense * x
        onward = turns & ~within & (why == "slips") & (sense * np.cos(angle) < 0.0)
        if onward.any():
            about = {name: values[onward] for name, values in about.items()}
            parts = (part[onward] for part in (angle, u, load, way - x))
            leg = Leg(*parts, rolls=np.zeros(onward.sum(), dtype=bool), **about)
            angle[onward] += sense[onward] * leg.end
            u[onward], load[onward], why[onward] = leg.u, leg.load, leg.why
            lasts, pressed = leg.integrals()
            time[onward] += lasts
            spun[onward] += about["friction"] / about["inertia"] * pressed
        # Adding 0 turns -0 into 0.
        omega = np.where(turns, -side * sense * spun * pace / r, 0.0) + 0.0
        time *= rho / pace
    found.keep(
        angle=np.where(why == "", end, angle),
        speed=np.sqrt(u) * pace,
        omega=omega,
        time=time,
        load=load,
    )
    reason = np.where(fine, why, found.reason).astype(np.str_).reshape(shape)
    return Slide(reason=reason, **{k: v.reshape(shape) for k, v in found.values.items()})


MOST_FRICTION = 1e100
"""Its square does not overflow, and slip is the same as with infinite friction."""

FAULTS = (
    "",
    "it does not get up the incoming belt",
    "it does not get over the pulley",
    "it slips back on the pulley, which has no closed form for a body that turns",
)
"""Why there is no separation, by `Separation.fault`; all occur on rising belts."""


@dataclass(frozen=True, eq=False)
class Separation:
    """State of the centre at the separation from the pulley, arrays of one shape.

    φ1 is the angle from the top of the pulley, rad; its cosine and sine have full relative
    precision. v1 is the speed, m/s, and `rim` is r ω, m/s, ω counter-clockwise: the velocity of the
    lowest point relative to the centre. Thrown up from a rising belt, the particle may come down on
    the pulley again after the time `again`, s, inf if not. `fault` is an index into `FAULTS`; if it
    is not 0, all else is NaN.
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
    """Return the separation after a ride that starts on the belt at its speed without spin.

    All are (N,), or numbers where there is a default: v0 (m/s), Rc (m), g (m/s²), µ of belt and
    pulley, whether the particle rotates, and then I/(m r²); the angle β at which the belt rises
    (rad), and the distance on it up to the pulley (m), which matters if the particle slides or
    rolls on an incline. Infinite µ is adhesion: carried at v0 without rotation, Eq. (2).

    Adhesion has a closed form; slip has one over the angle, whose onset and end are bisected to the
    last bit or two. The spin of a slipping disk is a quadrature, to about 1e-14.
    """
    count, endless = len(speed), np.isinf(friction)
    k, beta, way = (
        np.broadcast_to(np.asarray(part, dtype=np.float64), (count,))
        for part in (inertia, incline, ride_length)
    )
    friction, turns = np.where(endless, 0.0, friction), spin & ~endless
    (sin, cos), rises, begin = sin_cos(beta), beta > 0.0, 0.0 - beta
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        unit = gravity * ride_radius  # v² at u = 1
        # On the belt. With grip, friction carries this share of the weight; the rest accelerates.
        share = np.where(turns, k / (1.0 + k), 1.0)
        slides = ~endless & (np.abs(sin) * share > friction * cos)
        pull = np.where(slides, sin - np.sign(sin) * friction * cos, (1.0 - share) * sin)
        square = speed**2 - 2.0 * gravity * pull * way
        arrives = square > 0.0
        v = np.where(pull == 0.0, speed, np.sqrt(np.where(arrives, square, np.nan)))
        # When rolling, the rim compensates the speed; when sliding, friction changes the spin at
        # its own rate.
        rate = np.where(slides, np.sign(sin) * friction * cos / k, pull)
        rim = np.where(turns, rate * 2.0 * gravity * way / (speed + v), 0.0)
        belt, u = speed**2 / unit, v**2 / unit
        # A flight that begins at the end of the belt may come down on the pulley.
        lifts = u >= cos
        up = gravity * (v * sin + np.sqrt(np.maximum(cos * (unit - v**2 * cos), 0.0)))
        hops = lifts & rises & (v**2 * cos < unit)
        again = np.where(hops, 2.0 * (v**2 - unit * cos) / up, np.inf)
    # On the pulley the normal force is smaller, so it may slip at once, forwards or backwards.
    forward = ~lifts & ~rises & slides
    back = ~lifts & rises & (slides | (~endless & (sin * share > friction * (cos - u))))
    fault = np.where(arrives, np.where(turns & back, 3, 0), 1)
    phi1 = np.where(lifts, begin, arc_cos(np.where(lifts, 1.0, u)))  # Eq. (2), held by adhesion
    rides = ~lifts & ~endless & (fault == 0)
    angle, load = begin.copy(), cos - u

    def leg(which: Bools, grip: Floats, inertia: Floats, limit: Numbers, *, rolls: bool) -> Leg:
        """Continue some of them over the pulley, clockwise outside of it, at most to φ = π/2."""
        on = np.full((3, int(which.sum())), -1.0)
        part = Leg(
            0.5 * np.pi - angle[which], u[which], load[which], 0.5 * np.pi - angle[which],
            sense=on[0], side=on[1], friction=grip, inertia=inertia, limit=limit,
            rolls=np.full(len(grip), rolls),
        )  # fmt: skip
        angle[which] += part.end
        u[which], load[which] = part.u, part.load
        return part

    with np.errstate(all="ignore"):
        friction = np.minimum(friction, MOST_FRICTION)
        if (dragged := rides & back).any():
            part = leg(dragged, -friction[dragged], k[dragged], belt[dragged], rolls=False)
            fault[dragged] = np.where(part.why == "stops", 2, 0)
            u[dragged] = np.where(part.why == "holds", belt[dragged], u[dragged])
            forward[dragged] = part.why == "lifts off"
        if (held := rides & ~forward & (fault == 0)).any():
            ahead = u[held] - belt[held]
            carried = np.where(turns[held], k[held], np.inf)
            part = leg(held, friction[held], carried, np.inf, rolls=True)
            fault[held] = np.where(part.why == "stops", 2, 0)
            rolled = -(ahead + part.gained) / (np.sqrt(u[held]) + np.sqrt(belt[held]))
            rim[held] = np.where(turns[held], rolled * np.sqrt(unit[held]), 0.0)
        if (slips := rides & (fault == 0)).any():
            part = leg(slips, friction[slips], k[slips], np.inf, rolls=False)
            if turns[slips].any():
                spun = friction[slips] / k[slips] * part.integrals()[1] * np.sqrt(unit[slips])
                rim[slips] -= np.where(turns[slips], spun, 0.0)
        sound = fault == 0
        phi1 = np.where(sound, np.where(rides, angle, phi1), np.nan)
        sin, cos = sin_cos(phi1)
        v = np.where(sound, np.where(rides, np.sqrt(unit * cos), v), np.nan)
    # On a level belt without slip the cosine is known more accurately than the angle.
    level = ~rides & (beta == 0.0)
    cos = np.where(level, np.minimum(belt, 1.0), cos)
    sin = np.where(level, np.sqrt((1.0 - cos) * (1.0 + cos)), sin)
    return Separation(phi1, cos, sin, v, np.where(sound, rim, np.nan), again, fault)
