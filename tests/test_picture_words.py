"""What films and pictures say in German: all of it from the catalogue, with no English left."""

import json
import re

import pytest
from click.testing import CliRunner
from matplotlib.text import Text
from PIL import Image

from chutelab import scene
from chutelab.classroom.lessons import find, scene_of
from chutelab.cli import main
from chutelab.engines.simulation import judged, simulate
from chutelab.pictures import plots
from chutelab.pictures.animation import Stage, film, lay_out
from chutelab.pictures.animation.moments import asked, slowness, span
from chutelab.pictures.plots import look
from chutelab.pictures.plots.measures import loads, sensors, wear
from chutelab.util.words import STRINGS, words
from handmade import assert_legible
from shared import lessons, some

WORD = re.compile(r"[^\W\d_]{2,}")


def words_of(language):
    """All words of a language's catalogue for pictures, in small letters."""
    catalogue = json.loads((STRINGS / f"{language}.json").read_text(encoding="utf-8"))
    said = [text for key, text in catalogue.items() if key.startswith("picture-")]
    said = [re.sub(r"\{\w+\}", " ", text) for text in said]
    return {word.lower() for text in said for word in WORD.findall(text)}


ENGLISH = words_of("en") - words_of("de")


def texts_of(figure):
    return [text.get_text() for text in figure.findobj(Text) if text.get_text()]


def english_in(texts):
    """Words of the English catalogue and decimal points; a formula's letters are no words."""
    plain = [re.sub(r"\$[^$]*\$", " ", text) for text in texts]
    found = {word for text in plain for word in WORD.findall(text) if word.lower() in ENGLISH}
    return found | {text for text in plain if re.search(r"\d\.\d", text)}


def stage_of(recording, title, question):
    layout = lay_out(recording, width=1280, height=720, title=title, question=question)
    begin, end = span(recording, layout.window)
    slow, ask = slowness(end - begin), asked(recording, begin)
    moments = film(recording, begin, end, fps=20, slow=slow, ask=ask)
    return Stage(recording, layout, moments, slow=slow, ask=ask)


@pytest.mark.parametrize("name", some([one.name for one in lessons()], 13))
def test_a_german_film_has_no_english_in_it(name):
    lesson = find(name, "de")
    recording = judged(scene_of(lesson, lesson.picture.scene, lesson.picture.set))
    with look(language="de"):
        stage = stage_of(recording, lesson.picture.title, lesson.question)
        texts = texts_of(stage.figure)
        texts += [said for one in stage.writings for said in dict.fromkeys(one.said)]
    assert "Teilchen 0" in texts
    assert english_in(texts) == set()
    english = stage_of(recording, find(name).picture.title, find(name).question)
    # The same search finds what stands in an English film.
    assert english_in(texts_of(english.figure)) >= {"particle", "now"}
    # No question is cut off.
    for shown, told in ((texts, lesson), (texts_of(english.figure), find(name))):
        assert told.question in shown
        assert told.picture.title in shown


@pytest.mark.parametrize("language", ["en", "de"])
@pytest.mark.parametrize("number", range(len(lessons())))
def test_a_lesson_has_a_small_film_in_each_language(number, language):
    lesson = find(number, language)
    path = lesson.folder / {"en": "lesson.gif", "de": "lesson.de.gif"}[language]
    assert path.stat().st_size <= 400_000
    with Image.open(path) as gif:
        assert gif.size == (1280, 720)


@pytest.mark.parametrize("name", some(["slip", "stream-independent", "hopper"]))
def test_german_pictures_have_no_english_in_them(name):
    settings = ["stream.count=60"] if name == "stream-independent" else ["run.until=0.6"]
    settings = [] if name == "slip" else settings
    recording = simulate(scene.load(name, [*settings, "run.loads=0.01", 'title="Bild"']))
    with look(language="de"):
        for draw in (plots.overlay, plots.strobe, sensors, loads, wear):
            figure = draw(recording)
            figure.canvas.draw()
            # Names of streams and surfaces are the scene's own.
            assert english_in(texts_of(figure)) == set()
            assert_legible(figure, 1.5)
        assert english_in(texts_of(plots.overlay(recording, details=name == "slip"))) <= {"exact"}


def test_the_titles_of_shipped_scenes_are_german_too():
    recording = simulate("perpendicular", {"run.loads": 0.01})
    told = words("de").titles()[recording.title]
    assert told != recording.title
    with look(language="de"):
        assert told in texts_of(stage_of(recording, None, "Wo?").figure)
        for draw in (plots.overlay, plots.strobe, loads, wear):
            assert told in texts_of(draw(recording))


@pytest.mark.slow
def test_the_option_chooses_the_language(tmp_path):
    def run(*args):
        return CliRunner().invoke(main, ["run", "perpendicular", *map(str, args)])

    png = ("--only", "png", "-q")
    sizes = []
    for language in ("en", "de"):
        out = tmp_path / language
        assert run("--language", language, "--out", out, *png).exit_code == 0
        sizes.append((out / "overlay.png").read_bytes())
    assert sizes[0] != sizes[1]
    refused = run("--language", "de")
    assert refused.exit_code == 2
    assert "--language de is for pictures" in refused.output
    unknown = run("--language", "fr", "--out", tmp_path, *png)
    assert unknown.exit_code == 2
