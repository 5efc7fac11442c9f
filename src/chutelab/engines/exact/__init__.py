"""The event-driven engine: particles move on exact arcs, the next event is solved, not stepped.

One round resolves the next event of all particles of a block at once. There is no contact between
particles.

- `obstacles`: faces and circles to meet, and how they join: what goes on where one ends.
- `layout`: a machine's surfaces as these.
- `detect`: the next contact: of flight and slide, and of a ride round a circle.
- `particle_state`: the state of a block of particles, and what it leaves behind.
- `contacts`: what a contact does: blows, rest, grip and slip.
- `motion`: flight, slide, carriage and ride up to the next event.
- `engine`: the rounds, block by block; which machines of a family can run together.
"""

from chutelab.engines.exact.contacts import CornerError
from chutelab.engines.exact.engine import kinds, run

__all__ = ["CornerError", "kinds", "run"]
