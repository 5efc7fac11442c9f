"""The event-driven engine: particles move on exact arcs, the next event is solved, not stepped.

One round resolves the next event of all particles at once. There is no contact between particles.

- `obstacles`: faces and circles to meet.
- `layout`: a machine's surfaces as obstacles, and how they join.
- `detect`: the first contact of particles with constant acceleration.
- `arcs`: what stops a ride round a circle.
- `swarm`: the state of all particles, and how knots, events and books are written.
- `corner`: rest between two obstacles.
- `touch`: what a contact does: blows, rest, grip and slip.
- `round`, `straight`: the two kinds of motion.
- `engine`: the rounds.
"""

from chutelab.exact.corner import CornerError
from chutelab.exact.engine import run

__all__ = ["CornerError", "run"]
