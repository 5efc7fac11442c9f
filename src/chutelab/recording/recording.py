"""`Recording`: a finished run.

A particle's track is a list of *knots*; between two knots it is the cubic Hermite curve through
them. With exact end velocities that curve is the parabola of free flight, so a flight costs two
knots however long it lasts. An impact is two knots at one time.
"""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from chutelab.recording.layout import REASONS, Kind
from chutelab.recording.tracks import COLUMNS, blocks, energies, hermite
from chutelab.sheet import Sheet, Shown

if TYPE_CHECKING:
    from collections.abc import Callable, Collection
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from chutelab.recording.layout import Floats, Ints, Particle


class _Text:
    """A text field that may be given as a function, which is called when the text is asked for."""

    def __set_name__(self, owner: type, name: str) -> None:
        self.key = f"_{name}"

    def __get__(self, instance: object | None, owner: type) -> str:
        if instance is None:
            # So that the field has no default.
            raise AttributeError(self.key)
        text: str | Callable[[], str] = vars(instance)[self.key]
        if not isinstance(text, str):
            vars(instance)[self.key] = text = text()
        return text

    def __set__(self, instance: object, value: str | Callable[[], str]) -> None:
        vars(instance)[self.key] = value


@dataclass(frozen=True, eq=False, repr=False)
class Recording(Shown):
    """A finished run: read-only arrays, the same type from every engine.

    Attributes
    ----------
    scene : str
        The scene in canonical JSON, as `Scene.model_dump_json` writes it; an engine may give a
        function instead, so that it is written only when somebody asks.
    title, engine : str
        The scene's title; ``"exact"``, ``"contact"`` or ``"pymunk"``.
    particle : Particle
        Radius, mass and inertia.
    gravity : float
        m/s².
    surfaces : tuple of str
        Names that `events["surface"]` indexes; the last is always ``"particles"``.
    knots : ndarray, shape (K,), dtype `KNOT`
        All tracks, one after the other.
    offsets : ndarray, shape (N + 1,)
        Particle i owns ``knots[offsets[i]:offsets[i + 1]]``: two or more, in the order of time, or
        none if it was never released.
    ended : ndarray, shape (N,)
        Indices into `REASONS`.
    events : ndarray, shape (E,), dtype `EVENT`
        Sorted by time; at one time by particle, and of one particle as they came.
    by_surface : ndarray, shape (len(surfaces), 3)
        Ledger entries (J) of each surface, summed over particles. Of a family of machines (see
        `chutelab.exact.run`), and of none else, those of each particle, (N, len(surfaces), 3).
    steps : int
        Rounds (exact) or steps (contact, pymunk) taken.
    contacts : int
        Impacts and collisions resolved.
    seconds : float
        Wall time from the validated scene to the recording.
    """

    if TYPE_CHECKING:
        scene: str
    else:
        scene: _Text = _Text()
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

    def sheet(self) -> Sheet:
        """Return what it holds, in a few lines."""
        first, last = self.ends()
        happened = sorted(Counter(self.events["kind"].tolist()).items())
        ended = sorted(Counter(self.ended.tolist()).items())
        told = {
            "engine": self.engine,
            "particles": f"{self.count:,}",
            "time": f"{first['t'].min():.6g} to {last['t'].max():.6g} s" if len(first) else "none",
            "events": ", ".join(f"{n:,} {Kind(k).name.lower()}" for k, n in happened),
            "ended": ", ".join(f"{n:,} {REASONS[k]}" for k, n in ended),
            "knots": f"{len(self.knots):,}",
            "run time": f"{self.seconds:.3g} s",
        }
        return Sheet(self.title, ("", ""), tuple(told.items()), texts=2)

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
        """Return the events of the given kinds (all if none is given), sorted by time.

        With `surface`, those on that surface only: none if the scene has none of that name.
        """
        keep = np.ones(len(self.events), dtype=bool)
        if kinds:
            keep &= np.isin(self.events["kind"], [int(kind) for kind in kinds])
        if surface is not None:
            # Events on no surface have index -1, as unknown names do.
            keep &= (self.events["surface"] == self.surface_index(surface)) & (
                surface in self.surfaces
            )
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
            s, in any order.

        Returns
        -------
        position, velocity : ndarray, shape (T, N, 2)
            NaN before a particle's release and after its end; at an impact the state after it.
        """
        times = np.atleast_1d(np.asarray(times, dtype=np.float64))
        position, velocity = np.full((2, len(times), self.count, 2), np.nan)
        for cells in blocks(self.knots, self.offsets, times):
            for axis in (0, 1):
                where, pace = hermite(self.knots, cells, axis)
                position[cells.row, cells.particle, axis] = where
                velocity[cells.row, cells.particle, axis] = pace
        return position, velocity

    def energy_at(self, times: ArrayLike) -> dict[str, Floats]:
        """Return the energy ledger of all released particles up to each time.

        The books are right at any time, not only at knots: between two of them the belt work, the
        friction loss or the residual follows the energy of the particle, see
        `chutelab.recording.tracks.energies`. A particle that has ended keeps its last state.

        Parameters
        ----------
        times : array_like, shape (T,)
            s, in any order.

        Returns
        -------
        dict of ndarray, shape (T,)
            ``kinetic``, ``potential`` (y = 0 is the zero), the three `ENTRIES`, and ``residual``:
            what the balance since each release leaves over. J.
        """
        times = np.atleast_1d(np.asarray(times, dtype=np.float64))
        values = energies(self.knots, self.offsets, times, self.particle, self.gravity)
        return dict(zip(COLUMNS, values, strict=True))

    def energies(self, knots: NDArray[Any]) -> tuple[Floats, Floats]:
        """Return kinetic (rotation included) and potential energy (J) of knots of any shape."""
        velocity = knots["velocity"]
        kinetic = self.particle.kinetic(velocity[..., 0], velocity[..., 1], knots["omega"])
        return kinetic, self.particle.mass * self.gravity * knots["position"][..., 1]
