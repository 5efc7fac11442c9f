"""Contacts that last or come together: what a step did, in knots, events and the ledger."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from chutelab.recording import Kind
from chutelab.stepper.curves import follow
from chutelab.stepper.entries import book
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
class Deeds:
    """What the M contacts of a step did, in the frames of their normals, to P particles.

    Attributes
    ----------
    belt : ndarray, (M,)
        Speed of the surface, m/s.
    before_n, before_t, after_n, after_t : ndarray, (M,)
        Normal speed and slip before and after, m/s.
    pace : ndarray, (M,)
        The greater of both after, m/s.
    rounded : ndarray of bool, (M,)
        Whether the solid is round there.
    uses : ndarray, (N + K,)
        Number of contacts of each particle, and of each solid.
    who : ndarray, (P,)
        Particles in contact, not carried.
    change : ndarray, (P, 3)
        By how much vx, vy (m/s) and ω (rad/s) of each changed.
    """

    belt: Floats
    before_n: Floats
    before_t: Floats
    after_n: Floats
    after_t: Floats
    pace: Floats
    rounded: NDArray[np.bool_]
    uses: Ints
    who: Ints
    change: Floats


def settle_books(run: Run, contacts: Contacts, x: Floats, motion: Floats, t: float) -> None:
    """Book the contacts of a step, write knots and events, and keep the particles in contact.

    Parameters
    ----------
    contacts : Contacts
        The first of a pair is never carried.
    x : ndarray, (N, 2)
        Positions after the step, m.
    motion : ndarray, (2, N + K, 3)
        vx, vy and ω that pymunk had before and after the step; 0 for solids.
    """
    k, (before, after) = run.tracks, motion
    if np.count_nonzero(run.bend):
        # Led round the pulley along a chord, a particle only seems to press outwards.
        led = (run.bend[contacts.first] > 0.0).nonzero()[0]
        i, n = contacts.first[led], contacts.normal[led]
        before[i, :2] -= (before[i, :2] * n).sum(axis=1)[:, None] * n
    deeds = _deeds(run, contacts, x, motion)
    who = deeds.who
    flew = k.mode[who] == FLYING
    shock = flew | (
        np.abs(deeds.change[:, :2]).max(axis=1) > SHOCK + 4.0 * run.machine.gravity * run.dt
    )
    smooth = ~shock
    bend, hit = who[smooth], who[shock]
    # The mean of the velocities before and after is that halfway through the step's impulses.
    k.go_smoothly(bend, t, x[bend], after[bend] - 0.5 * deeds.change[smooth])
    if len(hit):
        # A flight comes in with the true velocity, half a step on from pymunk's.
        came = before[hit]
        came[:, :2] += 0.5 * run.dt * run.gravity * flew[shock, None]
        k.close(hit)
        k.knot(hit, t, x[hit], came[:, :2], came[:, 2])
    book(run, contacts, deeds, after)
    k.knot(hit, t, x[hit], after[hit, :2], after[hit, 2])
    _events(run, contacts, deeds, x, before, after, t)

    k.rest(who[flew])
    k.leave(who, x[who], after[who, :2], after[who, 2])
    run.bent[who], run.bend[who] = run.bend[who], 0.0
    _surfaces(run, contacts, deeds, hit[flew[shock]], x, after, t)
    _calm(run, contacts, deeds)
    if run.machine.align:
        run.idle.settle(contacts, deeds)
    if run.machine.until == "landed":
        run.finish(who[run.landed[who]], "landed")


def _deeds(run: Run, contacts: Contacts, x: Floats, motion: Floats) -> Deeds:
    """Return what the contacts did."""
    i, j, fixed = contacts.first, contacts.other, contacts.fixed
    solid = j[fixed] - run.count
    belt, rounded = np.zeros(len(i)), np.zeros(len(i), dtype=bool)
    belt[fixed] = run.solids.belt(solid, contacts.normal[fixed])
    rounded[fixed] = run.solids.rounded(solid, x[i[fixed]])
    nx, ny = contacts.normal.T
    mine, theirs = motion[:, i], motion[:, j]
    (u, v), rim = (mine - theirs)[..., :2].transpose(2, 0, 1), mine[..., 2] + theirs[..., 2]
    before_n, after_n = u * nx + v * ny
    before_t, after_t = u * ny - v * nx + run.radius * rim - belt
    uses = np.bincount(np.concatenate([i, j]), minlength=motion.shape[1])
    who = ((uses[: run.count] > 0) & (run.tracks.mode != CARRIED)).nonzero()[0]
    return Deeds(
        belt, before_n, before_t, after_n, after_t, np.maximum(np.abs(after_n), np.abs(after_t)),
        rounded, uses, who, motion[1, who] - motion[0, who],
    )  # fmt: skip


def _events(
    run: Run, contacts: Contacts, deeds: Deeds, x: Floats, before: Floats, after: Floats, t: float
) -> None:
    """Write impacts and collisions: contacts that were not there a step ago, and hit."""
    rows = run.begun(contacts.keys).nonzero()[0]
    if not len(rows):
        return
    i, j = contacts.first[rows], contacts.other[rows]
    fixed = (j >= run.count).nonzero()[0]
    # In flight the true velocity is half a step of gravity on from pymunk's.
    flown = np.zeros(len(before))
    flown[: run.count] = (run.tracks.mode == FLYING) * 0.5 * run.dt * run.machine.gravity
    approach = (flown[i] - flown[j]) * contacts.normal[rows, 1] - deeds.before_n[rows]
    told = approach > run.soft
    kind, surface = np.full(len(rows), Kind.COLLISION), np.full(len(rows), run.particles)
    solid = j[fixed] - run.count
    kind[fixed], surface[fixed] = Kind.IMPACT, run.solids.surface[solid]
    told[fixed] |= (approach[fixed] > FAINT * run.soft) & ~run.met[i[fixed], solid]
    run.met[i[fixed], solid] = True
    landing = fixed[(surface[fixed] == run.machine.landing) & ~run.landed[i[fixed]]]
    kind[landing], told[landing] = Kind.LANDING, True
    run.landed[i[landing]] = True
    if not np.count_nonzero(told):
        return
    who, rows, other = i[told], rows[told], j[told]
    came = before[who]
    came[:, 1] -= flown[who]
    run.event(
        kind[told], who, t, x[who], after[who, :2], after[who, 2], surface[told],
        np.where(other < run.count, run.ids[np.where(other < run.count, other, 0)], -1),
        velocity_before=came[:, :2], omega_before=came[:, 2],
        impulse=(contacts.j_n[rows], contacts.j_t[rows]),
    )  # fmt: skip
    run.recorder.contacts += len(who)


def _surfaces(
    run: Run, contacts: Contacts, deeds: Deeds, flew: Ints, x: Floats, after: Floats, t: float
) -> None:
    """Keep account of which single surface particles lie on, and whether they slip there."""
    surface = np.full(run.count, -1)
    rows = contacts.fixed[deeds.uses[contacts.first[contacts.fixed]] == 1]
    alone = contacts.first[rows]
    surface[alone] = run.solids.surface[contacts.other[rows] - run.count]
    run.stays.arrive(deeds.who, surface[deeds.who], t)
    speed = np.abs(deeds.after_t[rows])
    slipping = run.stays.slipping[alone]
    # A blow out of flight that ends the slip is no sticking yet.
    stops = slipping & (speed < SETTLED[0])
    if len(flew):
        stops &= ~np.isin(alone, flew)
    starts = ~slipping & (speed > SLIPS)
    run.stays.slipping[alone] = (slipping & ~stops) | starts
    _lie(run, contacts, deeds)
    for kind, which in ((Kind.STICK, stops), (Kind.SLIP, starts)):
        these = alone[which]
        run.event(kind, these, t, x[these], after[these, :2], after[these, 2], surface[these])


def _lie(run: Run, contacts: Contacts, deeds: Deeds) -> None:
    """Note the normals of surfaces that particles lie on, one or several in line; follow curves."""
    k, rows = run.tracks, contacts.fixed
    i, n, uses = contacts.first[rows], contacts.normal[rows], deeds.uses[contacts.first[rows]]
    rounded = deeds.rounded[rows]
    one = uses == 1
    k.upon[i[one]] = n[one]
    flat = one & ~rounded
    k.face[i[flat]] = contacts.other[rows[flat]] - run.count
    in_line = one.copy()
    several = ~one & (np.bincount(i, minlength=run.count)[i] == uses)
    for row in several.nonzero()[0].tolist():
        same = i == i[row]
        total = n[same].sum(axis=0)
        length = float(np.hypot(*total))
        in_line[row] = length > (1.0 - IN_LINE) * uses[row]
        if in_line[row]:
            k.upon[i[row]] = total / length
    for row in (in_line & rounded).nonzero()[0].tolist():
        solid = contacts.other[rows[row]] - run.count
        follow(run, int(i[row]), n[row], float(run.solids.reach[solid]) + run.radius)


def _calm(run: Run, contacts: Contacts, deeds: Deeds) -> None:
    """Count steps in a row in which particles lay still on what they can settle on."""
    who = deeds.who
    limit = STILL[0] if run.machine.interact else SETTLED[0]
    restless = deeds.pace > limit
    fixed = contacts.fixed
    restless[fixed] |= ~run.settles_on[contacts.other[fixed] - run.count]
    stirred = np.zeros(len(deeds.uses), dtype=bool)
    stirred[contacts.first[restless]] = True
    stirred[contacts.other[restless]] = True
    if not run.machine.interact:
        # Rolling down a slope is not lying on it.
        stirred[who] |= np.abs(deeds.change[:, :2]).max(axis=1) > limit
    run.calm[who] = np.where(stirred[who], 0, run.calm[who] + 1)
