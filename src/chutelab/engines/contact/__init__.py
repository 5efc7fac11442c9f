"""Particles that meet: impacts at their own instants, lasting contacts by contact dynamics.

The engine itself is in C, in `chutelab.core`; `engine` has `run`, from a machine to a recording.
"""

from chutelab.engines.contact.engine import run

__all__ = ["run"]
