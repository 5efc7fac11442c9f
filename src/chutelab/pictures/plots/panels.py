"""The panels of the overlay; each function takes axes, draws one thing and returns the axes.

The analytic parabola of a transfer is made of arcs, which can be drawn and compared with.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil, cos, isfinite, isnan, log10, sin, sqrt
from textwrap import fill, shorten

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from numpy.typing import ArrayLike

from chutelab.pictures.plots import style
from chutelab.pictures.plots.bodies import stream_colours
from chutelab.pictures.plots.scenery import (
    FINE,
    drawn_tracks,
    energies,
    nominal,
    path_of,
    strobe_step,
    strobe_times,
    struck_by_nominal,
    track_times,
    upright,
)
from chutelab.results import Recording
from chutelab.results.comparison import prediction as predicted
from chutelab.results.quantities import each
from chutelab.scene import Scene
from chutelab.theory import Transfer
from chutelab.theory.separation import separation
from chutelab.util.arrays import Floats
from chutelab.util.trig import RADIANS, sin_cos


@dataclass(frozen=True)
class Arc:
    """Free flight between two times, SI units, world frame.

    Attributes
    ----------
    begin, end : float
        s, on the clock that starts at separation.
    position, velocity : tuple of float
        m and m/s, at `begin`.
    gravity : float
        m/s², pointing down.
    """

    begin: float
    end: float
    position: tuple[float, float]
    velocity: tuple[float, float]
    gravity: float

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and velocities, (T, 2) each, at times (T,) since separation."""
        t = np.asarray(times, dtype=np.float64)[:, None] - self.begin
        pull = np.array([0.0, -self.gravity])
        velocity = np.array(self.velocity)
        return np.array(self.position) + t * (velocity + 0.5 * pull * t), velocity + pull * t


ON_BELT = 1e-9
"""m; how near to the belt's height a release counts as lying on the belt."""


def arcs(prediction: Transfer, scene: Scene) -> tuple[Arc, ...]:
    """Return the flights of particle 0 that are known in closed form, in order.

    With a plate they are the flight to it and the one from there to the belt, as far as the
    prediction goes. Without one it is the flight from the pulley down to the outgoing belt, if
    nothing is in the way.
    """
    belt, out, g = scene.incoming, scene.outgoing, scene.gravity
    if belt is None:
        return ()
    riding = belt.pulley_radius + scene.particle.radius
    if scene.plate is None:
        its, v, (sine, cosine) = scene.stream, belt.speed, sin_cos(belt.incline_deg * RADIANS)
        rides = its.fill is None and its.to is None
        if its.at is not None:
            x, y = its.at
            along, above = x * cosine + y * sine, y * cosine - x * sine
            rides &= -belt.length <= along <= 0.0 and abs(above - riding) <= ON_BELT
        carried = rides and its.velocity in (None, (v * cosine, v * sine)) and v > 0
        met = scene.surface or scene.crowded or scene.plates or scene.conveyor
        # Where on the belt it starts matters to one that slips.
        somewhere = sine != 0.0 and belt.friction != "adhesion" and scene.stream.at is not None
        if out is None or met or not g or not carried or somewhere:
            return ()
        left = separation(
            speed=np.array([belt.speed]),
            ride_radius=np.array([riding]),
            gravity=np.array([g]),
            friction=np.array([np.inf if belt.friction == "adhesion" else float(belt.friction)]),
            spin=np.array([scene.particle.spin]),
            inertia=scene.particle.moment or 0.5,
            incline=np.array([np.radians(belt.incline_deg)]),
            ride_length=belt.length,
        )
        sine, cosine, speed = (float(part[0]) for part in (left.sin, left.cos, left.v1))
        fall = riding * cosine - (riding - out.drop)
        # Thrown up slowly, it comes down on the pulley again.
        if fall <= 0.0 or isfinite(left.again[0]):
            return ()
        duration = (sqrt((speed * sine) ** 2 + 2.0 * g * fall) - speed * sine) / g
        legs = [(speed * cosine * duration, fall, duration)]
        if not out.start <= riding * sine + legs[0][0] <= out.start + out.length:
            return ()
    else:
        sine, cosine = sin(prediction.phi1), cos(prediction.phi1)
        # The paper counts x3 back from the plate, and both y downwards.
        legs = [
            (float(prediction.x2), float(prediction.y2), float(prediction.t2)),
            (-float(prediction.x3), float(prediction.y3), float(prediction.t3)),
        ]
    point, begin, found = (riding * sine, riding * cosine), 0.0, []
    for forward, down, duration in legs:
        if not (isfinite(point[0] + forward + down + duration) and duration > 0.0):
            break
        velocity = (forward / duration, 0.5 * g * duration - down / duration)
        found.append(Arc(begin, begin + duration, point, velocity, g))
        point, begin = (point[0] + forward, point[1] - down), begin + duration
    return tuple(found)


def flight(parts: tuple[Arc, ...], times: ArrayLike) -> tuple[Floats, Floats]:
    """Return positions and velocities, (T, 2), NaN off the arcs; at an impact, the state after."""
    times = np.asarray(times, dtype=np.float64)
    position, velocity = np.full((2, len(times), 2), np.nan)
    for arc in parts:
        inside = (times >= arc.begin) & (times <= arc.end)
        position[inside], velocity[inside] = arc.at(times[inside])
    return position, velocity


ROUNDING = 2.0**-52
"""m; the spacing of floating-point numbers at 1 m."""

FLOOR = 1e-17
"""m; the lower end of the residual's axis, where an exact zero is drawn."""


def analytic_of(
    recording: Recording, prediction: Transfer | None = None
) -> tuple[tuple[Arc, ...], float]:
    """Return the arcs known analytically, and the time (s) of the recording at which they begin.

    They are those of the recording's own prediction if none is given.
    """
    left = float(each(recording, "separation.t")[0])
    if isnan(left):
        return (), 0.0
    return arcs(prediction or predicted(recording), recording.scene), left


def draw_tracks(ax: Axes, recording: Recording, *, marks: bool = True) -> Axes:
    """Draw particle 0's track over the others', with strobe dots at round times and impact markers.

    The others' are thin and translucent, each in the colour of its stream. Without `marks` there
    are neither dots nor markers, and particle 0's is one of them if there are others.
    """
    chosen = drawn_tracks(recording)
    alike = not marks and len(chosen) > 1
    chosen = chosen if alike else chosen[1:]
    machine = recording.machine
    colours = stream_colours(len(machine.streams))
    fine = FINE * float(np.ptp(ax.get_xlim()))
    lines = [path_of(recording, i, fine) for i in chosen.tolist()]
    if lines:
        hues = [colours[stream] for stream in machine.releases.stream[chosen]]
        tracks = LineCollection(lines, colors=hues, lw=0.8, alpha=0.35, zorder=3.0)
        tracks.set_gid("stream")
        ax.add_collection(tracks, autolim=False)
    if alike:
        return ax
    path = path_of(recording, 0, fine)
    ax.plot(*path.T, color=style.TRACK, lw=1.6, zorder=5.0, gid="track", label="track")
    if not marks:
        return ax
    dots, _ = nominal(recording, strobe_times(recording))
    said = f"every {strobe_step(recording):g} s"
    ax.plot(*dots.T, **style.RINGS, ms=5.0, zorder=6.0, gid="strobe", label=said)
    struck = struck_by_nominal(recording)["t"]
    if len(struck):
        track = recording.track(0)["t"]
        where, _ = nominal(recording, np.clip(struck, track[0], track[-1]))
        (cross,) = ax.plot(*where.T, "x", color=style.STRIKE, ms=8.0, mew=2.0, zorder=7.0)
        cross.set(gid="impacts", label="impact")
    return ax


def draw_analytic(ax: Axes, parts: tuple[Arc, ...]) -> Axes:
    """Draw the analytic parabola, dashed; draw the track over it."""
    if parts:
        position, _ = flight(parts, _times_of(parts))
        dashed = {**style.DASHED, "gid": "analytic", "label": "analytic parabola"}
        ax.plot(*position.T, **dashed, zorder=4.5)
    return ax


def _times_of(parts: tuple[Arc, ...]) -> Floats:
    return np.unique(np.concatenate([np.linspace(arc.begin, arc.end, 120) for arc in parts]))


def draw_residual(
    ax: Axes, recording: Recording, parts: tuple[Arc, ...], start: float, reason: str = ""
) -> Axes:
    """Draw the distance between simulated and analytic positions of particle 0, on a log scale.

    `parts` and `start` are of `analytic_of`; without arcs the panel says so. `reason` says why
    there is no analytic parabola, or none to the end.
    """
    note = shorten(f"; then {reason}", 95, placeholder=" …") if reason else ""
    style.dress(ax, f"time since separation, s{note}", "distance, m", "Simulated − analytic")
    if not parts:
        ax.set_axis_off()
        why = reason or "particle 0 does not separate from a pulley"
        said = style.plain(fill(f"no analytic parabola; {why}", 60))
        text = ax.text(0.5, 0.5, said, ha="center", va="center")
        text.set(transform=ax.transAxes, fontsize=style.NORMAL, color=style.MUTED)
        return ax
    times = _times_of(parts)
    known, _ = flight(parts, times)
    clock, end = start + times, float(recording.track(0)["t"][-1])
    # A sum may pass the end by rounding, where there is no position any more.
    clock = np.where(np.isclose(clock, end, rtol=1e-12, atol=0.0), end, clock)
    distance = np.hypot(*(nominal(recording, clock)[0] - known).T)
    flying = np.isfinite(distance)
    times, distance = times[flying], distance[flying]
    largest = float(distance.max(initial=0.0))
    ax.set_yscale("log")
    ax.axhline(ROUNDING, color=style.MUTED, lw=1.0, ls=":")
    ax.plot(times, np.maximum(distance, FLOOR), ".", color=style.TRACK, ms=4.0, gid="residual")
    top = max(-14, ceil(log10(30.0 * largest))) if largest > 0.0 else -14
    bottom = round(log10(FLOOR))
    ax.set_ylim(FLOOR, 10.0**top)
    ax.set_yticks([10.0**k for k in range(bottom, top + 1, (top - bottom + 3) // 4)])
    ax.minorticks_off()
    ax.set_xlim(0.0, parts[-1].end)
    title = f"Simulated − analytic: at most {style.scientific(largest, 'm')}"
    ax.set_title(title, fontsize=style.NORMAL, loc="left", fontweight="bold")
    style.note(ax, "dotted: spacing of doubles at 1 m")
    return ax


def draw_velocity(
    ax: Axes, recording: Recording, parts: tuple[Arc, ...] = (), start: float = 0.0
) -> Axes:
    """Draw both velocity components of particle 0 over time, over the analytic ones, dashed."""
    style.dress(ax, "time, s", "velocity, m/s", "Velocity of particle 0")
    times = track_times(recording)
    _, velocity = nominal(recording, times)
    if parts:
        clock = np.union1d(_times_of(parts), np.nextafter([arc.end for arc in parts], 0.0))
        _, known = flight(parts, clock)
    for axis, (name, label) in enumerate((("vx", "forward"), ("vy", "up"))):
        if parts:
            ax.plot(start + clock, known[:, axis], **style.DASHED, gid=f"analytic {name}")
        (line,) = ax.plot(times, velocity[:, axis], color=style.VELOCITY[name], lw=1.6, gid=name)
        line.set_label(f"$v_{name[1]}$, {label}")
    ax.set_xlim(times[0], _beyond(times))
    ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85)
    return ax


def _beyond(times: Floats) -> float:
    """Return a time a little after the end, so that a jump at the end can be seen."""
    return float(times[-1] + (0.04 * (times[-1] - times[0]) or 1e-3))


SHOWN = 1e-9
"""A residual of more than this part of what was put in is no rounding."""


def draw_ledger(ax: Axes, recording: Recording, *, details: bool = True) -> Axes:
    """Draw the energy ledger of all particles over time.

    Kinetic and potential energy and both losses are stacked; energy at release plus belt work is a
    line. The line runs along the top of the stack but for the residual, which the title states:
    always with `details`, and otherwise if it is more than rounding.
    """
    t = recording.knots["t"]
    times = np.linspace(t.min(), t.max(), 240)
    if len(recording.events) <= len(times):
        times = upright(times, recording.events["t"])
    times = np.append(times, _beyond(times))
    books = energies(recording, times)
    supplied = books["start"] + books["belt_work"]
    factor, unit = style.scaled(supplied, "J")
    names = ("kinetic", "potential", "restitution_loss", "friction_loss")
    ax.stackplot(
        times,
        [factor * books[name] for name in names],
        colors=[style.ENERGY[name] for name in names],
        labels=[style.ENERGY_LABEL[name] for name in names],
        linewidth=0.0,
    )
    (line,) = ax.plot(times, factor * supplied, color=style.INK, lw=1.6, gid="supplied")
    line.set(linestyle=(0, (4, 1.5)), label="at release + belt work")
    residual = float(books["residual"][-1])
    title = "Energy ledger"
    if details or abs(residual) > SHOWN * np.abs(supplied).max():
        title += f": residual {style.scientific(residual, 'J')}"
    style.dress(ax, "time, s", f"energy, {unit}", title)
    ax.set_xlim(times[0], times[-1])
    ax.set_ylim(bottom=min(0.0, factor * float(supplied.min())))
    return ax
