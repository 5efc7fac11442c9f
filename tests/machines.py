"""Machines that several test files run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from chutelab.machine import build
from chutelab.scene import parse
from chutelab.stepper import run

PERPENDICULAR = """
[incoming]
speed = 2.0
pulley_radius = 0.1
[plate]
distance = 0.5
[outgoing]
drop = 0.5
"""


def two_disks(
    positions,
    velocities,
    *,
    times=(0.0, 0.0),
    gravity=0.0,
    restitution=0.7,
    friction=0.4,
    spin=True,
    until=0.2,
    dt=1e-3,
):
    """Run the pymunk engine on two disks, each released when and where told, far from all else."""
    machine = build(
        parse(
            f"""
gravity = {gravity}
[particle]
spin = {str(spin).lower()}
[stream]
count = 2
rate = 1.0
at = [0.0, 1.0]
velocity = [1.0, 0.0]
bed_height = 0.01
interact = true
restitution = {restitution}
friction = {friction}
[run]
until = {until}
dt = {dt}
[[surface]]
name = "far"
points = [[-50.0, -50.0], [50.0, -50.0], [50.0, 50.0]]
"""
        )
    )
    releases = replace(
        machine.releases,
        t=np.array(times),
        position=np.array(positions, dtype=float),
        velocity=np.array(velocities, dtype=float),
    )
    return run(replace(machine, releases=releases))
