"""What happened to particle 0, in words."""

from __future__ import annotations

from functools import lru_cache
from math import atan2, degrees, hypot
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.plots.sampling import STRUCK, subset
from chutelab.plots.scenery import machine_of
from chutelab.plots.style import quantity
from chutelab.recording import PARTICLES, Kind

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.machine import Machine
    from chutelab.recording import Recording


def surface_words(name: str) -> str:
    """Return how a surface is spoken of."""
    return {
        "incoming": "the incoming belt",
        "outgoing": "the outgoing belt",
        "plate": "the plate",
        PARTICLES: "other particles",
    }.get(name, f"“{name}”")


@lru_cache(maxsize=1)
def _machine(recording: Recording) -> Machine:
    return machine_of(recording)


def contact_normal(machine: Machine, event: Any) -> NDArray[np.float64]:
    """Return the unit normal of an impact, away from the surface, (2,).

    From where the particle is: a fixed step's velocities have gravity in them, too.
    """
    position, segments = event["position"], machine.segments
    mine = segments.surface == event["surface"]
    start, tangent = segments.start[mine], segments.tangent[mine]
    along = np.einsum("sd,sd->s", position - start, tangent)
    foot = start + np.clip(along, 0.0, segments.length[mine])[:, None] * tangent
    away = position - foot
    gap = np.hypot(*away.T)
    pulley, name = machine.pulley, machine.surfaces[event["surface"]]
    if pulley is not None and name == "incoming":
        rim = np.hypot(*position)
        if abs(rim - pulley.radius) < gap.min():
            return np.asarray(position / rim)
    nearest = int(np.argmin(gap))
    beyond = not 0.0 <= along[nearest] <= segments.length[mine][nearest]
    if beyond and gap[nearest] > 0.5 * machine.particle.radius > 0.0:
        return np.asarray(away[nearest] / gap[nearest])
    normal = np.array([-tangent[nearest][1], tangent[nearest][0]])
    return normal if normal @ event["velocity_before"] < 0.0 else -normal


def losses(recording: Recording, event: Any) -> NDArray[np.float64]:
    """Return what an impact booked on particle 0, J: belt work, restitution and friction loss."""
    track = recording.track(0)
    now = np.flatnonzero(track["t"] == event["t"])
    if not len(now):
        return np.zeros(3)
    return np.asarray(track["entries"][now[-1]] - track["entries"][now[0]])


def sentence(recording: Recording, event: Any) -> str:
    """Return one or two lines on an event of particle 0."""
    kind = Kind(int(event["kind"]))
    name = recording.surfaces[event["surface"]] if event["surface"] >= 0 else PARTICLES
    speed = hypot(*event["velocity_after"])
    if kind in STRUCK:
        return _impact(recording, event, kind, name)
    on = surface_words(name)
    if kind is Kind.SEPARATION and name != "incoming":
        return f"leaves {on} at {speed:.3g} m/s"
    if kind is Kind.SEPARATION:
        angle = degrees(atan2(*event["position"]))
        where = "at the top" if angle < 5e-4 else f"{angle:.1f}° past the top"
        return f"leaves the drive pulley {where}, at {speed:.3g} m/s"
    return {
        Kind.RELEASE: "is released",
        Kind.SLIP: f"begins to slip on {on}",
        Kind.STICK: f"no longer slips on {on}",
        Kind.SETTLE: f"has settled on {on}",
        Kind.EXIT: "has left the scene",
    }[kind]


def _impact(recording: Recording, event: Any, kind: Kind, name: str) -> str:
    before = hypot(*event["velocity_before"])
    if kind is Kind.COLLISION:
        # The event keeps the velocity of its `particle` only.
        if event["particle"] != 0:
            return f"is hit by particle {int(event['particle'])}"
        return f"hits particle {int(event['other'])} at {before:.3g} m/s"
    verb = "lands on" if kind is Kind.LANDING else "strikes"
    text = f"{verb} {surface_words(name)} at {before:.3g} m/s"
    normal = contact_normal(_machine(recording), event)
    into, off = (abs(float(event[v] @ normal)) for v in ("velocity_before", "velocity_after"))
    if into > 0.0:
        text += f", ε = {round(off / into, 3):g}"
    belt, restitution, friction = losses(recording, event)
    said = [
        f"{'+' if value > 0.0 else ''}{quantity(value, 'J')} {what}"
        for value, what in (
            (-float(restitution), "in the rebound"),
            (-float(friction), "to slip heat"),
            (float(belt), "from the belt"),
        )
        if abs(value) > 1e-15
    ]
    return f"{text}\n{', '.join(said) or 'no energy lost'}"


def going_on(recording: Recording, event: Any, *, flying: bool, still: bool = False) -> str:
    """Return what particle 0 does some time after an event: `flying`, `still`, or in contact."""
    kind = Kind(int(event["kind"]))
    if flying:
        return "in flight"
    if kind in (Kind.RELEASE, Kind.COLLISION) or event["surface"] < 0:
        return ""
    verb = "lies" if still else "slides" if kind in (*STRUCK, Kind.SLIP) else "rides"
    return f"{verb} on {surface_words(recording.surfaces[event['surface']])}"


def in_flight(recording: Recording, times: NDArray[np.float64], near: float) -> NDArray[np.bool_]:
    """Tell at which times (T,) particle 0 moves as gravity alone would have it.

    Just before a time or just after it, within `near` seconds: an impact is in flight too.
    """
    moments = times[:, None] + np.array([-near, 0.0, near])
    velocity = subset(recording, [0]).at(moments.ravel())[1].reshape(*moments.shape, 2)
    pulled = np.diff(velocity, axis=1) / near + np.array([0.0, recording.gravity])
    least = 1e-6 * max(recording.gravity, float(np.abs(pulled[np.isfinite(pulled)]).max(initial=0)))
    return np.asarray((np.hypot(*np.moveaxis(pulled, 2, 0)) <= least).any(axis=1))
