"""The pymunk engine: real contacts, friction, spin and pile-ups, stepped headless.

Between impulses every particle moves on a parabola, and there are two kinds of impulse. An *impact*
happens at its own instant: `forecast` finds it (with `outline` against solids, `meetings` between
particles), `impacts` resolves it, `clash` has pymunk's solver work out that one pair. A *contact*
that lasts gets its impulse once a step: `kick` steps what touches in one Space, `books` notes what
that did, `entries` what the ledger gets, `curves` leads round the pulley what would fly off a
straight step. Contacts in which nothing new happens are not even stepped (`idle`), and impacts that
are too many to be resolved one by one are left to the steps (`crowd`).

`solids` gives the surfaces the thickness a stepped contact needs, `world` is that Space, `carriage`
the ride by adhesion in closed form, `tracks` keeps paths and writes knots, `stays` knows who lies
on what, `state` is what these share, `engine` is the loop.

With ``run.align = false`` nothing is foretold: everything is in the Space and every step lasts dt,
the way physics engines are mostly used; impacts are seen late, and what is fast passes through.

Limits: lasting contacts are as exact as a step; bounces shorter than two steps count as rest; what
a particle meets after many impacts within one step is left to that step.
"""

from chutelab.stepper.engine import run
from chutelab.stepper.solids import HALF_THICKNESS

__all__ = ["HALF_THICKNESS", "run"]
