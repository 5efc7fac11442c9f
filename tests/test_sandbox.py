"""Random machines of all parts and mixtures of all kinds: laws that every run of them must keep."""

from dataclasses import replace
from math import inf

import numpy as np
import pytest
import tomli_w

from chutelab.engines import contact, exact
from chutelab.engines.simulation import simulate
from chutelab.machine import build
from chutelab.results import Kind, Recording
from chutelab.results.laws import judge
from chutelab.results.ledger import ledger
from chutelab.results.record import hermite
from chutelab.scene import from_dict
from references import surface_gaps
from sandbox import draw, tables
from shared import call, seeds

INSIDE = 0.03
"""Radii that no particle may be in a surface or in another."""

NEAR = 2e-5
"""m that ends may differ by after lasting contacts, without a look at a finer step."""

SLOW, DT = 8.0, 1e-3
"""Blows of less than so many times the weight during a step (s) may count as rest."""

PLACES, STRIDE = 6, 0.25
"""Places between two knots at which a track is looked at, at least, and radii between two."""


def of_each(value, count):
    return np.broadcast_to(value, count)


def places_of(recording, particle, radius):
    """Return times (M,), s, and places (M, 2) on a track: its knots, and as many between that it
    moves by less than `STRIDE`."""
    track = recording.track(particle)
    if len(track) < 2:
        return track["t"], track["position"]
    step = np.diff(track["t"])
    fast = np.hypot(*track["velocity"].T).max() + recording.gravity * step
    count = np.maximum(PLACES, np.ceil(step * fast / (STRIDE * radius))).astype(int)
    left = np.repeat(np.arange(len(step)), count)
    share = (np.arange(len(left)) - np.repeat(np.cumsum(count) - count, count)) / count[left]
    place, _ = hermite(track, left, share)
    t = track["t"][left] + share * step[left]
    return np.append(t, track["t"][-1]), np.append(place, track["position"][-1:], axis=0)


def in_surfaces(recording):
    """Yield what is in a surface by more than it may: what passes one is, somewhere."""
    machine = recording.machine
    for particle, r in enumerate(of_each(machine.particle.radius, machine.count).tolist()):
        t, place = places_of(recording, particle, r)
        for piece, name, gap in surface_gaps(machine, place, r) if len(t) else ():
            deep = np.where(piece.there(t), -gap / r, -inf)
            if piece.gate and t[0] < piece.appears <= t[-1]:
                # It shuts on no disk: one in it then is not touched until it is clear of it.
                since = np.flatnonzero(t >= piece.appears)
                if deep[since[0]] > 0.0:
                    clear = np.flatnonzero(deep[since] <= 0.0)
                    deep[since[0] : since[clear[0]] if len(clear) else len(t)] = -inf
            if deep.max() > INSIDE:
                at = deep.argmax()
                yield f"{particle} in {name} by {deep[at]:.2g} r at {t[at]:.6g} s"


def in_others(recording, most=INSIDE):
    """Yield which particles are in each other by more than they may, in radii."""
    machine = recording.machine
    radius = of_each(machine.particle.radius, machine.count)
    t = np.unique(recording.knots["t"])
    some = t[:: max(1, len(t) // 300)]
    for now in np.concatenate([some, np.linspace(t[0], t[-1], 200)]):
        place = recording.at([now])[0][0]
        here = np.flatnonzero(np.isfinite(place[:, 0]))
        gap = np.hypot(*np.moveaxis(place[here][:, None] - place[here], -1, 0))
        deep = (np.add.outer(radius[here], radius[here]) - gap) / np.minimum.outer(
            radius[here], radius[here]
        )
        np.fill_diagonal(deep, -inf)
        if len(here) and deep.max() > most:
            i, j = here[list(np.unravel_index(deep.argmax(), deep.shape))]
            yield f"{i} in {j} by {deep.max():.2g} r at {now:.6g} s"


def in_the_ledger(recording):
    """Yield what the books leave unexplained."""
    books = ledger(recording)
    if not abs(books.residual) <= 1e-10 * books.turned_over:
        yield f"ledger: {books.relative_residual:.1e}"
    if books.by_stream:
        others = sum(one["from_others"] for one in books.by_stream.values())
        if not abs(others - books.residual) <= 1e-12 * books.turned_over:
            yield f"streams: {others:.3g} J from others, residual {books.residual:.3g} J"
        if not recording.machine.interact and any(
            abs(one["from_others"]) > 1e-10 * books.turned_over for one in books.by_stream.values()
        ):
            yield "streams: energy from others where none meet"


def faults(recording):
    """Return what a run did that none may do."""
    found = [*in_surfaces(recording), *in_the_ledger(recording)]
    return found + list(in_others(recording)) if recording.machine.interact else found


def forced_from(recording, particle):
    """When something first holds a particle, s: from then on it does not fly; inf if never.

    The ride of an adhesive belt does not count. In free flight knots differ by the weight alone.
    """
    knots = recording.track(particle)
    events = recording.events[recording.events["particle"] == particle]
    if recording.machine.releases.carried[particle]:
        left = events["t"][events["kind"] == Kind.SEPARATION]
        knots = knots[knots["t"] >= left[0]] if len(left) else knots[:0]
    time, velocity = np.diff(knots["t"]), np.diff(knots["velocity"], axis=0)
    velocity[:, 1] += recording.gravity * time
    scale = 1e-9 * (np.abs(knots["velocity"]).max(initial=0.0) + recording.gravity)
    turning = np.abs(np.diff(knots["omega"])) > 1e-9 * (1.0 + np.abs(knots["omega"]).max(initial=0))
    held = ((np.abs(velocity).max(axis=1, initial=0.0) > scale) | turning) & (time > 0.0)
    return float(knots["t"][:-1][held].min(initial=inf))


def blows(recording, particle, until):
    """Events of a particle before it is held, or strikes too slowly for a step to tell."""
    events = recording.events[recording.events["particle"] == particle]
    mass = of_each(recording.machine.particle.mass, recording.count)[particle]
    struck = np.isin(events["kind"], (Kind.IMPACT, Kind.LANDING))
    slow = struck & (events["normal_impulse"] < SLOW * recording.gravity * DT * mass)
    until = min([until, *events["t"][slow]]) - 1e-9
    return events[events["t"] < until], until


def differences(exact, contact):
    """Yield in what two answers differ, where none meet, by more than they promise of blows."""
    for particle in range(exact.count):
        held = min(forced_from(exact, particle), forced_from(contact, particle))
        (a, before), (b, until) = (blows(run, particle, held) for run in (exact, contact))
        a, b = a[a["t"] < until], b[b["t"] < before]
        if a["kind"].tolist() != b["kind"].tolist() or (a["surface"] != b["surface"]).any():
            yield f"{particle}: other events"
            continue
        for name in ("t", "position", "velocity_after", "omega_after"):
            apart = np.abs(a[name] - b[name]).max(initial=0.0)
            if not apart <= 1e-9 * np.abs(a[name]).max(initial=1.0):
                yield f"{particle}: {name} of an event by {apart:.1e}"
        if exact.ended[particle] != contact.ended[particle]:
            yield f"{particle}: ended {exact.ended[particle]} and {contact.ended[particle]}"
        if before == until == inf and not ends_apart(exact, contact)[particle] <= 1e-9:
            yield f"{particle}: ends elsewhere"


def ends_apart(one, other):
    """How far apart the ends of tracks are, (N,), m; 0 of those never released."""
    apart = np.zeros(one.count)
    a, b = (run.ends()[1]["position"] for run in (one, other))
    apart[one.released] = np.abs(a - b).max(axis=1)
    return apart


def same(one, other):
    """Whether two recordings are the same to the last bit."""
    arrays = ("knots", "events", "offsets", "ended", "by_surface")
    return all(getattr(one, k).tobytes() == getattr(other, k).tobytes() for k in arrays)


def check(seed, folder):
    drawn = draw(seed)
    if seed % 10 == 0:
        # As a user has it: the command, from a file to a file.
        file = folder / "scene.toml"
        file.write_text(tomli_w.dumps(tables(seed)), encoding="utf-8")
        words = ["run", str(file), "--out", str(folder / "out"), "--only", "npz", "-q"]
        call(*words)
        assert same(Recording.load(folder / "out" / "recording.npz"), simulate(drawn))
    machine = build(drawn)
    run = contact.run(machine)
    assert faults(run) == []
    assert same(contact.run(build(draw(seed))), run)
    saved = Recording.of(run).save(folder / "recording.npz", tolerance=0.0)
    assert same(Recording.load(saved), run)
    if machine.interact:
        return
    try:
        followed = exact.run(machine)
    except exact.CornerError:
        # A disk that turns, held between two surfaces of which one moves: auto takes contact.
        assert simulate(drawn).engine == "contact"
        return
    assert faults(followed) == []
    assert list(differences(followed, run)) == []
    assert same(exact.run(build(draw(seed))), followed)
    # What is held somewhere is off by the square of a step.
    apart = ends_apart(followed, run)
    if (apart > NEAR).any():
        finer = ends_apart(followed, contact.run(replace(machine, dt=0.25 * machine.dt)))
        assert (finer <= np.maximum(NEAR, 0.25 * apart)).all(), (apart, finer)


@pytest.mark.parametrize("seed", seeds(5, 300))
def test_laws_hold_on_any_machine(seed, tmp_path):
    check(seed, tmp_path)


@pytest.mark.parametrize("seed", seeds(3, 12))
def test_what_rattles_sinks_in_by_no_more_than_blows_leave(seed):
    """Without gravity a row of 46 disks runs into a floor: its blows have no end.

    Overlaps beyond 1 % of the radius are not made deeper by what blows leave to the next step,
    0.5 % at most: so 1.5 % is the deepest, and a tenth of that for what sweeps leave.
    """
    drawn = tables(29)
    drawn["stream"]["seed"] = seed
    recording = contact.run(build(from_dict(drawn)))
    assert list(in_others(recording, 0.0165)) == []
    assert judge(recording) == ()
