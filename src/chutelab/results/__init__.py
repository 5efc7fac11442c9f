"""What an engine leaves behind: knots, events and the books they carry.

- `layout`: names and array types: events, knots, ledger entries.
- `recording`: `Recording`, a finished run.
- `tracks`: where the particles are, and what the books say, between the knots.
"""

from chutelab.results.recording import (
    ENTRIES,
    EVENT,
    KNOT,
    PARTICLES,
    REASONS,
    Floats,
    Ints,
    Kind,
    Recording,
    balance,
)

__all__ = [
    "ENTRIES",
    "EVENT",
    "KNOT",
    "PARTICLES",
    "REASONS",
    "Floats",
    "Ints",
    "Kind",
    "Recording",
    "balance",
]
