"""The moments of a recording that the film shows, their duration, and words for them."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, degrees, floor, hypot, isfinite, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from chutelab.machine import Machine
from chutelab.pictures.plots import Window
from chutelab.pictures.plots.scenery import STRUCK, action, flow, nominal, one_of_many
from chutelab.pictures.plots.style import figures, named, quantity, say
from chutelab.results import PARTICLES, Kind, Recording
from chutelab.util.arrays import Bools, Floats, Ints


def surface_words(called: str, form: str = "surface") -> str:
    """Return the words for a surface; `form` is "surface", or "on" for something on it."""
    if called in ("incoming", "outgoing", "plate", PARTICLES):
        return say(f"{form}-{called}")
    return say("surface", name=named(called))


def contact_normal(machine: Machine, event: Any) -> Floats:
    """Return the unit normal of an impact, away from the surface, (2,).

    It comes from the particle's place, as velocities of a fixed step include gravity.
    """
    position, velocity = event["position"], event["velocity_before"]
    mover, back = machine.mover(int(event["surface"])), np.eye(2)
    if mover is not None:
        # In the frame of the surface as written.
        position, back = mover.at_rest(position, event["t"]), mover.back(float(event["t"]))
        velocity = back @ (velocity - mover.velocity(event["t"])[:2])
    own = [piece for piece in machine.pieces if piece.surface == event["surface"]]
    nearest = min(own, key=lambda piece: float(piece.gap(position)))
    radius = np.broadcast_to(machine.particle.radius, machine.count)[event["particle"]]
    away, normal = nearest.away(position), nearest.normal(position)
    gap = float(np.hypot(*away))
    # At an end it is the direction from there.
    if gap > 0.5 * radius > 0.0 and abs(away[0] * normal[1] - away[1] * normal[0]) > 1e-9 * gap:
        return np.asarray(away / gap @ back)
    return np.asarray((normal if normal @ velocity < 0.0 else -normal) @ back)


def sentence(recording: Recording, event: Any) -> str:
    """Return one or two lines on an event of particle 0."""
    kind = Kind(int(event["kind"]))
    called = recording.surfaces[event["surface"]] if event["surface"] >= 0 else PARTICLES
    angle = degrees(atan2(*event["position"]))
    side = "top" if abs(angle) < 5e-4 else "past-top" if angle > 0.0 else "before-top"
    told = kind.name.lower()
    if kind == Kind.SEPARATION and called == "incoming":
        told = "pulley"
    # The event has the velocity of its `particle` only.
    by, events = int(event["particle"]), recording.events
    before_it = events[(events["particle"] == 0) & (events["t"] < event["t"])]
    if kind == Kind.COLLISION and by:
        told = "hit"
    if kind == Kind.SLIP and {*before_it["kind"][-1:]} & {Kind.IMPACT, Kind.LANDING, Kind.SLIP}:
        # It was sliding already, on this surface or on one that continues into it.
        return say("slides", on=surface_words(called, "on"))
    before, after = (
        f"{figures(hypot(*event[key]))} m/s" for key in ("velocity_before", "velocity_after")
    )
    text = say(
        f"event-{told}", surface=surface_words(called), on=surface_words(called, "on"),
        before=before, after=after, other=by or int(event["other"]),
        where=say(side, angle=figures(abs(angle), ".1f")),
    )  # fmt: skip
    if kind not in (Kind.IMPACT, Kind.LANDING) or event["normal_impulse"] == 0.0:
        return text
    normal = contact_normal(recording.machine, event)
    # Relative to the surface at the contact.
    mover, own = recording.machine.mover(int(event["surface"])), np.zeros((2, 2))
    if mover is not None:
        radius = np.broadcast_to(recording.machine.particle.radius, recording.count)[by]
        touched, t = event["position"] - radius * normal, float(event["t"])
        # A hinged surface has another velocity after the impact.
        own = np.stack([mover.velocity_at(touched, one) for one in (np.nextafter(t, 0.0), t)])
    into, off = (
        abs(float((event[v] - one) @ normal))
        for v, one in zip(("velocity_before", "velocity_after"), own, strict=True)
    )
    if into > 0.0:
        text = say("event-restitution", said=text, value=figures(round(off / into, 3), "g"))
    if kind == Kind.LANDING and list(before_it["kind"][-1:]) == [Kind.SEPARATION]:
        flown = event["t"] - before_it["t"][-1]
        text = say("event-flight", said=text, time=figures(flown, ".3f"))
    # Booked between the states before and after, or with a stepped engine within its step.
    track = recording.track(0)
    start, end = (int(np.searchsorted(track["t"], event["t"], side)) for side in ("left", "right"))
    after_it = max(start, end - 1)
    entries = track["entries"]
    belt, restitution, friction = entries[after_it] - entries[max(0, min(start, after_it - 1))]
    given = "belt" if mover is None else "drive"
    if mover is not None and mover.hinge:
        given = "to-swing" if belt < 0.0 else "from-swing"
    said = [
        say(f"loss-{what}", energy=f"{'+' if value > 0.0 else ''}{quantity(value, 'J')}")
        for value, what in (
            (-float(restitution), "rebound"),
            (-float(friction), "friction"),
            (float(belt), given),
        )
        if abs(value) > 1e-15
    ]
    return f"{text}\n{', '.join(said) or say('loss-none')}"


def going_on(recording: Recording, event: Any, *, flying: bool, still: bool = False) -> str:
    """Return particle 0's state some time after an event: `flying`, `still`, or in contact."""
    kind = Kind(int(event["kind"]))
    if flying:
        return say("flying")
    if kind in (Kind.RELEASE, Kind.COLLISION) or event["surface"] < 0:
        return ""
    verb = "lies" if still else "slides" if kind in (*STRUCK, Kind.SLIP) else "rides"
    return say(verb, on=surface_words(recording.surfaces[event["surface"]], "on"))


def in_flight(recording: Recording, times: Floats, near: float) -> Bools:
    """Return the times (T,) at which particle 0 moves under gravity alone.

    Within `near` seconds before or after a time, so that an impact counts as flight, too.
    """
    moments = times[:, None] + np.array([-near, 0.0, near])
    velocity = nominal(recording, moments.ravel())[1].reshape(*moments.shape, 2)
    pulled = np.diff(velocity, axis=1) / near + recording.gravity * recording.machine.up
    least = 1e-6 * max(recording.gravity, float(np.abs(pulled[np.isfinite(pulled)]).max(initial=0)))
    return np.asarray((np.hypot(*np.moveaxis(pulled, 2, 0)) <= least).any(axis=1))


RUNNING = 4.2
"""s; longest default duration of a film's motion on the screen, without holds."""

LIVES = 3.0
"""Longest film of a stream, in multiples of the time that particle 0 takes."""

HOLDS, WORTH = 4, 0.05
"""The film holds only at the hardest impacts: at most so many, or it would be a slide show, and at
none with less than this share of the largest impulse."""

HOLD_TOTAL, HOLD_LONGEST, TAIL = 300, 130, 120
"""Hundredths of a second: all holds together at most, one of them, and the last picture."""

ASKED = 300
"""Hundredths of a second that a film waits for a prediction."""

EDGE = 0.012
"""Least distance of particle 0 from the window's edges when the film begins, in shares of its
larger side."""

TOLD = 1.2
"""s on the screen, without holds, for which the caption says what happened."""

LASTING = (Kind.STICK, Kind.SETTLE, Kind.EXIT)
"""Events that begin a motion: the caption shows them until the next event."""


@dataclass(frozen=True)
class Moment:
    """One picture of the film: the recording's time (s), and what happened last, in words.

    It stays for `delay` hundredths of a second.
    """

    t: float
    delay: int
    words: str


def asked(recording: Recording, begin: float) -> float:
    """Return the time (s) at which a film stops for a prediction, before the result.

    It is when particle 0 comes to the top of the drive pulley, or when the film begins.
    """
    track = recording.track(0)
    times = np.linspace(float(track["t"][0]), action(recording)[0], 2000)
    over = nominal(recording, times)[0][:, 0] >= -1e-9
    carried = recording.machine.pulley is not None and not over[0] and over.any()
    return max(begin, float(times[np.argmax(over)])) if carried else begin


def film(
    recording: Recording,
    begin: float,
    end: float,
    *,
    fps: int,
    slow: float,
    ask: float | None = None,
    crowd: bool = False,
) -> tuple[Moment, ...]:
    """Return the moments from `begin` to `end`: equal steps, and holds at the hardest impacts.

    There are `fps` pictures a second; `slow` is seconds on the screen for one of the recording. At
    the time `ask`, if it is given, the film holds, for viewers to predict what comes. For a `crowd`
    it shows how many have come and gone, and does not hold at impacts of particle 0.

    Raises a `ValueError` if `fps` is no divisor of 100 up to 50 (a shorter delay browsers take for
    10 hundredths of a second), or `slow` is not positive and finite.
    """
    if not 0 < fps <= 50 or 100 % fps:
        raise ValueError(
            f"fps = {fps!r}: GIF delays are whole hundredths of a second; allowed are"
            " 1, 2, 4, 5, 10, 20, 25 and 50"
        )
    delay = 100 // fps
    if not 0.0 < slow < float("inf"):
        raise ValueError(f"slow = {slow!r}: allowed is a positive number")
    step = 0.01 * delay / slow
    events = recording.events
    own = events[(events["particle"] == 0) | (events["other"] == 0)]
    own = own[(own["t"] >= begin) & (own["t"] <= end)]
    crowd = crowd or one_of_many(recording)
    if crowd:
        own = own[:0]
    # The hardest impacts, in order, one for each time.
    impulse = np.abs(own["normal_impulse"])
    struck = np.flatnonzero(np.isin(own["kind"], STRUCK))
    struck = struck[impulse[struck] >= WORTH * impulse[struck].max(initial=0.0)]
    struck = struck[np.unique(own["t"][struck], return_index=True)[1]]
    held = struck[np.sort(np.argsort(-impulse[struck], kind="stable")[:HOLDS])]
    stops = own["t"][held]
    fixed = stops if ask is None else np.append(stops, ask)
    times = np.linspace(begin, end, max(2, round((end - begin) / step) + 1))
    if len(fixed):
        # A step that almost coincides with a hold would look like a stumble.
        times = times[np.abs(times[:, None] - fixed).min(axis=1) > 0.5 * step]
    times = np.unique(np.concatenate([[begin], times, fixed, [end]]))
    hold = min(HOLD_TOTAL // max(len(stops), 1), HOLD_LONGEST)
    delays = np.where(np.isin(times, stops), hold, delay)
    delays[-1] = max(delays[-1], TAIL)
    if crowd:
        gates = _gates(recording.machine, times, slow)
        counts = [
            [
                say(f"count-{what}", count=figures(n, ","))
                for n in np.searchsorted(np.sort(when), times, side="right").tolist()
            ]
            for what, when in flow(recording).items()
            if len(when)
        ]
        words = [told or ", ".join(said) for told, *said in zip(gates, *counts, strict=True)]
    else:
        words = _words(recording, own, held, times, slow)
    if ask is not None:
        at = int(np.searchsorted(times, ask))
        delays[at], words[at] = ASKED, say("ask")
    return tuple(Moment(float(t), int(d), w) for t, d, w in zip(times, delays, words, strict=True))


def span(recording: Recording, shown: Window) -> tuple[float, float]:
    """Return the beginning and end of the film (s).

    It begins when particle 0 comes into the window and ends with the recording, but a stream is
    shown for at most `LIVES` times the time of particle 0, or of the first of each stream.
    """
    track = recording.track(0)
    first, last = float(track["t"][0]), float(track["t"][-1])
    times = np.linspace(first, max(action(recording)[0], first), 400)
    radius = float(recording.radius[0])
    inset = max(EDGE, radius / max(shown.width, shown.height))
    all_of_it = shown.padded(*[-inset] * 4)
    inside = all_of_it.holds(nominal(recording, times)[0])
    begin = float(times[np.argmax(inside)]) if inside.any() else first
    end = float(recording.knots["t"].max())
    if last <= begin or one_of_many(recording):
        return begin, end
    firsts = np.unique(recording.machine.releases.stream, return_index=True)[1]
    lasts = [recording.track(i)["t"][-1] for i in firsts[recording.released[firsts]].tolist()]
    return begin, min(end, max(begin + LIVES * (last - begin), *lasts))


def slowness(length: float) -> float:
    """Return the round factor that shows `length` seconds in at most `RUNNING`, but not by much.

    >>> slowness(0.6), slowness(2.5), slowness(40.0)
    (6.0, 1.5, 0.1)
    """
    if length <= 0.0:
        return 1.0
    exact = RUNNING / length * (1.0 + 1e-9)
    power = floor(log10(exact))
    mantissa = exact / 10.0**power
    return float(f"{max(m for m in (1, 1.5, 2, 3, 4, 5, 6, 8) if m <= mantissa)}e{power}")


def _at(t: float, said: str) -> str:
    return f"t = {figures(t, '.3f')} s: {said}"


def _gates(machine: Machine, times: Floats, slow: float) -> list[str]:
    """Return the caption at each time: for a while the gate that opened or closed last."""
    news = {
        (t, _at(t, say(f"event-gate-{what}", surface=surface_words(machine.surfaces[surface]))))
        for parts in machine.parts
        for clock, what in ((parts.appears, "closes"), (parts.vanishes, "opens"))
        for t, surface in zip(clock.tolist(), parts.surface.tolist(), strict=True)
        if isfinite(t)
    }
    told = sorted(news)
    last = np.searchsorted([t for t, _ in told], times, side="right") - 1
    return [
        told[i][1] if i >= 0 and slow * (t - told[i][0]) <= TOLD else ""
        for t, i in zip(times.tolist(), last.tolist(), strict=True)
    ]


def _words(
    recording: Recording, own: NDArray[Any], held: Ints, times: Floats, slow: float
) -> list[str]:
    """Return the caption at each time: for a while the last event, then the present motion.

    Captions are for impacts at which the film holds, and for other events.
    """
    struck = np.isin(own["kind"], STRUCK)
    told = ~struck & (own["kind"] != Kind.RELEASE)
    if list(own["kind"][:2]) == [Kind.RELEASE, Kind.STICK]:
        # Released at the belt's speed, it never slipped.
        released, rode = own["velocity_after"][:2]
        told[1] = not np.allclose(rode, released, rtol=1e-3, atol=1e-6)
    told[held] = True
    stories = np.flatnonzero(told)
    lines = [_at(own["t"][i], sentence(recording, own[i])) for i in stories]
    # Particle 0 comes on the incoming belt if that is the first thing it leaves.
    first = own[struck | (own["kind"] == Kind.SEPARATION)][:1]
    incoming = recording.surface_index("incoming")
    carried = any((first["kind"] == Kind.SEPARATION) & (first["surface"] == incoming))
    gone = float(recording.track(0)["t"][-1])
    near = 0.25 * float(np.diff(times).min(initial=np.inf))
    flying = in_flight(recording, times, near)
    still = ~np.any(nominal(recording, times)[1], axis=1)
    captions, told_at = [], own["t"][stories]
    for t, flies, lies in zip(times, flying.tolist(), still.tolist(), strict=True):
        story = int(np.searchsorted(told_at, t, side="right")) - 1
        if story >= 0:
            last = own[stories[story]]
            # An impact is no longer mentioned once the particle slides.
            news = slow * (t - last["t"]) <= TOLD and (flies or last["kind"] not in STRUCK)
            if news or last["kind"] in LASTING:
                captions.append(lines[story])
                continue
        elif carried:
            captions.append(say("carried"))
            continue
        latest = int(np.searchsorted(own["t"], t, side="right")) - 1
        known = latest >= 0 and t <= gone
        said = going_on(recording, own[latest], flying=flies, still=lies) if known else ""
        captions.append(said)
    for i in held:
        # Other events at the same time wait for the next picture.
        at = int(np.searchsorted(times, own["t"][i]))
        captions[at] = lines[int(np.searchsorted(stories, i))]
    return captions
