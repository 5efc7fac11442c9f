"""What a run leaves behind, and how it is read.

- `recording`: `Recording`, a finished run: knots, events, and the ledger entries they carry.
- `recorder`: what engines write a run into.
- `ledger`: where the energy went, in total and by surface.
- `quantities`: the one reader of a run's numbers, by name and by particle.
- `arrival`: which particles have come to a surface, or to what lies on it.
- `stream`: a stream as a whole: the envelope of its paths.
- `comparison`: `compare`, particle 0 against the theory.
- `report`: what a run leaves to read, as tables.
- `laws`: what every run is judged by, with `evidence`, `surfaces` and `barriers`.
- `summary`: all of it as the JSON object of ``chutelab run --json``.
- `storage`: recordings as files.
"""

from chutelab.results.recording import (
    ENTRIES,
    EVENT,
    KNOT,
    PARTICLES,
    REASONS,
    Kind,
    Motion,
    Recording,
    balance,
)

__all__ = [
    "ENTRIES",
    "EVENT",
    "KNOT",
    "PARTICLES",
    "REASONS",
    "Kind",
    "Motion",
    "Recording",
    "balance",
]
