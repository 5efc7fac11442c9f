"""The adhesion ride: along the belt and round the pulley, in closed form."""

from __future__ import annotations

from math import acos, ceil, cos, inf, sin
from typing import TYPE_CHECKING

from pymunk import Vec2d

if TYPE_CHECKING:
    from chutelab.engines.pymunk.world import Track, World
    from chutelab.machine import Machine

ARC = 0.025
"""rad between knots round the pulley: ρ Δφ⁴/384, the curve's error, is 1e-9 of the radius."""


class Carriage:
    """Ride of one particle at the belt's speed, not turning, at the height it is released at.

    Attributes
    ----------
    until : float
        s; separation at cos φ1 = v²/(g ρ), at the top if that is 1 or more; or where another
        surface is met; or the end of the run.
    """

    def __init__(self, machine: Machine, world: World, particle: int) -> None:
        assert machine.pulley is not None
        start = machine.releases
        self.surface = machine.pulley.surface
        self.weight = machine.particle.mass * machine.gravity
        self.t = float(start.t[particle])
        self.x, self.rho = start.position[particle].tolist()
        self.speed = float(start.velocity[particle, 0])
        self.until, self.height = machine.end_time, self.rho
        if self.speed > 0.0:
            cosine = self.speed**2 / (machine.gravity * self.rho) if machine.gravity > 0.0 else inf
            path = max(0.0, -self.x) + self.rho * acos(min(cosine, 1.0))
            path = min(path, self.speed * (self.until - self.t))
            path = self._free(world, machine.particle.radius, path)
            self.until = min(self.t + path / self.speed, self.until)

    def delay(self, t: float) -> None:
        """Start at a later time (s): somebody was in the way."""
        self.until, self.t = self.until + t - self.t, t

    def state(self, t: float) -> tuple[Vec2d, Vec2d]:
        """Return place (m) and velocity (m/s) at a time (s)."""
        return self._at(self.x + self.speed * (t - self.t))

    def _at(self, along: float) -> tuple[Vec2d, Vec2d]:
        if along <= 0.0:
            return Vec2d(along, self.rho), Vec2d(self.speed, 0.0)
        c, s = cos(along / self.rho), sin(along / self.rho)
        return Vec2d(self.rho * s, self.rho * c), Vec2d(self.speed * c, -self.speed * s)

    def times(self) -> list[float]:
        """Return the times of the knots that the track needs after its first."""
        top = self.t - self.x / self.speed if self.speed > 0.0 else inf
        if self.until <= top:
            return [self.until]
        top = max(top, self.t)
        span = self.until - top
        pieces = ceil(span * self.speed / self.rho / ARC)
        return [top, *(top + span * n / pieces for n in range(1, pieces)), self.until]

    def write(self, track: Track, end: float) -> None:
        """Write the knots until a time (s), with what the belt pays: it lets the particle down."""
        for t in (*(t for t in self.times() if t < end), end):
            x, v = self.state(t)
            track.pay(self.surface, self.weight * (x.y - self.height), 0.0, 0.0)
            self.height = x.y
            track.knot(t, x, v, 0.0)

    def _free(self, world: World, radius: float, path: float) -> float:
        """Return how much of a path (m) is free of surfaces other than the own belt."""
        for face in world.faces:
            along = 0.0
            while face.surface != self.surface and along < path:
                x, v = self._at(self.x + along)
                found = face.shape.point_query(x)
                gap = found.distance - radius
                if gap <= world.rounding and v.dot(found.gradient) < 0.0:
                    path = along
                along += max(gap, world.rounding)
        return path
