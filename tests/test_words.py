"""What a learner is told in each language: whole catalogues, and exercises laid over by texts."""

import json
import re
import tomllib
from collections import Counter
from pathlib import Path

import pytest
from click.testing import CliRunner

from chutelab.classroom import exercises as package
from chutelab.classroom import lessons
from chutelab.classroom.exercises import EXERCISES, lesson, told
from chutelab.classroom.exercises.exercise import draw, translated
from chutelab.classroom.lessons.sheets import sheet
from chutelab.cli import main
from chutelab.scene import load, shipped
from chutelab.util.errors import InputError
from chutelab.util.words import LANGUAGES, STRINGS, LanguageError, words
from shared import call, some

EXERCISE_FILES = Path(package.__file__).parent
TRANSLATIONS = sorted(EXERCISE_FILES.glob("*.*.toml"))
LESSONS = Path(__file__).parent.parent / "lessons"


def catalogue(language):
    return json.loads((STRINGS / f"{language}.json").read_text(encoding="utf-8"))


def names_in(text):
    return Counter(re.findall(r"\{(\w+)\}", text))


def test_every_language_says_all_that_english_says_with_the_same_numbers_in_it():
    english = catalogue("en")
    assert list(english) == sorted(english)
    assert LANGUAGES[0] == "en"
    assert len(LANGUAGES) > 1
    for language in LANGUAGES:
        found = catalogue(language)
        assert list(found) == list(english), language
        for key, text in found.items():
            assert names_in(text) == names_in(english[key]), (language, key)


def test_a_reply_says_not_yet_and_never_wrong():
    for language, right, later in (("en", "right", "not yet"), ("de", "richtig", "noch nicht")):
        said = catalogue(language)
        assert (said["verdict-right"], said["verdict-off"]) == (right, later)
        replies = [text for key, text in said.items() if re.match("verdict|off|reply|besides", key)]
        for name in EXERCISES:
            for case in draw(told(name, language), "Ada")[1]:
                replies += [mistake.called for mistake in case.mistakes]
        for text in replies:
            assert not re.search(r"(?i)\b(wrong|invalid|falsch\w*|ungültig)\b", text), text


def test_an_unknown_language_is_told_which_there_are():
    with pytest.raises(LanguageError, match=r"no language 'fr'; there are en, de"):
        lesson("the-bounce", "Ada", language="fr")
    assert issubclass(LanguageError, InputError)


def test_a_conversation_in_german_has_no_english_in_it():
    task = lesson("the-bounce", "Ada", language="de")
    right = [case.right for case in draw(EXERCISES["the-bounce"], "Ada")[1]]
    said = [task, task.questions, task.check(1), task.check(1, -right[0])]
    said += [task.check(1, 1.03 * right[0]), task.check(2, 3.3 * right[1]), task.check(3, "bald")]
    said += [task.check(2, right[1]), task.check(9), [task.hint(4) for _ in range(3)]]
    said += [task.reveal(4), task.progress(), task.check(3, 2000 * right[2])]
    html = task._repr_html_() + task.check(1, right[0])._repr_html_()
    text = f"{said} {html} {task.progress()._repr_html_()}"
    assert not re.findall(r"(?i)\b(?:the|question|answer|with|right|tries|shown|not)\b", text)
    assert not re.search(r"\d\.\d", str(said))
    assert "g = 9,81 m/s²" in text
    assert task.check(2, right[1]).right


@pytest.mark.parametrize("name", some(EXERCISES, 5))
def test_a_mistake_has_one_name_in_all_languages(name):
    english, german = lesson(name, "Ada"), lesson(name, "Ada", language="de")
    # Of one question each, by turns: all texts are compared below.
    case = draw(EXERCISES[name], "Ada")[1][len(name) % 4]
    for trace in case.mistakes:
        said, other = (task.check(case.number, trace.number) for task in (english, german))
        assert (other.verdict, other.mistake) == (said.verdict, said.mistake)
        assert said.called == said.mistake


def test_a_mistake_is_called_by_the_name_of_its_language():
    sign = lesson("the-parabola", "Ada", language="de")
    reply = sign.check(1, -draw(EXERCISES["the-parabola"], "Ada")[1][0].right)
    assert reply.mistake == "sign or direction"
    assert reply.heading == "Frage 1: vermutlich „Vorzeichen oder Richtung“"


def placed(name, exercise):
    """Every text of an exercise by its place."""
    yield "title", exercise.title
    yield "story", exercise.story
    for one in exercise.parameters:
        yield one.name, one.meaning
    for i, asked in enumerate(exercise.questions, start=1):
        for field in ("title", "text", "working", "source"):
            yield f"{i} {field}", getattr(asked, field)
        for n, hint in enumerate(asked.hints):
            yield f"{i} hint {n}", hint
        for known in asked.mistakes:
            yield f"{i} {known.name}", known.says


@pytest.mark.parametrize("file", TRANSLATIONS, ids=lambda file: file.stem)
def test_a_translation_has_texts_only_and_all_of_them(file):
    name, language = file.stem.split(".")
    english = EXERCISES[name]
    found = tomllib.loads(file.read_text(encoding="utf-8"))
    assert set(found) <= {"title", "story", "parameters", "questions"}
    assert set(found["parameters"]) <= {one.name for one in english.parameters}
    assert len(found["questions"]) == len(english.questions)
    general = {
        words().say(key): words(language).say(key)
        for key in catalogue("en")
        if key.startswith("mistake-")
    }
    for asked, there in zip(english.questions, found["questions"], strict=True):
        assert set(there) == {"title", "text", "hints", "working", "source", "mistakes"}
        assert len(there["hints"]) == len(asked.hints)
        assert set(there["mistakes"]) <= {known.name for known in asked.mistakes}
        for known, (called, _) in there["mistakes"].items():
            assert general.get(known, called) == called
    laid_over = translated(english, file, language)
    missing = [
        one.name for asked in laid_over.questions for one in asked.mistakes if not one.called
    ]
    assert laid_over.whole, f"not translated: {missing or 'a meaning, the title or the story'}"
    pairs = zip(placed(name, english), placed(name, laid_over), strict=True)
    for (place, said), (_, translation) in pairs:
        assert names_in(said) == names_in(translation), place
        assert not re.search(r"\d\.\d", translation), (place, "a decimal point")


def test_what_is_not_translated_is_in_english_and_that_is_said(tmp_path, monkeypatch):
    english = EXERCISES["trust"]
    file = tmp_path / "trust.de.toml"
    told = translated(english, file, "de")
    assert (told.story, told.language, told.whole) == (english.story, "de", False)
    file.write_text(
        'title = "Kann man einer Simulation trauen?"\n[[questions]]\ntitle = "Ordnung"\n'
        '[questions.mistakes]\n"upside down" = ["Kehrwert", "Umgekehrt."]\n',
        encoding="utf-8",
    )
    told = translated(english, file, "de")
    assert (told.title, told.questions[0].title) == ("Kann man einer Simulation trauen?", "Ordnung")
    assert (told.questions[0].text, told.whole) == (english.questions[0].text, False)
    assert told.questions[0].mistakes[0].called == "Kehrwert"
    assert told.questions[1:] == [*english.questions[1:]]
    note = words("de").say("untranslated")
    assert note not in repr(lesson("trust", "Ada", language="de"))
    monkeypatch.setattr("chutelab.classroom.exercises.told", lambda *_: told)
    task = lesson("trust", "Ada", language="de")
    assert " ".join(note.split()) in " ".join(repr(task).split())
    assert note in task._repr_html_()


FOLDERS = sorted(path.parent.name for path in LESSONS.glob("*/lesson.toml"))


@pytest.mark.parametrize("folder", FOLDERS)
def test_a_lesson_says_the_same_in_both_languages(folder):
    english, german = (lessons.read(LESSONS / folder, language) for language in ("en", "de"))
    assert german.untranslated == ()
    assert german.title != english.title
    for which in ("student", "explanation"):
        said, translation = (sheet(one, which) for one in (english, german))
        # A picture with words is there in both.
        translation = translation.replace(".de.png)", ".png)").replace(".de.gif)", ".gif)")
        # What is typed is the same, and so are the formulas and the numbers in the text.
        for pattern in (r"```.*?```", r"`[^`\n]+`", r"\]\([^)]*\)"):
            typed = re.findall(pattern, translation.replace(".de.", "."), re.DOTALL)
            assert sorted(typed) == sorted(re.findall(pattern, said, re.DOTALL))
        assert formulas_in(translation) == formulas_in(said)
        assert numbers_in(translation) == numbers_in(said)
    pairs = zip(texts_of(english), texts_of(german), strict=True)
    for (place, said), (_, translation) in pairs:
        assert numbers_in(translation) == numbers_in(said), place
        # A plain text stands in both, and its numbers are written as the language does.
        prose = re.sub(r"Abschnitt 3\.2|doi:\S+", "", without_code(translation))
        assert said == translation or not re.search(r"\d\.\d", prose), place
        prose = without_code(re.sub(r"\$[^$]+\$", "", translation))
        assert not re.findall(r"(?i)\b(?:the|with|is|for|from|which)\b", prose), place


def texts_of(lesson):
    """Places and texts of a lesson: all that is a text and no name, key or formula."""

    def below(value, place):
        if isinstance(value, dict):
            for key, one in value.items():
                if key not in (
                    "set",
                    "kind",
                    "value",
                    "controls",
                    "scene",
                    "scenes",
                    "live",
                    "level",
                ):
                    yield from below(one, f"{place}.{key}")
        elif isinstance(value, list | tuple):
            for n, one in enumerate(value):
                yield from below(one, f"{place}[{n}]")
        elif isinstance(value, str):
            yield place, value

    return below(lesson.model_dump(exclude={"page"}), "")


def without_code(text):
    return re.sub(r"```.*?```|`[^`\n]+`|\]\([^)]*\)", "", text, flags=re.DOTALL)


def formulas_in(text):
    return Counter(re.findall(r"\$\$?[^$]+\$\$?", without_code(text)))


def numbers_in(text):
    """Numbers with a decimal mark, as a point; a decimal point is no German."""
    plain = re.sub(r"\$\$?[^$]+\$\$?", "", without_code(text))
    return Counter(found.replace(",", ".") for found in re.findall(r"\d+[.,]\d+", plain))


def test_a_lesson_that_is_not_translated_is_in_english_and_that_is_said(tmp_path):
    folder = tmp_path / "my-lesson"
    assert CliRunner().invoke(main, ["lesson", "new", str(folder)]).exit_code == 0
    plan = folder / "lesson.toml"
    text = plan.read_text(encoding="utf-8")
    plan.write_text(text.replace("question = ", "question.en = "), encoding="utf-8")
    lesson, english = lessons.read(folder, "de"), lessons.read(folder)
    assert (lesson.title, lesson.question) == (english.title, english.question)
    assert lesson.untranslated == ("question",)
    note = words("de").say("untranslated")
    for more in ([], ["--sheet", "student"], ["--sheet", "teacher"]):
        args = ["lesson", "show", str(folder), *more]
        assert note in call(*args, "--language", "de").output
        assert words("en").say("untranslated") not in CliRunner().invoke(main, args).output
    plan.write_text(text.replace("question = ", 'question.de = "Was?"\nquestion.en = '), "utf-8")
    assert lessons.read(folder, "de").question == "Was?"
    assert lessons.read(folder, "de").untranslated == ()
    plan.write_text(text.replace("question = ", "question.de = 3\nquestion.en = "), "utf-8")
    with pytest.raises(lessons.LessonError, match="question"):
        lessons.read(folder, "de")


def test_the_sheets_of_a_translated_lesson_are_german():
    for which in ("student", "teacher", "explanation"):
        args = ["lesson", "show", "3", "--sheet", which, "--language", "de"]
        text = CliRunner().invoke(main, args).output
        prose = without_code(text).replace("the-bounce", "").replace("„your name“", "")
        assert not re.findall(r"(?i)\b(?:the|and|of|with|is|for|from)\b", prose)
    assert CliRunner().invoke(main, ["lesson", "show", "3", "--language", "fr"]).exit_code != 0


def test_pages_of_lessons_are_german_around_what_is_translated(tmp_path):
    args = ["lesson", "page", "1", "--language", "de", "--out", str(tmp_path / "de")]
    call(*args)
    index = (tmp_path / "de" / "index.html").read_text(encoding="utf-8")
    page = (tmp_path / "de" / "01-the-parabola" / "index.html").read_text(encoding="utf-8")
    live = (tmp_path / "de" / "01-the-parabola" / "page.html").read_text(encoding="utf-8")
    assert all('<html lang="de">' in text for text in (index, page, live))
    assert "Eine Lektion" in index
    assert "Alle Lektionen" in page
    assert "Zurück zur Lektion" in live
    prose = re.sub(r"<code.*?</code>|<pre.*?</pre>|<math.*?</math>|<[^>]*>", " ", page, flags=re.S)
    assert not re.findall(r"\b(?:the|and|with|when|lessons)\b", prose)


def test_shipped_scenes_have_a_title_in_each_language():
    for name in shipped():
        assert words().say(f"title-{name}") == load(name).title
    german = words("de").titles()
    assert all(german[title] != title for title in german)


def test_parts_of_shipped_scenes_have_a_name_in_each_language_and_it_is_no_other_text():
    """The stream "first" of the drum was called "Say who I am", which was a text of lessons."""
    own = re.compile(r"[^.!?]{1,26}")
    folder = STRINGS.parents[1] / "pictures" / "live" / "assets" / "strings"
    known = {
        language: {
            key.removeprefix("name-"): text
            for key, text in json.loads((folder / f"{language}.json").read_text("utf-8")).items()
            if key.startswith("name-")
        }
        for language in LANGUAGES
    }
    for language, texts in known.items():
        assert [text for text in texts.values() if not own.fullmatch(text)] == [], language
    for name in shipped():
        scene = load(name)
        for part in (*scene.free, *scene.sensor, *scene.streams, *scene.particles):
            if part.name is None or part.name in ("plate", "stream"):
                continue
            stem = re.sub(r" \d+$", "", part.name)
            # "left" is a wall.
            assert known["en"][stem] in (stem.replace("_", " "), f"{stem} wall"), (name, stem)
            assert known["de"][stem] != stem
