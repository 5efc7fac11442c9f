"""The lesson picture: a film of a recording, slowed down, that stops at what matters.

===============  ==================================================================================
`moments`        which moments are shown, for how long each, and what happened, in words
`actors`         what moves: particles, arrows, belts, pulley, and the energy bars
`stage`          where everything is: a background drawn once, and what moves on it
`files`          `animate`: all of it as a GIF in a few fixed colours, or as mp4 or webm; `still`
===============  ==================================================================================
"""

from chutelab.pictures.animation.files import FORMATS, VideoError, animate, need_video, still
from chutelab.pictures.animation.moments import Moment, film
from chutelab.pictures.animation.stage import SHOWS, Stage

__all__ = [
    "FORMATS",
    "SHOWS",
    "Moment",
    "Stage",
    "VideoError",
    "animate",
    "film",
    "need_video",
    "still",
]
