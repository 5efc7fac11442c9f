"""What a contact does to a particle: a blow, and a ride round a pulley or a surface's end.

A blow follows Newton restitution with Coulomb friction (`impulses`).

On a ride the centre of the particle moves on a circle of radius ρ. The angle φ is that of the
normal, which points at the particle, from the top, clockwise; inside a circle ρ is negative. With w
the speed along (n_y, -n_x), z = r ω, N the normal and F the tangential force per mass,

    φ' = w/ρ,   w' = g sin φ + F,   z' = (m r²/I) F,   N = g cos φ - w²/ρ,

and F = stick · g sin φ + load · N: gripping without turning is stick = -1, rolling -I/(I + m r²),
-1/3 of a disk; slipping is load = -σ µ, with σ the sign of the slip u = w + z - belt. Rolling
friction adds a couple q m r, at most κ N, that opposes the spin against the surface's own,
z' = (m r²/I) (F + q), and holds it where it can. Everything is
expanded in a Taylor series in time, which holds for any mixture of turning back, spinning and
slipping. A step is as long as its last terms are rounding; knots within it come from the series.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from chutelab.mechanics.ballistics import polynomial
from chutelab.util.arrays import Bools, Floats, Ints

DISK_SHARE = 1.0 / 3.0
"""m*/m of a free disk: at its rim, with I = m r²/2, an impulse moves the contact point 3 times as
much as it would a particle that does not turn."""


def rim_share(radius: ArrayLike, mass: ArrayLike, inertia: ArrayLike) -> Floats:
    """Return m*/m = I/(I + m r²) at the rim of particles, (...); 1 of those that do not turn.

    Examples
    --------
    >>> abs(float(rim_share(0.1, 2.0, 0.4 * 2.0 * 0.1**2)) - 2.0 / 7.0) < 1e-15
    True
    """
    radius, mass, inertia = (np.asarray(given) for given in (radius, mass, inertia))
    turns = inertia > 0.0
    share = np.where(turns, inertia / np.where(turns, inertia + mass * radius**2, 1.0), 1.0)
    # That of a disk is not to depend on the rounding of its I.
    return np.asarray(np.where(np.abs(share - DISK_SHARE) < 1e-15, DISK_SHARE, share))


def impulses(
    approach: ArrayLike,
    slip: ArrayLike,
    restitution: ArrayLike,
    friction: ArrayLike,
    share: ArrayLike,
) -> tuple[Floats, Floats]:
    """Return the normal and tangential impulse per mass (m/s) of an impact.

    J_n = (1 + ε) |v_n| and J_t = -m*/m · u clipped to ±µ J_n (design, section 5).

    Parameters
    ----------
    approach, slip : array_like
        Normal speed towards the surface (>= 0) and slip of the contact point before, m/s.
    restitution, friction : array_like
        ε and µ of the pair; µ may be inf.
    share : array_like
        m*/m, see `rim_share`.

    Examples
    --------
    >>> n, t = impulses(2.0, 0.5, 0.5, 0.1, 1.0)
    >>> float(n), round(float(t), 12)
    (3.0, -0.3)
    """
    normal = np.asarray((1.0 + np.asarray(restitution)) * np.asarray(approach))
    return normal, limited(slip, normal, np.asarray(friction, dtype=np.float64), share)


def limited(slip: ArrayLike, normal: Floats, friction: Floats, share: ArrayLike) -> Floats:
    """Return the impulse per mass that stops the slip, or the most that friction allows."""
    most = grip_limit(friction, normal)
    wanted = -np.asarray(share) * np.asarray(slip)
    return np.asarray(np.minimum(np.maximum(wanted, -most), most))


ROUNDS = 100
"""Bound on the turns in which friction and rolling friction take their shares of a blow: each
changes what the other has to stop by 5/7 at most."""


def shared(
    slip: Floats, spin: Floats, normal: Floats, friction: Floats, rolling: Floats, share: Floats
) -> tuple[Floats, Floats]:
    """Return tangential impulse and couple over r of a blow, per mass (m/s).

    Friction stops the slip as far as µ J_n allows, rolling friction the spin as far as κ J_n does.

    Parameters
    ----------
    slip, spin : ndarray, (k,)
        Before: slip, and r times the angular velocity against the surface's own, m/s.
    normal : ndarray, (k,)
        Normal impulse per mass, m/s.
    friction, rolling, share : ndarray, (k,)
        µ, κ, and m*/m.
    """
    tangential = limited(slip, normal, friction, share)
    couple, lever, most = np.zeros_like(tangential), 1.0 / share - 1.0, rolling * normal
    grip, turns = grip_limit(friction, normal), (lever > 0.0) & (most > 0.0)
    for _ in range(ROUNDS):
        wanted = -spin / np.where(turns, lever, 1.0) - tangential
        couple = np.where(turns, np.clip(wanted, -most, most), 0.0)
        new = np.clip(-share * (slip + lever * couple), -grip, grip)
        if np.array_equal(new, tangential):
            break
        tangential = new
    return tangential, couple


def grip_limit(friction: Floats, normal: Floats) -> Floats:
    """Return µ N, the most that friction can give; inf where µ is, also without a normal force."""
    sticks = np.isinf(friction)
    if np.count_nonzero(sticks):
        return np.where(sticks, np.inf, np.where(sticks, 0.0, friction) * normal)
    return np.asarray(friction * normal)


ORDER = 20
"""Degree of the series."""

LEFT_OUT = 1e-16
"""Share of the angle (rad), of the speeds and of the load that the last terms of a step may be."""

CURVE = 0.9e-9
"""Share of the radius by which the cubic Hermite curve between two knots may leave the way: 1e-9,
less what is missed by looking at three times of a step."""

STEP_ANGLE = (384.0 * CURVE) ** 0.25
"""rad between knots at constant speed: there the curve is off by ρ Δφ⁴/384."""

MOST_KNOTS = 32
"""Knots in one step."""

HALVINGS = 64
"""Bisections of a step for the time of an event, past the last bit."""


class Outcome(IntEnum):
    """What ends a step on the circle."""

    NOTHING = 0
    LIFT = 1
    ONSET = 2
    GRIP = 3
    LOW = 4
    HIGH = 5
    HALT = 6
    ROLL = 7


GAUGES = np.array(
    [
        Outcome.LIFT, Outcome.ONSET, Outcome.ONSET, Outcome.GRIP, Outcome.LOW, Outcome.HIGH,
        Outcome.HALT, Outcome.ROLL, Outcome.ROLL,
    ]
)  # fmt: skip
"""What the gauges of a step tell, in their order."""


@dataclass(frozen=True, eq=False)
class Circle:
    """Particles that ride round circles; every array has shape (k,)."""

    phi: Floats  # angle from the top, clockwise, rad
    w: Floats  # speed along the circle, m/s
    z: Floats  # r ω, m/s
    rho: Floats  # radius of the centre's path, m; negative inside a circle, φ is of the normal
    gravity: Floats  # m/s²
    friction: Floats  # µ, may be inf
    belt: Floats  # speed of the circle's surface, m/s
    slip: Floats  # sign σ of the slip; 0 while gripping or rolling
    share: Floats  # m*/m, see `rim_share`
    low: Floats  # angles where the circle ends or something is met, rad
    high: Floats
    # Rolling friction: arm over radius κ; sign τ of the spin z - `turn` against the surface's own,
    # 0 while it is held; that of the surface, r times its angular velocity, m/s. None: no κ.
    rolling: Floats | None = None
    roll: Floats | None = None
    turn: Floats | None = None

    @property
    def lever(self) -> Floats:
        """Return m r²/I, or 0: how much more an impulse moves the rim by spin than by its pace."""
        return np.asarray(1.0 / self.share - 1.0)

    def couple(self, force: Floats, normal: Floats) -> Floats:
        """Return rolling friction's couple over m r, m/s², at a friction and a normal force."""
        if self.rolling is None or self.roll is None:
            return np.zeros_like(force)
        held = (self.roll == 0.0) & (self.rolling > 0.0)
        return np.where(held, -force, -self.roll * self.rolling * normal)


@dataclass(frozen=True, eq=False)
class Step:
    """State at the end of a step, and what the contact did; arrays (k,)."""

    dt: Floats
    outcome: NDArray[np.int8]
    phi: Floats
    w: Floats
    z: Floats
    work: Floats  # ∫F dt, m/s: times mass and belt speed it is the belt's work
    heat: Floats  # -∫F u dt, m²/s²: times mass it is the friction loss; with that of the couple
    twist: Floats  # ∫q dt, m/s: times mass and the surface's r ω it is the belt's work too
    # Knots before the end, (7, m, k): time since the beginning, then φ to `twist` as above; those
    # whose time is not below `dt` are none.
    knots: Floats


def normal_force(circle: Circle) -> Floats:
    """N per mass, m/s²; contact lasts while it is positive."""
    return np.asarray(circle.gravity * np.cos(circle.phi) - circle.w**2 / circle.rho)


def grip_slip(circle: Circle) -> Floats:
    """Return the slip sign of a contact without slip now: 0 if friction can hold it.

    Otherwise the particle starts to slip the way gravity pulls.
    """
    pull = circle.gravity * np.sin(circle.phi)
    force = circle.share * np.abs(pull)
    return np.where(force <= grip_limit(circle.friction, normal_force(circle)), 0.0, np.sign(pull))


def advance(circle: Circle, longest: Floats) -> Step:
    """Move on by one step, or to the first event within it.

    Parameters
    ----------
    circle : Circle
        N must be positive.
    longest : ndarray, (k,)
        s; upper bound of the step.
    """
    series = _series(circle)
    dt, parts = _step(circle, series, longest)
    gauges = _gauges(circle, series)
    _end_where_it_turns(circle, series, gauges, dt)
    times = dt * np.minimum(np.arange(1, parts.max() + 1)[:, None] / parts, 1.0)
    passed = polynomial(gauges[:, :, None], times) < 0.0
    outcome = np.zeros(len(dt), dtype=np.int8)
    hit = np.flatnonzero(passed.any(axis=(0, 1)))
    if len(hit):
        first = passed[:, :, hit].any(axis=0).argmax(axis=0)
        low = np.where(first > 0, times[first - 1, hit], 0.0)
        at = _first_negative(gauges[:, :, hit], low, times[first, hit], passed[:, first, hit])
        which = np.argmin(at, axis=0)
        dt[hit] = at[which, np.arange(len(hit))]
        outcome[hit] = GAUGES[which]
    phi, w, z, work, heat, twist = polynomial(series[:, :6], dt)
    phi = np.where(outcome == Outcome.LOW, circle.low, phi)
    phi = np.where(outcome == Outcome.HIGH, circle.high, phi)
    times = times[:-1]
    knots = np.concatenate([times[None], polynomial(series[:, :6, None], times)])
    return Step(dt, outcome, phi, w, z, work, heat, twist, knots)


def _step(c: Circle, series: Floats, longest: Floats) -> tuple[Floats, Ints]:
    """Return how long a step is, s, and by how many knots, evenly in time, it is recorded, (k,).

    The cubic between two knots, h apart, is off by h⁴/384 times the fourth derivative of the place
    ρ exp(i φ), which is ρ |φ₁⁴ - 3 φ₂² - 4 φ₁ φ₃ + i (φ₄ - 6 φ₁² φ₂)| with those of the angle.
    """
    pace = np.abs(c.w) + np.abs(c.z) + np.abs(c.belt) + np.sqrt(c.gravity * np.abs(c.rho))
    scale = np.stack([np.ones_like(pace), pace, pace, c.gravity + c.w**2 / np.abs(c.rho)])
    terms = np.abs(series[:, [0, 1, 2, 6]])
    dt = longest.copy()
    with np.errstate(divide="ignore", invalid="ignore"):
        for n in (ORDER - 1, ORDER):
            share = np.nan_to_num((terms[n] / scale).max(axis=0))
            dt = np.minimum(dt, (LEFT_OUT / share) ** (1.0 / n))
    # What rests does so for ever.
    finite = np.where(np.isfinite(dt), dt, 0.0)
    times, rates, found = finite * np.array([[0.0], [0.5], [1.0]]), series[:, 0], []
    for _ in range(4):
        rates = rates[1:] * np.arange(1, len(rates))[:, None]
        found.append(polynomial(rates[:, None], times))
    one, two, three, four = found
    bend = np.hypot(one**4 - 3.0 * two**2 - 4.0 * one * three, four - 6.0 * one**2 * two)
    parts = np.ceil(finite * (bend.max(axis=0) / (384.0 * CURVE)) ** 0.25).clip(1.0)
    dt *= np.minimum(MOST_KNOTS / parts, 1.0)
    return dt, np.minimum(parts, MOST_KNOTS).astype(np.int64)


def _end_where_it_turns(circle: Circle, series: Floats, gauges: Floats, dt: Floats) -> None:
    """Shorten steps to the turning point where that is beyond an end of the circle.

    At the end of the whole step the particle would be back, and the end not seen.
    """
    back = np.sign(circle.w) * series[:, 1]
    turns = np.flatnonzero(polynomial(back, dt) < 0.0)
    if len(turns):
        passed = np.ones((1, len(turns)), dtype=bool)
        (at,) = _first_negative(back[:, None, turns], np.zeros(len(turns)), dt[turns], passed)
        ends = GAUGES[: gauges.shape[1]]
        beyond = polynomial(gauges[:, :, turns], at) < 0.0
        beyond &= ((ends == Outcome.LOW) | (ends == Outcome.HIGH))[:, None]
        dt[turns] = np.where(beyond.any(axis=0), at, dt[turns])


def _series(c: Circle) -> Floats:
    """Taylor coefficients in time, (ORDER + 1, 9, k): φ, w, z, ∫F, heat, ∫q, N, F, q."""
    k = len(c.phi)
    out = np.zeros((ORDER + 1, 9, k))
    phi, w, z, work, heat, twist, normal, force, couple = (out[:, i] for i in range(9))
    sine, cosine, slip = np.zeros((3, ORDER + 1, k))
    phi[0], w[0], z[0] = c.phi, c.w, c.z
    sine[0], cosine[0] = np.sin(c.phi), np.cos(c.phi)
    slip[0] = c.w + c.z - c.belt
    gripping = c.slip == 0.0
    stick = np.where(gripping, -c.share, 0.0)
    load = np.where(gripping, 0.0, -c.slip * np.where(gripping, 0.0, c.friction))
    slip[0] = np.where(gripping, 0.0, slip[0])
    lever, rolls = c.lever, c.rolling is not None
    if c.rolling is not None and c.roll is not None and c.turn is not None:
        held = (c.roll == 0.0) & (c.rolling > 0.0)
        stick = np.where(gripping & held, -1.0, stick)
        load = np.where(gripping, c.share * lever * c.roll * c.rolling, load)
        spin = np.zeros((ORDER + 1, k))
        spin[0] = np.where(held, 0.0, c.z - c.turn)
    for n in range(ORDER + 1):
        normal[n] = c.gravity * cosine[n] - np.einsum("ik,ik->k", w[: n + 1], w[n::-1]) / c.rho
        force[n] = stick * c.gravity * sine[n] + load * normal[n]
        if rolls:
            couple[n] = c.couple(force[n], normal[n])
        if n == ORDER:
            break
        w[n + 1] = (c.gravity * sine[n] + force[n]) / (n + 1)
        z[n + 1] = lever * (force[n] + couple[n] if rolls else force[n]) / (n + 1)
        phi[n + 1] = w[n] / c.rho / (n + 1)
        rates = np.arange(1, n + 2)[:, None] * phi[1 : n + 2]
        sine[n + 1] = np.einsum("ik,ik->k", rates, cosine[n::-1]) / (n + 1)
        cosine[n + 1] = -np.einsum("ik,ik->k", rates, sine[n::-1]) / (n + 1)
        work[n + 1] = force[n] / (n + 1)
        heat[n + 1] = -np.einsum("ik,ik->k", force[: n + 1], slip[n::-1]) / (n + 1)
        slip[n + 1] = np.where(gripping, 0.0, w[n + 1] + z[n + 1])
        if rolls:
            twist[n + 1] = couple[n] / (n + 1)
            heat[n + 1] -= np.einsum("ik,ik->k", couple[: n + 1], spin[n::-1]) / (n + 1)
            spin[n + 1] = z[n + 1]
    return out


def _gauges(c: Circle, series: Floats) -> Floats:
    """Series that turn negative at an event, (ORDER + 1, G, k), in the order of `GAUGES`."""
    phi, w, z, _, _, _, normal, force, couple = (series[:, i] for i in range(9))
    rolls = c.rolling is not None
    gauges = np.zeros((ORDER + 1, len(GAUGES) if rolls else 6, len(c.phi)))
    gauges[:, 0] = normal
    limited = (c.slip == 0.0) & np.isfinite(c.friction)
    grip = np.where(limited, c.friction, 0.0) * normal
    gauges[:, 1] = np.where(limited, grip - force, 0.0)
    gauges[:, 2] = np.where(limited, grip + force, 0.0)
    gauges[:, 3] = c.slip * (w + z)
    gauges[0, 3] -= c.slip * c.belt
    for n, way, end in ((4, 1.0, c.low), (5, -1.0, c.high)):
        # Round a circle that does not end it may go however often.
        ends = np.isfinite(end)
        gauges[:, n] = np.where(ends, way * phi, 0.0)
        gauges[0, n] -= np.where(ends, way * end, -1.0)
    if c.rolling is not None and c.roll is not None and c.turn is not None:
        gauges[:, 6] = c.roll * z
        gauges[0, 6] -= c.roll * c.turn
        # What slips with less friction than that stays held.
        held = (c.roll == 0.0) & (c.rolling > 0.0) & (c.slip == 0.0)
        gauges[:, 7] = np.where(held, c.rolling * normal - couple, 0.0)
        gauges[:, 8] = np.where(held, c.rolling * normal + couple, 0.0)
    return gauges


def _first_negative(gauges: Floats, low: Floats, high: Floats, passed: Bools) -> Floats:
    """Bisect each gauge that is negative at `high`, (G, k); inf for the rest."""
    low, high = (np.broadcast_to(end, passed.shape) for end in (low, high))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        above = polynomial(gauges, middle) >= 0.0
        low, high = np.where(above, middle, low), np.where(above, high, middle)
    return np.where(passed, high, np.inf)
