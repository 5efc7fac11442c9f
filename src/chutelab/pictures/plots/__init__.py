"""Pictures of recordings: `overlay`, `strobe`, and small functions that take and return `Axes`.

===============  ==================================================================================
`style`          light or dark colours, language, text sizes, units; a figure that shows itself
`scenery`        what of a recording is worth drawing: particles, times, part of the world
`machinery`      machine and particles to scale, with names
`panels`         tracks, parabola, velocity, ledger; envelope, arrivals, flow, power, losses
`figure`         the overlay, a still for print, the velocity at an impact, the paper's figures
`studies`        searches, uncertainty, sweeps, measured points, run time against error
===============  ==================================================================================

Figures are drawn by Agg through `Figure` objects: no pyplot, no global state.
"""

from chutelab.pictures.plots.figure import overlay, strobe
from chutelab.pictures.plots.machinery import draw_scene
from chutelab.pictures.plots.panels import (
    Arc,
    analytic_of,
    arcs,
    draw_analytic,
    draw_arrivals,
    draw_envelope,
    draw_flow,
    draw_ledger,
    draw_losses,
    draw_power,
    draw_residual,
    draw_tracks,
    draw_velocity,
    flight,
)
from chutelab.pictures.plots.scenery import Window, window_of
from chutelab.pictures.plots.style import look

__all__ = [
    "Arc",
    "Window",
    "analytic_of",
    "arcs",
    "draw_analytic",
    "draw_arrivals",
    "draw_envelope",
    "draw_flow",
    "draw_ledger",
    "draw_losses",
    "draw_power",
    "draw_residual",
    "draw_scene",
    "draw_tracks",
    "draw_velocity",
    "flight",
    "look",
    "overlay",
    "strobe",
    "window_of",
]
