"""Families of machines: which of them cannot be built, and some of them as a family."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from chutelab.many import of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from chutelab.machine.parts import Machine


class RefusedError(ValueError):
    """Some scenes of a family that contradict themselves.

    Parameters
    ----------
    reasons : mapping of int to str
        What is wrong, by their numbers; "" if only building one by itself can tell.
    """

    def __init__(self, reasons: Mapping[int, str]) -> None:
        super().__init__(f"{len(reasons)} scenes of the family cannot be built")
        self.reasons = dict(reasons)


def members(machine: Machine, places: NDArray[np.int64]) -> Machine:
    """Return some members of a family of machines, as a family."""
    segments, start, pulley = machine.segments, machine.releases, machine.pulley
    own = ("start", "tangent", "length", "speed", "restitution", "friction")
    particle, wheel = machine.particle, ("radius", "speed", "friction", "restitution")
    return replace(
        machine,
        gravity=of(machine.gravity, places),
        particle=replace(
            particle, **{name: of(value, places) for name, value in vars(particle).items()}
        ),
        segments=replace(
            segments, **{name: np.take(getattr(segments, name), places, axis=0) for name in own}
        ),
        pulley=pulley
        and replace(pulley, **{name: of(getattr(pulley, name), places) for name in wheel}),
        releases=replace(start, **{name: value[places] for name, value in vars(start).items()}),
        end_time=of(machine.end_time, places),
    )
