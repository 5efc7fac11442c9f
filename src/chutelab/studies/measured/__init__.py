"""Measured tracks over the model: read, compare, fit.

>>> from chutelab import load, measured
>>> film = measured.read("perpendicular-track")
>>> found = measured.fit(load("perpendicular"), film, ["plate.restitution", "incoming.speed"])
>>> [f"{value:.2f}" for value in found.values]
['0.62', '1.90']

- `track`: a `Track`, points with their times, how they lie in the world (`Placement`), and how far
  off the simulation (`Residuals`).
- `reading`: the files that the video-analysis program Tracker exports, as tracks; the shipped one
  was made from a simulation with noise, so that its answer is known.
- `fitting`: what can be fitted, and least squares, with uncertainties; needs
  ``pip install "chutelab[fit]"``.
- `result`: what a fit found, what makes it less certain than it looks, and its files.
"""

from chutelab.studies.measured.fitting import fit
from chutelab.studies.measured.reading import find, read
from chutelab.studies.measured.result import Fit
from chutelab.studies.measured.track import MeasuredError, Placement, Residuals, Track, residuals

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
