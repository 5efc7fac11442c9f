"""What an engine leaves behind: knots, events and the books they carry.

A particle's track is a list of *knots*; between two knots it is the cubic Hermite curve through
them. With exact end velocities that curve is the parabola of free flight, so a flight costs two
knots however long it lasts. An impact is two knots at one time.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    from collections.abc import Collection
    from pathlib import Path

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

ENTRIES = ("belt_work", "restitution_loss", "friction_loss")
"""The three entries of the energy ledger, in the order of every array that holds them."""

PARTICLES = "particles"
"""Name under which the losses of particle-particle contacts are booked."""


class Kind(IntEnum):
    """What happened in an event."""

    RELEASE = 0
    SEPARATION = 1
    SLIP = 2
    IMPACT = 3
    LANDING = 4
    COLLISION = 5
    STICK = 6
    SETTLE = 7
    EXIT = 8


REASONS = ("time", "landed", "settled", "exit")
"""Why a particle's track ends; `Recording.ended` holds indices into this tuple."""

EVENT = np.dtype(
    [
        ("t", "f8"),
        ("particle", "i4"),
        ("other", "i4"),
        ("kind", "i1"),
        ("surface", "i2"),
        ("position", "f8", 2),
        ("velocity_before", "f8", 2),
        ("velocity_after", "f8", 2),
        ("omega_before", "f8"),
        ("omega_after", "f8"),
        ("normal_impulse", "f8"),
        ("tangential_impulse", "f8"),
    ]
)
"""One event: SI units; `other` is the partner or -1, `surface` an index into `Recording.surfaces`
or -1, `kind` a `Kind`; the impulses (N s) act on the particle, the normal one away from the
surface, the tangential one along (n_y, -n_x) for the contact normal n."""

KNOT = np.dtype(
    [
        ("t", "f8"),
        ("position", "f8", 2),
        ("velocity", "f8", 2),
        ("omega", "f8"),
        ("entries", "f8", 3),
    ]
)
"""One knot: time, state, and the cumulative ledger entries (J) of that particle, see `ENTRIES`."""


@dataclass(frozen=True)
class Particle:
    """The one kind of particle of a recording.

    Attributes
    ----------
    radius : float
        r, m; 0 for a mass point.
    mass : float
        m, kg.
    inertia : float
        Moment of inertia about the centre, kg m²; 0 for a particle that does not turn.
    """

    radius: float
    mass: float
    inertia: float


@dataclass(frozen=True, eq=False)
class Recording:
    """A finished run: read-only arrays, the same type from every engine.

    Attributes
    ----------
    scene : str
        The scene in canonical JSON, as `Scene.model_dump_json` writes it.
    title, engine : str
        The scene's title; ``"exact"`` or ``"pymunk"``.
    particle : Particle
        Radius, mass and inertia.
    gravity : float
        m/s².
    surfaces : tuple of str
        Names that `events["surface"]` indexes; the last is always ``"particles"``.
    knots : ndarray, shape (K,), dtype `KNOT`
        All tracks, one after the other.
    offsets : ndarray, shape (N + 1,)
        Particle i owns ``knots[offsets[i]:offsets[i + 1]]``; empty if it was never released.
    ended : ndarray, shape (N,)
        Indices into `REASONS`.
    events : ndarray, shape (E,), dtype `EVENT`
        Sorted by time.
    by_surface : ndarray, shape (len(surfaces), 3)
        Ledger entries (J) of each surface, summed over particles.
    steps : int
        Steps (pymunk) or rounds (exact) taken.
    contacts : int
        Impacts and collisions resolved.
    seconds : float
        Wall time from the validated scene to the recording.
    """

    scene: str
    title: str
    engine: str
    particle: Particle
    gravity: float
    surfaces: tuple[str, ...]
    knots: NDArray[Any]
    offsets: Ints
    ended: NDArray[np.int8]
    events: NDArray[Any]
    by_surface: Floats
    steps: int
    contacts: int
    seconds: float = field(default=0.0)

    def __post_init__(self) -> None:
        for name in ("knots", "offsets", "ended", "events", "by_surface"):
            getattr(self, name).flags.writeable = False

    @property
    def count(self) -> int:
        """Number of particles."""
        return len(self.offsets) - 1

    def save(self, path: str | Path) -> Path:
        """Write an npz file, whole or not at all; `load` gives the recording back bit for bit."""
        from chutelab.storage import save

        return save(self, path)

    @classmethod
    def load(cls, path: str | Path) -> Recording:
        """Read what `save` wrote; a `chutelab.storage.RecordingError` says what is wrong."""
        from chutelab.storage import load

        return load(path)

    def to_csv(
        self,
        folder: str | Path,
        *,
        step: float | None = None,
        only: Collection[str] = ("events", "trajectory"),
    ) -> list[Path]:
        """Write events.csv and trajectory.csv into a folder; see `chutelab.storage.to_csv`."""
        from chutelab.storage import to_csv

        return to_csv(self, folder, step=step, only=only)

    def track(self, particle: int) -> NDArray[Any]:
        """Return the knots of one particle, shape (k,)."""
        return self.knots[self.offsets[particle] : self.offsets[particle + 1]]

    def ends(self) -> tuple[NDArray[Any], NDArray[Any]]:
        """Return the first and last knots of all released particles, each of shape (n,)."""
        released = self.offsets[1:] > self.offsets[:-1]
        return (
            self.knots[self.offsets[:-1][released]],
            self.knots[self.offsets[1:][released] - 1],
        )

    def surface_index(self, name: str) -> int:
        """Return the index of a surface, or -1 if the scene has none of that name."""
        return self.surfaces.index(name) if name in self.surfaces else -1

    def select(self, *kinds: Kind, surface: str | None = None) -> NDArray[Any]:
        """Return the events of the given kinds (all if none is given), sorted by time."""
        keep = np.ones(len(self.events), dtype=bool)
        if kinds:
            keep &= np.isin(self.events["kind"], [int(kind) for kind in kinds])
        if surface is not None:
            keep &= self.events["surface"] == self.surface_index(surface)
        return self.events[keep]

    def first(self, events: NDArray[Any]) -> NDArray[Any]:
        """Reduce events to the first one of each particle, in the order of the particles."""
        _, index = np.unique(events["particle"], return_index=True)
        return events[index]

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions (m) and velocities (m/s) at any times.

        Parameters
        ----------
        times : array_like, shape (T,)
            s.

        Returns
        -------
        position, velocity : ndarray, shape (T, N, 2)
            NaN before a particle's release and after its end; at an impact the state after it.
        """
        index, inside, times = self._intervals(times)
        position, velocity, _ = self._hermite(index, times)
        position[~inside] = np.nan
        velocity[~inside] = np.nan
        return position, velocity

    def energy_at(self, times: ArrayLike) -> dict[str, Floats]:
        """Return the energy ledger of all released particles up to each time.

        Belt work is interpolated linearly between knots, the restitution loss not at all (it
        changes in impacts only), the friction loss by the energy balance of the interval with the
        numerical residual shared out linearly; so the books are right at any time, not only at
        knots. A particle that has ended keeps its last state.

        Returns
        -------
        dict of ndarray, shape (T,)
            ``kinetic``, ``potential`` (y = 0 is the zero), the three `ENTRIES`, and ``residual``:
            what the balance since each release leaves over. J.
        """
        index, _, times = self._intervals(times)
        started = np.zeros(index.shape, dtype=bool)
        has_knots = self.offsets[1:] > self.offsets[:-1]
        first = self.knots[np.minimum(self.offsets[:-1], max(len(self.knots) - 1, 0))]
        last = self.knots[np.maximum(self.offsets[1:] - 1, 0)]
        started[:, has_knots] = times[:, None] >= first["t"][has_knots]
        clipped = np.clip(times[:, None], first["t"], last["t"])
        position, velocity, share = self._hermite(index, clipped)
        left, right = self.knots[index], self.knots[index + 1]

        kinetic, potential = self._energies(position, velocity, left, right, share)
        total = kinetic + potential
        at_first = sum(self.energies(first))
        residual_left = sum(self.energies(left)) - at_first - balance(left["entries"])
        residual_right = sum(self.energies(right)) - at_first - balance(right["entries"])
        residual = residual_left + share * (residual_right - residual_left)
        belt = left["entries"][..., 0] + share * (
            right["entries"][..., 0] - left["entries"][..., 0]
        )
        restitution = np.where(share < 1.0, left["entries"][..., 1], right["entries"][..., 1])
        friction = belt - restitution + residual - (total - at_first)
        values = {
            "kinetic": kinetic,
            "potential": potential,
            "belt_work": belt,
            "restitution_loss": restitution,
            "friction_loss": friction,
            "residual": residual,
        }
        return {name: np.where(started, value, 0.0).sum(axis=1) for name, value in values.items()}

    def energies(self, knots: NDArray[Any]) -> tuple[Floats, Floats]:
        """Return kinetic (rotation included) and potential energy (J) of knots of any shape."""
        return self._kinetic(knots["velocity"], knots["omega"]), self._potential(knots["position"])

    def _kinetic(self, velocity: Floats, omega: Floats) -> Floats:
        p = self.particle
        return np.asarray(0.5 * p.mass * (velocity**2).sum(axis=-1) + 0.5 * p.inertia * omega**2)

    def _potential(self, position: Floats) -> Floats:
        return np.asarray(self.particle.mass * self.gravity * position[..., 1])

    def _energies(
        self, position: Floats, velocity: Floats, left: Any, right: Any, share: Floats
    ) -> tuple[Floats, Floats]:
        omega = left["omega"] + share * (right["omega"] - left["omega"])
        return self._kinetic(velocity, omega), self._potential(position)

    def _intervals(self, times: ArrayLike) -> tuple[Ints, NDArray[np.bool_], Floats]:
        """Find the knot at or before each time, (T, N), by bisecting all tracks at once."""
        times = np.atleast_1d(np.asarray(times, dtype=np.float64))
        t = self.knots["t"]
        low = np.broadcast_to(self.offsets[:-1], (len(times), self.count)).copy()
        high = np.broadcast_to(self.offsets[1:] - 1, low.shape).copy()
        empty = high < low
        last = np.where(empty, 0, high)
        first_t = t[np.where(empty, 0, low)] if len(t) else np.zeros(low.shape)
        last_t = t[last] if len(t) else np.zeros(low.shape)
        inside = ~empty & (times[:, None] >= first_t) & (times[:, None] <= last_t)
        while np.any(high > low):
            middle = (low + high + 1) // 2
            after = t[np.minimum(middle, len(t) - 1)] <= times[:, None]
            low = np.where(after & (high > low), middle, low)
            high = np.where(after, high, np.maximum(middle - 1, low))
        # The interval needs a right end: the last knot of a track closes the one before it.
        start = np.broadcast_to(self.offsets[:-1], low.shape)
        index = np.minimum(low, np.maximum(last - 1, start))
        return np.clip(index, 0, max(len(t) - 2, 0)), inside, times

    def _hermite(self, index: Ints, times: Floats) -> tuple[Floats, Floats, Floats]:
        if times.ndim == 1:
            times = times[:, None]
        left, right = self.knots[index], self.knots[index + 1]
        h = right["t"] - left["t"]
        with np.errstate(divide="ignore", invalid="ignore"):
            share = np.where(h > 0.0, (times - left["t"]) / h, 1.0)
        s, h = share[..., None], h[..., None]
        dx = right["position"] - left["position"]
        va, vb = left["velocity"], right["velocity"]
        # Hermite basis, written around the left knot so that a long flight loses no digits.
        position = left["position"] + s * (
            h * va + s * ((3.0 * dx - h * (2.0 * va + vb)) + s * (h * (va + vb) - 2.0 * dx))
        )
        with np.errstate(divide="ignore", invalid="ignore"):
            slope = np.where(h > 0.0, dx / np.where(h > 0.0, h, 1.0), vb)
        velocity = va + s * (
            2.0 * (3.0 * slope - 2.0 * va - vb) + 3.0 * s * (va + vb - 2.0 * slope)
        )
        velocity = np.where(h > 0.0, velocity, vb)
        return position, velocity, share


def balance(entries: Floats) -> Floats:
    """Energy (J) that the entries bring to the particles: belt work less both losses."""
    return np.asarray(entries[..., 0] - entries[..., 1] - entries[..., 2])
