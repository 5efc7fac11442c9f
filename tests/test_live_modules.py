"""The words that the live page's modules say."""

import json
import re

from chutelab.classroom.exercises import EXERCISES, SAID, data_of
from chutelab.pictures.live import LANGUAGES, html
from chutelab.scene import load
from chutelab.scene.quantities import REGISTRY
from live.node import ASSETS


def test_every_language_has_every_word_and_no_other():
    catalogues = [
        json.loads((ASSETS / "strings" / f"{language}.json").read_text(encoding="utf-8"))
        for language in LANGUAGES
    ]
    # Quantities are called in English as in the registry.
    numbers = {f"number-{row.name}" for row in REGISTRY.values() if row.symbol}
    for catalogue in catalogues:
        assert list(catalogue) == sorted({*catalogues[0], *(numbers & catalogue.keys())})
        for id_ in catalogue.keys() - numbers:
            text = catalogue[id_]
            # What is filled in is the same.
            assert set(re.findall(r"\{\w+\}", text)) == set(
                re.findall(r"\{\w+\}", catalogues[0][id_])
            ), id_


def test_every_word_that_is_said_is_in_the_catalogue():
    text = json.loads((ASSETS / "strings" / "en.json").read_text(encoding="utf-8"))
    modules = [path for path in ASSETS.iterdir() if path.name.endswith(".ts")]
    assert len(modules) > 20
    for module in modules:
        said = re.findall(r'\bsay\("([\w-]+)"', module.read_text(encoding="utf-8"))
        assert set(said) <= set(text), module.name


def test_every_word_of_an_exercise_is_in_its_catalogue():
    told = data_of(EXERCISES["the-bounce"])["words"]
    assert {key.partition("-")[0] for key in told} == set(SAID)
    for name in ("draw.ts", "judging.ts", "task.ts", "exercise.ts"):
        text = (ASSETS / name).read_text(encoding="utf-8")
        said = re.findall(r'\b(?:worded\((?:exercise, )?|its\()"([\w-]+)"', text)
        assert said
        assert set(said) <= set(told), name


def test_every_colour_that_a_style_names_is_set():
    """A property that is not set is no colour at all, and what it paints is not seen."""
    for lesson in (None, {"title": "", "steps": []}):
        page = html(load("perpendicular"), lesson=lesson)
        style = re.search("<style>(.*)</style>", page, re.DOTALL)[1]
        used = set(re.findall(r"var\(--([\w-]+)\)", style))
        # Shares of sliders and of the time that is computed are set by the page.
        assert used - {"ready", "at"} <= set(re.findall(r"--([\w-]+):", style))
        assert len(used) > 30
