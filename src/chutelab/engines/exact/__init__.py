"""The event-driven engine: particles move on exact arcs, the next event is solved, not stepped.

It is in C, in `chutelab.core` (exact.c and its files), and shares nothing with the contact
engine's; `engine` has `run`, from a machine to a recording. There is no contact between particles.
"""

from chutelab.engines.exact.engine import ROUNDS, CornerError, run

__all__ = ["ROUNDS", "CornerError", "run"]
