"""A scene resolved to world-frame arrays: what the engines take, and all they take.

- `parts`: `Machine`, its particle, segments and pulley.
- `releases`: where, when and how fast each particle starts.
- `rows`: a scene as one row of numbers, of which the core lays the surfaces.
- `builder`: `build`, from a validated scene to a machine.
"""

from chutelab.machine.builder import build
from chutelab.machine.parts import (
    DRIVE_PULLEY,
    Arcs,
    Caution,
    Machine,
    Particle,
    Pulley,
    Segments,
    Thread,
    moved,
    origin,
)
from chutelab.machine.releases import RefusedError

__all__ = [
    "DRIVE_PULLEY",
    "Arcs",
    "Caution",
    "Machine",
    "Particle",
    "Pulley",
    "RefusedError",
    "Segments",
    "Thread",
    "build",
    "moved",
    "origin",
]
