"""What there is to say of a run: that it was stopped, that particles waited, got stuck or roll.

None where there is nothing to say; otherwise ``str`` says it.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from chutelab.machine.releases import Squeeze, squeeze
from chutelab.results.arrival import arrivals
from chutelab.results.comparison import prediction
from chutelab.results.firsts import column, first
from chutelab.results.ledger import ledger
from chutelab.results.record import REASONS, Kind, Record
from chutelab.theory import Drag, drag
from chutelab.util.tables import number

CARRIED = 1e-3
"""m/s from the belt's speed, up to which a particle rides with it: the slip that counts as none."""

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


def stopped(recording: Record) -> Stopped | None:
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


def waits(recording: Record) -> Waits | None:
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


def plugged(recording: Record) -> Plug | None:
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


def air_drag(recording: Record) -> Drag | None:
    """Return what air drag would do, by the fastest moment of a recording; None for mass points."""
    speeds = np.hypot(*recording.knots["velocity"].T)
    if not len(speeds):
        return drag(recording.scene, prediction(recording), 0.0)
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
    return drag(recording.scene, prediction(recording), speed, radius, mass)


def squeezed(recording: Record) -> Squeeze | None:
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


def rolling(recording: Record) -> Rolling | None:
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


def layers(recording: Record) -> tuple[float, float] | None:
    """Return where the lowest and the highest layer of a bed land on the outgoing belt, x, m.

    None if all are released at one height, or one of the two does not land there.
    """
    if recording.count < 2 or recording.scene.stream.bed_height == 0.0:
        return None
    landed = column(first(recording, "landing"), "x")[recording.released]
    heights = recording.ends()[0]["position"][:, 1]
    ends = landed[[np.argmin(heights), np.argmax(heights)]]
    return (float(ends[0]), float(ends[1])) if np.isfinite(ends).all() else None
