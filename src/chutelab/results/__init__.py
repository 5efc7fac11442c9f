"""The results of a run, and everything that is computed from them.

- `record`: `Record`, a finished run: knots, events, and their ledger entries.
- `recorder`: collects a run while an engine writes it.
- `ledger`: the energy ledger, in total and by surface, up to any time.
- `arrival`: arrivals on a surface or on what lies on it; fates of particles.
- `quantities`: the readers of the registry: a run's numbers by name and by particle; the paper's
  symbols; particle 0 beside the theory.
- `stream`: a stream as a whole: flow, fates, steady power, the envelope of its paths.
- `laws`: the laws by which every run is judged.
- `sensors`: passages through lines across a stream; `loads`: loads on surfaces in bins of time;
  `wear`: impacts and sliding on surfaces, piece by piece; `fields`: a crowd as a continuum, on a
  grid.
- `summary`: notes, tables, and the JSON object of ``chutelab run --json``.
- `storage`: recordings as files; `packing`: those of large crowds.

A `Recording` is a record with these readers as its properties and methods. The readers import
`Record`, so that there is no circle of imports, and are imported when they are first needed: most
runs need few of them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numpy.typing import ArrayLike

from chutelab.results.record import Motion, Record
from chutelab.results.rows import ENTRIES, EVENT, KNOT, PARTICLES, REASONS, Kind, balance

if TYPE_CHECKING:
    from chutelab.results.fields import Fields
    from chutelab.results.laws import Broken
    from chutelab.results.ledger import Ledger
    from chutelab.results.loads import Load
    from chutelab.results.wear import Wear
    from chutelab.theory import Transfer
    from chutelab.util.arrays import Floats


__all__ = [
    "ENTRIES", "EVENT", "KNOT", "PARTICLES", "REASONS", "Kind", "Motion", "Record", "Recording",
    "balance",
]  # fmt: skip


class Recording(Record):
    """A finished run: what `simulate` returns, the same type from every engine.

    Its arrays and numbers are those of `results.record.Record`.
    """

    @classmethod
    def of(cls, record: Record) -> Recording:
        """Return a record as a recording; they share their arrays and cached results."""
        recording = object.__new__(cls)
        recording.__dict__.update(record.__dict__)
        return recording

    @property
    def prediction(self) -> Transfer:
        """The theory's prediction for the scene, see `chutelab.theory.predict`."""
        from chutelab.results.quantities import prediction

        return prediction(self)

    @property
    def laws(self) -> tuple[Broken, ...]:
        """The laws that this run breaks, empty if it keeps all; see `results.laws`."""
        from chutelab.results.laws import judge

        return judge(self)

    @property
    def ledger(self) -> Ledger:
        """The energy ledger, in total and by surface; see `results.ledger.Ledger`."""
        from chutelab.results.ledger import ledger

        return ledger(self)

    def energy_at(self, times: ArrayLike) -> dict[str, Floats]:
        """Return the ledger of all particles at times (T,), s; see `results.ledger.energy_at`."""
        from chutelab.results.ledger import energy_at

        return energy_at(self, times)

    def measure(self, quantity: str) -> float:
        """Return a quantity by its name, such as ``landing.x.mean``; see `chutelab.measure`."""
        from chutelab.results.quantities import measure

        return measure(self, quantity)

    def loads(self, surface: str, *, every: float | None = None) -> Load:
        """Return the load on a surface over time, see `results.loads`; needs ``run.loads``."""
        from chutelab.results.loads import loads

        return loads(self, surface, every)

    def wear(
        self,
        surface: str,
        pieces: int = 50,
        *,
        erosion: float | None = None,
        abrasion: float | None = None,
    ) -> Wear:
        """Return the wear of a surface, piece by piece; see `results.wear.worn`."""
        from chutelab.results.wear import worn

        return worn(self, surface, pieces, erosion=erosion, abrasion=abrasion)

    def field(self, begin: float | None = None, end: float | None = None, **options: Any) -> Fields:
        """Return density, velocity, temperature and stress on a grid; see `results.fields`."""
        from chutelab.results.fields import fields

        return fields(self, begin, end, **options)

    def summary(self) -> dict[str, Any]:
        """Return what ``chutelab run --json`` prints; see `results.summary.summary`."""
        from chutelab.results.summary import summary

        return summary(self)

    def save(self, path: str | Path, *, tolerance: float | None = None) -> Path:
        """Write an npz file, whole or not at all; see `results.storage.save`.

        `load` gives the recording back bit for bit; a crowd of 10,000 knots or more within a
        tolerance, in radii: 1e-6 if none is given; 0 keeps all bits.
        """
        from chutelab.results.storage import TOLERANCE, save

        return save(self, path, tolerance=TOLERANCE if tolerance is None else tolerance)

    @classmethod
    def load(cls, path: str | Path) -> Recording:
        """Read what `save` wrote; a `results.storage.RecordingError` says what is wrong."""
        from chutelab.results.storage import load

        return cls.of(load(path))

    def to_csv(
        self,
        folder: str | Path,
        *,
        step: float | None = None,
        only: Collection[str] = ("events", "trajectory"),
        coefficients: Mapping[str, float] | None = None,
    ) -> list[Path]:
        """Write events.csv and trajectory.csv into a folder; see `results.storage.to_csv`."""
        from chutelab.results.storage import to_csv

        return to_csv(self, folder, step=step, only=only, coefficients=coefficients)

    def frame(self, table: str = "trajectory", *, step: float | None = None) -> Any:
        """Return positions over time, or ``"events"``, as a DataFrame; see `storage.frame`."""
        from chutelab.results.storage import frame

        return frame(self, table, step=step)
