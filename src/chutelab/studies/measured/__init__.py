"""Measured tracks over the model: read, compare, fit.

>>> from chutelab import load, measured
>>> film = measured.read("perpendicular-track")
>>> found = measured.fit(load("perpendicular"), film, ["plate.restitution", "incoming.speed"])
>>> [f"{value:.2f}" for value in found.values]
['0.62', '1.90']

- `track`: a `Track`, points with their times, and how they lie in the world (`Placement`).
- `text`: the bytes of a file as lines of cells: encodings, separators, decimal marks.
- `reading`: the files that the video-analysis program Tracker exports, as tracks.
- `residuals`: a track beside the simulation, point by point.
- `parameters`: what can be fitted: any number of the scene, and the placement.
- `jacobian`: how the points move with the parameters, and what they cannot tell.
- `problem`: both as a function whose values least squares makes small.
- `fitting`: least squares, with uncertainties; needs ``pip install "chutelab[fit]"``.
- `result`, `diagnosis`: what a fit found, and what makes it less certain than it looks.
- `files`: a comparison as JSON and as a table of points.
- `example`: the track that is shipped, made from a simulation with noise: its answer is known.
"""

from chutelab.studies.measured.fitting import fit
from chutelab.studies.measured.reading import find, read
from chutelab.studies.measured.residuals import Residuals, residuals
from chutelab.studies.measured.result import Fit
from chutelab.studies.measured.track import MeasuredError, Placement, Track

__all__ = [
    "Fit",
    "MeasuredError",
    "Placement",
    "Residuals",
    "Track",
    "find",
    "fit",
    "read",
    "residuals",
]
