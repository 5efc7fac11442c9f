"""Round the pulley, or the end of a face: particles that a straight step would carry off it."""

from __future__ import annotations

from math import cos, sin, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from chutelab.stepper.state import Run

Floats = NDArray[np.float64]


def follow(run: Run, particle: int, normal: Floats, rho: float) -> None:
    """Lead a particle round the pulley, or the end of a face, unless it is to fly off.

    Moved along the tangent it would lose the contact and hop. It gets the chord instead, and
    between move and solve half the centripetal change, so that the contact feels
    g cos φ - v²/ρ.
    """
    k = run.tracks
    w = k.w[particle]
    along = np.array([normal[1], -normal[0]])
    speed = float(w @ along)
    centripetal = speed * speed / rho
    pressed = centripetal < run.machine.gravity * normal[1]
    if pressed or run.bent[particle] == 1.0 / rho:
        run.bend[particle] = 1.0 / rho
    if not pressed:
        return
    turn = speed * run.dt / rho
    ahead = np.cos(turn) * normal + np.sin(turn) * along
    k.aim[particle] = w - 0.5 * run.dt * centripetal * normal
    push = 0.5 * run.mass * centripetal * ahead
    run.world.steer(particle, tuple(k.aim[particle].tolist()), tuple(push.tolist()))


def leave(run: Run, i: int, t: float) -> bool:
    """Let a particle go where it presses on a curve no more, up to a step before or after t.

    Return whether there is such a place; else the contact was lost by a hair, not for good.

    Near there friction is as small as the pressure p = g cos φ - v²/ρ, so v dv = g sin φ ρ dφ
    and dp/dφ = -3 g sin φ.
    """
    k, g, rho = run.tracks, run.machine.gravity, 1.0 / float(run.bend[i])
    (nx, ny), (wx, wy) = k.upon[i].tolist(), k.w[i].tolist()
    # Along the curve w is half a step of gravity ahead.
    speed = wx * ny - wy * nx - 0.5 * run.dt * g * nx
    pressure, slope = g * ny - speed * speed / rho, 3.0 * g * abs(nx)
    most = abs(speed) * run.dt / rho
    if pressure >= slope * most:
        return False
    turn = max(pressure / slope, -most) if slope > 0.0 else 0.0
    turn = turn if speed > 0.0 else -turn
    c, s = cos(turn), sin(turn)
    mx, my = nx * c + ny * s, ny * c - nx * s
    x, y = (k.at[i] + rho * np.array([mx - nx, my - ny])).tolist()
    faster = sqrt(max(speed * speed + 2.0 * g * rho * (ny - my), 0.0))
    faster = faster if speed > 0.0 else -faster
    then = t + (2.0 * rho * turn / (speed + faster) if turn else 0.0)
    k.give_up(i, then)
    k.mark(i, then, x, y, faster * my, -faster * mx, float(k.spin[i]))
    k.fly(i)
    return True
