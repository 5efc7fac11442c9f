"""Lone particles in the stepped engines, in scenes drawn at random, against the exact engine.

Where all contacts are blows there is no step to go wrong by. Where contacts last, errors vanish as
steps shorten: as dt² in the contact engine, as dt in pymunk.

What is compared is what `studies.accuracy` calls a run's answers, by the sizes it gives them:
where, when and how fast each surface is struck first and left first, the impulses, the end and the
ledger. With three reservations, which are the same for every scene:

- Blows softer than what gravity does in two steps are part of a lasting contact, not events.
- A particle that slides where nothing presses it may be told to leave or not to leave: separations
  count where both tell them. Their velocity does not count (see `test_contact.py`).
- Where two surfaces are struck at once, or so soon one after the other that a step cannot tell,
  rigid bodies have no answer, and engines choose one. A run counts up to there. So it does to where
  a particle lies still against a moving surface and another one: two forces and two frictions
  balance the weight, one equation too few for the work of the belt.
"""

from dataclasses import replace
from itertools import pairwise
from math import inf, log, sqrt

import numpy as np
import pytest

from chutelab.engines import contact, exact, pymunk
from chutelab.engines.pymunk.faces import HAIR
from chutelab.engines.pymunk.world import DIGITS
from chutelab.machine import build
from chutelab.results import Kind
from chutelab.results.recorder import StalledError
from chutelab.studies.accuracy import apart, each, sizes, stirred
from crowds import hop_step
from drawn import draw, only_blows
from references import normal_of

LONGEST = 4e-3
"""s; the first step tried."""

RATIO = 4.0
"""Of one step to the next."""

PHASES = (1.0, 0.93, 0.86, 0.79, 0.71)
"""Shares of each step that are run as well, by the contact engine: errors depend on where within a
step a phase begins, and the largest of five is what counts."""

BLOWS = {contact: 1e-10, pymunk: 1e-9}
"""Relative error allowed where all contacts are blows, for inputs whose change comes out no larger
than it went in."""

ORDERS = {contact: 1.6, pymunk: 0.9}
"""Order at which errors vanish, at least: 2 and 1, less what five phases leave to chance."""


def step_of(engine, machine):
    """Return the first step, s. A hop in the contact engine, g h²/8, is at most r/1000."""
    return LONGEST if engine is pymunk else hop_step(machine, LONGEST)


def together(recording, least):
    """Return when two surfaces are struck within less than `least` (s), inf if they never are."""
    struck = recording.select(Kind.IMPACT, Kind.LANDING)
    normals = [normal_of(recording, blow) for blow in struck]
    other = [float(a @ b) < 1.0 - 1e-6 for a, b in pairwise(normals)]
    at = np.flatnonzero((np.diff(struck["t"]) < least) & np.array(other, dtype=bool))
    return float(struck["t"][at[0]]) if len(at) else inf


def jammed(recording, machine):
    """Return when it comes to lie for good between two surfaces of which one moves, or inf."""
    knots, parts = recording.knots, machine.segments
    still = ~knots["velocity"].any(axis=1)
    if not still[-1]:
        return inf
    way = knots["position"][-1] - parts.start
    along = np.clip((way * parts.tangent).sum(axis=1), 0.0, parts.length)
    gaps = np.hypot(*(way - along[:, None] * parts.tangent).T) - machine.particle.radius
    touched = parts.speed[gaps < 1e-9 * machine.particle.radius]
    moves = np.flatnonzero(~still)
    return knots["t"][moves[-1] + 1] if len(touched) > 1 and touched.any() else inf


def flies_back(recording, machine):
    """Return when, without gravity, it flies back over the pulley as low as the belt carried it.

    Then it grazes the pulley. Chipmunk's normal of a blow is off by the rounding of coordinates
    over the radius, by which it may come so much lower as to touch.
    """
    if machine.gravity != 0.0 or machine.pulley is None:
        return inf
    height = machine.pulley.radius + machine.particle.radius
    blows = recording.select(Kind.IMPACT, Kind.LANDING)["t"]
    knots = recording.knots[recording.knots["t"] >= min(blows, default=inf)]
    (x, y), (vx, _) = knots["position"].T, knots["velocity"].T
    tilt = DIGITS * np.abs(x) / machine.particle.radius
    back = (x * vx < 0.0) & (np.abs(y - height) <= tilt * np.abs(x))
    return min(knots["t"][back] - x[back] / vx[back], default=inf)


def told(recording, soft, until, surfaces):
    """Return the answers of a run up to a time, without blows softer than `soft` (m/s), and with
    the separations from some surfaces."""
    events = recording.events
    blows = np.isin(events["kind"], (Kind.IMPACT, Kind.LANDING))
    weak = blows & (events["normal_impulse"] <= soft * recording.particle.mass)
    parts = events["kind"] == Kind.SEPARATION
    idle = parts & ~np.isin(events["surface"], list(surfaces))
    kept = replace(recording, events=events[~weak & ~idle & (events["t"] < until)])
    whole = ("energy", "number") if until < inf else ()
    return [
        answer for answer in each(kept)
        if answer.name != "velocity at the separation" and answer.kind not in whole
        and (until == inf or answer.name != "place of the end")
    ]  # fmt: skip


def difference(found, reference, soft, until):
    """Return how far a run is from the reference, relative; inf if other things happen."""
    runs = found, reference
    left = [set(run.select(Kind.SEPARATION)["surface"].tolist()) for run in runs]
    mine, its = (told(run, soft, until, left[0] & left[1]) for run in runs)
    return apart(mine, its, sizes(reference), "relative")[0]


def errors(engine, machine, reference, levels, phases=(1.0,)):
    """Return the largest error of a lone run at each level of steps, and the last step (s)."""
    first = step_of(engine, machine)
    back = flies_back(reference, machine) if engine is pymunk else inf
    until = min(together(reference, 2.0 * first), jammed(reference, machine), back) - 2.0 * first
    machine = replace(machine, end_time=min(machine.end_time, until))
    found = []
    for level in range(levels):
        steps = [share * first / RATIO**level for share in phases]
        worst = 0.0
        for dt in steps:
            run = engine.run(replace(machine, dt=dt))
            worst = max(worst, difference(run, reference, 4.0 * machine.gravity * dt, until))
        found.append(worst)
    return found, first / RATIO ** (levels - 1)


def growth(scene, reference):
    """Return by how much a scene magnifies a change of its inputs, at least 1."""
    share = 1e-9
    other = exact.run(build(stirred(scene, share)))
    return max(1.0, difference(other, reference, 0.0, inf) / share)


def left_out(engine, machine, reference, dt):
    """Return the error that an engine may keep, whatever the order (relative).

    In the contact engine what begins and ends within one step: g dt², by the size L of places; and
    what rounding of places, 2e-16 L, does to a load of about g that wears off: 2e-16 L/(g dt²). In
    pymunk bounces lower than two hairs h, which take 2 √(2 h/g) (1 + ε + ε² + ...), by what moves
    on in that time (see `chutelab.engines.pymunk.lone`).
    """
    size = sizes(reference)
    if engine is contact:
        fall = machine.gravity * dt**2 / size["place"]
        rounding = 2e-16 / (fall * min(PHASES) ** 2) if fall > 0.0 else 0.0
        return max(BLOWS[engine], fall, rounding)
    blows = reference.select(Kind.IMPACT, Kind.LANDING)
    if not len(blows) or machine.gravity == 0.0:
        return BLOWS[engine]
    lengths = np.abs([*machine.segments.start.ravel(), *machine.segments.end.ravel()]).max()
    hair = max(HAIR * machine.particle.radius, 4.0 * DIGITS * float(lengths))
    e = float(machine.segments.restitution[machine.segments.restitution < 1.0].max(initial=0.0))
    lost = 2.0 * sqrt(2.0 * 2.0 * hair / machine.gravity) / (1.0 - e)
    return max(BLOWS[engine], lost * max(size["speed"] / size["place"], 1.0 / size["time"]))


def check(engine, seed):
    scene = draw(seed, points=False)
    machine = build(scene)
    try:
        reference = exact.run(machine)
    except exact.CornerError:
        pytest.skip("a belt and a wall hold it: the exact engine has no answer")
    except StalledError:
        # Its blows never end, and so it is in each engine.
        with pytest.raises(StalledError):
            engine.run(machine)
        return
    # A rebound as slow as what gravity does in a step is over within two: it is no blow.
    if only_blows(reference, 2.0 * step_of(engine, machine)):
        (error,), _ = errors(engine, machine, reference, 1)
        assert error <= BLOWS[engine] * growth(scene, reference)
        return
    # Pymunk's steps on a curve are half a radius' way at most: three levels may differ too little.
    for levels in (4,) if engine is contact else (3, 4):
        phases = PHASES if engine is contact else (1.0,)
        found, dt = errors(engine, machine, reference, levels, phases)
        # An error may be small by luck: that counts which is the largest at any step.
        coarse, fine = max(found), found[-1]
        order = log(coarse / fine) / log(RATIO ** (levels - 1)) if 0.0 < fine < inf else 0.0
        if fine <= left_out(engine, machine, reference, dt) or order >= ORDERS[engine]:
            return
    raise AssertionError(found)


@pytest.mark.parametrize(
    ("engine", "seed"),
    [
        pytest.param(engine, n, marks=() if n in few else pytest.mark.slow)
        for engine, few in ((contact, range(2, 6)), (pymunk, range(1, 4)))
        for n in range(500)
    ],
)
def test_a_stepped_engine_comes_to_what_exact_says(engine, seed):
    check(engine, seed)
