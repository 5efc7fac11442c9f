"""Strings, rods, springs and pins as joints of a Space, and what their impulses do to the ledger.

A string takes nothing while it is tight, a rod or a pin never, but for the order of the step: what
they take is a restitution loss of the particles. What a spring gives them is told as their work.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pymunk
from pymunk import Vec2d

from chutelab.machine import Joint, Machine
from chutelab.util.arrays import Floats

LEFT = 0.9
"""Share that is left, a step later, of what a string was stretched by when it was pulled tight."""

TAUT, ROUNDING = 1e-9, 1e-13
"""Shares of its length: by which a string that pulls may seem too short, and is kept stretched."""


@dataclass
class Tie:
    """A joint of the Space; of a string, `over` (m) is what it is still stretched by."""

    joint: Joint
    held: Any
    spring: Floats  # a row of `Record.springs`
    over: float = 0.0
    tied: bool = False

    def ends(self, positions: Floats) -> tuple[Vec2d, Vec2d]:
        """Return its far end and its particle's, where particles are at positions (2, N)."""
        far, own = self.joint.ends(positions.T)
        return Vec2d(*far.tolist()), Vec2d(*own.tolist())


class Ties:
    """All joints of a machine.

    Parameters
    ----------
    machine : Machine
    space : pymunk.Space
    bodies : list of pymunk.Body
        Of each particle.
    """

    def __init__(self, machine: Machine, space: pymunk.Space, bodies: list[pymunk.Body]) -> None:
        self.space, self.all = space, list[Tie]()
        self.free = np.zeros(machine.count, dtype=bool)
        for joint in machine.joints:
            held = self._held(joint, bodies, machine.releases.position)
            held.error_bias = 0.0
            held.collide_bodies = joint.kind not in ("rod", "pin")
            self.all.append(Tie(joint, held, np.zeros(4)))
        self.springs = [tie.spring for tie in self.all if tie.joint.kind == "spring"]

    def _held(self, joint: Joint, bodies: list[pymunk.Body], places: Floats) -> Any:
        far = self.space.static_body if joint.other < 0 else bodies[joint.other]
        own, anchor = bodies[joint.particle], joint.anchor or (0.0, 0.0)
        if joint.kind == "string":
            return pymunk.SlideJoint(far, own, anchor, (0.0, 0.0), 0.0, joint.length)
        if joint.kind == "spring":
            rest = joint.length, joint.stiffness, joint.damper
            return pymunk.DampedSpring(far, own, anchor, (0.0, 0.0), *rest)
        if joint.kind == "rod":
            rod = pymunk.PinJoint(far, own, anchor, (0.0, 0.0))
            rod.distance = joint.length
            return rod
        arm = tuple((np.array(anchor) - places[joint.particle]).tolist())
        if joint.other >= 0:
            anchor = tuple((np.array(anchor) - places[joint.other]).tolist())
        return pymunk.PivotJoint(far, own, anchor, arm)

    def put(self, i: int, *, free: bool) -> None:
        """Tie what a particle has, or take it away: what has two is tied once both fly."""
        self.free[i] = free
        for tie in self.all:
            joint = tie.joint
            if i not in (joint.particle, joint.other):
                continue
            flies = bool(self.free[joint.particle] and (joint.other < 0 or self.free[joint.other]))
            if flies != tie.tied:
                (self.space.add if flies else self.space.remove)(tie.held)
            tie.tied = flies

    def tighten(self, h: float) -> None:
        """Set the lengths of strings for the next step.

        Chipmunk lets a string go that is not longer than its length: one that pulls is kept longer
        by rounding. One that is pulled tight has overshot by up to a step; that is taken back
        slowly, or what hangs on it would be thrown back.
        """
        for tie in self.all:
            if not tie.tied or tie.joint.kind != "string":
                continue
            held, whole = tie.held, tie.joint.length
            ahead = held.b.position + h * held.b.velocity
            far = held.anchor_a if tie.joint.other < 0 else held.a.position + h * held.a.velocity
            length = (ahead - far).length
            if held.impulse > 0.0:
                tie.over *= LEFT
            else:
                tie.over = max(length - whole, 0.0)
            held.max = whole + tie.over
            if length > whole * (1.0 - TAUT):
                held.max = min(held.max, length * (1.0 - ROUNDING))

    def pulled(self, state: Floats, pull: Vec2d, h: float) -> list[tuple[Tie, Floats]]:
        """Return what each joint did in the last step to the ledger: entries of the particles, J.

        `state` (2, 5, N) is that before and after it: x, y, vx, vy and angular velocity; `pull` is
        gravity.
        """
        done = []
        for tie in self.all:
            if not tie.tied:
                continue
            joint, own = tie.joint, state[..., tie.joint.particle]
            far = state[..., joint.other] if joint.other >= 0 else np.zeros((2, 5))
            mean, entries = 0.5 * (own + far * -1.0).sum(axis=0)[2:4], np.zeros(3)
            # Where the bodies stand is where the joint acts.
            held = tie.held
            middle = (held.anchor_a if joint.other < 0 else held.a.position) - held.b.position
            towards = np.array(middle.normalized())
            impulse = float(tie.held.impulse)
            if joint.kind == "spring":
                kept = [0.5 * joint.stiffness * ((a - b).length - joint.length) ** 2
                        for a, b in (tie.ends(state[k, :2]) for k in (0, 1))]  # fmt: skip
                entries[0] = -impulse * float(towards @ mean)
                damping = impulse - joint.stiffness * (joint.length - middle.length) * h
                if not tie.spring.any():
                    tie.spring[0] = kept[0]
                tie.spring[1] = kept[1]
                tie.spring[2:] += damping * float(towards @ mean), entries[0]
            elif joint.kind == "string":
                entries[1] = -impulse * float(towards @ mean)
            elif joint.kind == "rod":
                change = (own - far)[1, 2:4] - (own - far)[0, 2:4]
                change -= h * np.array(pull) if joint.other < 0 else 0.0
                entries[1] = -impulse * float(np.sign(towards @ change) * (towards @ mean))
            done.append((tie, entries))
        return done
