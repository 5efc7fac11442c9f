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


def settle_books(run: Run, contacts: Contacts, x: Floats, motion: Motion, t: float) -> None:
    """Book the contacts of a step, write knots and events, and keep the particles in contact.

    Parameters
    ----------
    contacts : Contacts
        Without those of lone particles; the first of a pair is never carried.
    x : ndarray, (N, 2)
        Positions after the step, m.
    """
    i, solid = contacts.first, contacts.other - run.count
    pairs = solid < 0
    j = np.where(pairs, contacts.other, 0)
    n = contacts.normal
    along = np.stack([n[:, 1], -n[:, 0]], axis=-1)
    j_n, j_t = _dot(contacts.impulse, n), _dot(contacts.impulse, along)
    belt = np.zeros(len(i))
    belt[~pairs] = run.solids.belt(solid[~pairs], n[~pairs])
    carried = pairs & (run.tracks.mode[j] == CARRIED)

    def parts(v: Floats, omega: Floats) -> tuple[Floats, Floats]:
        other = np.where(pairs[:, None], v[j], 0.0)
        rim = run.radius * (omega[i] + np.where(pairs, omega[j], 0.0))
        relative = v[i] - other
        return _dot(relative, n), _dot(relative, along) + rim - belt

    # Led round the pulley along a chord, a particle only seems to press outwards.
    led = np.flatnonzero((run.tracks.aim[i] != run.tracks.w[i]).any(axis=1))
    motion.before[i[led]] -= _dot(motion.before[i[led]], n[led])[:, None] * n[led]
    mean = 0.5 * (motion.before + motion.after)
    normal_speed, slip = parts(mean, 0.5 * (motion.spin_before + motion.spin_after))
    after_n, after_t = parts(motion.after, motion.spin_after)

    who = np.flatnonzero(_involved(run, contacts))
    was_flying = run.tracks.mode[who] == FLYING
    jump = np.abs(motion.after[who] - motion.before[who]).max(axis=1)
    shock = was_flying | (jump > SHOCK + 4.0 * run.machine.gravity * run.dt)
    _knots_before(run, who, shock, was_flying, x, motion, t)
    _book(run, contacts, pairs, carried, (j_n * normal_speed, j_t * slip, j_t * belt), motion)
    hit = who[shock]
    run.tracks.knot(hit, t, x[hit], motion.after[hit], motion.spin_after[hit])
    _events(run, contacts, (j_n, j_t), x, motion, t)

    run.tracks.rest(who[was_flying])
    run.tracks.leave(who, x[who], motion.after[who], motion.spin_after[who])
    _surfaces(run, contacts, who, after_t, x, motion, t)
    _calm(run, contacts, who, np.maximum(np.abs(after_n), np.abs(after_t)), motion)
    if run.machine.until == "landed":
        run.finish(who[run.landed[who]], "landed")


def _dot(a: Floats, b: Floats) -> Floats:
    return np.asarray(np.einsum("md,md->m", a, b))


def _involved(run: Run, contacts: Contacts) -> NDArray[np.bool_]:
    """Tell which particles have a contact and are not carried, (N,)."""
    out = np.zeros(run.count, dtype=bool)
    out[contacts.first] = True
    out[contacts.other[contacts.other < run.count]] = True
    return np.asarray(out & (run.tracks.mode != CARRIED))


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


def _book(
    run: Run,
    contacts: Contacts,
    pairs: NDArray[np.bool_],
    carried: NDArray[np.bool_],
    works: tuple[Floats, Floats, Floats],
    motion: Motion,
) -> None:
    """Book contacts; what two particles lose is shared, what a carried one gives is belt work."""
    on_normal, on_slip, by_belt = works
    both = pairs & ~carried
    half = np.where(both, 0.5, 1.0)
    surface = np.full(len(pairs), run.particles)
    surface[~pairs] = run.solids.surface[contacts.other[~pairs] - run.count]
    if carried.any():
        drive = motion.after[contacts.other[carried]]
        given = _dot(contacts.impulse[carried], drive)
        run.recorder.book(run.ids[contacts.first[carried]], 0, given)
    run.recorder.book(
        run.ids[np.concatenate([contacts.first, contacts.other[both]])],
        np.concatenate([surface, surface[both]]),
        np.concatenate([by_belt, np.zeros(np.count_nonzero(both))]),
        np.concatenate([-half * on_normal, -0.5 * on_normal[both]]),
        np.concatenate([-half * on_slip, -0.5 * on_slip[both]]),
    )


def _events(
    run: Run,
    contacts: Contacts,
    impulse: tuple[Floats, Floats],
    x: Floats,
    motion: Motion,
    t: float,
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
    told = begun & (approach > run.machine.gravity * run.dt)
    kind = np.where(pairs, Kind.COLLISION, Kind.IMPACT)
    s = np.flatnonzero(~pairs)
    solid = j[s] - run.count
    told[s] |= (approach[s] > FAINT * run.machine.gravity * run.dt) & ~run.met[i[s], solid]
    run.met[i[s], solid] = True
    landing = (run.solids.surface[solid] == run.machine.landing) & ~run.landed[i[s]]
    kind[s[landing]], told[s[landing]] = Kind.LANDING, True
    run.landed[i[s[landing]]] = True
    who = i[told]
    surface = np.full(len(i), run.particles)
    surface[s] = run.solids.surface[solid]
    run.event(
        kind[told], who, t, x[who], motion.after[who], motion.spin_after[who], surface[told],
        np.where(pairs, run.ids[np.where(pairs, j, 0)], -1)[told],
        velocity_before=before[who], omega_before=motion.spin_before[who],
        impulse=(impulse[0][told], impulse[1][told]),
    )  # fmt: skip
    run.recorder.contacts += int(np.count_nonzero(told))


def _surfaces(
    run: Run, contacts: Contacts, who: Ints, slip: Floats, x: Floats, motion: Motion, t: float
) -> None:
    """Keep account of which single surface particles lie on, and whether they slip there."""
    pairs = contacts.other < run.count
    uses = np.bincount(contacts.first, minlength=run.count)
    uses += np.bincount(contacts.other[pairs], minlength=run.count)
    surface = np.full(run.count, -1)
    rows = np.flatnonzero(~pairs & (uses[contacts.first] == 1))
    alone = contacts.first[rows]
    surface[alone] = run.solids.surface[contacts.other[rows] - run.count]
    run.arrive(who, surface[who], t)
    speed = np.abs(slip[rows])
    stops = run.slipping[alone] & (speed < SETTLED[0])
    starts = ~run.slipping[alone] & (speed > SLIPS)
    _lie(run, contacts, uses)
    run.slipping[alone] = (run.slipping[alone] & ~stops) | starts
    for kind, these in ((Kind.STICK, alone[stops]), (Kind.SLIP, alone[starts])):
        run.event(
            kind, these, t, x[these], motion.after[these], motion.spin_after[these],
            surface[these],
        )  # fmt: skip


def _lie(run: Run, contacts: Contacts, uses: Ints) -> None:
    """Note the normals of surfaces that particles lie on, one or several in line; follow curves."""
    solid = contacts.other >= run.count
    i, n = contacts.first[solid], contacts.normal[solid]
    total = np.zeros((run.count, 2))
    np.add.at(total, i, n)
    length = np.linalg.norm(total, axis=1)
    in_line = (uses > 0) & (length > (1.0 - IN_LINE) * uses)
    who = np.flatnonzero(in_line)
    run.tracks.upon[who] = total[who] / length[who, None]
    which = contacts.other[solid] - run.count
    curved = in_line[i] & run.solids.rounded(which, run.tracks.at[i])
    for row in np.flatnonzero(curved).tolist():
        run.follow(int(i[row]), n[row], float(run.solids.reach[which[row]]) + run.radius)


def _calm(run: Run, contacts: Contacts, who: Ints, speed: Floats, motion: Motion) -> None:
    """Count steps in a row in which particles lay still on what they can settle on."""
    limit = STILL[0] if run.machine.interact else SETTLED[0]
    pairs = contacts.other < run.count
    restless = speed > limit
    solid = contacts.other[~pairs] - run.count
    restless[~pairs] |= ~run.settles_on[solid]
    stirred = np.zeros(run.count, dtype=bool)
    stirred[contacts.first[restless]] = True
    stirred[contacts.other[restless & pairs]] = True
    if not run.machine.interact:
        # Rolling down a slope is not lying on it.
        change = np.abs(motion.after - motion.before).max(axis=1)
        stirred[who] |= change[who] > limit
    run.calm[who] = np.where(stirred[who], 0, run.calm[who] + 1)
