"""Panels of figures; each function takes axes, draws one thing and returns the axes.

Of particle 0: tracks, velocity, the analytic parabola (made of arcs) and the distance from it. Of a
crowd: the envelope of its paths, arrivals, flow and belt power. Of the run: energies and losses.
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
from chutelab.pictures.plots.scenery import (
    FINE,
    drawn_tracks,
    energies,
    flow,
    nominal,
    paid_by,
    path_of,
    strobe_step,
    strobe_times,
    struck_by_nominal,
    track_times,
    upright,
)
from chutelab.pictures.plots.style import figures, named, say, spoken, stream_colours
from chutelab.results import Recording
from chutelab.results.arrival import arrivals
from chutelab.results.ledger import ledger
from chutelab.results.quantities import each
from chutelab.results.quantities import prediction as predicted
from chutelab.results.sensors import QUANTILES
from chutelab.results.stream import envelopes, flows
from chutelab.results.summary import layers
from chutelab.scene import Scene
from chutelab.theory import Transfer
from chutelab.theory.prediction import not_carried, ride_of
from chutelab.theory.slide import separation
from chutelab.util.arrays import Floats
from chutelab.util.tables import number


@dataclass(frozen=True)
class Arc:
    """Free flight between two times, world frame."""

    begin: float  # s, on the clock that starts at separation; so is `end`
    end: float
    position: tuple[float, float]  # m, at `begin`
    velocity: tuple[float, float]  # m/s, at `begin`
    gravity: float  # m/s², pointing down

    def at(self, times: ArrayLike) -> tuple[Floats, Floats]:
        """Return positions and velocities, (T, 2) each, at times (T,) since separation."""
        t = np.asarray(times, dtype=np.float64)[:, None] - self.begin
        pull = np.array([0.0, -self.gravity])
        velocity = np.array(self.velocity)
        return np.array(self.position) + t * (velocity + 0.5 * pull * t), velocity + pull * t


def arcs(prediction: Transfer, scene: Scene) -> tuple[Arc, ...]:
    """Return the flights of particle 0 that have a closed form, in order.

    With a plate they are the flight to it and the one from there to the belt, as far as the
    prediction goes. Without one it is the flight from the pulley down to the outgoing belt, if
    nothing is in the way.
    """
    belt, out, g = scene.incoming, scene.outgoing, scene.gravity
    if belt is None:
        return ()
    riding = belt.pulley_radius + scene.particle.radius
    if scene.plate is None:
        met = scene.surface or scene.crowded or scene.plates or scene.conveyor
        lies = any(other for other, _ in not_carried(scene))
        if out is None or met or not (g and belt.speed) or lies:
            return ()
        ride = ride_of(scene)
        ride["ride_radius"] = ride.pop("pulley_radius") + ride.pop("particle_radius")
        left = separation(**{name: np.atleast_1d(value) for name, value in ride.items()})
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
        # The paper's x3 points back from the plate, and both y downwards.
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
"""m; lower end of the residual's axis, where an exact zero is drawn."""


def analytic_of(
    recording: Recording, prediction: Transfer | None = None
) -> tuple[tuple[Arc, ...], float]:
    """Return the arcs known analytically, and the time (s) of the recording at which they begin.

    By default they are those of the recording's own prediction.
    """
    left = float(each(recording, "separation.t")[0])
    if isnan(left):
        return (), 0.0
    return arcs(prediction or predicted(recording), recording.scene), left


def draw_tracks(ax: Axes, recording: Recording, *, marks: bool = True) -> Axes:
    """Draw particle 0's track over the others', with strobe dots at round times and impact markers.

    The others' tracks are thin and translucent, in the colour of their stream. Without `marks`
    there are neither dots nor markers, and particle 0's track looks like the others, if there are
    any.
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
    ax.plot(*path.T, color=style.TRACK, lw=1.6, zorder=5.0, gid="track", label=say("track"))
    if not marks:
        return ax
    dots, _ = nominal(recording, strobe_times(recording))
    said = say("every", step=figures(strobe_step(recording), "g"))
    ax.plot(*dots.T, **style.RINGS, ms=5.0, zorder=6.0, gid="strobe", label=said)
    struck = struck_by_nominal(recording)["t"]
    if len(struck):
        track = recording.track(0)["t"]
        where, _ = nominal(recording, np.clip(struck, track[0], track[-1]))
        (cross,) = ax.plot(*where.T, "x", color=style.STRIKE, ms=8.0, mew=2.0, zorder=7.0)
        cross.set(gid="impacts", label=say("impact"))
    return ax


def draw_analytic(ax: Axes, parts: tuple[Arc, ...]) -> Axes:
    """Draw the analytic parabola, dashed; draw the track over it."""
    if parts:
        position = path_of_arcs(parts)
        dashed = {**style.DASHED, "gid": "analytic", "label": say("analytic-parabola")}
        ax.plot(*position.T, **dashed, zorder=4.5)
    return ax


def path_of_arcs(parts: tuple[Arc, ...]) -> Floats:
    """Return the points of the analytic parabola, (P, 2), m; none without arcs."""
    return flight(parts, _times_of(parts))[0] if parts else np.empty((0, 2))


def _times_of(parts: tuple[Arc, ...]) -> Floats:
    return np.unique(np.concatenate([np.linspace(arc.begin, arc.end, 120) for arc in parts]))


def draw_residual(
    ax: Axes, recording: Recording, parts: tuple[Arc, ...], start: float, reason: str = ""
) -> Axes:
    """Draw the distance between simulated and analytic positions of particle 0, on a log scale.

    `parts` and `start` come from `analytic_of`; without arcs the panel says so. `reason` says why
    there is no analytic parabola, or why it ends early.
    """
    then = say("residual-then", reason=reason) if reason else ""
    axis = say("residual-axis", note=shorten(then, 95, placeholder=" …"))
    style.dress(ax, axis, say("residual-distance"), say("residual-title"))
    if not parts:
        ax.set_axis_off()
        why = say("residual-none", reason=reason or say("residual-unseparated"))
        said = style.plain(fill(why, 60))
        text = ax.text(0.5, 0.5, said, ha="center", va="center")
        text.set(transform=ax.transAxes, fontsize=style.NORMAL, color=style.MUTED)
        return ax
    times = _times_of(parts)
    known, _ = flight(parts, times)
    clock, end = start + times, float(recording.track(0)["t"][-1])
    # By rounding a sum may pass the end, after which there is no position.
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
    title = say("residual-largest", largest=style.scientific(largest, "m"))
    ax.set_title(title, fontsize=style.NORMAL, loc="left", fontweight="bold")
    style.note(ax, say("residual-spacing"))
    return ax


def draw_velocity(
    ax: Axes, recording: Recording, parts: tuple[Arc, ...] = (), start: float = 0.0
) -> Axes:
    """Draw both velocity components of particle 0 over time, over the analytic ones, dashed."""
    style.dress(ax, say("time"), say("velocity-axis"), say("velocity-title"))
    times = track_times(recording)
    _, velocity = nominal(recording, times)
    if parts:
        clock = np.union1d(_times_of(parts), np.nextafter([arc.end for arc in parts], 0.0))
        _, known = flight(parts, clock)
    for axis, (name, label) in enumerate((("vx", "forward"), ("vy", "up"))):
        if parts:
            ax.plot(start + clock, known[:, axis], **style.DASHED, gid=f"analytic {name}")
        (line,) = ax.plot(times, velocity[:, axis], color=style.VELOCITY[name], lw=1.6, gid=name)
        line.set_label(f"$v_{name[1]}$, {say(label)}")
    ax.set_xlim(times[0], _beyond(times))
    box = ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85).get_window_extent()
    paths = (line.get_path().transformed(line.get_transform()) for line in ax.lines)
    if any(path.intersects_bbox(box, filled=False) for path in paths):
        # No place is free, so it gets its own strip.
        low, high = ax.get_ylim()
        ax.set_ylim(low, high + 0.2 * (high - low))
        ax.legend(fontsize=style.SMALL, loc="upper center", ncols=2, framealpha=0.85)
    return ax


def _beyond(times: Floats) -> float:
    """Return a time a little after the end, so that a jump at the end can be seen."""
    return float(times[-1] + (0.04 * (times[-1] - times[0]) or 1e-3))


ALWAYS = ("kinetic", "potential", "restitution_loss", "friction_loss")
"""Entries that are shown even if they are 0 throughout."""

SHOWN = 1e-9
"""A residual larger than this share of the energy put in is not rounding."""


def draw_ledger(ax: Axes, recording: Recording, *, details: bool = True) -> Axes:
    """Draw the energy ledger of all particles over time.

    Energies and losses are stacked; energy at release plus the work of belts and drives is a line.
    The line is at the top of the stack except for the residual, which the title states: always with
    `details`, otherwise if it is more than rounding.
    """
    t = recording.knots["t"]
    times = np.linspace(t.min(), t.max(), 240)
    if len(recording.events) <= len(times):
        times = upright(times, recording.events["t"])
    times = np.append(times, _beyond(times))
    balance = energies(recording, times)
    supplied = balance["start"] + balance["belt_work"]
    factor, unit = style.scaled(supplied, "J")
    names = [
        name
        for name in (
            "kinetic", "potential", "spring", "restitution_loss", "friction_loss", "damper_loss",
        )
        if name in balance and (name in ALWAYS or balance[name].any())
    ]  # fmt: skip
    ax.stackplot(
        times,
        [factor * balance[name] for name in names],
        colors=[style.ENERGY[name] for name in names],
        labels=[say(f"ledger-{'heights' if name == 'potential' else name}") for name in names],
        linewidth=0.0,
    )
    (line,) = ax.plot(times, factor * supplied, color=style.INK, lw=1.6, gid="supplied")
    paid = ", ".join(say(f"by-{part}") for part in paid_by(recording))
    told = say("supplied", by=paid) if paid else say("supplied-nothing")
    told = "\n".join(fill(line, 28) for line in told.splitlines())
    line.set(linestyle=(0, (4, 1.5)), label=told)
    residual = float(balance["residual"][-1])
    title = say("ledger")
    if details or abs(residual) > SHOWN * np.abs(supplied).max():
        title = say("ledger-with", residual=style.scientific(residual, "J"))
    style.dress(ax, say("time"), say("energy-axis", unit=unit), title)
    ax.set_xlim(times[0], times[-1])
    ax.set_ylim(bottom=min(0.0, factor * float(supplied.min())))
    return ax


EDGES = {"low": f"{100 * QUANTILES[0]:.0f}", "high": f"{100 * QUANTILES[-1]:.0f}"}
"""Percentiles that enclose most particles."""


def draw_envelope(ax: Axes, recording: Recording) -> Axes:
    """Draw for each stream the envelope of its paths, and the middle path.

    A legend names them once; the colours of streams are in the legend of the particles.
    """
    streams, paths = recording.machine.streams, envelopes(recording)
    colours = stream_colours(len(streams))
    for name, color in zip(streams, colours, strict=True):
        if name not in paths:
            continue
        first = name == next(iter(paths))
        right, middle, left = (line[np.isfinite(line).all(axis=1)] for line in paths[name].lines)
        (band,) = ax.fill(*np.concatenate([right, left[::-1]]).T, color=color, alpha=0.4, lw=0.0)
        band.set(zorder=3.5, gid="envelope", label=say("envelope", **EDGES) if first else "")
        dark = style.TRACK if len(colours) == 1 else style.tint(color, 0.6, style.INK)
        (way,) = ax.plot(*middle.T, color=dark, lw=1.6, zorder=5.0, gid="median")
        way.set_label(say("median-path") if first else "")
    return ax


def draw_arrivals(ax: Axes, recording: Recording, title: str | None = None) -> Axes:
    """Draw the distribution of arrivals on the outgoing belt, with mean and spread.

    For a bed, the landings of the lowest and the highest layer are marked.
    """
    found = arrivals(recording)["position"][:, 0]
    found = found[np.isfinite(found)]
    title = say("arrivals") if title is None else title
    style.dress(ax, say("arrival-place"), say("particles"), title)
    if len(found) == 0:
        return ax
    mean, deviation = float(found.mean()), float(found.std())
    # If all arrive in one place, there is still a bar.
    edges = 24 if np.ptp(found) > 1e-9 else [mean - 5e-4, mean + 5e-4]
    ax.hist(found, bins=edges, color=style.STREAM)
    ax.axvspan(mean - deviation, mean + deviation, color=style.MUTED, alpha=0.2, gid="spread")
    ax.axvline(mean, color=style.INK, lw=1.6, gid="mean")
    style.note(
        ax, say("mean-spread", mean=figures(mean, ".4f"), spread=style.quantity(deviation, "m"))
    )
    if (ends := layers(recording)) is not None:
        for x, layer, dashes in zip(ends, ("lowest", "highest"), ("--", ":"), strict=True):
            ax.axvline(
                x, color=style.STRIKE, lw=1.6, ls=dashes, gid=layer, label=say(f"layer-{layer}")
            )
        # Above the bars.
        ax.set_ylim(top=1.25 * ax.get_ylim()[1])
        ax.legend(fontsize=style.SMALL, loc="upper center", ncols=2, framealpha=0.85)
    ax.locator_params(axis="x", nbins=5)
    return ax


def draw_flow(ax: Axes, recording: Recording) -> Axes:
    """Draw the numbers of particles released, arrived and left, over time.

    A steeper line is a larger flow; the remark has the rate of arrivals, as in the summary. If all
    particles are there from the start and none comes or goes, their speeds are drawn.
    """
    style.dress(ax, say("time"), say("particles"), say("flow"))
    first, last = recording.ends()
    counted = flow(recording)
    ends = float(first["t"].min()), float(last["t"].max())
    if not (np.ptp(first["t"]) or len(counted["arrived"]) or len(counted["left"])):
        return draw_speeds(ax, recording)
    colours = (style.MUTED, style.TRACK, style.STRIKE)
    for (name, times), color in zip(counted.items(), colours, strict=True):
        if len(times):
            clock = np.concatenate([ends[:1], np.sort(times), ends[1:]])
            count = np.append(np.arange(len(times) + 1), len(times))
            (steps,) = ax.step(clock, count, where="post", color=color, lw=1.6, gid=name)
            steps.set_label(say(f"flow-{name}", count=figures(len(times), ",")))
    slice_, whole = flows(recording)
    if slice_ is not None:
        key, carried = ("flow-slice", slice_) if whole is None else ("flow-whole", whole)
        style.note(ax, say(key, flow=spoken().local(number(carried))))
    ax.set(xlim=ends if ends[1] > ends[0] else None, ylim=(0.0, 1.08 * recording.count))
    ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85)
    return ax


def draw_speeds(ax: Axes, recording: Recording) -> Axes:
    """Draw the speeds of all particles over time: median and the range of most."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), 200)
    speeds = np.hypot(*np.moveaxis(recording.at(times)[1], 2, 0))
    low, middle, high = np.nanquantile(speeds, QUANTILES, axis=1)
    style.dress(ax, say("time"), say("speed-axis"), say("speed-title"))
    said = say("quantiles", **EDGES)
    ax.fill_between(times, low, high, color=style.STREAM, alpha=0.5, lw=0.0, label=said)
    ax.plot(times, middle, color=style.TRACK, lw=1.6, gid="speed", label=say("median"))
    ax.set_xlim(times[0], times[-1])
    ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85)
    return ax


def draw_power(ax: Axes, recording: Recording) -> Axes:
    """Draw the power of all drives over time: the mean in each of 40 parts of the run."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), 41)
    paid = recording.energy_at(times)["belt_work"]
    power = np.diff(paid) / np.diff(times)
    factor, unit = style.scaled(power, "W")
    style.dress(ax, say("time"), say("power-axis", unit=unit), say("power-title"))
    ax.stairs(factor * power, times, color=style.BELT, lw=1.6, gid="power")
    ax.axhline(0.0, color=style.MUTED, lw=0.8)
    ax.set_xlim(times[0], times[-1])
    style.note(ax, say("work", work=style.quantity(float(paid[-1]), "J")))
    return ax


MOST_SURFACES = 6
"""Most surfaces whose losses are shown: those with the largest losses."""


def draw_losses(ax: Axes, recording: Recording) -> Axes:
    """Draw the losses by surface, the largest on top: in rebounds and to friction."""
    balance = ledger(recording).by_surface
    taken = {name: row["restitution_loss"] + row["friction_loss"] for name, row in balance.items()}
    names = sorted((name for name in taken if taken[name]), key=lambda name: -abs(taken[name]))
    names = names[:MOST_SURFACES]
    losses = np.array([[balance[n][key] for n in names] for key in LOSSES]).reshape(2, -1)
    factor, unit = style.scaled(losses, "J")
    style.dress(ax, say("loss-axis", unit=unit), "", say("losses"))
    ax.grid(visible=False, axis="y")
    base: Floats = np.zeros(len(names))
    for key, loss in zip(LOSSES, factor * losses, strict=True):
        ax.barh(range(len(names)), loss, left=base, height=0.7, color=style.ENERGY[key], gid=key)
        base = base + loss
    ax.set_yticks(range(len(names)), [style.plain(named(one)) for one in names])
    ax.set_ylim(max(len(names), 2) - 0.4, -0.6)
    return ax


LOSSES = ("restitution_loss", "friction_loss")
