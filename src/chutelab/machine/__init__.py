"""A scene resolved to world-frame arrays, the only input of the engines.

- `parts`: `Machine`, its particle and its pulley; places and speeds of moving surfaces.
- `shapes`: straight and bent pieces of surfaces: nearest point, gap, ends, box, path to draw.
- `releases`: where, when and how fast each particle starts.
- `builder`: `build`, from a validated scene, as rows of numbers, to a machine; `ahead`, to one that
  the core builds as it runs.
"""

from chutelab.machine.builder import PASSES, VISCOSITY, ahead, build, chooses, hand_over
from chutelab.machine.parts import (
    DRIVE_PULLEY,
    SWING,
    Caution,
    Joint,
    Machine,
    Mover,
    Particle,
    Pulley,
    pace_of,
)
from chutelab.machine.releases import RefusedError
from chutelab.machine.shapes import Arcs, Pieces, Segments, apart, placed

__all__ = [
    "DRIVE_PULLEY", "PASSES", "SWING", "VISCOSITY", "Arcs", "Caution", "Joint", "Machine", "Mover",
    "Particle", "Pieces", "Pulley", "RefusedError", "Segments", "ahead", "apart", "build",
    "chooses", "hand_over", "pace_of", "placed",
]  # fmt: skip
