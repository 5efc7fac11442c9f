"""A transfer written out by hand, whose every number is known, and the texts seen in a figure."""

from dataclasses import replace
from math import inf, sqrt
from typing import NamedTuple

import numpy as np
import pytest
from matplotlib.text import Text

from chutelab import scene
from chutelab.machine import Arcs, Particle, Segments, build
from chutelab.machine.releases import Releases
from chutelab.results import REASONS, Kind, Recording
from chutelab.results.recorder import Recorder
from machines import boxed

G, V, R, PARTICLE, EPS, DISTANCE, DROP, MASS, MU = 9.81, 2.0, 0.1, 0.0063, 0.5, 0.5, 0.5, 0.008, 0.5
BELT_TIME = 0.5
TEXT = f"""
title = "By hand"
[incoming]
speed = {V}
pulley_radius = {R}
[plate]
distance = {DISTANCE}
restitution = {EPS}
[outgoing]
drop = {DROP}
friction = {MU}
"""
EXACT = ("perpendicular", "inclined-40", "inclined-60", "low-speed", "slip", "belt-landing")
SHOWN = [
    "inclined-60",
    *(pytest.param(name, marks=pytest.mark.slow) for name in (*EXACT[:2], *EXACT[3:], "free-fall")),
]
"""Scenes whose pictures are drawn; that with the longest texts by default."""


def t_impact():
    return (R + DISTANCE - PARTICLE) / V


def t_landing():
    down = G * t_impact()
    return t_impact() + (sqrt(down**2 + 2.0 * G * DROP) - down) / G


def expected(since):
    """Position and velocity after leaving the top at V, plate at t_impact: v_x becomes -ε V."""
    hit = R + DISTANCE - PARTICLE
    after = since >= t_impact()
    x = np.where(after, hit - EPS * V * (since - t_impact()), V * since)
    y = R + PARTICLE - 0.5 * G * since**2
    vx = np.where(after, -EPS * V, V)
    return np.stack([x, y], axis=-1), np.stack([vx, -G * since], axis=-1)


def by_hand(residual=0.0, shift=0.0):
    """One particle: ride, separation at 0.5 s, plate, landing; optionally with planted errors.

    `residual` J too few are booked as slip heat; the flight is `shift` m too high.
    """
    machine = build(scene.parse(TEXT))
    recorder = Recorder(machine)
    start = np.array([-1.0, R + PARTICLE])
    along = np.array([V, 0.0])
    lifted = np.array([0.0, shift])

    def knot(t, position, velocity):
        recorder.knots([0], [t], position, velocity, 0.0)

    knot(0.0, start, along)
    recorder.events(Kind.RELEASE, [0], [0.0], start, along)
    knot(BELT_TIME, np.array([0.0, R + PARTICLE]), along)
    top = np.array([0.0, R + PARTICLE + shift])
    knot(BELT_TIME, top, along)
    recorder.events(Kind.SEPARATION, [0], [BELT_TIME], top, along, surface=0)
    hit = np.array([R + DISTANCE - PARTICLE, R + PARTICLE - 0.5 * G * t_impact() ** 2 + shift])
    before = np.array([V, -G * t_impact()])
    after = np.array([-EPS * V, before[1]])
    now = BELT_TIME + t_impact()
    knot(now, hit, before)
    recorder.book(0, 1, restitution_loss=0.5 * MASS * V**2 * (1.0 - EPS**2))
    knot(now, hit, after)
    recorder.events(
        Kind.IMPACT, [0], [now], hit, after, velocity_before=before, surface=1,
        normal_impulse=MASS * V * (1.0 + EPS),
    )  # fmt: skip
    place, down = (part[0] for part in expected(np.array([t_landing()])))
    push = min(MU * MASS * abs(down[1]), MASS * (V - down[0]))
    carried = np.array([down[0] + push / MASS, 0.0])
    now = BELT_TIME + t_landing()
    knot(now, place + lifted, down)
    work, lost = push * V, 0.5 * MASS * down[1] ** 2
    gained = 0.5 * MASS * (carried @ carried - down @ down)
    recorder.book(0, 2, work, lost, work - lost - gained - residual)
    knot(now, place + lifted, carried)
    recorder.events(
        Kind.LANDING, [0], [now], place + lifted, carried, velocity_before=down, surface=2,
        normal_impulse=MASS * abs(down[1]), tangential_impulse=push,
    )  # fmt: skip
    recorder.ended[:] = 1
    return Recording.of(recorder.finish(engine="exact", steps=3))


class Line(NamedTuple):
    """A straight piece of the surface of that name."""

    name: str
    start: tuple[float, float]
    end: tuple[float, float]
    speed: float = 0.0
    appears: float = -inf
    vanishes: float = inf


class Round(NamedTuple):
    """An arc, in degrees, or a whole circle."""

    name: str
    center: tuple[float, float]
    radius: float
    begin: float = 0.0
    extent: float = 360.0
    speed: float = 0.0
    appears: float = -inf
    vanishes: float = inf


def conveyor(name, start, end, radius, speed):
    """A belt round two pulleys, forward on top."""
    a, b = np.array(start), np.array(end)
    x, y = (b - a) / np.hypot(*(b - a))
    up = radius * np.array([-y, x])
    runs = [Line(name, tuple(p), tuple(q), speed) for p, q in ((a + up, b + up), (b - up, a - up))]
    return [*runs, Round(name, start, radius, speed=speed), Round(name, end, radius, speed=speed)]


def machine_of(*pieces, at=((0.0, 1.0),), stream=(), radius=0.004, **more):
    """A machine of these pieces without conveyors, particles released at these places at 0 s."""
    base = build(
        scene.parse('title = "By hand"\n[stream]\nat = [0.0, 1.0]\nvelocity = [0.0, 0.0]\n')
    )
    names = tuple(dict.fromkeys(piece.name for piece in pieces))
    lines = [piece for piece in pieces if isinstance(piece, Line)]
    rounds = [piece for piece in pieces if isinstance(piece, Round)]

    def common(of):
        every = {key: np.array([float(getattr(one, key)) for one in of])
                 for key in ("speed", "appears", "vanishes")}  # fmt: skip
        every |= {key: np.full(len(of), 0.5) for key in ("restitution", "friction")}
        every["one_sided"] = np.zeros(len(of), np.int64)
        return every | {"surface": np.array([names.index(one.name) for one in of], np.int64)}

    start, end = (np.array([getattr(one, key) for one in lines], float).reshape(-1, 2)
                  for key in ("start", "end"))  # fmt: skip
    length = np.hypot(*(end - start).T)
    count, which = len(at), np.array(stream or [0] * len(at))
    found = replace(
        base,
        surfaces=names,
        segments=Segments(
            start=start, tangent=(end - start) / length[:, None], length=length, **common(lines)
        ),
        arcs=Arcs(
            center=np.array([one.center for one in rounds], float).reshape(-1, 2),
            radius=np.array([one.radius for one in rounds]),
            begin=np.radians([one.begin for one in rounds]),
            extent=np.radians([one.extent for one in rounds]),
            **common(rounds),
        ),
        releases=Releases(
            np.zeros(count), np.array(at, float), *np.zeros((1, count, 2)), *np.zeros((2, count)),
            np.zeros(count, bool), which, which.copy(), np.zeros((count, 4)),
        ),
        particle=Particle(radius, 0.008, 0.0),
        outlines=more.pop("outlines", (None,) * (1 + max(which))),
        **more,
    )  # fmt: skip
    return boxed(found)


def recording_of(machine, *tracks, ended="time"):
    """A recording of tracks, one a particle, of rows t, x, y, vx, vy, ω; angles are their sum."""
    recorder = Recorder(machine)
    for i, track in enumerate(tracks):
        rows = np.array(track, float)
        t, omega = rows[:, 0], rows[:, 5]
        angle = np.cumsum([0.0, *(0.5 * (omega[1:] + omega[:-1]) * np.diff(t))])
        recorder.knots(np.full(len(rows), i), t, rows[:, 1:3], rows[:, 3:5], omega, angle)
        recorder.events(Kind.RELEASE, i, rows[0, 0], rows[0, 1:3], rows[0, 3:5])
    recorder.ended[:] = REASONS.index(ended)
    return Recording.of(recorder.finish(engine="exact", steps=0))


def seen(figure):
    """All texts that are drawn, tick labels outside the view left out."""
    hidden = set()
    for ax in figure.axes:
        for axis in (ax.xaxis, ax.yaxis):
            low, high = sorted(axis.get_view_interval())
            slack = 1e-9 * (high - low)
            for minor in (False, True):
                ticks = axis.get_ticklocs(minor=minor)
                labels = axis.get_ticklabels(minor=minor)
                hidden |= {
                    label
                    for tick, label in zip(ticks, labels, strict=False)
                    if not low - slack <= tick <= high + slack or not ax.axison
                }
            if not ax.axison:
                hidden.add(axis.label)
    return [
        text
        for text in figure.findobj(Text)
        if text.get_visible() and text.get_text().strip() and text not in hidden
    ]


def assert_legible(figure, most):
    """No text is cut off, smaller than 9 pt, or by more than `most` pixels on another."""
    boxes = [(text, text.get_window_extent()) for text in seen(figure)]
    frame = figure.bbox
    for i, (text, box) in enumerate(boxes):
        assert text.get_fontsize() >= 9.0 or "mathdefault" in text.get_text()
        assert frame.x0 <= box.x0 < box.x1 <= frame.x1, text
        assert frame.y0 <= box.y0 < box.y1 <= frame.y1, text
        for other, near in boxes[:i]:
            beside = min(box.x1, near.x1) - max(box.x0, near.x0)
            above = min(box.y1, near.y1) - max(box.y0, near.y0)
            assert min(beside, above) < most, (text, other)
