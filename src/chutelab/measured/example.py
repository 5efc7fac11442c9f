"""A film that was never shot: a simulated track with noise, in the form that Tracker exports.

The shipped track ``perpendicular-track`` is made here: what a fit to it should find is known.
To write it again: ``example.shipped_text()`` is its content, byte for byte.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np

from chutelab.measured.residuals import ends, follow, run
from chutelab.measured.track import Track
from chutelab.scene import load

if TYPE_CHECKING:
    from chutelab.scene import Scene

SCENE: Final = "perpendicular"
TRUTH: Final = {"plate.restitution": 0.62, "incoming.speed": 1.9}
"""What the shipped track was made with; the scene itself says 0.5 and 2 m/s."""

NAME: Final = "simulated_with_noise"
FRAMES: Final = 120.0
"""1/s: slow motion of a common telephone."""

NOISE: Final = 0.001
"""m; how well a ball of 8 mm is marked by hand."""

SEED: Final = 4
BEGIN: Final = 0.4
"""s; the film begins when the particle comes into the picture, a little before the pulley."""


def filmed(
    scene: Scene,
    *,
    frames: float = FRAMES,
    noise: float = NOISE,
    seed: int = SEED,
    begin: float = 0.0,
) -> Track:
    """Return what a camera would see of particle 0, to a tenth of a millimetre.

    Parameters
    ----------
    scene : Scene
        What is filmed, until particle 0 ends.
    frames : float
        Frames per second.
    noise : float
        Standard deviation of each coordinate, m; independent and normal.
    seed : int
        Of the noise.
    begin : float
        s, on the clock of the simulation, which is that of the film.
    """
    recording = run(scene)
    first, last = np.ceil(begin * frames), np.floor(ends(recording)[1] * frames)
    seconds = np.arange(first, last + 1.0) / frames
    errors = noise * np.random.default_rng(seed).standard_normal((len(seconds), 2))
    return Track(
        name=NAME,
        source="<simulated>",
        seconds=seconds,
        points=np.round(follow(recording, seconds) + errors, 4),
        lines=np.arange(len(seconds)) + 3,
    )


def tracker_text(track: Track) -> str:
    """Return a track as Tracker would export it: its name, the columns' names, the points."""
    rows = [
        f"{t:.6f},{x:.4f},{y:.4f}" for t, (x, y) in zip(track.seconds, track.points, strict=True)
    ]
    return "\n".join([track.name, "t,x,y", *rows]) + "\n"


def shipped_text() -> str:
    """Return the content of the shipped track."""
    scene = load(SCENE, [f"{key}={value}" for key, value in TRUTH.items()])
    return tracker_text(filmed(scene, begin=BEGIN))
