"""Fields: mass to rounding, stress by hand, the balance of momentum at places, and files."""

import csv
import json
from itertools import pairwise
from math import pi

import numpy as np
import pytest
from click.testing import CliRunner

import chutelab
from chutelab.cli import main
from chutelab.pictures.plots.measures import field as picture
from chutelab.results.fields import NAMES
from chutelab.util.errors import InputError
from shared import call

G = 9.81


def gas(engine="contact", seed=3, **keys):
    """Disks without friction that fly about in a box of 0.2 m, and lose a little in each blow."""
    wall = {"restitution": 0.9, "friction": 0.0}
    corners = [[0.0, 0.0], [0.2, 0.0], [0.2, 0.2], [0.0, 0.2], [0.0, 0.0]]
    return chutelab.simulate(
        {
            "particle": {"radius": [0.008, 0.012], "density": 2500, "spin": False},
            "surface": [
                {"name": f"wall{n}", "from": a, "to": b, **wall}
                for n, (a, b) in enumerate(pairwise(corners))
            ],
            "stream": {"count": 12, "fill": [[0.02, 0.02], [0.18, 0.18]], "seed": seed,
                       "velocity": [1.5, 0.7], "interact": True, "restitution": 0.9,
                       "friction": 0.0},
            "run": {"until": 0.2},
            **keys,
        },
        engine=engine,
    )  # fmt: skip


@pytest.fixture(scope="module")
def run():
    return gas()


@pytest.mark.parametrize("cell", [0.003, 0.0071, 0.0125])
def test_the_integral_over_the_grid_is_the_mass_inside(run, cell):
    """All twelve are there all the time: Σ ρ cell² = Σ m, and Σ ρ V cell² = Σ m v."""
    found = run.field(cell=cell, width=0.025)
    assert found.mass == pytest.approx(run.mass.sum(), rel=1e-13)
    times = 0.2 * (np.arange(50) + 0.5) / 50
    momentum = (run.mass[:, None] * run.at(times).velocity.mean(axis=0)).sum(axis=0)
    told = np.nansum(found.density * found.velocity, axis=(1, 2)) * cell**2
    assert told == pytest.approx(momentum, rel=1e-11)


def test_one_particle_is_spread_by_the_kernel():
    """At its middle ρ = 5 m / (π c²), and it has no temperature; nothing is c away from it."""
    run = chutelab.simulate(
        {"gravity": 0.0, "particle": {"radius": 0.01, "mass": 2.0},
         "stream": {"at": [0.0, 0.0], "velocity": [1e-9, 0.0]}, "run": {"until": 1.0}}
    )  # fmt: skip
    c = 0.1
    found = run.field(width=c, cell=0.005, box=((-0.1525, -0.1525), (0.1525, 0.1525)))
    far = np.hypot(*np.meshgrid(found.x, found.y, indexing="ij"))
    d = (far / c).clip(max=1.0)
    expected = 2.0 * 5.0 / (pi * c * c) * (1.0 + 3.0 * d) * (1.0 - d) ** 3
    assert found.density == pytest.approx(expected, rel=2e-3, abs=1e-3)
    assert found["density"][far >= c + 1e-6].max() == 0.0
    assert found.temperature[far < c - 1e-6].max() < 1e-30


def test_temperature_and_kinetic_stress_of_two_streams():
    """Two at ±u through each other: V = 0, T = u²/2, σ_xx = -ρ u², nothing across."""
    u = 0.5
    run = chutelab.simulate(
        {"gravity": 0.0, "particle": {"radius": 0.001, "mass": 1.0},
         "stream": [{"at": [-0.5, 0.0], "velocity": [u, 0.0]},
                    {"at": [0.5, 0.0], "velocity": [-u, 0.0]}], "run": {"until": 2.0}}
    )  # fmt: skip
    found = run.field(width=0.2, cell=0.02, samples=2000)
    x, y = (int(np.abs(one).argmin()) for one in (found.x, found.y))
    assert found["vx"][x, y] == pytest.approx(0.0, abs=1e-3)
    assert found["temperature"][x, y] == pytest.approx(0.5 * u * u, rel=1e-5)
    assert found["sxx"][x, y] == pytest.approx(-found.density[x, y] * u * u, rel=1e-5)
    assert found["syy"][x, y] == pytest.approx(0.0, abs=1e-12)
    assert found["pressure"][x, y] == pytest.approx(found.density[x, y] * 0.5 * u * u, rel=1e-5)


def test_the_integral_of_contact_stress_is_that_of_its_blows(run):
    """∫ σ = -(1/T) Σ J b: without friction J is along b, r_a + r_b between two, r at a wall."""
    found = run.field()
    blows = run.select("collision", "impact")
    change = run.mass[blows["particle"]][:, None] * (
        blows["velocity_after"] - blows["velocity_before"]
    )
    reach = run.radius[blows["particle"]] + np.where(
        blows["other"] >= 0, run.radius[blows["other"]], 0.0
    )
    along = change / np.hypot(*change.T)[:, None]
    expected = -np.einsum("ci,cj,c->ij", change, along, reach) / 0.2
    told = found.contact.sum(axis=(2, 3)) * found.cell**2
    assert told == pytest.approx(expected, rel=1e-6)
    walls = blows["other"] < 0
    given = found.traction.sum(axis=(1, 2)) * found.cell**2
    assert given == pytest.approx(change[walls].sum(axis=0) / 0.2, rel=1e-12)
    assert found.left_out < 1e-3


def test_momentum_is_balanced_at_each_place(run):
    """[p(t₁) - p(t₀)]/T + div(ρ V V) = div σ + ρ g + traction, but for differences over cells.

    These are off by the square of a cell: (5/8)² of it with 5 mm instead of 8 mm.
    """
    begin, end, errors = 0.05, 0.15, []
    for cell in (0.008, 0.005):
        more = {"width": 0.08, "cell": cell, "box": ((-0.02, -0.02), (0.22, 0.22))}
        found = run.field(begin, end, samples=200, **more)
        now = [run.field(t, t + 1e-9, samples=1, **more) for t in (begin, end)]
        momentum = [one.density * np.nan_to_num(one.velocity) for one in now]
        rate = (momentum[1] - momentum[0]) / (end - begin)

        def divergence(flux, cell=cell):
            return np.stack([np.gradient(flux[i, 0], cell, axis=0)
                             + np.gradient(flux[i, 1], cell, axis=1) for i in (0, 1)])  # fmt: skip

        velocity = np.nan_to_num(found.velocity)
        flow = divergence(found.density * velocity[:, None] * velocity[None])
        weight = np.stack([0.0 * found.density, -G * found.density])
        given = divergence(found.kinetic + found.contact) + weight + found.traction
        inner = np.s_[:, 2:-2, 2:-2]
        errors.append(np.abs(rate + flow - given)[inner].max())
    assert errors[1] < 0.01 * np.abs(found.traction).max()
    assert errors[1] < 0.03 * np.abs(divergence(found.contact)).max()
    assert errors[1] / errors[0] == pytest.approx((5.0 / 8.0) ** 2, rel=0.1)


@pytest.fixture(scope="module")
def bin_of_disks():
    """80 disks that fall into a bin with smooth walls, come to rest and sleep."""
    corners = [[0.0, 0.3], [0.0, 0.0], [0.1, 0.0], [0.1, 0.3]]
    return chutelab.simulate(
        {
            "particle": {"radius": [0.004, 0.006], "density": 2500},
            "surface": [
                {"name": f"wall{n}", "from": a, "to": b, "restitution": 0.2,
                 "friction": 0.4 if n == 1 else 0.0}
                for n, (a, b) in enumerate(pairwise(corners))
            ],
            "stream": {"count": 80, "fill": [[0.01, 0.01], [0.09, 0.2]], "seed": 4,
                       "velocity": [0.3, -0.5], "interact": True, "restitution": 0.3,
                       "friction": 0.4},
            "run": {"until": 3.0, "stress": 0.01},
        },
        engine="contact",
    )  # fmt: skip


def unexplained(run):
    """Of each disk: Σ J - m (v₁ - v₀) - m g (t₁ - t₀), N s; all |J|; and blows solved alone."""
    given, size = np.zeros((run.count, 2)), np.zeros(run.count)

    def add(particle, other, impulse):
        pair = other >= 0
        for index, sign in ((particle, 1.0), (other[pair], -1.0)):
            own = impulse if sign > 0.0 else impulse[pair]
            np.add.at(given, index, sign * own)
            np.add.at(size, index, np.hypot(*own.T))

    kept = run.lasting
    add(kept["particle"], kept["other"], kept["impulse"])
    blows = run.select("impact", "landing", "collision")
    change = run.mass[blows["particle"]][:, None] * (
        blows["velocity_after"] - blows["velocity_before"]
    )
    told = np.hypot(blows["normal_impulse"], blows["tangential_impulse"])
    # Blows that were solved together are kept as lasting contacts are.
    alone = np.isclose(np.hypot(*change.T), told, rtol=1e-6, atol=0.0)
    add(blows["particle"][alone], blows["other"][alone], change[alone])
    first, last = run.ends()
    wanted = run.mass[:, None] * (last["velocity"] - first["velocity"])
    wanted[:, 1] += run.mass * G * (last["t"] - first["t"])
    return given - wanted, size, alone


def test_lasting_contacts_and_blows_are_all_that_changes_momentum(bin_of_disks):
    """In flight, sliding and asleep; and on a belt that carries what is struck on it."""
    run = bin_of_disks
    assert np.any(run.lasting["to"] - run.lasting["from"] > 0.011), "nothing sleeps"
    off, size, alone = unexplained(run)
    assert not alone.all()
    assert np.hypot(*off.T) == pytest.approx(0.0, abs=1e-11 * size.max())
    # The law sees a thousandth of one contact in ten thousand.
    off[0] += 1e-3 * run.lasting["impulse"][np.abs(run.lasting["impulse"]).sum(axis=1).argmax()]
    assert np.hypot(*off.T).max() > 1e-9 * size.max()
    off, size, _ = unexplained(chutelab.simulate("coal-transfer", {"run.stress": 0.02}))
    assert np.hypot(*off.T) == pytest.approx(0.0, abs=1e-11 * size.max())


@pytest.mark.slow
def test_stress_at_rest_bears_the_weight_above(bin_of_disks, tmp_path):
    """Smooth walls bear no weight: -∫ σ_yy dx = g ∫∫ ρ above; and they are pressed as σ_xx says."""
    box = ((-0.03, -0.03), (0.13, 0.2))
    found = bin_of_disks.field(2.5, 3.0, width=0.02, cell=0.002, box=box)
    assert found.left_out == 0.0
    across = -found["syy"].sum(axis=0) * found.cell
    weight = G * found.density.sum(axis=0) * found.cell**2
    above = weight[::-1].cumsum()[::-1] - 0.5 * weight
    inside = (found.y > 0.02) & (above > 0.02 * above.max())
    assert across[inside] == pytest.approx(above[inside], abs=5e-4 * above.max())
    floor = found.traction[1].sum() * found.cell**2
    assert floor == pytest.approx(bin_of_disks.mass.sum() * G, rel=1e-6)
    left = found.traction[0, found.x < 0.05].sum() * found.cell**2
    middle = int(np.argmin(np.abs(found.x - 0.05)))
    assert -found["sxx"][middle].sum() * found.cell == pytest.approx(left, rel=2e-3)
    again = bin_of_disks.load(bin_of_disks.save(tmp_path / "run.npz"))
    assert np.array_equal(again.lasting, bin_of_disks.lasting)


def test_what_lasting_contacts_give_is_told_where_it_is_left_out():
    """A disk at rest on a floor gets m g from a lasting contact: all of its impulses."""
    floor = {"name": "floor", "from": [-1.0, 0.0], "to": [1.0, 0.0]}
    run = chutelab.simulate(
        {"particle": {"radius": 0.01}, "surface": [floor],
         "stream": {"at": [0.0, 0.01], "velocity": [0.0, 0.0]}, "run": {"until": 0.5}},
        engine="contact",
    )  # fmt: skip
    found = run.field(0.1, 0.4)
    assert found.left_out == pytest.approx(1.0)
    assert "lasting contacts, 100 % of all impulses" in found.note
    assert "strings" not in found.note
    assert "strings" in chutelab.simulate("cradle", {"run.until": 0.1}).field().note
    assert not found.contact.any()


def test_colours_are_of_what_a_picture_shows():
    """A hopper's grains fall out of the picture, faster than any that is seen."""
    run = chutelab.simulate("hopper", {"stream.count": 40, "run.until": 1.0})
    found = run.field(0.6, 1.0)
    figure = picture(run, found, "speed")
    (ax, *_), bottom = figure.axes, figure.axes[0].get_ylim()[0]
    (mesh,) = (one for one in ax.collections if one.get_gid() == "field")
    dense = found.density > 1e-3 * found.density.max()
    seen = dense & (found.y > bottom - 0.5 * found.cell)
    assert mesh.get_clim()[1] == found["speed"][seen].max() < found["speed"][dense].max()


def test_command_files_and_refusals(run, tmp_path):
    called = ["field", "stream-independent", "--set", "stream.count=40", "--between", "0.6,0.8",
              "--of", "speed", "--of", "sxx", "--vtk", "--out", str(tmp_path)]  # fmt: skip
    call(*called)
    names = {path.name for path in tmp_path.iterdir()}
    assert names == {"field-speed.png", "field-sxx.png", "fields.csv", "fields.vti"}
    rows = list(csv.DictReader((tmp_path / "fields.csv").read_text("utf-8").splitlines()))
    assert set(rows[0]) == {"x", "y", *NAMES}
    told = json.loads(CliRunner().invoke(main, [*called[:6], "--json"]).stdout)
    cell = told["cell"]
    mass = sum(float(row["density"]) for row in rows) * cell**2
    assert mass == pytest.approx(told["mass"], rel=1e-12)
    head = (tmp_path / "fields.vti").read_bytes()[:2000]
    assert b"ImageData" in head
    assert b'Name="temperature"' in head
    for options, said in (
        ({"begin": 0.1, "end": 0.1}, "window = "),
        ({"width": 0.0}, "width = 0.0: a finite number above 0 m"),
        ({"cell": 0.2}, "cell = 0.2"),
        ({"cell": 1e-6}, "1,000,000 cells or fewer"),
        ({"box": ((0.0, 0.0), (0.0, 1.0))}, "two corners"),
        ({"samples": 0}, "samples = 0"),
    ):
        with pytest.raises(InputError, match=said):
            run.field(**options)
    with pytest.raises(InputError, match="one of density"):
        run.field()["heat"]
    for arguments, said in (
        (["--of", "heat", "--out", str(tmp_path)], "--of = "),
        (["--between", "1"], "two times such as 0.5,1.2"),
        (["--vtk"], "give --out DIR too"),
    ):
        refused = call("field", "slip", *arguments, code=2)
        assert said in refused.output
