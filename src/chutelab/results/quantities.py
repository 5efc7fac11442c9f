"""A run's quantities: the one place where numbers are read off a recording.

`first` gives the first separation, impact or landing of each particle, `each` a quantity of each
particle by its name, such as ``landing.x``, `measure` one of the run, such as ``landing.x.mean``,
and `observed` those of particle 0 under the paper's symbols. Then there is what happened to a crowd
as a whole: which particles waited for a place, rode into others, or roll instead of being carried.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import nan
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.machine.releases import Squeeze, squeeze
from chutelab.results.arrival import arrivals, never
from chutelab.results.ledger import ledger
from chutelab.results.recording import ENTRIES, REASONS, Kind, Recording
from chutelab.scene import Scene
from chutelab.scene.rules import FIRST, NEEDED, SYMBOLS, suggestion, unit_of
from chutelab.theory import Drag, drag
from chutelab.util.arrays import Floats, Numbers
from chutelab.util.tables import number

KINDS = {
    "degrees": "angle", "s": "time", "m": "length", "m/s": "speed", "J": "energy", "W": "power",
}  # fmt: skip
"""Kinds of quantities by their units."""

QUANTITIES = {name.removesuffix("_deg"): KINDS[unit] for name, unit in SYMBOLS.items()}
"""What theory and runs both have, under the paper's symbols, and what kind of quantity it is."""

ALONG = 1e-14
"""Share of the rebound speed below which its part away from the plate is rounding."""

CARRIED = 1e-3
"""m/s from the belt's speed, up to which a particle rides with it: the slip that counts as none."""

_STATISTICS: dict[str, Callable[[Floats], Any]] = {
    "mean": np.mean, "spread": np.std, "min": np.min, "max": np.max,
    "q02": lambda values: np.quantile(values, 0.02), "q50": np.median,
    "q98": lambda values: np.quantile(values, 0.98),
}  # fmt: skip


def first(recording: Recording, event: str, surface: str | None = None) -> NDArray[Any]:
    """Return the first "separation", "impact" or "landing" of each particle, (N,), dtype `EVENT`.

    From the incoming belt, on the plate and on the outgoing belt, unless another surface is given.
    NaN throughout where it did not happen.
    """
    events, surface = never(recording.count), surface or NEEDED[event]
    if surface not in recording.surfaces:
        return events
    found = recording.first(recording.select(event, surface=surface))
    events[found["particle"]] = found
    return events


def column(events: NDArray[Any], name: str) -> Floats:
    """Return ``t``, ``x``, ``y``, ``vx``, ``vy``, ``vx_after`` or ``vy_after`` of events, SI."""
    if name == "t":
        return np.asarray(events["t"])
    if name in ("x", "y"):
        return np.asarray(events["position"][:, "xy".index(name)])
    when = "after" if name.endswith("_after") else "before"
    return np.asarray(events[f"velocity_{when}"][:, "xy".index(name[1])])


def end_times(recording: Recording) -> Floats:
    """Return when the particles' tracks end, s, (N,); NaN of those that were never released."""
    times = np.full(recording.count, nan)
    times[recording.released] = recording.ends()[1]["t"]
    return times


def each(recording: Recording, name: str) -> Floats:
    """Return a quantity of each particle, (N,), in the unit its name has; NaN without one.

    Names are such as ``x2``, ``landing.x``, ``flight.t`` (from the incoming belt to the plate, or
    to the outgoing belt), ``impact.hood.t``, ``ended.t`` or ``ledger.belt_work``. Of a family of
    scenes, each particle is a scene of its own; only its recording has ``ledger.by_surface`` of
    each particle.

    Raises
    ------
    KeyError
        If there is no such quantity.
    """
    match name.split("."):
        case ["ended", "t"]:
            return end_times(recording)
        case ["ended", "x" | "y" as axis]:
            places = np.full(recording.count, nan)
            places[recording.released] = recording.ends()[1]["position"][:, "xy".index(axis)]
            return places
        case ["ledger", entry]:
            values = np.full(recording.count, nan)
            values[recording.released] = recording.ends()[1]["entries"][:, ENTRIES.index(entry)]
            return values
        case ["ledger", "by_surface", surface, entry]:
            if surface not in recording.surfaces:
                return np.zeros(recording.count)
            owner = recording.surface_index(surface)
            return np.asarray(recording.by_surface[:, owner, ENTRIES.index(entry)])
        case ["flight", "t"]:
            # From the incoming belt to what is met next.
            left = column(first(recording, "separation"), "t")
            met = (column(first(recording, event), "t") for event in ("impact", "landing"))
            return np.asarray(np.fmin(*met) - left)
        case ["impact", surface, key]:
            return column(first(recording, "impact", surface), key)
        case ["separation" | "impact" | "landing" as event, key]:
            return column(first(recording, event), key)
        case ["arrival", key]:
            return column(arrivals(recording), key)
    values = symbols(recording)[name.removesuffix("_deg")]
    return np.degrees(values) if name.endswith("_deg") else values


def measure(recording: Recording, name: str) -> float:
    """Return a quantity of a recording, in the unit its name has; NaN if it did not happen.

    Names are such as ``x2``, ``landing.x.mean`` or ``ledger.by_surface.plate.restitution_loss``.
    One without statistic is particle 0's, with or without ``particles[0].`` before it; ``spread``
    is the standard deviation, ``q02`` what 2 % of the particles are below. After
    ``by_stream.NAME.`` it is that of the particles of one stream.

    Raises
    ------
    KeyError
        If the scene has no quantity of that name.
    """
    surfaces, streams = recording.scene.surfaces, recording.machine.streams
    if unit_of(name, surfaces, streams) is None:
        raise KeyError(f"no quantity {name!r}; {suggestion(name, surfaces)}")
    if name.startswith(FIRST):
        return float(each(recording, name.removeprefix(FIRST))[0])
    parts, whose = name.split("."), np.ones(recording.count, dtype=bool)
    if parts[0] == "by_stream":
        stream = recording.machine.streams.index(parts[1])
        parts, whose = parts[2:], recording.machine.releases.stream == stream
    match parts:
        case ["contacts"]:
            return float(recording.contacts)
        case ["ended", reason] if reason in REASONS:
            return float(np.count_nonzero(recording.ended == REASONS.index(reason)))
        case ["ledger", "by_surface", surface, entry]:
            return ledger(recording).by_surface[surface][entry]
        case ["ledger", stored, end]:
            return float(getattr(ledger(recording), stored)[("start", "end").index(end)])
        case ["ledger", entry]:
            return float(getattr(ledger(recording), entry))
        case [*event, "count"]:
            return float(np.isfinite(each(recording, ".".join([*event, "t"]))[whose]).sum())
        case [*quantity, statistic] if statistic in _STATISTICS:
            values = each(recording, ".".join(quantity))[whose]
            values = values[np.isfinite(values)]
            return float(_STATISTICS[statistic](values)) if len(values) else nan
    return float(each(recording, name)[0])


def layers(recording: Recording) -> tuple[float, float] | None:
    """Return where the lowest and the highest layer of a bed land on the outgoing belt, x, m.

    None if all are released at one height, or one of the two does not land there.
    """
    if recording.count < 2 or recording.scene.stream.bed_height == 0.0:
        return None
    landed = each(recording, "landing.x")[recording.released]
    heights = recording.ends()[0]["position"][:, 1]
    ends = landed[[np.argmin(heights), np.argmax(heights)]]
    return (float(ends[0]), float(ends[1])) if np.isfinite(ends).all() else None


def observed(recording: Recording) -> dict[str, float]:
    """Return the `QUANTITIES` of particle 0, see `symbols`."""
    return {name: float(values[0]) for name, values in symbols(recording).items()}


def symbols(recording: Recording) -> dict[str, Floats]:
    """Return the `QUANTITIES` of each particle, (N,), SI units and radians; NaN without one."""
    left, hit, down = (first(recording, event) for event in NEEDED)
    # In the paper's frame an impact is counted from the separation, a landing from the impact.
    hit[np.isnan(left["t"])] = never(1)
    down[np.isnan(hit["t"])] = never(1)
    unpaid = dict.fromkeys(("belt_work", "slip_heat"), np.full(recording.count, nan))
    own = recording.particle
    found = from_events(recording.scene, left, hit, down, own.radius, own.mass) | unpaid
    # What the belt pays until there is no slip is known only of a particle that got there, and had
    # nothing but the belt to do with since it landed.
    if recording.count == 1 and REASONS[recording.ended[0]] == "settled":
        since = recording.events["t"] > down["t"][0]
        belt = recording.surface_index("outgoing")
        if np.isfinite(down["t"][0]) and (recording.events["surface"][since] == belt).all():
            paid = ledger(recording).by_surface["outgoing"]
            found["belt_work"] = np.array([paid["belt_work"]])
            found["slip_heat"] = np.array([paid["friction_loss"]])
    return found


def from_events(
    scene: Scene,
    left: NDArray[Any],
    hit: NDArray[Any],
    down: NDArray[Any],
    radius: Numbers,
    mass: Numbers,
) -> dict[str, Floats]:
    """Return what separation, impact and landing tell of the `QUANTITIES`, in the paper's frame.

    x2, y2 are counted from the separation point, y down; x3 and v3x back from the plate. The events
    are (N,), of one scene or a family of N, and NaN, as `never` has it, where one did not happen;
    radius (m) and mass (kg) are the particles'.
    """
    plate = scene.plate
    top = nan if scene.incoming is None else scene.incoming.pulley_radius
    belt = nan if scene.outgoing is None else scene.outgoing.speed
    alpha = np.radians(nan if plate is None else plate.angle_deg)
    (x1, y1), (x2, y2), (x3, y3) = (event["position"].T for event in (left, hit, down))
    (ux, uy), (wx, wy) = hit["velocity_before"].T, hit["velocity_after"].T
    vx, vy = down["velocity_before"].T
    sine, cosine = np.sin(alpha), np.cos(alpha)
    away, along = -(wx * cosine + wy * sine), wx * sine - wy * cosine
    # Rounding must not choose between π and -π for a rebound up along the plate.
    away = np.where(np.abs(away) <= ALONG * np.hypot(wx, wy), 0.0, away)
    energy = 0.5 * mass * (vx * vx + belt * belt)
    return {
        "phi1": np.arctan2(x1, y1),
        "t2": hit["t"] - left["t"],
        "x2": x2 - x1,
        "y2": y1 - y2,
        "v2": np.hypot(ux, uy),
        "v2r": np.hypot(wx, wy),
        "phi2": np.arctan2(ux * cosine + uy * sine, ux * sine - uy * cosine),
        "phi2r": np.arctan2(away, along + 0.0),  # + 0.0: the angle of no rebound is 0, not -π
        "t3": down["t"] - hit["t"],
        "x3": x2 - x3,
        "y3": y2 - y3,
        "v3x": -vx,
        "v3y": -vy,
        "v3": np.hypot(vx, vy),
        "d3": top + radius - y3,
        "dEk": energy,
        "P": energy * scene.rate,
    }


STILL = 1e-3
"""m/s; a bed that trembles is slower, what slides or falls is not for long."""


@dataclass(frozen=True)
class Stopped:
    """A run that was ended before it was over, as ``--max-seconds`` does.

    How many particles were under way then, how many not yet released, and up to which time all that
    happened is recorded, s.
    """

    particles: int
    unreleased: int
    t: float

    def __str__(self) -> str:
        some = "1 particle" if self.particles == 1 else f"{self.particles:,} particles"
        after = f" and {self.unreleased:,} not yet released" if self.unreleased else ""
        return (
            f"STOPPED before it was over, with {some} under way{after}: all of it is recorded up to"
            f" t = {number(self.t)} s, and sums are of what is recorded"
        )


def stopped(recording: Recording) -> Stopped | None:
    """Return where a run was stopped; None if it was not."""
    halted = recording.ended == REASONS.index("stopped")
    if not halted.any():
        return None
    under_way = halted & recording.released
    t = float(recording.knots["t"].max(initial=0.0))
    if not recording.machine.interact:
        # Each by itself: some are ahead of others.
        last = recording.knots["t"][recording.offsets[1:][under_way] - 1]
        due = recording.machine.releases.t[halted & ~recording.released]
        t = min(float(last.min(initial=t)), float(due.min(initial=t)))
    released = int(np.count_nonzero(under_way))
    return Stopped(released, int(np.count_nonzero(halted)) - released, t)


@dataclass(frozen=True)
class Waits:
    """Particles that were released late because their place was taken.

    How many waited and were released, and how long these did at most and on average, s (0 if none
    did); `never` is how many were due and found no place until the end of the run.
    """

    particles: int
    longest: float
    mean: float
    never: int

    def __str__(self) -> str:
        said = []
        if self.particles:
            some = "1 particle" if self.particles == 1 else f"{self.particles} particles"
            said.append(
                f"{some} waited for a free place to be released, {number(self.longest)} s at most"
                f" and {number(self.mean)} s on average"
            )
        if self.never:
            said.append(f"{self.never} found no free place until the end")
        return "; ".join(said)


def waits(recording: Recording) -> Waits | None:
    """Return which particles waited for a place; None if none did."""
    due, dt = recording.machine.releases.t, recording.machine.dt
    # The pymunk engine releases at the beginning of a step: up to a step late is not waiting.
    least = (1.0 + 1e-6) * dt if recording.engine == "pymunk" else 1e-9
    released = recording.select(Kind.RELEASE)
    late = released["t"] - due[released["particle"]]
    late = late[late > least]
    halt = stopped(recording)
    end = recording.knots["t"].max(initial=0.0) if halt is None else halt.t
    missing = int(np.count_nonzero(due[~recording.released] < end - dt))
    if not len(late) and not missing:
        return None
    longest, mean = (float(late.max()), float(late.mean())) if len(late) else (0.0, 0.0)
    return Waits(len(late), longest, mean, missing)


@dataclass(frozen=True)
class Plug:
    """Particles that meet each other and lie still in the machine when a run is over.

    How many these are, and how many have left it or arrived on the outgoing belt.
    """

    still: int
    through: int

    def __str__(self) -> str:
        lie = "1 particle lies" if self.still == 1 else f"{self.still:,} particles lie"
        return (
            f"{lie} still in the machine at the end, {self.through:,} got through: it is plugged,"
            " or something holds them where nothing carries them on"
        )


def plugged(recording: Recording) -> Plug | None:
    """Return which particles got stuck; None if none did, or there was nowhere to go.

    Told of particles that meet, where some got through or an outgoing belt waits for them, of a
    run that was not stopped. Still is what moves with less than `STILL`, and what has settled: its
    contacts are at rest, though a grain on trembling ones may be a little faster.
    """
    machine = recording.machine
    if not machine.interact or stopped(recording) is not None:
        return None
    through = recording.ended == REASONS.index("exit")
    if recording.scene.outgoing is not None:
        through |= np.isfinite(arrivals(recording)["t"])
    still = np.zeros(recording.count, dtype=bool)
    still[recording.released] = np.hypot(*recording.ends()[1]["velocity"].T) < STILL
    still |= recording.ended == REASONS.index("settled")
    lying, gone = int(np.count_nonzero(still & ~through)), int(np.count_nonzero(through))
    if not lying or not (gone or recording.scene.outgoing is not None):
        return None
    return Plug(lying, gone)


def air_drag(recording: Recording) -> Drag | None:
    """Return what air drag would do, by the fastest moment of a recording; None for mass points."""
    speeds = np.hypot(*recording.knots["velocity"].T)
    if not len(speeds):
        return drag(recording.scene, recording.prediction, 0.0)
    fastest = int(np.argmax(speeds))
    speed = float(speeds[fastest])
    # Not every knot has the speed just before an impact; events do.
    met = np.hypot(*recording.events["velocity_before"].T)
    particle = int(np.searchsorted(recording.offsets, fastest, side="right")) - 1
    if len(met) and met.max() > speed:
        speed, particle = float(met.max()), int(recording.events["particle"][np.argmax(met)])
    radius, mass = (
        float(np.broadcast_to(part, recording.count)[particle])
        for part in (recording.particle.radius, recording.particle.mass)
    )
    return drag(recording.scene, recording.prediction, speed, radius, mass)


def squeezed(recording: Recording) -> Squeeze | None:
    """Return what rode into others by adhesion, see `machine.releases.squeeze`; or None."""
    released = recording.select(Kind.RELEASE)
    released = released[recording.machine.releases.carried[released["particle"]]]
    radius = np.broadcast_to(recording.particle.radius, recording.count)[released["particle"]]
    return squeeze(recording.scene, released["t"], released["position"], radius)


@dataclass(frozen=True)
class Rolling:
    """Disks that settled on the outgoing belt without being carried by it.

    A free disk stops slipping when its contact point runs with the belt. Its centre, v_x, may then
    be far from the belt's speed v_b: it rolls, and the belt pays no more. Belt work so far and
    m v_b (v_b - v_x) together are what loads that are carried take.

    `particles` is how many roll, `belt_work` what the outgoing belt has paid for all particles, J,
    and `belt_work_carried` what it would have paid if those that roll were carried, J.
    """

    particles: int
    belt_work: float
    belt_work_carried: float

    def __str__(self) -> str:
        disks = "1 disk rolls" if self.particles == 1 else f"{self.particles} disks roll"
        return (
            f"{disks} on the outgoing belt: nothing slips, and nothing is carried along. The belt"
            f" has paid {number(self.belt_work)} J, loads that are carried take"
            f" {number(self.belt_work_carried)} J (a disk that arrives without turning takes a"
            " third of a carried load's work)"
        )


def rolling(recording: Recording) -> Rolling | None:
    """Return what settled on the outgoing belt without being carried; None if nothing did."""
    belt = recording.scene.outgoing
    if belt is None or belt.speed is None or np.all(recording.particle.inertia == 0.0):
        return None
    settled = recording.select(Kind.SETTLE, surface="outgoing")
    missing = belt.speed - settled["velocity_after"][:, 0]
    astray = np.abs(missing) > CARRIED
    if not astray.any():
        return None
    paid = ledger(recording).by_surface["outgoing"]["belt_work"]
    masses = np.broadcast_to(recording.particle.mass, recording.count)[settled["particle"]]
    due = belt.speed * float((masses * missing)[astray].sum())
    return Rolling(int(astray.sum()), paid, paid + due)
