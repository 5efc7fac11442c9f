"""A scene resolved to world-frame arrays: what both engines take, and all they take.

- `parts`: `Machine`, its segments and its pulley.
- `crossings`: what `chutelab check` says of surfaces that cross.
- `clearance`: releases that overlap a surface.
- `frame`: a place near the machine to count from.
- `family`: machines that differ in numbers only.
- `builder`: `build`, from a validated scene to a machine.
"""

from chutelab.machine.builder import RefusedError, build, members
from chutelab.machine.parts import Machine, Particle, Pulley, Segments, moved, origin

__all__ = [
    "Machine",
    "Particle",
    "Pulley",
    "RefusedError",
    "Segments",
    "build",
    "members",
    "moved",
    "origin",
]
