"""A run as SVG, and its numbers as a table: text, which a browser draws faster than an image.

Lines take the page's own text colour, so the picture is right on light and dark pages.
"""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from math import degrees, isfinite, nan

import numpy as np

from chutelab.machine import Machine
from chutelab.pictures import BLUE, GREY, VERMILION
from chutelab.results import Kind, Recording
from chutelab.results.quantities import observed
from chutelab.util.arrays import Floats
from chutelab.util.tables import Sheet

TRACK, GHOST, STRIKE = BLUE, GREY, VERMILION
"""The track, the one before, and places of impacts."""

WIDTH, TALLEST = 660, 460
"""Pixels of the picture, across and at most in height."""

SAMPLES = 160
"""Points of a drawn track, evenly in time; its knots are added."""

STROBE = 0.05
"""s between two dots."""

MOST_KNOTS = 600
"""Knots at which a track is drawn as well, so that its corners are sharp."""

BEFORE = 0.35
"""m of belt before the pulley's axis that are shown."""

ROWS = (
    ("phi1", "leaves the pulley at φ1", "°"),
    ("v2", "speed at the plate", "m/s"),
    ("v2r", "speed after the plate", "m/s"),
    ("vx", "forward velocity at the landing", "m/s"),
    ("x", "lands at x", "m"),
    ("belt_work", "work of the outgoing belt", "mJ"),
    ("slip_heat", "of which heat", "mJ"),
)
"""What the table says of particle 0: key, words, unit."""


UNSHOWN = "a live picture cannot show this; `chutelab run --out` draws it"
"""What is said of a scene that is not plain."""


@dataclass(frozen=True)
class View:
    """The part of the world that is shown, m."""

    left: float
    right: float
    bottom: float
    top: float

    @property
    def scale(self) -> float:
        """Pixels per metre."""
        return min(WIDTH / (self.right - self.left), TALLEST / (self.top - self.bottom))

    def pixels(self, points: Floats) -> Floats:
        """Return points, (..., 2) in m, as pixels from the top left corner."""
        return (points - (self.left, self.top)) * (self.scale, -self.scale)

    def joined(self, other: View) -> View:
        """Return the smallest view that holds both."""
        return View(
            min(self.left, other.left),
            max(self.right, other.right),
            min(self.bottom, other.bottom),
            max(self.top, other.top),
        )

    def within(self, other: View) -> View:
        """Return the part of this view that lies in another."""
        return View(
            max(self.left, other.left),
            min(self.right, other.right),
            max(self.bottom, other.bottom),
            min(self.top, other.top),
        )

    def padded(self, share: float) -> View:
        """Return a view larger by a share of its larger side, all round."""
        by = share * max(self.right - self.left, self.top - self.bottom)
        return View(self.left - by, self.right + by, self.bottom - by, self.top + by)


def view_of(recording: Recording) -> View:
    """Return a view of particle 0's track, the pulley and the plate's pivot."""
    scene = recording.scene
    track = recording.track(0)["position"]
    points = [track[track[:, 0] >= -BEFORE]] if scene.incoming is not None else [track]
    if scene.incoming is not None:
        radius = scene.incoming.pulley_radius
        points.append(np.array([[-max(BEFORE, radius), radius], [radius, -radius]]))
    if scene.plate is not None and scene.incoming is not None:
        points.append(
            np.array([[scene.incoming.pulley_radius + scene.plate.distance, track[0, 1]]])
        )
    corners = np.concatenate(points)
    (left, bottom), (right, top) = corners.min(axis=0), corners.max(axis=0)
    return View(float(left), float(right), float(bottom), float(top)).padded(0.08)


def tracks(recording: Recording) -> list[Floats]:
    """Return the points of the tracks to draw, (P, 2) each; the first is particle 0's."""
    knots = recording.knots["t"]
    times = np.union1d(np.linspace(knots.min(), knots.max(), SAMPLES), knots[:MOST_KNOTS])
    position = recording.at(times)[0]
    paths = (position[:, particle] for particle in range(recording.count))
    return [path[np.isfinite(path[:, 0])] for path in paths]


def draw(recording: Recording, view: View, before: list[Floats]) -> str:
    """Return the picture of a run as SVG.

    Parameters
    ----------
    recording : Recording
        The run.
    view : View
        What to show.
    before : list of ndarray, (P, 2)
        Tracks of the setting before, for comparison; m.
    """
    height = round(view.scale * (view.top - view.bottom))
    width = round(view.scale * (view.right - view.left))
    parts = [_line(view, points, GHOST, 1.5, dash="4 4") for points in before[:1]]
    parts += _machine(view, recording.machine)
    paths = tracks(recording)
    parts += [_line(view, points, TRACK, 1.0, opacity=0.35) for points in paths[1:]]
    parts += [_line(view, points, TRACK, 2.5) for points in paths[:1]]
    parts += _dots(view, recording)
    title = escape(f"{recording.title}: the track of the particle, and dots every {STROBE} s")
    return (
        f'<svg role="img" aria-label="{title}" width="{width}" height="{height}"'
        f' viewBox="0 0 {width} {height}" style="max-width:100%;height:auto">'
        f"{''.join(parts)}</svg>"
    )


def numbers(recording: Recording) -> dict[str, float]:
    """Return what the table shows, in its units; NaN where there is nothing to tell.

    Work and heat are counted until nothing slips, as `chutelab.theory` does: m* v_b and m*/2 times
    the slip at the landing, with m* = m/3 for a free disk.
    """
    scene, seen = recording.scene, observed(recording)
    found = {
        "phi1": degrees(seen["phi1"]),
        "v2": seen["v2"],
        "v2r": seen["v2r"],
        **dict.fromkeys(("vx", "x", "belt_work", "slip_heat"), nan),
    }
    landed = recording.select(Kind.LANDING)
    landed = landed[landed["particle"] == 0]
    if scene.outgoing is not None and len(landed):
        vx, particle = float(landed["velocity_before"][0, 0]), recording.particle
        slip = scene.outgoing.speed - vx - particle.radius * float(landed["omega_before"][0])
        carried = particle.mass / 3.0 if particle.inertia > 0.0 else particle.mass
        found["vx"], found["x"] = vx, float(landed["position"][0, 0])
        found["belt_work"] = 1000.0 * carried * scene.outgoing.speed * slip
        found["slip_heat"] = 500.0 * carried * slip**2
    return found


def table(found: dict[str, float]) -> Sheet:
    """Return the numbers of particle 0 as a table; without those that are not there."""
    rows = [
        (words, f"{found[key]:.3g}\N{NO-BREAK SPACE}{unit}")
        for key, words, unit in ROWS
        if isfinite(found[key])
    ]
    return Sheet("", ("", ""), tuple(rows))


def _machine(view: View, machine: Machine) -> list[str]:
    segments = machine.segments
    parts = [
        _line(view, np.array(ends), "currentColor", 3.0)
        for ends in zip(segments.start, segments.end, strict=True)
    ]
    if machine.pulley is not None:
        x, y = view.pixels(np.zeros(2))
        radius = machine.pulley.radius * view.scale
        parts.append(
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="none"'
            ' stroke="currentColor" stroke-width="2"/>'
            f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="currentColor"/>'
        )
    return parts


def _dots(view: View, recording: Recording) -> list[str]:
    times = recording.track(0)["t"]
    position = recording.at(np.arange(times[0], times[-1], STROBE))[0][:, 0]
    radius = max(2.5, recording.particle.radius * view.scale)
    dots = [(*point, radius, TRACK) for point in view.pixels(position)]
    own = recording.events[recording.events["particle"] == 0]
    struck = own[own["normal_impulse"] > 0.0]["position"][:20]
    dots += [(*point, radius + 2.0, STRIKE) for point in view.pixels(struck)]
    return [
        f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{size:.1f}" fill="none" stroke="{colour}"'
        ' stroke-width="2"/>'
        for x, y, size, colour in dots
    ]


def _line(
    view: View,
    points: Floats,
    colour: str,
    width: float,
    *,
    opacity: float = 1.0,
    dash: str = "none",
) -> str:
    path = " ".join(f"{x:.1f},{y:.1f}" for x, y in view.pixels(points).tolist())
    return (
        f'<polyline points="{path}" fill="none" stroke="{colour}" stroke-width="{width}"'
        f' stroke-opacity="{opacity}" stroke-dasharray="{dash}" stroke-linejoin="round"/>'
    )
