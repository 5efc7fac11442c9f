"""SciPy's DOP853 with events: what a careful scientist writes instead of an engine.

The flights are integrated by `scipy.integrate.solve_ivp`, each until its event; what happens at the
event is put in by hand. One particle at a time: events of many are solved one after the other. It
knows these cases only, and so is fast; `chutelab.engines.reference` follows any machine.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from chutelab.machine import build
from chutelab.scene import Scene
from workprecision.cases import Answer


def _until(
    event: Callable[[float, Any], float],
    rates: Callable[[float, Any], Sequence[float]],
    state: Sequence[float],
    scene: Scene,
    rtol: float,
    first_step: float | None = None,
) -> tuple[float, Any]:
    """Integrate a state (x, y, vx, vy) until an event falls to 0; return the time and the state."""
    event.terminal, event.direction = True, -1.0  # type: ignore[attr-defined]
    found = solve_ivp(
        rates,
        (0.0, scene.run.max_time),
        state,
        method="DOP853",
        rtol=rtol,
        atol=rtol,
        events=event,
        first_step=first_step,
    )
    return float(found.t[-1]), found.y[:, -1].tolist()


def _flight(
    scene: Scene, start: Sequence[float], rtol: float
) -> tuple[dict[str, float], Sequence[float]]:
    """Follow one particle from the top of the pulley to its landing."""
    belt, plate, out, r = scene.incoming, scene.plate, scene.outgoing, scene.particle.radius
    assert belt is not None
    assert plate is not None
    assert out is not None
    face = belt.pulley_radius + plate.distance - r
    level = belt.pulley_radius - out.drop + r

    def rates(_t: float, state: Any) -> Sequence[float]:
        return state[2], state[3], 0.0, -scene.gravity

    def to_plate(_t: float, state: Any) -> float:
        return float(face - state[0])

    def to_belt(_t: float, state: Any) -> float:
        return float(state[1] - level)

    t2, (x, y, vx, vy) = _until(to_plate, rates, start, scene, rtol)
    rebound = (x, y, -plate.restitution * vx, vy)
    t3, last = _until(to_belt, rates, rebound, scene, rtol)
    answer = {
        "t2": t2,
        "y2": start[1] - y,
        "t3": t3,
        "x3": x - last[0],
        "v3x": -last[2],
        "v3y": -last[3],
    }
    return answer, last


def _start(scene: Scene) -> tuple[float, float, float, float]:
    """Return the state at the top of the pulley: the ride up to there needs no integration."""
    assert scene.incoming is not None
    return (0.0, scene.incoming.pulley_radius + scene.particle.radius, scene.incoming.speed, 0.0)


def _arrays(answer: dict[str, float]) -> Answer:
    return {name: np.array([value]) for name, value in answer.items()}


def transfer(scene: Scene, rtol: float) -> Answer:
    """Integrate one particle until it has landed."""
    return _arrays(_flight(scene, _start(scene), rtol)[0])


def belt(scene: Scene, rtol: float) -> Answer:
    """Integrate one particle until it has landed, and its slip until the belt has its speed."""
    answer, (x, y, vx, vy) = _flight(scene, _start(scene), rtol)
    out = scene.outgoing
    assert out is not None
    mu = float(out.friction)
    side = 1.0 if vx < out.speed else -1.0
    vx += side * min(mu * abs(vy), abs(out.speed - vx))

    def rates(_t: float, state: Any) -> Sequence[float]:
        return state[2], 0.0, side * mu * scene.gravity, 0.0

    def to_grip(_t: float, state: Any) -> float:
        return float(side * (out.speed - state[2]))

    time, last = _until(to_grip, rates, (x, y, vx, 0.0), scene, rtol)
    return _arrays({**answer, "t_grip": time, "x_grip": last[0] - x})


def bounce(scene: Scene, rtol: float) -> Answer:
    """Integrate bounce after bounce until they are shorter than `rtol` of what has passed.

    The height is that over the floor, or short bounces would drown in its digits. The first step of
    each flight is half of it: a flight starts where its event is 0, and one that was over within
    the first step would not be seen to have begun.
    """
    floor, r, g = scene.surface[0], scene.particle.radius, scene.gravity
    assert scene.stream.at is not None

    def rates(_t: float, state: Any) -> Sequence[float]:
        return state[2], state[3], 0.0, -g

    def to_floor(_t: float, state: Any) -> float:
        return float(state[1])

    x, y = scene.stream.at
    passed, state = _until(to_floor, rates, (x, y - r, 0.0, 0.0), scene, rtol)
    flight = passed
    while flight > rtol * passed:
        speed = -floor.restitution * state[3]
        again = (state[0], 0.0, state[2], speed)
        flight, state = _until(to_floor, rates, again, scene, rtol, first_step=speed / g)
        passed += flight
    return _arrays({"t_rest": passed, "y_rest": state[1] + r})


def independent(scene: Scene, rtol: float) -> Answer:
    """Integrate the particles of a stream one after the other."""
    starts = build(scene).releases
    found = [
        _flight(scene, (*position, *velocity), rtol)[0]
        for position, velocity in zip(
            starts.position.tolist(), starts.velocity.tolist(), strict=True
        )
    ]
    return {name: np.array([one[name] for one in found]) for name in found[0]}
