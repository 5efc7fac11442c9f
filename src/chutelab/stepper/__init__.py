"""The pymunk engine: real contacts, friction, spin and pile-ups, stepped headless.

`solids` gives the surfaces the thickness a stepped engine needs, `world` is the only module that
talks to pymunk, `carriage` is the ride by adhesion in closed form, `tracks` keeps what every
particle is doing and writes its knots, `blow` and `strike` resolve the impact of a lone particle at
its very instant, `books` accounts for all other contacts, `state` is what these share, `engine` is
the loop.

Between contacts a flight is known in closed form from its last knot, and nothing is read from
pymunk. Limits: the step is fixed, so a particle with v dt > r + `HALF_THICKNESS` may pass through a
surface; bounces shorter than two steps count as rest; contacts that several bodies have within one
step are resolved together, at its end.
"""

from chutelab.stepper.engine import run
from chutelab.stepper.solids import HALF_THICKNESS

__all__ = ["HALF_THICKNESS", "run"]
