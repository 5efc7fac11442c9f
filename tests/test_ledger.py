"""The books of a run: what they hold, that they close, and that errors show in them."""

from dataclasses import asdict, replace

import pytest

from chutelab import machine, scene
from chutelab.engines import exact
from chutelab.engines.simulation import choose, simulate
from chutelab.results import ENTRIES
from chutelab.results.ledger import ledger

EXACT = [name for name in scene.shipped() if choose(machine.build(scene.load(name))) == "exact"]
G, R, M = 9.81, 0.0063, 0.008


def shipped(name, *overrides):
    return exact.run(machine.build(scene.load(scene.find(name), overrides)))


@pytest.mark.parametrize("name", EXACT)
def test_the_surfaces_make_up_the_total(name):
    recording = shipped(name)
    books = ledger(recording)
    assert list(books.by_surface) == list(recording.surfaces)
    assert list(books.by_surface)[-1] == "particles"
    for entry in ENTRIES:
        parts = [row[entry] for row in books.by_surface.values()]
        assert sum(parts) == pytest.approx(getattr(books, entry), rel=1e-12, abs=1e-17)
    assert set(books.by_surface["particles"].values()) == {0.0}


def test_the_entries_are_what_the_impacts_and_the_ride_say():
    """A particle let down round the pulley, onto a plate of ε = 0.5, onto a belt with µ = 0.5."""
    recording = shipped("low-speed")
    books = ledger(recording).by_surface
    left, plate, landing = (recording.select(kind)[0] for kind in (1, 3, 4))
    drop = 0.5 + R - left["position"][1]
    assert books["incoming"]["belt_work"] == pytest.approx(-M * G * drop, rel=1e-13, abs=0.0)
    normal = plate["velocity_before"][0]
    lost = 0.5 * M * normal**2 * (1.0 - 0.5**2)
    assert books["plate"] == pytest.approx(
        {"belt_work": 0.0, "restitution_loss": lost, "friction_loss": 0.0}, rel=1e-14, abs=0.0
    )
    (vx, vy), belt = landing["velocity_before"], 2.0
    pull = min(0.5 * M * abs(vy), M * abs(belt - vx))
    assert books["outgoing"] == pytest.approx(
        {
            "belt_work": pull * belt,
            "restitution_loss": 0.5 * M * vy**2,
            "friction_loss": pull * (belt - vx) - 0.5 * pull**2 / M,
        },
        rel=1e-14,
        abs=0.0,
    )


@pytest.mark.parametrize(("share", "shown"), [(0.5, False), (2.0, True)])
def test_what_is_of_the_size_of_rounding_is_shown_as_none_unless_in_detail(share, shown):
    """Of what was turned over an entry up to 1e-12, a kinetic energy up to 5e-6."""
    books = ledger(shipped("perpendicular"))
    heat, kinetic = (share * size * books.turned_over for size in (1e-12, 5e-6))
    books = replace(books, friction_loss=heat, kinetic=(kinetic, books.kinetic[1]))
    for details in (False, True):
        sheet = books.sheet(details=details)
        assert (sheet.foot[0][-1] != "0") is (shown or details)
        assert sheet.notes[0].startswith("kinetic 0 -> ") is not (shown or details)


def test_without_belts_no_work_is_told_as_theirs():
    """What a plank gives each ball on it is ½ m v² + m g Δy: they neither roll nor slip."""
    recording = simulate("see-saw")
    sheet = ledger(recording).sheet()
    assert sheet.columns == ("", "restitution loss", "friction loss", "work on it")
    told = {row[0]: row[-1] for row in (*sheet.rows, *sheet.foot)}
    assert told["plank"] == told["particles"] == ""
    first, last = recording.ends()
    for name, m, k0, k1 in zip(("light", "heavy"), (0.008, 0.016), first, last, strict=True):
        spin = 0.5 * 0.5 * m * 0.01**2 * k1["omega"] ** 2
        gained = 0.5 * m * (k1["velocity"] ** 2).sum() + spin
        gained += m * G * (k1["position"][1] - k0["position"][1])
        assert float(told[f"of {name}"]) == pytest.approx(gained, rel=1e-5), name


@pytest.mark.parametrize("spins", [False, True])
def test_a_wrong_end_velocity_moves_the_residual_by_its_kinetic_energy(spins):
    recording = shipped("perpendicular", f"particle.spin={str(spins).lower()}")
    knots = recording.knots.copy()
    velocity, omega = knots["velocity"][-1].copy(), knots["omega"][-1].copy()
    knots["velocity"][-1] += (1e-3, -2e-3)
    knots["omega"][-1] += 5.0
    inertia = 0.5 * M * R**2 if spins else 0.0
    change = 0.5 * M * ((knots["velocity"][-1] ** 2).sum() - (velocity**2).sum())
    change += 0.5 * inertia * (knots["omega"][-1] ** 2 - omega**2)
    true, false = ledger(recording), ledger(replace(recording, knots=knots))
    assert abs(change) > 1e-7
    assert false.residual - true.residual == pytest.approx(change, abs=1e-15 * true.turned_over)
    same = {name for name in asdict(true) if getattr(true, name) == getattr(false, name)}
    assert set(asdict(true)) - same == {"kinetic", "residual"}
