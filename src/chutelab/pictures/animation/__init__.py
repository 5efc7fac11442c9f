"""The lesson picture: a film of a recording, slowed down, that stops at what matters.

===============  ==================================================================================
`moments`        which moments are shown, and for how long each
`words`          what happened, and what goes on, in words
`layout`         where everything is in the picture, and which part of the world it shows
`arrows`         the velocity with its components
`actors`         what moves in the scene: particles, belts, pulley
`bars`           the energy ledger as two stacked bars that always add up
`lettering`      numbers that change with every frame, set from characters drawn once
`stage`          the picture: a background drawn once, and what moves on it
`palette`        the colours of every film
`gif`            the file as a GIF, of each frame only what changed
`video`          the file as mp4 or webm
`lesson`         `animate`, all of it together
===============  ==================================================================================
"""

from chutelab.pictures.animation.film import FORMATS, VideoError, animate, need_video
from chutelab.pictures.animation.moments import Moment, film
from chutelab.pictures.animation.stage import SHOWS, Stage

__all__ = ["FORMATS", "SHOWS", "Moment", "Stage", "VideoError", "animate", "film", "need_video"]
