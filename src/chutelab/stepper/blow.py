"""The impact of a lone particle, put back to its instant within the step.

Pymunk sees a contact up to a step late, with the disk already inside the surface, and finds the
impulse from velocities half a step old. Here the path is followed back to the touch, and the
impulse is shifted by what the velocities differ there. The law of contact stays pymunk's: only
differences of its inputs enter.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

Vector = tuple[float, float]

ROUNDS = 30
"""Bound of the Newton iterations; from one step away they converge in five."""


@dataclass(frozen=True)
class Capsule:
    """A line from a to b and all within `reach` of it (the disk's radius included), m.

    Before the line, seen along the unit vector `out`, the gap keeps its sign beyond it; a = b and
    out = 0 is a disk.
    """

    a: Vector
    b: Vector
    reach: float
    out: Vector = (0.0, 0.0)

    def nearest(self, x: float, y: float) -> tuple[float, Vector, bool]:
        """Return gap (m), outward normal, and whether the round end is what is nearest."""
        ux, uy = self.b[0] - self.a[0], self.b[1] - self.a[1]
        dx, dy = x - self.a[0], y - self.a[1]
        square, along = ux * ux + uy * uy, dx * ux + dy * uy
        if 0.0 < along < square:
            return dx * self.out[0] + dy * self.out[1] - self.reach, self.out, False
        if along > 0.0:
            dx, dy = x - self.b[0], y - self.b[1]
        distance = hypot(dx, dy)
        if distance == 0.0:
            return -self.reach, (0.0, 1.0), True
        return distance - self.reach, (dx / distance, dy / distance), True


@dataclass(frozen=True)
class Touch:
    """When and how two bodies touched.

    Attributes
    ----------
    back : float
        s before the end of the step.
    normal : tuple of float
        Unit normal towards the particle.
    curvature : float
        1/m, of the partner's outline at the end of the step; 0 on a face.
    """

    back: float
    normal: Vector
    curvature: float


def touch(
    offset: Vector, velocity: Vector, gravity: float, capsule: Capsule, longest: float
) -> Touch | None:
    """Follow a relative flight back to where the gap was zero.

    Parameters
    ----------
    offset, velocity : tuple of float
        Of the particle relative to the partner at the end of the step, m and m/s.
    gravity : float
        Relative acceleration downwards, m/s²: 0 between two flights.
    capsule : Capsule
        The partner.
    longest : float
        s; how far back the flight goes.

    Returns
    -------
    Touch or None
        None if the path does not lead back to a touch: they overlapped from the start, or part.
    """
    back = 0.0
    gap, normal, rounded = capsule.nearest(*offset)
    curvature = 1.0 / capsule.reach if rounded else 0.0
    tolerance = 1e-9 * capsule.reach
    for _ in range(ROUNDS):
        vx, vy = velocity[0], velocity[1] + gravity * back
        closing = -(normal[0] * vx + normal[1] * vy)
        if closing <= 0.0:
            break
        step = -gap / closing
        before, back = back, min(max(back + step, 0.0), longest)
        x = offset[0] - velocity[0] * back
        y = offset[1] - velocity[1] * back - 0.5 * gravity * back * back
        gap, normal, _ = capsule.nearest(x, y)
        if abs(back - before) <= 1e-15 * longest:
            break
    if abs(gap) > tolerance:
        return None
    return Touch(back, normal, curvature)


def shifted_impulse(
    impulse: Vector,
    change_normal: float,
    change_slip: float,
    slip: float,
    masses: Vector,
    restitution: float,
    friction: float,
) -> Vector:
    """Shift an impulse of pymunk's to the velocities at the touch.

    J_n changes by -m (1 + ε) times the change of the normal velocity; where friction held, J_t by
    -m* times the change of the slip, where it slipped, in proportion to J_n.

    Parameters
    ----------
    impulse : tuple of float
        Normal and tangential impulse found, N s.
    change_normal, change_slip : float
        Change of what the solver started from, m/s: the normal change as that part which meets
        (1 + ε), gravity's share included.
    slip : float
        Slip at the touch, m/s.
    masses : tuple of float
        Effective masses m and m*, kg.
    """
    normal = max(impulse[0] - masses[0] * (1.0 + restitution) * change_normal, 0.0)
    bound = friction * normal
    if abs(impulse[1]) < friction * impulse[0] * (1.0 - 1e-9):
        tangential = impulse[1] - masses[1] * change_slip
    else:
        bound = min(bound, masses[1] * abs(slip))
        tangential = impulse[1] * normal / impulse[0]
    return normal, min(max(tangential, -bound), bound)
