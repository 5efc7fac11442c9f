"""How far particle 0 of each variant is from the closed form, as far as it went the same way.

The closed form knows an unbounded plate and belt. Whether a particle went the way that its
equations describe is read off its events: leaving the pulley, the blow on the struck face of the
plate, the landing. Where another contact comes first, the stages before it are compared.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.compare import QUANTITIES, from_events, never, relative_errors, scales
from chutelab.recording import ENTRIES, REASONS, Kind
from chutelab.theory import unbounded

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from chutelab.recording import Recording
    from chutelab.scene import Scene

    Floats = NDArray[np.float64]
    Bools = NDArray[np.bool_]

WAY = ((Kind.SEPARATION, "incoming"), (Kind.IMPACT, "plate"), (Kind.LANDING, "outgoing"))
"""The events that the equations describe, in this order."""

OTHER = (Kind.COLLISION, Kind.STICK, Kind.SETTLE)
"""Kinds of events that they do not know of, on the way or on another surface."""


def deviation(recording: Recording, scene: Scene, shape: tuple[int, int]) -> Floats:
    """Return the largest relative error, (V,), as `chutelab.compare` measures it; NaN for none.

    Parameters
    ----------
    recording, scene : Recording, Scene
        Of one variant, or a family of them.
    shape : tuple of int
        Variants V, and the particles M of each.
    """
    count = shape[0]
    if scene.incoming is None or scene.plate is None or (scene.stream.interact and shape[1] > 1):
        return np.full(count, np.nan)
    events = _way(recording, shape[1], count)
    begins = _begins(recording, scene, shape)
    for one in events:
        one[~begins] = never(1)
    simulated = from_events(scene, *events)
    theory = unbounded(scene)
    settled = _settled(recording, shape)
    if settled is not None:
        simulated |= settled
    sizes = scales(scene, theory)
    worst = np.full(count, np.nan)
    for name, found in simulated.items():
        expected = getattr(theory, name)
        errors = relative_errors(found, expected, sizes[QUANTITIES[name]])
        worst = np.fmax(worst, np.where(np.isfinite(errors), errors, np.nan))
    return worst


def _begins(recording: Recording, scene: Scene, shape: tuple[int, int]) -> Bools:
    """Tell whether particle 0 was released on the belt, as fast as the belt is, (V,)."""
    assert scene.incoming is not None
    belt, start = scene.incoming, recording.offsets[: -1 : shape[1]]
    released = recording.offsets[1 :: shape[1]] > start
    first = recording.knots[np.where(released, start, 0)]
    (x, y), (vx, vy) = first["position"].T, first["velocity"].T
    height = belt.pulley_radius + scene.particle.radius
    on_belt = (y == height) & (-belt.length <= x) & (x <= 0.0)
    return np.asarray(released & on_belt & (vx == belt.speed) & (vy == 0.0))


def _way(recording: Recording, every: int, count: int) -> list[NDArray[Any]]:
    """Return leaving, blow and landing of particle 0 of each variant, NaN from where it strays."""
    events = recording.events
    kinds = [int(kind) for kind, _ in WAY] + [int(kind) for kind in OTHER]
    incoming = recording.surface_index("incoming")
    # Grip and slip on the belt and the pulley are in the equations.
    known = (events["kind"] == Kind.STICK) & (events["surface"] == incoming)
    mine = np.isin(events["kind"], kinds) & (events["particle"] % every == 0) & ~known
    own = events[mine]
    own = own[np.argsort(own["particle"], kind="stable")]
    variant = own["particle"] // every
    rank = np.arange(len(own)) - np.searchsorted(variant, variant)
    # A carried particle leaves the belt with a blow that throws it off, too.
    second = np.full(count, np.nan)
    second[variant[rank == 1]] = own["t"][rank == 1]
    found = [never(count) for _ in WAY]
    astray = np.zeros(count, dtype=bool)
    for n, ((kind, surface), into) in enumerate(zip(WAY, found, strict=True)):
        at = rank == n
        there, which = variant[at], own[at]
        fits = (which["kind"] == kind) & (which["surface"] == recording.surface_index(surface))
        here = np.zeros(count, dtype=bool)
        here[there] = fits
        here &= ~astray
        into[there[here[there]]] = which[here[there]]
        astray = ~here
    early = found[0]["t"] >= second
    for into in found:
        into[early] = never(1)
    return found


def _settled(recording: Recording, shape: tuple[int, int]) -> dict[str, Floats] | None:
    """Return what the outgoing belt paid for those that no longer slip on it, NaN for others."""
    if shape[1] > 1 or "outgoing" not in recording.surfaces:
        return None
    entries = recording.by_surface.reshape(shape[0], -1, len(ENTRIES))
    belt = entries[:, recording.surface_index("outgoing")]
    over = recording.ended == REASONS.index("settled")
    return {
        "belt_work": np.where(over, belt[:, ENTRIES.index("belt_work")], np.nan),
        "slip_heat": np.where(over, belt[:, ENTRIES.index("friction_loss")], np.nan),
    }
