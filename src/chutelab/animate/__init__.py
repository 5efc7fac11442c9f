"""The lesson picture: a GIF of a recording, slowed down, that stops at what matters.

===============  ==================================================================================
`moments`        which moments are shown, and for how long each
`words`          what happened, in words
`bars`           the energy ledger as two stacked bars that always add up
`actors`         what moves in the scene: particles, belts, pulley
`stage`          the picture: a cached background, and the artists that move on it
`gif`            one shared palette, and the file, written whole or not at all
===============  ==================================================================================
"""

from chutelab.animate.gif import animate
from chutelab.animate.moments import Moment, film
from chutelab.animate.stage import Stage

__all__ = ["Moment", "Stage", "animate", "film"]
