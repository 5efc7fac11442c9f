"""A transfer written out by hand, whose every number is known, and the texts seen in a figure."""

from __future__ import annotations

from math import sqrt

import numpy as np
from matplotlib.figure import Figure
from matplotlib.text import Text

from chutelab import scene
from chutelab.machine import build
from chutelab.results import Kind, Recording
from chutelab.results.recorder import Recorder

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


def t_impact() -> float:
    return (R + DISTANCE - PARTICLE) / V


def t_landing() -> float:
    down = G * t_impact()
    return t_impact() + (sqrt(down**2 + 2.0 * G * DROP) - down) / G


def expected(since: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Position and velocity after leaving the top at V, plate at t_impact: v_x becomes -ε V."""
    hit = R + DISTANCE - PARTICLE
    after = since >= t_impact()
    x = np.where(after, hit - EPS * V * (since - t_impact()), V * since)
    y = R + PARTICLE - 0.5 * G * since**2
    vx = np.where(after, -EPS * V, V)
    return np.stack([x, y], axis=-1), np.stack([vx, -G * since], axis=-1)


def by_hand(residual: float = 0.0, shift: float = 0.0) -> Recording:
    """One particle: ride, separation at 0.5 s, plate, landing; optionally with planted errors.

    `residual` J too few are booked as slip heat; the flight is `shift` m too high.
    """
    machine = build(scene.parse(TEXT))
    recorder = Recorder(machine)
    start = np.array([-1.0, R + PARTICLE])
    along = np.array([V, 0.0])
    lifted = np.array([0.0, shift])

    def knot(t: float, position: np.ndarray, velocity: np.ndarray) -> None:
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
    recorder.book([0], [1], restitution_loss=0.5 * MASS * V**2 * (1.0 - EPS**2))
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
    recorder.book([0], [2], work, lost, work - lost - gained - residual)
    knot(now, place + lifted, carried)
    recorder.events(
        Kind.LANDING, [0], [now], place + lifted, carried, velocity_before=down, surface=2,
        normal_impulse=MASS * abs(down[1]), tangential_impulse=push,
    )  # fmt: skip
    recorder.ended[:] = 1
    return recorder.finish(engine="exact", steps=3)


def seen(figure: Figure) -> list[Text]:
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
