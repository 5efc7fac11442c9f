"""Contacts that last or come together: what each step's impulses did, and to whom it is booked.

In a step pymunk changes a body's velocity from w to w', half a step ahead of the time on the clock.
Seen as a jump of the true velocity at the end of the step, from v to v', the sum v + v' is w + w'
whatever gravity does: J·(w + w')/2 is the work of an impulse to the last bit, at rest as in a blow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recording import Kind
from chutelab.stepper.curves import follow
from chutelab.stepper.impacts import FAINT
from chutelab.stepper.tracks import CARRIED, FLYING

if TYPE_CHECKING:
    from chutelab.stepper.state import Run
    from chutelab.stepper.world import Contacts

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SHOCK = 1e-3
"""m/s; a change of velocity beyond this and four steps of gravity is a kink in the track, written
as two knots at one time, not a bend."""

SETTLED = 1e-6, 3
"""m/s of slip and of normal speed, and steps in a row without more, after which a lone particle
lies still; the contact solver ends a slip within one step, to rounding."""

STILL = 1e-3, 0.1
"""m/s and s: the same for a whole run of interacting particles."""

IN_LINE = 1e-4
"""Shortfall of a sum of unit normals that are to count as one: 0.8° between two."""

SLIPS = 1e-3
"""m/s; slip above which a contact that held is said to slip."""


@dataclass(frozen=True, eq=False)
class Motion:
    """Velocities (N, 2) and ω (N,) that pymunk had of all particles before and after a step."""

    before: Floats
    after: Floats
    spin_before: Floats
    spin_after: Floats


@dataclass(frozen=True, eq=False)
class Deeds:
    """What the M contacts of a step did, in the frames of their normals.

    Attributes
    ----------
    j_n, j_t : ndarray, (M,)
        Impulses on the first, N s.
    belt : ndarray, (M,)
        Speed of the surface, m/s.
    before_t, after_n, after_t : ndarray, (M,)
        Slip before, normal speed and slip after, m/s.
    rounded : ndarray of bool, (M,)
        Whether the solid is round there.
    uses : ndarray, (N,)
        Number of contacts of each particle.
    change, turn : ndarray, (N, 2) and (N,)
        By how much velocity and ω of each particle changed, m/s and rad/s.
    """

    j_n: Floats
    j_t: Floats
    belt: Floats
    before_t: Floats
    after_n: Floats
    after_t: Floats
    rounded: NDArray[np.bool_]
    uses: Ints
    change: Floats
    turn: Floats


def settle_books(run: Run, contacts: Contacts, x: Floats, motion: Motion, t: float) -> None:
    """Book the contacts of a step, write knots and events, and keep the particles in contact.

    Parameters
    ----------
    contacts : Contacts
        The first of a pair is never carried.
    x : ndarray, (N, 2)
        Positions after the step, m.
    """
    k, n = run.tracks, contacts.normal
    # Led round the pulley along a chord, a particle only seems to press outwards.
    i = contacts.first
    led = ((k.aim[i] != k.w[i]).any(axis=1)).nonzero()[0]
    motion.before[i[led]] -= _dot(motion.before[i[led]], n[led])[:, None] * n[led]
    deeds, before_n = _deeds(run, contacts, x, motion)
    who = ((deeds.uses > 0) & (k.mode != CARRIED)).nonzero()[0]
    was_flying = k.mode[who] == FLYING
    jump = np.abs(deeds.change[who]).max(axis=1)
    shock = was_flying | (jump > SHOCK + 4.0 * run.machine.gravity * run.dt)
    _knots_before(run, who, shock, was_flying, x, motion, t)
    _book(run, contacts, deeds, before_n, motion)
    hit = who[shock]
    k.knot(hit, t, x[hit], motion.after[hit], motion.spin_after[hit])
    _events(run, contacts, deeds, x, motion, t)

    k.rest(who[was_flying])
    k.leave(who, x[who], motion.after[who], motion.spin_after[who])
    run.bent[who], run.bend[who] = run.bend[who], 0.0
    flew = np.zeros(run.count, dtype=bool)
    flew[who[was_flying]] = True
    _surfaces(run, contacts, who, flew, deeds, x, motion, t)
    _calm(run, contacts, who, deeds)
    if run.machine.align:
        run.idle.settle(contacts, who, deeds)
    if run.machine.until == "landed":
        run.finish(who[run.landed[who]], "landed")


def _deeds(run: Run, contacts: Contacts, x: Floats, motion: Motion) -> tuple[Deeds, Floats]:
    """Return what the contacts did, and the normal speeds before."""
    i, solid = contacts.first, contacts.other - run.count
    pairs = solid < 0
    rows = pairs.nonzero()[0]
    j, fixed = contacts.other[rows], (~pairs).nonzero()[0]
    nx, ny = contacts.normal[:, 0], contacts.normal[:, 1]
    push_x, push_y = contacts.impulse[:, 0], contacts.impulse[:, 1]
    belt, rounded = np.zeros(len(i)), np.zeros(len(i), dtype=bool)
    belt[fixed] = run.solids.belt(solid[fixed], contacts.normal[fixed])
    rounded[fixed] = run.solids.rounded(solid[fixed], x[i[fixed]])

    def parts(v: Floats, omega: Floats) -> tuple[Floats, Floats]:
        relative, rim = v[i], omega[i]
        relative[rows] -= v[j]
        rim[rows] += omega[j]
        u, w = relative[:, 0], relative[:, 1]
        return u * nx + w * ny, u * ny - w * nx + run.radius * rim - belt

    before_n, before_t = parts(motion.before, motion.spin_before)
    after_n, after_t = parts(motion.after, motion.spin_after)
    uses = np.bincount(i, minlength=run.count) + np.bincount(j, minlength=run.count)
    return Deeds(
        push_x * nx + push_y * ny, push_x * ny - push_y * nx, belt, before_t, after_n, after_t,
        rounded, uses, motion.after - motion.before, motion.spin_after - motion.spin_before,
    ), before_n  # fmt: skip


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("md,md->m", a, b))


def _knots_before(
    run: Run, who: Ints, shock: NDArray[np.bool_], flying: NDArray[np.bool_], x: Floats,
    motion: Motion, t: float,
) -> None:  # fmt: skip
    """Write what tracks need before the step's entries are booked; remember smooth steps."""
    k = run.tracks
    bend = who[~shock]
    mean = 0.5 * (motion.before + motion.after)[bend]
    spin = 0.5 * (motion.spin_before + motion.spin_after)[bend]
    k.foretold(bend, t, x[bend], mean, spin)
    k.hold(bend, t, x[bend], mean, spin)
    kink = who[shock]
    k.close(kink)
    # A flight comes in with the true velocity, half a step on from the one pymunk moved it with.
    v = motion.before[kink] + 0.5 * run.dt * run.gravity * flying[shock][:, None]
    k.knot(kink, t, x[kink], v, motion.spin_before[kink])


def _book(run: Run, contacts: Contacts, deeds: Deeds, before_n: Floats, motion: Motion) -> None:
    """Book contacts; what two particles lose is shared, what a carried one gives is belt work."""
    i, other = contacts.first, contacts.other
    pairs = other < run.count
    carried = pairs & (run.tracks.mode[np.where(pairs, other, 0)] == CARRIED)
    both = (pairs & ~carried).nonzero()[0]
    entries = np.empty((len(i) + len(both), 3))
    share = np.where(pairs & ~carried, -0.25, -0.5)
    first = entries[: len(i)]
    first[:, 0] = deeds.j_t * deeds.belt
    first[:, 1] = share * deeds.j_n * (before_n + deeds.after_n)
    first[:, 2] = share * deeds.j_t * (deeds.before_t + deeds.after_t)
    entries[len(i) :] = first[both]
    surface = np.full(len(entries), run.particles)
    fixed = (~pairs).nonzero()[0]
    surface[fixed] = run.solids.surface[other[fixed] - run.count]
    run.recorder.book(run.ids[np.concatenate([i, other[both]])], surface, *entries.T)
    if carried.any():
        given = _dot(contacts.impulse[carried], motion.after[other[carried]])
        run.recorder.book(run.ids[i[carried]], 0, given)


def _events(
    run: Run, contacts: Contacts, deeds: Deeds, x: Floats, motion: Motion, t: float
) -> None:
    """Write impacts and collisions: contacts that were not there a step ago, and hit."""
    i, j = contacts.first, contacts.other
    begun = run.begun(i, j)
    if not begun.any():
        return
    pairs = j < run.count
    before = motion.before.copy()
    before[run.tracks.mode == FLYING] += 0.5 * run.dt * run.gravity
    relative = before[i] - np.where(pairs[:, None], before[np.where(pairs, j, 0)], 0.0)
    approach = -_dot(relative, contacts.normal)
    told = begun & (approach > run.soft)
    kind = np.where(pairs, Kind.COLLISION, Kind.IMPACT)
    s = (~pairs).nonzero()[0]
    solid = j[s] - run.count
    told[s] |= (approach[s] > FAINT * run.soft) & ~run.met[i[s], solid]
    run.met[i[s], solid] = True
    landing = (run.solids.surface[solid] == run.machine.landing) & ~run.landed[i[s]]
    kind[s[landing]], told[s[landing]] = Kind.LANDING, True
    run.landed[i[s[landing]]] = True
    if not told.any():
        return
    who = i[told]
    surface = np.full(len(i), run.particles)
    surface[s] = run.solids.surface[solid]
    run.event(
        kind[told], who, t, x[who], motion.after[who], motion.spin_after[who], surface[told],
        np.where(pairs, run.ids[np.where(pairs, j, 0)], -1)[told],
        velocity_before=before[who], omega_before=motion.spin_before[who],
        impulse=(deeds.j_n[told], deeds.j_t[told]),
    )  # fmt: skip
    run.recorder.contacts += int(np.count_nonzero(told))


def _surfaces(
    run: Run, contacts: Contacts, who: Ints, flew: NDArray[np.bool_], deeds: Deeds, x: Floats,
    motion: Motion, t: float,
) -> None:  # fmt: skip
    """Keep account of which single surface particles lie on, and whether they slip there."""
    fixed = contacts.other >= run.count
    surface = np.full(run.count, -1)
    rows = (fixed & (deeds.uses[contacts.first] == 1)).nonzero()[0]
    alone = contacts.first[rows]
    surface[alone] = run.solids.surface[contacts.other[rows] - run.count]
    run.stays.arrive(who, surface[who], t)
    speed = np.abs(deeds.after_t[rows])
    slipping = run.stays.slipping[alone]
    # A blow out of flight that ends the slip is no sticking yet.
    stops = slipping & ~flew[alone] & (speed < SETTLED[0])
    starts = ~slipping & (speed > SLIPS)
    run.stays.slipping[alone] = (slipping & ~stops) | starts
    _lie(run, contacts, deeds, fixed.nonzero()[0])
    for kind, these in ((Kind.STICK, alone[stops]), (Kind.SLIP, alone[starts])):
        run.event(
            kind, these, t, x[these], motion.after[these], motion.spin_after[these],
            surface[these],
        )  # fmt: skip


def _lie(run: Run, contacts: Contacts, deeds: Deeds, rows: Ints) -> None:
    """Note the normals of surfaces that particles lie on, one or several in line; follow curves."""
    i, n, uses = contacts.first[rows], contacts.normal[rows], deeds.uses
    total = np.stack(
        [np.bincount(i, weights=n[:, axis], minlength=run.count) for axis in (0, 1)], axis=-1
    )
    length = np.hypot(total[:, 0], total[:, 1])
    in_line = (uses > 0) & (length > (1.0 - IN_LINE) * uses)
    who = in_line.nonzero()[0]
    run.tracks.upon[who] = total[who] / length[who, None]
    flat = ((uses[i] == 1) & ~deeds.rounded[rows]).nonzero()[0]
    run.tracks.face[i[flat]] = contacts.other[rows[flat]] - run.count
    curved = in_line[i] & deeds.rounded[rows]
    for row in curved.nonzero()[0].tolist():
        solid = contacts.other[rows[row]] - run.count
        follow(run, int(i[row]), n[row], float(run.solids.reach[solid]) + run.radius)


def _calm(run: Run, contacts: Contacts, who: Ints, deeds: Deeds) -> None:
    """Count steps in a row in which particles lay still on what they can settle on."""
    limit = STILL[0] if run.machine.interact else SETTLED[0]
    pairs = contacts.other < run.count
    restless = np.maximum(np.abs(deeds.after_n), np.abs(deeds.after_t)) > limit
    solid = contacts.other[~pairs] - run.count
    restless[~pairs] |= ~run.settles_on[solid]
    stirred = np.zeros(run.count, dtype=bool)
    stirred[contacts.first[restless]] = True
    stirred[contacts.other[restless & pairs]] = True
    if not run.machine.interact:
        # Rolling down a slope is not lying on it.
        stirred[who] |= np.abs(deeds.change[who]).max(axis=1) > limit
    run.calm[who] = np.where(stirred[who], 0, run.calm[who] + 1)
