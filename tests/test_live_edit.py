"""What is drawn, typed, kept and shared on the live page, without a screen: in node."""

import base64
import csv
import json
from io import StringIO

import numpy as np
import pytest

from chutelab.machine import build
from chutelab.pictures.live.describe import describe
from chutelab.scene import from_dict, load, parse, to_toml
from live.node import ASSETS, needs_node
from live.node import ask as ask_node

pytestmark = needs_node

SCENES = ("perpendicular", "inclined-40", "cascade", "spoon", "inclined-conveyor", "free-fall")
TWO_KINDS = """
[[particle]]
name = "small"
[[particle]]
name = "large"
radius = 0.02
[[stream]]
name = "a"
particle = "small"
at = [0, 1]
velocity = [1, 0]
[[stream]]
name = "b"
particle = "large"
at = [0, 2]
velocity = [1, 0]
[[surface]]
name = "floor"
from = [-2, 0]
to = [2, 0]
"""


def words(language):
    return json.loads((ASSETS / "strings" / f"{language}.json").read_text(encoding="utf-8"))


def given_of(scene):
    return describe(scene)["scene"]


def ask(*questions, language="en"):
    told = {
        "page": describe(load("perpendicular")),
        "language": language,
        "strings": words(language),
        "questions": questions,
    }
    return ask_node("edit.mjs", told)


def arc_through(a, b, c):
    """Centre and radius of the circle through three points: both bisectors, as linear equations."""
    a, b, c = np.array(a), np.array(b), np.array(c)
    center = np.linalg.solve([b - a, c - a], [(b @ b - a @ a) / 2, (c @ c - a @ a) / 2])
    return center, np.hypot(*(a - center))


def test_what_was_edited_is_a_scene_for_python_too_and_fits_in_an_address():
    scenes = [parse(TWO_KINDS), *map(load, SCENES)]
    edits = [
        ["part", "line", [[3.0, -1.0], [3.5, -1.25]]],
        ["part", "arc", [[4.0, 0.0], [5.0, 0.0], [4.5, 0.5]]],
        ["part", "ball", [[3.25, 0.5]], {"start": 0.25}],
        ["set", {"gravity": 1.62}],
    ]
    answers = ask(*({"ask": "edited", "given": given_of(one), "edits": edits} for one in scenes))
    center, radius = arc_through((4.0, 0.0), (4.5, 0.5), (5.0, 0.0))
    undo = []
    for scene, found in zip(scenes, answers, strict=True):
        assert found["back"] == found["changed"]
        after = parse(found["toml"])
        assert after.gravity == 1.62
        assert len(after.surface) == len(scene.surface) + 2
        line, arc = after.surface[-2:]
        assert line.points == ((3.0, -1.0), (3.5, -1.25))
        assert arc.center == pytest.approx(center, abs=1e-4)
        assert arc.radius == pytest.approx(radius, abs=1e-4)
        drop = after.streams[-1]
        assert (drop.at, drop.velocity, drop.start) == ((3.25, 0.5), (0.0, 0.0), 0.25)
        assert build(after).releases.position[-1] == pytest.approx([3.25, 0.5])
        without = [["without", one.name] for one in (line, arc, drop)]
        undo.append({"ask": "edited", "given": found["changed"], "edits": without})
    for scene, back in zip(scenes, ask(*undo), strict=True):
        kept = parse(back["toml"])
        assert kept.surface == scene.surface
        assert len(kept.streams) == len(scene.streams)


def test_an_arc_goes_through_the_three_points_in_the_order_they_were_set():
    random = np.random.default_rng(15)
    places = np.round(random.uniform((3.0, -3.0), (5.0, -1.0), (60, 3, 2)), 3)
    given = given_of(load("perpendicular"))
    answers = ask(
        *(
            {"ask": "edited", "given": given, "edits": [["part", "arc", [a, c, b]]]}
            for a, b, c in places.tolist()
        )
    )
    arcs = 0
    for (a, b, c), answer in zip(places, answers, strict=True):
        if "fault" in answer or "radius" not in answer["changed"]["surface"][-1]:
            continue
        arc = answer["changed"]["surface"][-1]
        center, radius = arc_through(a, b, c)
        if radius > 20.0:
            continue
        arcs += 1
        # Angles are rounded to a tenth of a degree, lengths to a tenth of a millimetre.
        assert arc["center"] == pytest.approx(center, abs=1e-4)
        assert arc["radius"] == pytest.approx(radius, abs=1e-4)

        def turned(point, arc=arc):
            off = np.array(point) - arc["center"]
            return np.degrees(np.arctan2(off[1], off[0]))

        begin, end = arc["from_deg"], arc["to_deg"]
        assert (begin - turned(a) + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.1)
        assert (end - turned(c) + 180.0) % 360.0 - 180.0 == pytest.approx(0.0, abs=0.1)
        low, high = sorted((begin, end))
        assert (turned(b) - low) % 360.0 < high - low
    assert arcs > 40


def test_the_surface_that_is_clicked_is_the_nearest_one():
    scene = load("cascade")
    machine = build(scene)
    # An own look at the same machine: each surface as many points.
    share = np.linspace(0.0, 1.0, 2001)
    dots, names = [], []
    for start, end, surface in zip(
        machine.segments.start, machine.segments.end, machine.segments.surface, strict=True
    ):
        dots.append(start + share[:, None] * (end - start))
        names += [machine.surfaces[surface]] * len(share)
    for n in range(len(machine.arcs.radius)):
        angle = machine.arcs.begin[n] + share * machine.arcs.extent[n]
        ring = np.column_stack([np.cos(angle), np.sin(angle)])
        dots.append(machine.arcs.center[n] + machine.arcs.radius[n] * ring)
        names += [machine.surfaces[machine.arcs.surface[n]]] * len(share)
    disk = np.sqrt(np.linspace(0.0, 1.0, 40))[:, None, None] * np.stack(
        [np.cos(2 * np.pi * share[::20]), np.sin(2 * np.pi * share[::20])], axis=-1
    )
    dots.append(machine.pulley.radius * disk.reshape(-1, 2))
    names += ["incoming"] * (disk.size // 2)
    dots, names = np.concatenate(dots), np.array(names)
    random = np.random.default_rng(5)
    low, high = dots.min(axis=0), dots.max(axis=0)
    places = random.uniform(low - 0.1, high + 0.1, (400, 2))
    given = given_of(scene)
    (found,) = ask({"ask": "nearest", "given": given, "places": places.tolist(), "reach": 0.08})
    sure = 0
    for place, name in zip(places, found, strict=True):
        far = np.hypot(*(dots - place).T)
        nearest = far.min()
        others = far[names != names[far.argmin()]].min()
        if abs(nearest - 0.08) < 0.01 or others - nearest < 0.02:
            continue
        sure += 1
        assert name == (names[far.argmin()] if nearest < 0.08 else "")
    assert sure > 150


def test_numbers_have_their_range_and_controls_limit_them():
    given = given_of(load("inclined-40"))
    controls = ["plate.angle_deg", "incoming.speed"]
    live = {"controls": controls, "ranges": {"plate.angle_deg": [10, 60]}}
    free, some, main, handles, every, none = ask(
        {"ask": "fields", "given": given, "name": "plate", "live": {"controls": None}},
        {"ask": "fields", "given": given, "name": "plate", "live": live},
        {"ask": "fields", "given": given, "name": "scene", "live": live},
        {"ask": "handles", "given": given, "live": live},
        {"ask": "handles", "given": given, "live": {"controls": None}},
        {"ask": "handles", "given": given, "live": {"controls": []}},
    )
    assert [field["key"] for field in free] == [
        "plate.distance", "plate.angle_deg", "plate.pivot_height", "plate.above",
        "plate.below", "plate.restitution", "plate.friction", "plate.motion",
    ]  # fmt: skip
    angle = free[1]
    assert (angle["value"], angle["unit"]) == (40.0, "degrees")
    assert (angle["low"], angle["high"]) == pytest.approx((-90.0, 90.0))
    assert [(field["key"], field["low"], field["high"]) for field in some] == [
        ("plate.angle_deg", 10, 60)
    ]
    assert [field["key"] for field in main] == ["incoming.speed", "plate.angle_deg"]
    keys = [key for _, axes, _ in handles for key in axes]
    assert set(keys) == {"plate.angle_deg", "incoming.speed"}
    assert all(len(axes) == len(values) for _, axes, values in handles)
    assert len(every) > len(handles) > len(none) == 0


def test_a_material_s_numbers_are_shown_where_the_scene_says_none():
    text = '[particle]\nmaterial = "coal"\n' + TWO_KINDS[TWO_KINDS.index("[[surface]]") :]
    scene = parse(f"{text}[stream]\nat = [0, 1]\nvelocity = [1, 0]\n")
    fields, particle = ask(
        *(
            {"ask": "fields", "given": given_of(scene), "name": name, "live": {}}
            for name in ("floor", "particle")
        )
    )
    shown = {field["name"]: field.get("value") for field in fields}
    machine = build(scene)
    floor = machine.surfaces.index("floor")
    row = list(machine.segments.surface).index(floor)
    assert shown["restitution"] == np.ravel(machine.segments.restitution[..., row])[0]
    assert shown["friction"] == np.ravel(machine.segments.friction[..., row])[0]
    # A mass beside a material would contradict it.
    assert "mass" not in [field["name"] for field in particle]


def test_what_is_copied_with_what_it_waits_for_waits_for_the_copy():
    rows = [
        {"name": "gate", "points": [[0, 0], [1, 0]], "opens_when": {"touched": "bell"}},
        {"name": "bell", "points": [[0, 1], [1, 1]]},
    ]
    given = given_of(load("free-fall"))
    given |= {"surface": rows, "stream": {**given["stream"], "interact": True}}
    both, alone = ask(*(
        {"ask": "edited", "given": given, "edits": [["copies", names, [0.0, 0.5]]]}
        for names in (["gate", "bell"], ["gate"])
    ))  # fmt: skip
    first, bell, gate, copied = both["changed"]["surface"]
    assert (first["opens_when"], bell["name"]) == ({"touched": "bell"}, "bell")
    assert gate["opens_when"] == {"touched": copied["name"]} != {"touched": "bell"}
    assert alone["changed"]["surface"][-1]["opens_when"] == {"touched": "bell"}


@pytest.mark.parametrize(("language", "comma"), [("en", "."), ("de", ",")])
def test_what_cannot_be_says_why_in_the_language(language, comma):
    given = given_of(load("perpendicular"))
    (fields,) = ask({"ask": "fields", "given": given, "name": "plate", "live": {}})
    field = {one["name"]: one for one in fields}
    bounded = {**field["distance"], "low": 0.25, "high": 1.5}
    high, none, positive, good, broken, part, parsed = ask(
        {"ask": "checked", "field": bounded, "text": f"1{comma}75"},
        {"ask": "checked", "field": bounded, "text": "steep"},
        {"ask": "checked", "field": field["distance"], "text": "0"},
        {"ask": "checked", "field": bounded, "text": f" 1{comma}5"},
        {"ask": "edited", "given": given, "edits": [["set", {"plate.distance": -1.0}]]},
        {"ask": "edited", "given": given, "edits": [["part", "line", [[5.0, 1.0], [5.0, 1.0]]]]},
        {"ask": "parse", "texts": ["1,5", " −0.25", "3e-3", "", "a", "1,5,2", "1.000,5"]},
        language=language,
    )
    said = words(language)
    text = said["fault-range"].format(low=f"0{comma}25", high=f"1{comma}5")
    assert high["fault"] == f"{said['name-plate']}, {said['key-distance']}: {text}"
    assert none["fault"].endswith(said["fault-number"])
    assert positive["fault"].endswith(said["fault-range"].format(low="1e−9", high="1000000"))
    assert good == {"value": 1.5}
    assert broken["key"] == "plate.distance"
    assert part["fault"].startswith(f"{said['name-surface']} 1, {said['key-points']}: ")
    assert parsed == ["1.5", "-0.25", "0.003", "NaN", "NaN", "NaN", "NaN"]


def test_a_name_may_be_one_that_every_object_has():
    given = [
        {
            "particle": {"material": name},
            "material": [{"name": name, "density": 2000.0, "restitution": 0.5, "friction": 0.3}],
            "surface": [{"name": name, "from": [-1.0, 0.0], "to": [1.0, 0.0]}],
            "stream": {"name": name, "at": [0.0, 1.0], "velocity": [0.0, 0.0]},
        }
        for name in ("__proto__", "constructor", "toString")
    ]
    answers = ask(*({"ask": "edited", "given": one, "edits": []} for one in given))
    for one, found in zip(given, answers, strict=True):
        assert "fault" not in found
        assert parse(found["toml"]) == parse(to_toml(from_dict(one)))


def in_address(value):
    text = json.dumps(value).encode()
    return "#" + base64.urlsafe_b64encode(text).decode().rstrip("=")


def test_an_address_that_tells_nonsense_is_no_scene():
    given = given_of(load("perpendicular"))
    nonsense = [
        "#", "#1", "#%%%", in_address([1, 2]), in_address("plate"), in_address(None),
        in_address({"plate": 5}), in_address({"plate": {"angle_deg": "steep"}}),
        in_address({"plate": {"angle_deg": {"a": 1}}}), in_address({"plates": {"angle_deg": 1}}),
        in_address({"plate": {"colour": 1}}), in_address({"gravity": "much"}),
        in_address({"surface": [{"name": "a", "points": [[[[1]]]]}]}),
        in_address({"title": {"toString": 1}}), in_address({"constructor": {"name": 1}}),
        in_address({"plate": {"__proto__": 1}}), in_address({"surface": "floor"}),
    ]  # fmt: skip
    good = in_address({"plate": {"distance": 0.5, "angle_deg": 12.5}})
    *found, taken = ask(
        *({"ask": "hash", "given": given, "hash": text} for text in [*nonsense, good])
    )
    for text, answer in zip(nonsense, found, strict=True):
        assert answer is None or answer["fault"], text
        assert answer is None or not answer["fault"].endswith(answer["text"]), text
    assert taken == {**given, "plate": {"distance": 0.5, "angle_deg": 12.5}}


@pytest.mark.parametrize("comma", [False, True])
def test_a_table_comes_back_from_its_text_with_all_digits(comma):
    random = np.random.default_rng(2)
    values = [*(random.normal(size=20) * 10.0 ** random.integers(-12, 12, 20)).tolist(), 0.1, 3]
    head = ["t [s]", "a;b,c", 'say "x"', "=1+1", "ü"]
    rows = [head, *([n, *values[n : n + 4]] for n in range(18))]
    (text,) = ask({"ask": "csv", "rows": rows, "comma": comma})
    found = list(csv.reader(StringIO(text, newline=""), delimiter=";" if comma else ","))
    assert found[0] == [*head[:3], "'=1+1", "ü"]
    back = [[float(cell.replace(",", ".") if comma else cell) for cell in row] for row in found[1:]]
    assert back == rows[1:]
    if not comma:
        assert ask({"ask": "stem", "title": "Plate: 40° / 2 m/s"}) == ["Plate-40-2-m-s"]
