"""What a run leaves behind, and how it is read.

- `record`: `Record`, a finished run: knots, events, and the ledger entries they carry.
- `recording`: `Recording`, the same with all that is read off it, for those who use it.
- `recorder`: what engines write a run into.
- `ledger`: where the energy went, in total and by surface.
- `quantities`: the readers of the registry: a run's numbers by name and by particle.
- `firsts`: the first events of each particle, and the paper's symbols from them.
- `notes`: what there is to say of a run, such as that particles got stuck.
- `arrival`: which particles have come to a surface, or to what lies on it.
- `stream`: a stream as a whole: the envelope of its paths.
- `comparison`: `compare`, particle 0 against the theory.
- `report`: what a run leaves to read, as tables.
- `laws`: what every run is judged by, with `evidence`, `surfaces` and `barriers`.
- `summary`: all of it as the JSON object of ``chutelab run --json``.
- `storage`: recordings as files.
"""

from chutelab.results.record import (
    ENTRIES,
    EVENT,
    KNOT,
    PARTICLES,
    REASONS,
    Kind,
    Motion,
    Record,
    balance,
)
from chutelab.results.recording import Recording

__all__ = [
    "ENTRIES",
    "EVENT",
    "KNOT",
    "PARTICLES",
    "REASONS",
    "Kind",
    "Motion",
    "Record",
    "Recording",
    "balance",
]
