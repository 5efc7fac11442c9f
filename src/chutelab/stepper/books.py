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


@dataclass(eq=False, slots=True)
class Deeds:
    """What the M contacts of a step did, in the frames of their normals, to P particles.

    Attributes
    ----------
    belt : ndarray, (M,)
        Speed of the surface, m/s.
    before, after : ndarray, (2, M)
        Normal speed and slip before and after, m/s.
    pace : ndarray, (M,)
        The greater of both after, m/s.
    rounded : ndarray of bool, (M,)
        Whether the solid is round there.
    lone, flat : ndarray
        Rows of contacts with a solid that are their particle's only one, and those on a face.
    free, held : ndarray
        Rows of contacts with particles, free and carried.
    who : ndarray, (P,)
        Particles in contact, not carried.
    change : ndarray, (P, 3)
        By how much vx, vy (m/s) and ω (rad/s) of each changed.
    """

    belt: Floats
    before: Floats
    after: Floats
    pace: Floats
    rounded: NDArray[np.bool_]
    lone: Ints
    flat: Ints
    free: Ints
    held: Ints
    who: Ints
    change: Floats


def settle_books(run: Run, contacts: Contacts, x: Floats, motion: Floats, t: float) -> None:
    """Book the contacts of a step, write knots and events, and keep the particles in contact.

    Parameters
    ----------
    contacts : Contacts
        The first of a pair is never carried.
    x : ndarray, (N + K, 2)
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
    u, v, _ = np.abs(deeds.change).T
    shock = flew | (np.maximum(u, v) > SHOCK + 4.0 * run.machine.gravity * run.dt)
    place, velocity = x.take(who, axis=0), after.take(who, axis=0)
    # The mean of the velocities before and after is that halfway through the step's impulses.
    states = np.empty((len(who), 6))
    states[:, 0], states[:, 1:3], states[:, 3:] = t, place, velocity - 0.5 * deeds.change
    hit = who[shock]
    if len(hit):
        smooth = ~shock
        k.go_smoothly(who[smooth], states[smooth])
        # A flight comes in with the true velocity, half a step on from pymunk's.
        came = before[hit]
        came[:, :2] += 0.5 * run.dt * run.gravity * flew[shock, None]
        k.close(hit)
        k.knot(hit, t, x[hit], came[:, :2], came[:, 2])
    else:
        k.go_smoothly(who, states)
    book(run, contacts, deeds, after)
    if len(hit):
        k.knot(hit, t, x[hit], after[hit, :2], after[hit, 2])
    come = who[flew]
    _events(run, contacts, deeds, come, x, motion, t)

    k.rest(come)
    k.leave(who, place, velocity)
    run.bent[who], run.bend[who] = run.bend[who], 0.0
    _surfaces(run, contacts, deeds, come, x, after, t)
    _calm(run, contacts, deeds)
    if run.machine.align:
        run.idle.settle(contacts, deeds)
    if run.machine.until == "landed":
        run.finish(who[run.landed[who]], "landed")


def _deeds(run: Run, contacts: Contacts, x: Floats, motion: Floats) -> Deeds:
    """Return what the contacts did."""
    i, j, fixed, uses = contacts.first, contacts.other, contacts.fixed, contacts.uses
    partners, mode = run.world.partners, run.tracks.mode
    nx, ny = contacts.normal.T
    belt, rounded = partners.belt(j, nx, ny), partners.rounded(j, x.take(i, axis=0))
    speeds = _relative(contacts, nx, ny, motion, run.radius)
    speeds[1] -= belt
    before, after = speeds.transpose(1, 0, 2)
    flat = lone = fixed[uses[i[fixed]] == 1]
    if np.count_nonzero(rounded):
        flat = lone[~rounded[lone]]
    carried = mode[j[contacts.pairs]] == CARRIED
    who = uses[: run.count].nonzero()[0]
    who = who[mode[who] != CARRIED]
    return Deeds(
        belt, before, after, np.maximum(*np.abs(after)), rounded, lone, flat,
        contacts.pairs[~carried], contacts.pairs[carried], who,
        motion[1].take(who, axis=0) - motion[0].take(who, axis=0),
    )  # fmt: skip


def _relative(contacts: Contacts, nx: Floats, ny: Floats, motion: Floats, radius: float) -> Floats:
    """Return normal speeds and slips on solids at rest, (2, 2, M), before and after a step."""
    mine, theirs = motion.take(contacts.first, axis=1), motion.take(contacts.other, axis=1)
    u, v, _ = (mine - theirs).transpose(2, 0, 1)
    speeds = np.empty((2, *u.shape))
    speeds[0] = u * nx + v * ny
    speeds[1] = u * ny - v * nx + radius * (mine[:, :, 2] + theirs[:, :, 2])
    return speeds


def _events(
    run: Run, contacts: Contacts, deeds: Deeds, flew: Ints, x: Floats, motion: Floats, t: float
) -> None:
    """Write impacts and collisions: contacts that were not there a step ago, and hit."""
    rows = run.begun(contacts.keys).nonzero()[0]
    if not len(rows):
        return
    (before, after), i, j = motion, contacts.first[rows], contacts.other[rows]
    fixed = (j >= run.count).nonzero()[0]
    solid = j[fixed] - run.count
    # In flight the true velocity is half a step of gravity on from pymunk's.
    flown = np.zeros(len(before))
    flown[flew] = 0.5 * run.dt * run.machine.gravity
    approach = (flown[i] - flown[j]) * contacts.normal[:, 1][rows] - deeds.before[0][rows]
    told, known = approach > run.soft, run.met[i[fixed], solid]
    if not np.count_nonzero(told) and np.count_nonzero(known) == len(known):
        return
    kind, surface = np.full(len(rows), Kind.COLLISION), run.world.partners.surface[j]
    kind[fixed] = Kind.IMPACT
    told[fixed] |= (approach[fixed] > FAINT * run.soft) & ~known
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
        impulse=(contacts.impulse[0][rows], contacts.impulse[1][rows]),
    )  # fmt: skip
    run.recorder.contacts += len(who)


def _surfaces(
    run: Run, contacts: Contacts, deeds: Deeds, flew: Ints, x: Floats, after: Floats, t: float
) -> None:
    """Keep account of which single surface particles lie on, and whether they slip there."""
    lone, surface = deeds.lone, np.full(run.count, -1)
    alone = contacts.first[lone]
    surface[alone] = run.world.partners.surface[contacts.other[lone]]
    run.stays.arrive(deeds.who, surface[deeds.who], t)
    speed = np.abs(deeds.after[1][lone])
    slipping = run.stays.slipping[alone]
    # A blow out of flight that ends the slip is no sticking yet.
    stops = slipping & (speed < SETTLED[0])
    if len(flew):
        stops &= ~np.isin(alone, flew)
    starts = ~slipping & (speed > SLIPS)
    _lie(run, contacts, deeds)
    for kind, which in ((Kind.STICK, stops), (Kind.SLIP, starts)):
        if np.count_nonzero(which):
            these = alone[which]
            run.stays.slipping[these] = kind is Kind.SLIP
            run.event(kind, these, t, x[these], after[these, :2], after[these, 2], surface[these])


def _lie(run: Run, contacts: Contacts, deeds: Deeds) -> None:
    """Note the normals of surfaces that particles lie on, one or several in line; follow curves."""
    k, i = run.tracks, contacts.first
    k.upon[i[deeds.lone]] = contacts.normal.take(deeds.lone, axis=0)
    k.face[i[deeds.flat]] = contacts.other[deeds.flat] - run.count
    rows = contacts.fixed
    its = i[rows]
    led = deeds.lone
    # Contacts are sorted: those of a particle with several solids follow each other.
    if np.count_nonzero(its[1:] == its[:-1]):
        led = np.concatenate((led, _in_line(run, contacts, deeds)))
    for row in led[deeds.rounded[led]].tolist():
        solid = contacts.other[row] - run.count
        reach = float(run.solids.reach[solid]) + run.radius
        follow(run, int(i[row]), contacts.normal[row], reach)


def _in_line(run: Run, contacts: Contacts, deeds: Deeds) -> Ints:
    """Return the rows of several surfaces in line with each other; note the mean of the normals."""
    rows = contacts.fixed
    i, n = contacts.first[rows], contacts.normal[rows]
    uses = contacts.uses[i]
    in_line = np.zeros(len(rows), dtype=bool)
    several = (uses > 1) & (np.bincount(i, minlength=run.count)[i] == uses)
    for row in several.nonzero()[0].tolist():
        same = i == i[row]
        total = n[same].sum(axis=0)
        length = float(np.hypot(*total))
        in_line[row] = length > (1.0 - IN_LINE) * uses[row]
        if in_line[row]:
            run.tracks.upon[i[row]] = total / length
    return rows[in_line]


def _calm(run: Run, contacts: Contacts, deeds: Deeds) -> None:
    """Count steps in a row in which particles lay still on what they can settle on."""
    who = deeds.who
    limit = STILL[0] if run.machine.interact else SETTLED[0]
    restless = (deeds.pace > limit) | run.world.partners.unsettling[contacts.other]
    stirred = np.zeros(len(contacts.uses), dtype=bool)
    stirred[contacts.first[restless]] = True
    stirred[contacts.other[restless]] = True
    if not run.machine.interact:
        # Rolling down a slope is not lying on it.
        stirred[who] |= np.abs(deeds.change[:, :2]).max(axis=1) > limit
    calm = run.calm[who] + 1
    calm[stirred[who]] = 0
    run.calm[who] = calm
