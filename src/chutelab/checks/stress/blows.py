"""Laws on what one blow may do: the restitution and the friction of the pair that meets."""

from __future__ import annotations

from math import inf
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.checks.stress.evidence import EPS, ROUNDINGS, Evidence, Verdict, worst
from chutelab.results import Kind
from chutelab.util.arrays import Floats, Ints

LEAST = 1e-12
"""Friction that two particles of the pymunk engine have where the scene says 0: Chipmunk's pair is
a product, and a factor 0 would take it from all pairs."""


def cone(e: Evidence) -> Verdict | None:
    """No blow pulls, or grips by more than the pair's friction times what it pushes.

    The figure is the excess as a share of the largest momentum m v.
    """
    events = e.recording.select(Kind.IMPACT, Kind.LANDING, Kind.COLLISION)
    if not len(events):
        return None
    kinds = e.machine.releases.kind
    friction = e.machine.pair_friction[kinds[events["particle"]], kinds[events["other"]]]
    if e.engine == "pymunk":
        friction = np.maximum(friction, LEAST)
    alone = np.flatnonzero(events["other"] < 0)
    struck, _, _ = _struck(e, events[alone])
    friction[alone] = _of_pieces(e, events[alone], struck, "friction")
    rough = np.isinf(friction)
    normal, along = events["normal_impulse"], np.abs(events["tangential_impulse"])
    excess = np.where(rough, 0.0, along - np.where(rough, 0.0, friction) * normal)
    return _verdict(events, np.maximum(excess, -normal) / (e.masses.max() * e.speed), "of m v")


def rebound(e: Evidence) -> Verdict | None:
    """Judge whether speeds after blows are the restitution times the speeds before.

    This is about one blow at a time, so not about crowds and corners. A stepped engine may let a
    particle stay that would leave slower than gravity brings it back in a step, and the pymunk
    engine knows speeds to what gravity does to them in one. A mass point has no contact normal to
    be measured by. The figure is how far off it is, as a share of the largest speed.
    """
    events = e.recording.select(Kind.IMPACT, Kind.LANDING)
    if e.alike or e.crowd or not e.radii.all():
        return None
    struck, away, touched = _struck(e, events)
    events, struck, away = (of[touched == 1] for of in (events, struck, away))
    if not len(events):
        return None
    normal = away / np.hypot(*away.T)[:, None]
    before = (events["velocity_before"] * normal).sum(axis=1)
    after = (events["velocity_after"] * normal).sum(axis=1)
    due = -before * _of_pieces(e, events, struck, "restitution")
    rounding, pull = ROUNDINGS * EPS, e.machine.gravity * (e.dt or 0.0) / e.speed
    stays = (np.abs(after) <= rounding * e.speed) & (due <= pull * e.speed)
    off = np.where(stays, 0.0, np.abs(after - due)) / e.speed
    return _verdict(events, off, "of v", pull if e.engine == "pymunk" else 0.0)


def _verdict(events: NDArray[Any], off: Floats, unit: str, more: float = 0.0) -> Verdict:
    off = np.nan_to_num(off, nan=inf)
    hit = events[int(np.argmax(off))]
    where = f"particle {hit['particle']} at t = {hit['t']:.6g} s"
    return worst([(float(off.max()), where)], ROUNDINGS * EPS + more, unit)


def _struck(e: Evidence, events: NDArray[Any]) -> tuple[Ints, Floats, Ints]:
    """Find what was struck at blows on surfaces (c,).

    Returns
    -------
    struck : ndarray of int, (c,)
        Number of the nearest piece of the surface that is named.
    away : ndarray, (c, 2)
        Way from there to the centre, m.
    touched : ndarray of int, (c,)
        How many pieces, of any surface, were as near as one that is touched.
    """
    best, touched = np.full(len(events), inf), np.zeros(len(events), dtype=int)
    struck, away = np.zeros(len(events), dtype=int), np.zeros((len(events), 2))
    near = e.rounding + e.arcs + e.late
    for number, piece in enumerate(e.pieces):
        out = piece.away(events["position"])
        off = np.abs(np.hypot(*out.T) - e.radii[events["particle"]])
        off[~piece.there(events["t"], e.dt or 0.0)] = inf
        touched += off <= near
        nearer = (events["surface"] == piece.surface) & (off < best)
        best[nearer], struck[nearer], away[nearer] = off[nearer], number, out[nearer]
    return struck, away, touched


def _of_pieces(e: Evidence, events: NDArray[Any], struck: Ints, name: str) -> Floats:
    """Return what pieces have with the particles that strike them, (c,)."""
    count = len(e.machine.pair_friction)
    # A row for each piece, a column for each kind of particles.
    values = np.array([np.broadcast_to(getattr(piece, name), count) for piece in e.pieces])
    kinds = e.machine.releases.kind[events["particle"]]
    return np.asarray(values.reshape(-1, count)[struck, kinds])
