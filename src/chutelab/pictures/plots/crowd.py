"""The panels of a crowd: the envelope of its paths, arrivals, flow, belt power and losses."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes

from chutelab.pictures.plots import style
from chutelab.pictures.plots.bodies import stream_colours
from chutelab.results import REASONS, Recording
from chutelab.results.arrival import arrivals
from chutelab.results.ledger import ledger
from chutelab.results.stream import QUANTILES, envelopes, flows
from chutelab.results.summary import layers
from chutelab.scene.quantities import REGISTRY
from chutelab.scene.units import with_unit
from chutelab.util.arrays import Floats
from chutelab.util.tables import number

INSTANTS = 200
"""At which speeds are told."""

EDGES = f"{100 * QUANTILES[0]:.0f} to {100 * QUANTILES[-1]:.0f} % of the paths"
"""What a legend says of an envelope."""


def draw_envelope(ax: Axes, recording: Recording) -> Axes:
    """Draw for each stream the band in which all but few of its paths lie, and the middle one.

    A legend names them once; which stream has which colour is told by its particles.
    """
    streams, paths = recording.machine.streams, envelopes(recording)
    colours = stream_colours(len(streams))
    for name, color in zip(streams, colours, strict=True):
        if name not in paths:
            continue
        first = name == next(iter(paths))
        right, middle, left = (line[np.isfinite(line).all(axis=1)] for line in paths[name].lines)
        (band,) = ax.fill(*np.concatenate([right, left[::-1]]).T, color=color, alpha=0.4, lw=0.0)
        band.set(zorder=3.5, gid="envelope", label=EDGES if first else "")
        dark = style.TRACK if len(colours) == 1 else style.tint(color, 0.6, "#000000")
        (way,) = ax.plot(*middle.T, color=dark, lw=1.6, zorder=5.0, gid="median")
        way.set_label("median path" if first else "")
    return ax


def draw_arrivals(ax: Axes, recording: Recording, title: str = "Arrivals") -> Axes:
    """Draw how many particles arrive where on the outgoing belt, with the mean and the spread.

    Of a bed, the landings of the lowest and the highest layer are marked.
    """
    found = arrivals(recording)["position"][:, 0]
    found = found[np.isfinite(found)]
    place = REGISTRY["arrival.x"]
    style.dress(ax, with_unit(place.meaning, place.unit), "particles", title)
    if len(found) == 0:
        return ax
    mean, deviation = float(found.mean()), float(found.std())
    # All that arrive in one place still make a bar.
    edges = 24 if np.ptp(found) > 1e-9 else [mean - 5e-4, mean + 5e-4]
    ax.hist(found, bins=edges, color=style.STREAM)
    ax.axvspan(mean - deviation, mean + deviation, color=style.MUTED, alpha=0.2, gid="spread")
    ax.axvline(mean, color=style.INK, lw=1.6, gid="mean")
    style.note(ax, f"{mean:.4f} m, spread {style.quantity(deviation, 'm')}")
    if (ends := layers(recording)) is not None:
        for x, layer, dashes in zip(ends, ("lowest", "highest"), ("--", ":"), strict=True):
            ax.axvline(x, color=style.STRIKE, lw=1.6, ls=dashes, gid=layer, label=f"{layer} layer")
        # Above the bars.
        ax.set_ylim(top=1.25 * ax.get_ylim()[1])
        ax.legend(fontsize=style.SMALL, loc="upper center", ncols=2, framealpha=0.85)
    ax.locator_params(axis="x", nbins=5)
    return ax


def draw_flow(ax: Axes, recording: Recording) -> Axes:
    """Draw how many particles have been released, have arrived and have left, over time.

    The steeper, the larger the flow; the remark says what arrives, as the summary does.
    Where all are there from the start and none comes or goes: how fast they are.
    """
    style.dress(ax, "time, s", "particles", "Flow")
    first, last = recording.ends()
    come, left = arrivals(recording), recording.ended[recording.released]
    counted = (
        ("released", first["t"], style.MUTED),
        ("arrived", come["t"][np.isfinite(come["t"])], style.TRACK),
        ("left the scene", last["t"][left == REASONS.index("exit")], style.STRIKE),
    )
    ends = float(first["t"].min()), float(last["t"].max())
    if not (np.ptp(first["t"]) or any(len(times) for _, times, _ in counted[1:])):
        return draw_speeds(ax, recording)
    for name, times, color in counted:
        if len(times):
            clock = np.concatenate([ends[:1], np.sort(times), ends[1:]])
            count = np.append(np.arange(len(times) + 1), len(times))
            (steps,) = ax.step(clock, count, where="post", color=color, lw=1.6, gid=name)
            steps.set_label(f"{name} {len(times):,}")
    flow, whole = flows(recording)
    if flow is not None:
        said = f"{number(flow)} t/h arrive, of the slice"
        style.note(ax, said if whole is None else f"{number(whole)} t/h arrive")
    ax.set(xlim=ends if ends[1] > ends[0] else None, ylim=(0.0, 1.08 * recording.count))
    ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85)
    return ax


def draw_speeds(ax: Axes, recording: Recording) -> Axes:
    """Draw the speeds of all particles over time: the middle one, and between which most are."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), INSTANTS)
    speeds = np.hypot(*np.moveaxis(recording.at(times)[1], 2, 0))
    low, middle, high = np.nanquantile(speeds, QUANTILES, axis=1)
    style.dress(ax, "time, s", "speed, m/s", "Speed of all")
    said = f"{100 * QUANTILES[0]:.0f} to {100 * QUANTILES[-1]:.0f} %"
    ax.fill_between(times, low, high, color=style.STREAM, alpha=0.5, lw=0.0, label=said)
    ax.plot(times, middle, color=style.TRACK, lw=1.6, gid="speed", label="median")
    ax.set_xlim(times[0], times[-1])
    ax.legend(fontsize=style.SMALL, loc="best", framealpha=0.85)
    return ax


PARTS = 40
"""Parts of the time in which the belts' power is told."""


def draw_power(ax: Axes, recording: Recording) -> Axes:
    """Draw what all drives pay over time: the mean power in each of `PARTS` parts of the run."""
    clock = recording.knots["t"]
    times = np.linspace(clock.min(), clock.max(), PARTS + 1)
    paid = recording.energy_at(times)["belt_work"]
    power = np.diff(paid) / np.diff(times)
    factor, unit = style.scaled(power, "W")
    style.dress(ax, "time, s", f"power, {unit}", "Belt power")
    ax.stairs(factor * power, times, color=style.BELT, lw=1.6, gid="power")
    ax.axhline(0.0, color=style.MUTED, lw=0.8)
    ax.set_xlim(times[0], times[-1])
    style.note(ax, f"work {style.quantity(float(paid[-1]), 'J')}")
    return ax


MOST_SURFACES = 6
"""Surfaces whose losses are told; of more, those that take most."""


def draw_losses(ax: Axes, recording: Recording) -> Axes:
    """Draw the losses by surface, the largest on top: in rebounds and to friction."""
    books = ledger(recording).by_surface
    taken = {name: row["restitution_loss"] + row["friction_loss"] for name, row in books.items()}
    names = sorted((name for name in taken if taken[name]), key=lambda name: -abs(taken[name]))
    names = names[:MOST_SURFACES]
    losses = np.array([[books[n][key] for n in names] for key in LOSSES]).reshape(2, -1)
    factor, unit = style.scaled(losses, "J")
    style.dress(ax, f"loss, {unit}", "", "Losses by surface")
    ax.grid(visible=False, axis="y")
    base: Floats = np.zeros(len(names))
    for key, loss in zip(LOSSES, factor * losses, strict=True):
        ax.barh(range(len(names)), loss, left=base, height=0.7, color=style.ENERGY[key], gid=key)
        base = base + loss
    ax.set_yticks(range(len(names)), [style.plain(name) for name in names])
    ax.set_ylim(max(len(names), 2) - 0.4, -0.6)
    return ax


LOSSES = ("restitution_loss", "friction_loss")
