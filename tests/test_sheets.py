"""The sheets of lessons: printed, and as files in Markdown, HTML and PDF."""

import re
from io import BytesIO

import pytest
import typst
from PIL import Image
from pypdf import PdfReader

from chutelab.classroom.exercises import told
from chutelab.classroom.lessons import read
from chutelab.classroom.lessons.building import start
from chutelab.classroom.lessons.sheets import SHEETS, printed, sheet
from chutelab.classroom.lessons.texts import as_text, html_of, parsed, typeset, without_tex
from chutelab.util.words import words
from shared import Page, chutelab, find, lessons, some


def pages(pdf):
    """Count the pages of a PDF: each has its own object."""
    return len(re.findall(rb"/Type\s*/Page\b", pdf))


def test_sheets_are_printed_and_refuse_what_cannot_be(tmp_path):
    for which in SHEETS:
        said = sheet(find(1), which)
        assert chutelab("lesson", "show", 1, "--sheet", which).output == without_tex(said)
        raw = chutelab("lesson", "show", 1, "--sheet", which, "--format", "md").output
        assert raw == said
    made = start(tmp_path / "mine")
    assert "for the teacher" in chutelab("lesson", "show", made, "--sheet", "teacher").output


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ((), "name one LESSON"),
        ((1, "--all"), "name one LESSON"),
        (("--all",), "--sheet student, teacher or explanation"),
        ((1, "-o", "x.pdf"), "--sheet student, teacher or explanation"),
        ((1, "--sheet", "student", "--json"), "give one of them"),
        ((1, "--sheet", "student", "--format", "pdf"), "say where to: -o sheet.pdf"),
        (("--all", "--sheet", "student"), "say where to"),
        ((1, "--sheet", "student", "-o", "sheet.doc"), "end in .md, .html or .pdf"),
        ((1, "--sheet", "student", "-o", "a.html", "--format", "pdf"), "--format says pdf"),
    ],
)
def test_what_cannot_be_printed_is_said(arguments, said):
    result = chutelab("lesson", "show", *arguments)
    assert result.exit_code == 2
    assert said in result.output


def test_sheets_go_into_a_folder_with_names_of_their_own(tmp_path):
    out = tmp_path / "new"
    assert chutelab("lesson", "show", 2, "--sheet", "teacher", "-o", out).exit_code == 0
    result = chutelab("lesson", "show", "--all", "--sheet", "student", "--format", "md", "-o", out)
    assert result.exit_code == 0
    names = sorted(path.name for path in out.iterdir())
    assert "02-letting-go-teacher.pdf" in names
    assert {"01-the-parabola-student.md", "09-design-student.md"} <= set(names)


@pytest.mark.parametrize("which", SHEETS)
@pytest.mark.parametrize("number", some([lesson.number for lesson in lessons()]))
def test_every_sheet_is_a_page_that_is_whole(number, which):
    lesson = find(number)
    page = Page(printed(lesson, which, "html").decode("utf-8"))
    tags = [tag for tag, _ in page.tags]
    assert tags.count("h1") == 1
    for one in page.addresses:
        there = one.startswith(("data:", "https://")) or (lesson.folder / one).is_file()
        assert there, one
    assert "$" not in page.text
    assert "\\" not in page.text
    assert tags.count("math") == html_of(sheet(lesson, which)).count("<math")
    # Room to write: under each question without sentences to choose from.
    questions = sum(not ask.choices for step in lesson.steps for ask in step.asks)
    assert page.told("class").count("answer") == (questions if which == "student" else 0)


@pytest.mark.parametrize(
    ("number", "which"),
    [
        pytest.param(n, which, marks=() if n % 9 == 3 * k else pytest.mark.slow)
        for n in range(len(lessons()))
        for k, which in enumerate(SHEETS)
    ],
)
def test_every_sheet_is_a_pdf_of_a_few_pages(number, which):
    assert 1 <= pages(printed(find(number), which, "pdf")) <= 4


@pytest.mark.parametrize("number", some([4, 7, 13]))
@pytest.mark.parametrize("language", some(["en", "de"], 2))
def test_the_heading_of_your_numbers_is_on_the_page_of_their_table(number, language):
    lesson, say = find(number, language), words(language).say
    found = PdfReader(BytesIO(printed(lesson, "student", "pdf"))).pages
    texts = [" ".join(page.extract_text().split()) for page in found]
    (there,) = [n for n, text in enumerate(texts) if say("step-numbers") in text]
    first = told(lesson.name, language).questions[0]
    for said in (say("sheet-numbers"), say("sheet-question"), f"1. {first.title}"):
        assert said in texts[there]


@pytest.mark.parametrize(
    ("tex", "characters", "set_as"),
    [
        ("v_{3x}", "v3x", "attach(v, b: 3 x)"),
        ("v_2'", "v2'", "attach(v, b: 2, t: ′)"),
        (r"\frac{a}{b + c}", "a/(b + c)", r"frac(a, b \+ c)"),
        (r"\frac{1}{2} m", "½ m", "frac(1, 2) m"),
        (r"\sqrt{2 g h}", "√(2 g h)", "sqrt(2 g h)"),
        (r"\mu \to \infty", "µ → ∞", "μ → ∞"),
        (r"\sin^2\varphi", "sin² φ", "attach(sin, t: 2) φ"),
        (r"\cos(x)", "cos(x)", r"cos \( x \)"),
        (r"\dot m", "m\N{COMBINING DOT ABOVE}", "accent(m, dot)"),
        ("10^{-3}", "10^-3", "attach(10, t: − 3)"),
    ],
)
def test_formulas_are_written_in_characters_and_for_print(tex, characters, set_as):
    assert as_text(parsed(tex)) == characters
    assert typeset(parsed(tex)) == set_as


@pytest.mark.parametrize(
    "tex",
    ["{", "}", "_", "^^", "a_", r"\frac{a", r"\sqrt", "x_{", r"\unknown{x}", "#panic()", "\\", "'"],
)
def test_no_formula_is_too_broken_to_be_shown(tex):
    as_text(parsed(tex))
    typst.compile(f"${typeset(parsed(tex))} x$".encode(), format="pdf")


EVIL = '#panic() \\ " ] [ $ * _ ` <x> @y // /* "); #eval("1")'


def test_no_text_of_a_lesson_is_a_command_of_the_printer(tmp_path):
    folder = start(tmp_path / "mine")
    table = f"| {EVIL} | b |\n|---|---|\n| {EVIL} | |\n"
    more = f"\n\n{EVIL}\n\n- {EVIL}\n\n{table}\n`{EVIL.replace('`', '')}`\n"
    plan = (folder / "lesson.toml").read_text(encoding="utf-8")
    plan = plan.replace('"Mine"', f"'{EVIL}'")
    quoted = f"'''{more}'''"
    for name in ("text", "then"):
        plan = re.sub(rf"^{name} = .*$", lambda _, n=name: f"{n} = {quoted}", plan, flags=re.M)
    (folder / "lesson.toml").write_text(plan, encoding="utf-8")
    lesson = read(folder)
    for which in SHEETS:
        assert pages(printed(lesson, which, "pdf")) >= 1
        page = Page(printed(lesson, which, "html").decode("utf-8"))
        assert "x" not in dict(page.tags)


def test_pictures_beside_a_text_are_in_its_sheets_and_no_others(tmp_path):
    folder = start(tmp_path / "mine")
    Image.new("RGB", (20, 10), "#ff0000").save(folder / "red.png")
    secret = tmp_path / "secret.png"
    Image.new("RGB", (20, 10)).save(secret)
    without = printed(read(folder), "student", "pdf")
    file = folder / "lesson.toml"
    text = file.read_text(encoding="utf-8")

    def shows(picture):
        made = text.replace('text = "Sketch its path."', f'text = "Sketch it. ![it]({picture})"')
        file.write_text(made, encoding="utf-8")

    shows("red.png")
    assert len(printed(read(folder), "student", "pdf")) > len(without)
    assert "data:image/png;base64," in printed(read(folder), "student", "html").decode()
    for name in ("../secret.png", secret, "gone.png", "https://example.com/x.png"):
        shows(name)
        assert "data:image/png" not in printed(read(folder), "student", "html").decode()
        printed(read(folder), "student", "pdf")
