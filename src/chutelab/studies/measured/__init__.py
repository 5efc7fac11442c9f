"""Measured tracks over the model: read, compare, fit.

>>> from chutelab import load, measured
>>> film = measured.read("perpendicular-track")
>>> found = measured.fit(load("perpendicular"), film, ["plate.restitution", "incoming.speed"])
>>> [f"{value:.2f}" for value in found.values]
['0.62', '1.90']

- `track`: a `Track`, points with their times, and how they lie in the world (`Placement`).
- `reading`: the files that the video-analysis program Tracker exports, as tracks; the shipped one,
  made from a simulation with noise: its answer is known.
- `residuals`: a track beside the simulation, point by point.
- `parameters`: what can be fitted: any number of the scene, and the placement.
- `fitting`: least squares, with uncertainties; needs ``pip install "chutelab[fit]"``.
- `result`: what a fit found, what makes it less certain than it looks, and its files.
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
