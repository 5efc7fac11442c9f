"""Crowds: where a run does not get on, it says so, and keeps what it has."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from chutelab.machine import build
from chutelab.recorder import StalledError
from chutelab.recording import Kind
from chutelab.scene import parse
from chutelab.stepper import crowd, run
from chutelab.stepper.crowd import Crowd

R, GAP, SPEED, START = 0.004, 1e-6, 2.0, 0.1

SCENE = """
gravity = 0.0
[stream]
count = 6
rate = 1.0
at = [0.0, 1.0]
velocity = [1.0, 0.0]
bed_height = 0.01
interact = true
restitution = 1.0
[run]
until = 0.2
[[surface]]
name = "far"
from = [-50.0, -50.0]
to = [50.0, -50.0]
"""


def cradle():
    """Five at rest in a row, hair by hair; a sixth comes and the blow goes through them all."""
    machine = build(parse(SCENE))
    row = [(5.0 + n * (2.0 * R + GAP), 3.0) for n in range(5)]
    position = np.array([*row, (5.0 - 2.0 * R - SPEED * START, 3.0)])
    velocity = np.zeros((6, 2))
    velocity[5, 0] = SPEED
    return replace(
        machine,
        releases=replace(machine.releases, t=np.zeros(6), position=position, velocity=velocity),
    )


def test_a_blow_goes_through_a_row_within_one_step():
    recording = run(cradle())
    hits = recording.select(Kind.COLLISION)
    assert hits["t"] == pytest.approx(START + np.arange(5) * GAP / SPEED, abs=1e-12)
    ends = np.array([recording.track(n)[-1]["velocity"] for n in range(6)])
    assert ends[4] == pytest.approx([SPEED, 0.0], abs=1e-12)
    assert ends[[0, 1, 2, 3, 5]] == pytest.approx(np.zeros((5, 2)), abs=1e-12)


def test_too_many_impacts_within_a_step_say_who_when_and_where(monkeypatch):
    monkeypatch.setattr(crowd, "BOUND", (3, 0))
    with pytest.raises(StalledError) as caught:
        run(cradle())
    error = caught.value
    # The fourth impact is one too many: that of the third and the fourth in the row.
    assert error.particle in (2, 3)
    assert error.t == pytest.approx(START + 3 * GAP / SPEED, abs=1e-12)
    x = 5.0 + error.particle * (2.0 * R + GAP) + (GAP if error.particle == 2 else 0.0)
    assert error.position == pytest.approx((x, 3.0), abs=1e-9)
    told = str(error)
    place = f"t = {error.t:.6g} s, x = {x:.6g} m, y = 3 m"
    assert f"particle {error.particle} is stuck at {place}" in told
    assert "4 impacts within one step" in told
    # What happened until then is kept.
    recording = error.recording
    assert recording is not None
    assert len(recording.select(Kind.COLLISION)) == 3
    assert recording.track(2)[-1]["t"] == error.t
    assert recording.track(2)[-1]["velocity"] == pytest.approx([SPEED, 0.0], abs=1e-12)


@pytest.mark.parametrize("dt", [1e-2, 1e-3, 1e-5])
def test_however_thick_a_crowd_a_step_presses_it_together_by_a_hundredth_of_a_radius(dt):
    slow = max(9.81 * dt, 2e-3 * R / dt)
    state = SimpleNamespace(start=0.0, dt=dt, radius=R, slow=slow, count=6)
    thick = Crowd(state)
    impacts = [0, 1, 10, 100, 200]
    alone = [thick.least_approach(n) for n in impacts]
    assert alone[:3] == [slow] * 3
    assert alone == sorted(alone)
    thick._load = 10_000
    pressed = [thick.least_approach(n) for n in impacts]
    # m/s times s: what two that are left to the step may overlap after it.
    assert max(*alone, *pressed) * dt <= max(0.01 * R, slow * dt)
    assert pressed[-1] == max(0.01 * R / dt, slow)
