"""What all blocks of an exact run share: the machine, and where it is counted from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Self

from chutelab.exact.layout import obstacles
from chutelab.machine import origin

if TYPE_CHECKING:
    from chutelab.exact.obstacles import Obstacles
    from chutelab.machine import Machine
    from chutelab.many import Value


@dataclass(eq=False)
class World:
    """What all blocks share.

    Attributes
    ----------
    machine : Machine
        What is run.
    origin : tuple of float
        World point from which the engine counts positions, m.
    obstacles : Obstacles
        Its surfaces, from there.
    """

    machine: Machine
    origin: tuple[float, float]
    obstacles: Obstacles

    @classmethod
    def of(cls, machine: Machine) -> Self:
        """Resolve a machine."""
        place = origin(machine)
        return cls(machine, place, obstacles(machine, place))

    @cached_property
    def exit_box(self) -> tuple[Value, Value, Value, Value]:
        """Left, right, bottom and top of `Machine.exit_box`, from the origin, m."""
        left, right, bottom, top = self.machine.exit_box
        x, y = self.origin
        return left - x, right - x, bottom - y, top - y
