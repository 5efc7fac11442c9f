"""Cases of each kind: files made from mutants in the folder at hand, and the words of a command.

A kind is a function of a random generator; it writes into the current folder and returns the words.
Good files to begin with are made once, by `begin`, in the folder beside that one.
"""

import copy
import tomllib
from pathlib import Path

import click
import tomli_w

import chutelab
from broken_sandbox import BASES
from chutelab import scene
from chutelab.cli import main
from chutelab.scene import Scene
from hostile.mutants import NUMBERS, TEXTS, changed, extreme, garbled

GOOD = Path("../good")
SCENES = sorted(scene.shipped())
PARTED = ("cascade", "cradle", "dominoes", "hopper", "spoon", "two-sizes")
"""Shipped scenes of the parts that `machines` puts together, besides those of `broken_sandbox`."""

SWEEP = ("sweep", "perpendicular", "--vary", "plate.restitution=0:1:40", "--engine", "pymunk")
TRACK = "mass_A\nt\tx\ty\n" + "".join(
    f"{0.01 * n:.2f}\t{0.02 * n:.3f}\t{0.1 - 0.0005 * n * n:.4f}\n" for n in range(30)
)
COMMANDS = (
    "run", "check", "show", "sweep", "solve", "compare", "live", "figure", "scenes",
    "materials", "quantities", "new", "schema", "tables",
    "lesson list", "lesson show", "lesson new",
)  # fmt: skip
USUAL = {
    "scene": "perpendicular", "scenes": "inclined-60", "material": "coal", "number": "8",
    "recording": "../good/recording.npz", "lesson": "the-bounce", "from_": "2",
    "name": "mine", "path": "new.toml", "set_": "plate.angle_deg=10",
    "vary": "plate.restitution=0:1:3", "uncertainty": "plate.restitution=0.5±0.1",
    "data": "../good/film.txt", "fit": "plate.restitution", "out": "out", "plot": "out.png",
    "only": "csv,json", "target": "landing.vx=-1", "of": "landing.x.mean",
    "engine": "exact",
    "dt": "1e-3",
    "accuracy": "1e-3", "jobs": "1", "sample": "4", "seed": "3", "points": "9",
    "max_seconds": "0.3",
}  # fmt: skip
"""A good value for what a command takes, by its name there."""

KEYS = (
    "particle[0].radius", "particle.shape", "material[0].density", "pair[0].between",
    "stream[1].rate", "stream.fill", "stream[0].to", "surface[0].center", "surface[0].to_deg",
    "surface[0].opens_at", "surface[0].repeat", "conveyor[0].speed", "plate[1].pivot",
    "string[0].length", "incoming.incline_deg",
    "plate.angle_deg", "plate.restitution", "incoming.speed", "outgoing.drop", "stream.count",
    "run.dt", "run.until",
    "run.engine", "particle.radius", "particle.spin", "surface.0.points", "gravity", "title",
    "plate", "a.b.c", "",
)  # fmt: skip
LISTS = (
    "material", "pair", "conveyor", "surface", "string", "rod", "spring", "pin", "expect",
)  # fmt: skip
"""Tables of which there are several."""


def _rules():
    """Return the schema's rule of each key, by table and name."""
    schema = Scene.model_json_schema()
    found = {}
    for table, rule in schema["properties"].items():
        parts = [rule, *rule.get("anyOf", ()), *([rule["items"]] if "items" in rule else [])]
        names = [part["$ref"].rpartition("/")[2] for part in parts if "$ref" in part]
        found |= {
            f"{table}.{key}": own
            for name in names
            for key, own in schema["$defs"][name]["properties"].items()
        }
        found[table] = rule
    return found


RULES = _rules()
QUANTITIES = ("landing.x", "landing.vx.mean", "impact.t", "d3", "belt_work", "reason", "nothing")


def begin():
    """Write a good recording and a good track into `GOOD`."""
    GOOD.mkdir()
    chutelab.simulate(chutelab.load("perpendicular")).save(GOOD / "recording.npz")
    (GOOD / "film.txt").write_text(TRACK, encoding="utf-8")


def scenes(rng):
    """A shipped scene with mistakes in its text or in its values."""
    text = scene.shipped()[rng.choice(SCENES)].read_bytes()
    if rng.random() < 0.25:
        Path("mutant.toml").write_bytes(garbled(rng, text))
        return _tried(rng)
    return _mutant(rng, tomllib.loads(text.decode()))


def machines(rng):
    """A scene of all parts, or of parts of several machines, with mistakes in its values.

    Half of them get a table from another machine: names then lead nowhere, or to another thing.
    """
    bases = [
        *BASES.values(),
        *(tomllib.loads(scene.shipped()[name].read_text()) for name in PARTED),
    ]
    tables = copy.deepcopy(rng.choice(bases))
    while rng.random() < 0.5:
        name, other = rng.choice(list(rng.choice(bases).items()))
        own = tables.get(name)
        # Tables of a list come to those that are there, others replace them.
        tables[name] = (
            [*own, *other] if isinstance(own, list) and isinstance(other, list) else other
        )
    return _mutant(rng, tables)


def keys(rng):
    """A scene in which one to three keys of all that there are have extreme values."""
    drawn = rng.choices(sorted(RULES), k=rng.choice((1, 1, 2, 3)))
    bases = [
        *BASES.values(),
        *(tomllib.loads(path.read_text()) for path in scene.shipped().values()),
    ]
    table = drawn[0].partition(".")[0]
    tables = copy.deepcopy(rng.choice([base for base in bases if table in base] or bases))
    _few(tables)
    for path in drawn:
        table, _, key = path.partition(".")
        given = extreme(rng, RULES[path])
        if not key:
            tables[table] = given
            continue
        rows = tables.setdefault(table, [{}] if table in LISTS else {})
        row = rng.choice(rows or [{}]) if isinstance(rows, list) else rows
        if isinstance(row, dict):
            row[key] = given
    return _written(rng, tables)


def _few(tables):
    # Work that takes long is no hang.
    streams = tables.get("stream", [])
    for stream in streams if isinstance(streams, list) else [streams]:
        stream["count"] = min(stream.get("count", 1), 200)


def _mutant(rng, tables):
    _few(tables)
    for _ in range(rng.choice((1, 1, 1, 2, 3))):
        tables = changed(rng, tables)
    return _written(rng, tables)


def _written(rng, tables):
    try:
        text = tomli_w.dumps(tables).encode("utf-8", "surrogatepass")
    except (TypeError, AttributeError, ValueError):  # the whole is no table any more
        text = repr(tables).encode("utf-8", "replace")
    Path("mutant.toml").write_bytes(text)
    return _tried(rng)


def _tried(rng):
    """Return the words of a command on the mutant."""
    run = ["run", "mutant.toml", "--max-seconds", "0.3"]
    return rng.choice(
        ([*run, "--json"], run, [*run, "--out", "out", "--only", "csv,npz,json,png"], ["check",
        "mutant.toml"],
         ["check", "mutant.toml", "--json"])
    )  # fmt: skip


def arguments(rng):
    """Words that a command knows, most with values that may be, one or two with others."""
    words = rng.choice(COMMANDS).split()
    command = main
    for word in words:
        command = command.commands[word]
    for parameter in command.params:
        needed = parameter.required or isinstance(parameter, click.Argument)
        if rng.random() > (0.95 if needed else 0.3):
            continue
        usual = USUAL.get(str(parameter.name), "")
        said = usual if usual and rng.random() < 0.8 else _word(rng)
        if isinstance(parameter, click.Argument):
            words.append(said)
        else:
            words.append(rng.choice(parameter.opts))
            words += [] if parameter.is_flag else [said]
    if rng.random() < 0.1:
        words.insert(
            rng.randrange(len(words) + 1), rng.choice(("--no-such-thing", "--help", "-q", "--", ""))
        )
    if words[0] == "run":
        words += ["--max-seconds", "0.3"]
    return [word.replace("\x00", "") for word in words]


def _word(rng):
    key, number = rng.choice(KEYS), rng.choice((*NUMBERS, 2, 3, 20, 1e-3))
    return str(
        rng.choice(
            (number, rng.choice(TEXTS), f"{key}={number}", f"{key}={rng.choice(TEXTS)}",
            f"{key}=0:1:3",
             f"{key}={number}:1", f"{key}=0.5±{number}", f"{rng.choice(QUANTITIES)}={number}",
             rng.choice(QUANTITIES),
             "out", "rows.csv", "out.png", "no/such/folder/x.csv", "exact", "contact", "pymunk",
             "png", "../good/recording.npz")
        )
    )  # fmt: skip


def tracks(rng):
    """A table of points with mistakes in it."""
    Path("film.txt").write_bytes(
        garbled(rng, TRACK.encode(rng.choice(("utf-8", "utf-16", "latin-1"))))
    )
    words = ["compare", "perpendicular", "--data", "film.txt"]
    extra = (
        [],
        ["--json"],
        ["--fit", "plate.restitution"],
        ["--scale", str(rng.choice(NUMBERS))],
        ["--t0", str(rng.choice(NUMBERS))],
    )
    return [*words, *rng.choice(extra)]


KINDS = {
    "scenes": scenes,
    "machines": machines,
    "keys": keys,
    "arguments": arguments,
    "tracks": tracks,
}
