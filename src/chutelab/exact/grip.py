"""Contact that lasts: the load on it, gripping or slipping, and coming to rest."""

from __future__ import annotations

import numpy as np

from chutelab.exact.obstacles import Floats, Ints, dot, pick
from chutelab.exact.swarm import Contact, Mode, Swarm, below
from chutelab.recording import Kind


def load_on(s: Swarm, who: Ints, obstacle: Ints, c: Contact) -> Floats:
    """Return the normal force per mass that would keep a particle on an obstacle, m/s²."""
    load = s.weight_on(who, c.normal)
    curved = (obstacle >= s.obstacles.segments).nonzero()[0]
    if len(curved):
        rho = pick(s.obstacles.rho, who[curved], obstacle[curved] - s.obstacles.segments)
        load[curved] -= dot(s.v[:, who[curved]], c.tangent[:, curved]) ** 2 / rho
    return load


def settle_law(s: Swarm, who: Ints) -> None:
    """Choose between gripping and slipping, and end tracks that have settled.

    Without slip, friction must hold against gravity: m*/m |g_t| <= µ N. Where it cannot, slip
    starts the way gravity pulls.
    """
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    arc = s.mode[who] == Mode.ARC
    w = dot(s.v.take(who, axis=1), c.tangent)
    slip = s.slip_of(who, c, w)
    still = slip == 0.0
    if s.spins:
        s.z[who] = np.where(still, c.belt - w, s.z[who])
    else:
        w = np.where(still, c.belt, w)
    s.v[:, who] = w * c.tangent
    pull, load = s.weight_along(who, c.normal), load_on(s, who, s.on[who], c)
    grips = still & below(s.share * np.abs(pull), c.friction, load)
    begins = grips & (s.slip[who] != 0.0)
    s.slip[who] = np.where(grips, 0.0, np.where(still, np.sign(pull), np.sign(slip)))
    s.event(int(Kind.STICK), who[begins], c.surface[begins])
    if s.machine.until == "settled":
        # Rolling down a slope is not lying on it.
        steady = grips & ((pull == 0.0) | (not s.spins)) & ~(arc & (w != 0.0))
        lies = steady & ((c.belt == 0.0) | (c.surface == s.machine.landing))
        s.event(int(Kind.SETTLE), who[lies], c.surface[lies])
        s.finish(who[lies], "settled")


def end_slip(s: Swarm, who: Ints) -> None:
    """Make a slip that is used up exactly zero, then see whether friction holds."""
    if not len(who):
        return
    c = s.contact(who, s.on[who], s.side[who])
    if s.spins:
        s.z[who] = c.belt - dot(s.v.take(who, axis=1), c.tangent)
    else:
        s.v[:, who] = c.belt * c.tangent
    settle_law(s, who)


def face_force(s: Swarm, who: Ints, c: Contact) -> tuple[Floats, Floats]:
    """Return acceleration (2, k) and friction force per mass along the tangent (k,) on a face."""
    pull, load = s.weight_along(who, c.normal), s.weight_on(who, c.normal)
    slip = s.slip[who]
    gripping = slip == 0.0
    finite = np.where(np.isinf(c.friction) | gripping, 0.0, c.friction)
    force = np.where(gripping, -s.share * pull, -slip * finite * load)
    return (pull + force) * c.tangent, force
