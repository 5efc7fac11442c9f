"""Files of large crowds: tracks within a share of the radius, sums and ends to the last bit."""

import hashlib
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from chutelab import scene
from chutelab.engines.simulation import simulate
from chutelab.results import Recording, packing, storage
from chutelab.results.ledger import energy_at, ledger
from chutelab.results.storage import RecordingError
from test_recording import DRUM, crowded

NAMES = [
    *("galton", "dominoes", "drum"),
    *(pytest.param(name, marks=pytest.mark.slow) for name in ("hopper", "stream")),
]
run = cache(crowded)


@cache
def loaded(name, tolerance=1e-6):
    """Return a run as it comes back from its file."""
    record = run(name)
    told = packing.pack(record, tolerance)
    return replace(record, **packing.unpack(told, record.offsets, record.particle))


def times_of(record):
    """Return even times, and the middles of intervals that are 1e-9 s long or more."""
    t, rng = record.knots["t"], np.random.default_rng(5)
    middles = (t[:-1] + np.diff(t) / 2.0)[np.diff(t) > 1e-9]
    return np.concatenate([rng.uniform(0.0, t.max(), 300), rng.choice(middles, 300)])


@pytest.mark.parametrize("name", NAMES)
def test_a_track_in_a_file_is_off_by_less_than_the_tolerance_at_any_time(name):
    """ε r in place; in velocity what leads ε r aside in a sixteenth of a step, see `LONG`."""
    record, times = run(name), times_of(run(name))
    radius, dt = record.radius.min(), record.machine.dt
    places, paces = record.at(times)

    def off(other):
        found = other.at(times)
        far = np.nanmax(np.hypot(*np.moveaxis(found[0] - places, -1, 0))) / radius
        return far, np.nanmax(np.abs(found[1] - paces)) / (radius / dt)

    far, fast = off(loaded(name))
    assert far <= 1e-6
    assert fast <= 1.6e-5
    assert off(loaded(name, 0.01))[0] > 1e-6
    turned = loaded(name).at(times).angle - record.at(times).angle
    assert np.nanmax(np.abs(turned)) <= 1e-3


@pytest.mark.parametrize("name", NAMES)
def test_ends_times_and_sums_come_back_to_the_last_bit_and_energies_nearly(name):
    record, other = run(name), loaded(name)
    assert ledger(other) == ledger(record)
    for one, back in zip(record.ends(), other.ends(), strict=True):
        assert one.tobytes() == back.tobytes()
    assert np.array_equal(other.knots["t"], record.knots["t"])
    for field in ("t", *packing.WHOLE):
        assert np.array_equal(other.events[field], record.events[field])
    size, times = ledger(record).turned_over, times_of(record)
    told, found = energy_at(record, times), energy_at(other, times)
    for entry, values in told.items():
        assert np.abs(found[entry] - values).max() <= 1e-6 * size
    steps = record.totals["t"][1:-1]
    for entry, values in energy_at(record, steps).items():
        assert np.abs(energy_at(other, steps)[entry] - values).max() <= 1e-12 * size


@pytest.mark.parametrize("name", NAMES)
def test_states_and_impulses_of_events_are_as_near_as_tracks(name):
    record, other = run(name), loaded(name)
    radius, dt, mass = record.radius.min(), record.machine.dt, record.mass.min()
    speed = 1.25e-6 * radius / dt * (1.0 + 1e-6)
    most = {"position": 0.351e-6 * radius, "velocity": speed, "omega": 2.0 * speed / radius}
    most["normal"] = most["tangential"] = mass * speed
    for field in ("position", "velocity_before", "velocity_after", "omega_before", "omega_after",
                  "normal_impulse", "tangential_impulse"):  # fmt: skip
        off = np.abs(other.events[field] - record.events[field]).max()
        assert off <= most[field.split("_")[0]]
    # What changes nothing does so afterwards.
    states = [
        [events[field][part] for field, part in packing.STATE]
        for events in (record.events, other.events)
    ]
    still, found = (
        np.all(np.equal(state[2:5], state[5:8]), axis=0) & ~np.any(state[8:], axis=0)
        for state in states
    )
    assert still.any()
    assert np.all(found[still])


@pytest.mark.parametrize("far", [0.0, 1.0, -1.0, 2.0**51, -(2.0**51) + 1.0])
def test_whole_numbers_of_any_size_come_back(far):
    numbers = np.rint(far * np.random.default_rng(1).uniform(size=(3, 50))).astype(np.int64)
    numbers[0, 0] = int(far)
    reader = packing.Reader(**packing.write([numbers, -numbers[0]]))
    assert np.array_equal(reader.read(3, 50), numbers)
    assert np.array_equal(reader.read(50), -numbers[0])
    assert np.array_equal(packing.unfold(packing.fold(numbers)), numbers)


def test_a_large_crowd_is_a_quarter_of_all_its_bits_and_its_laws_hold(tmp_path):
    record = run("drum")
    assert len(record.knots) > storage.MANY
    whole = storage.save(record, tmp_path / "whole.npz", tolerance=0.0)
    short = storage.save(record, tmp_path / "short.npz")
    assert short.stat().st_size < 0.25 * whole.stat().st_size
    assert storage.load(whole).knots.tobytes() == record.knots.tobytes()
    back = Recording.load(short)
    assert back.knots.tobytes() == loaded("drum").knots.tobytes()
    assert back.totals.tobytes() == record.totals.tobytes()
    assert back.laws == Recording.of(record).laws == ()
    # What comes back is no further off when it goes there again.
    again = storage.load(storage.save(back, tmp_path / "again.npz"))
    off = np.abs(again.knots["position"] - record.knots["position"]).max()
    assert off <= 2e-6 * record.radius.min()


def test_what_units_of_entries_round_accuses_no_run():
    """If 36 disks stop each other many entries change at one instant, each rounded to a unit."""
    wide = 0.182
    walls = [[-wide / 2.0, y] for y in (1.0, 0.0)]
    drawn = {
        "gravity": 0.0,
        "particle": {"radius": 0.01, "mass": 0.005, "spin": True},
        "surface": [
            {"name": "bin", "points": [*walls, *([-x, y] for x, y in reversed(walls))],
             "restitution": 0.0, "friction": 0.5}
        ],
        "stream": {"count": 36, "fill": [walls[1], [wide / 2.0, 0.3]], "velocity": [0.0, -0.8],
                   "interact": True, "restitution": 0.0, "friction": 5.0},
        "run": {"until": 0.5},
    }  # fmt: skip
    record = simulate(scene.from_dict(drawn), engine="contact")
    told = packing.unpack(packing.pack(record, 1e-6), record.offsets, record.particle)
    assert not record.laws
    assert replace(record, **told | {"unit": 0.0}).laws
    assert not replace(record, **told).laws


def test_a_small_crowd_and_what_is_too_far_away_keep_all_bits(tmp_path):
    record = run("galton")
    assert len(record.knots) < storage.MANY
    knots = storage.load(storage.save(record, tmp_path / "few.npz")).knots
    assert knots.tobytes() == record.knots.tobytes()
    record = run("drum")
    knots = record.knots.copy()
    knots["position"][5] = 1e9
    path = storage.save(replace(record, knots=knots), tmp_path / "far.npz")
    assert storage.load(path).knots.tobytes() == knots.tobytes()
    for tolerance in (-1e-9, 0.1, float("nan")):
        with pytest.raises(ValueError, match=r"^tolerance = .*: from 0 to 0\.01 radii$"):
            storage.save(record, tmp_path / "none.npz", tolerance=tolerance)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["far.npz", "few.npz"]


def test_a_packed_file_of_an_earlier_version_is_read_as_it_was():
    """Four disks fall into a bin, and push each other several times at an instant (format 2)."""
    record = storage.load(Path(__file__).parent / "earlier.npz")
    told = hashlib.sha256(record.knots.tobytes()).hexdigest()
    assert told == "41ddb5bc563f57dc8206789f29cab252c6b34f814f84fad65089820c33474b5f"
    events, (mass,) = record.events, set(record.mass.tolist())
    assert events["normal_impulse"].sum() == pytest.approx(0.09655873089753793, rel=1e-14)
    assert events["omega_after"].sum() == pytest.approx(-117.2991350064202, rel=1e-14)
    push = mass * (events["velocity_after"] - events["velocity_before"])
    size = np.hypot(events["normal_impulse"], events["tangential_impulse"])
    assert np.abs(np.hypot(*push.T) - size).max() <= 2e-6 * mass * 0.01 / record.machine.dt
    assert Recording.of(record).laws == ()


def test_a_packed_file_that_is_damaged_or_made_to_fill_the_memory_is_refused(tmp_path):
    path = storage.save(run("drum"), tmp_path / "short.npz")
    good = np.load(path)
    arrays = {name: good[name] for name in good.files}
    many = 8_000_000
    bad = {
        "when": [np.zeros((1, 1, many), dtype=np.uint8), arrays["when"][..., 1:]],
        "whose": [np.zeros((1, 6, many), dtype=np.uint8), arrays["whose"] + 7],
        "sizes": [
            np.zeros(many, dtype=np.uint8),
            np.append(arrays["sizes"], np.uint8(0)),
            arrays["sizes"][:-5],
            arrays["sizes"] + 40,
        ],
        "bits": [arrays["bits"][:100], np.append(arrays["bits"], arrays["bits"][:1])],
        "units": [np.zeros(10), np.full(10, np.nan), arrays["units"][:3]],
        "ends": [arrays["ends"][:, :2]],
        "times": [arrays["times"][..., :5]],
        "offsets": [arrays["offsets"] + 1, -arrays["offsets"]],
    }
    for name, values in bad.items():
        for value in values:
            np.savez_compressed(path, **{**arrays, name: value})
            with pytest.raises(RecordingError, match="not a recording as"):
                storage.load(path)


FULL = {
    "surface": [{**DRUM["surface"][0], "radius": 0.165}],
    "stream": {**DRUM["stream"], "count": 300, "fill": [[-0.1, -0.1], [0.1, 0.1]]},
    "run": {"until": 8.0},
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("told", "most"),
    [(scene.load("hopper"), 4e6), (scene.from_dict(DRUM | FULL), 25e6)],
    ids=["hopper", "drum"],
)
def test_files_of_crowds_are_as_small_as_it_is_said(tmp_path, told, most):
    assert simulate(told).save(tmp_path / "short.npz").stat().st_size <= most
