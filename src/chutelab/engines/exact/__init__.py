"""The event-driven engine: particles move on exact arcs, the next event is solved, not stepped.

One round resolves the next event of all particles of a block at once. There is no contact between
particles.

- `obstacles`: faces and circles to meet.
- `layout`: a machine's surfaces as obstacles, and how they join.
- `motion`, `detect`, `circles`: the first contact of particles with constant acceleration.
- `arcs`: what stops a ride round a circle.
- `world`, `swarm`: what all blocks of particles share, and the state of one.
- `journal`: what they leave behind: knots, events, bookings.
- `corner`: rest between two obstacles.
- `touch`, `grip`: what a contact does: blows and rest, grip and slip.
- `round`, `straight`: the two kinds of motion.
- `engine`: the rounds, block by block.
- `alike`: which machines of a family can run together.
"""

from chutelab.engines.exact.contacts import CornerError
from chutelab.engines.exact.engine import kinds, run

__all__ = ["CornerError", "kinds", "run"]
