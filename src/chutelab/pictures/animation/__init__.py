"""The lesson picture: a film of a recording, slowed down, that stops at what matters.

===============  ==================================================================================
`moments`        which moments are shown, for how long each, and what happened, in words
`actors`         what moves: particles, arrows, belts, pulley, and the energy bars
`stage`          the picture, `animate`: GIF, mp4 or webm, and `still`
===============  ==================================================================================
"""

from chutelab.pictures.animation.moments import Moment, film
from chutelab.pictures.animation.stage import (
    FORMATS,
    SHOWS,
    Stage,
    VideoError,
    animate,
    need_video,
    still,
)

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
