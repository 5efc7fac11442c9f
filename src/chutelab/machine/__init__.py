"""A scene resolved to world-frame arrays: what both engines take, and all they take.

- `parts`: `Machine`, its segments and its pulley.
- `crossings`: what `chutelab check` says of surfaces that cross.
- `clearance`: releases that overlap a surface.
- `frame`: a place near the machine to count from.
- `family`: machines that differ in numbers only.
- `builder`: `build`, from a validated scene to a machine.
"""

from chutelab.machine.builder import build
from chutelab.machine.family import RefusedError, members
from chutelab.machine.frame import moved, origin
from chutelab.machine.parts import Machine, Pulley, Segments

__all__ = [
    "Machine",
    "Pulley",
    "RefusedError",
    "Segments",
    "build",
    "members",
    "moved",
    "origin",
]
