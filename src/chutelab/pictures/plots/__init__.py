"""Pictures of recordings: `overlay`, `strobe`, and small functions that take and return `Axes`.

===============  ==================================================================================
`style`          colours, text sizes, units
`sampling`       times and parts of a recording that are worth drawing; energies to stack
`window`         the part of the world in which something happens
`scenery`        the machine to scale, with the names of its surfaces
`analytic`       the analytic parabola as arcs of flight
`panels`         tracks, parabola, residual, velocity, energy ledger
`figure`         the overlay
`strobe`         a still for print: where the particle is at round times
===============  ==================================================================================

Figures are drawn by Agg through `Figure` objects: no pyplot, no global state.
"""

from chutelab.pictures.plots.figure import overlay
from chutelab.pictures.plots.panels import (
    Arc,
    analytic_of,
    arcs,
    draw_analytic,
    draw_ledger,
    draw_residual,
    draw_tracks,
    draw_velocity,
    flight,
)
from chutelab.pictures.plots.scenery import Window, draw_scene, machine_of, window_of
from chutelab.pictures.plots.strobe import strobe

__all__ = [
    "Arc",
    "Window",
    "analytic_of",
    "arcs",
    "draw_analytic",
    "draw_ledger",
    "draw_residual",
    "draw_scene",
    "draw_tracks",
    "draw_velocity",
    "flight",
    "machine_of",
    "overlay",
    "strobe",
    "window_of",
]
