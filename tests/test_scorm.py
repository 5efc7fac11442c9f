"""SCORM 1.2 packages: their manifest, and lessons played through in a platform's stand-in."""

import json
import re
from pathlib import Path
from xml.etree import ElementTree as ET
from zipfile import ZipFile

import pytest
from click.testing import CliRunner

from chutelab.classroom.exercises import EXERCISES
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.lessons.pages import package
from chutelab.cli import main
from live.browser import to_step
from shared import find, some

LIVE = Path(__file__).parent / "live"
STAND_IN = LIVE / "node_modules" / "scorm-again" / "dist" / "scorm12.min.js"
CP = "{http://www.imsproject.org/xsd/imscp_rootv1p1p2}"
ADL = "{http://www.adlnet.org/xsd/adlcp_rootv1p2}"
ADA = "Lovelace, Ada"
LESSONS = [
    name if name == "the-bounce" else pytest.param(name, marks=pytest.mark.slow)
    for name in EXERCISES
]

# Children in order, each with the least and the most of it, and attributes with those required:
# imscp_rootv1p1p2.xsd and adlcp_rootv1p2.xsd, without the metadata that may be left out.
ANY = 10**9
STRUCTURE = {
    "manifest": (
        [("metadata", 0, 1), ("organizations", 1, 1), ("resources", 1, 1), ("manifest", 0, ANY)],
        {"identifier"}, {"version", "{http://www.w3.org/XML/1998/namespace}base"},
    ),
    "metadata": ([("schema", 0, 1), ("schemaversion", 0, 1)], set(), set()),
    "schema": ([], set(), set()),
    "schemaversion": ([], set(), set()),
    "organizations": ([("organization", 1, ANY)], {"default"}, set()),
    "organization": ([("title", 1, 1), ("item", 1, ANY)], {"identifier"}, {"structure"}),
    "title": ([], set(), set()),
    "item": (
        [("title", 1, 1), ("item", 0, ANY)],
        {"identifier"}, {"identifierref", "isvisible", "parameters"},
    ),
    "resources": ([("resource", 1, ANY)], set(), set()),
    "resource": (
        [("file", 1, ANY), ("dependency", 0, ANY)],
        {"identifier", "type", f"{ADL}scormtype", "href"}, set(),
    ),
    "file": ([], {"href"}, set()),
}  # fmt: skip
LONGEST = {"title": 200, "schema": 100, "schemaversion": 20}
"""Characters of a text, as the schemas have it."""


def check_structure(element):
    """An element is in the right namespace, with children and attributes as the schema says."""
    name = element.tag.removeprefix(CP)
    children, required, allowed = STRUCTURE[name]
    found = [child.tag.removeprefix(CP) for child in element]
    counts = [(found.count(child), least, most) for child, least, most in children]
    assert all(least <= count <= most for count, least, most in counts), (name, found)
    order = [child for child, _, _ in children]
    assert found == sorted(found, key=order.index), (name, found)
    assert required <= set(element.attrib) <= required | allowed, (name, element.attrib)
    if not children:
        assert len((element.text or "").strip()) <= LONGEST.get(name, 0)
        assert ((element.text or "").strip() == "") == (name not in LONGEST)
    else:
        assert not "".join([element.text or "", *(one.tail or "" for one in element)]).strip()
    for child in element:
        check_structure(child)


def check_manifest(xml, files):
    """What the schemas cannot say is right too: names are names, and lead to something."""
    root = ET.fromstring(xml)
    assert root.tag == f"{CP}manifest"
    check_structure(root)
    assert root.findtext(f"{CP}metadata/{CP}schema") == "ADL SCORM"
    assert root.findtext(f"{CP}metadata/{CP}schemaversion") == "1.2"
    names = [one.get("identifier") for one in root.iter() if "identifier" in one.attrib]
    assert len(set(names)) == len(names)
    assert all(re.fullmatch(r"[A-Za-z_][\w.-]*", name, re.ASCII) for name in names)
    organizations = root.find(f"{CP}organizations")
    assert organizations.get("default") in [one.get("identifier") for one in organizations]
    resources = {one.get("identifier"): one for one in root.iter(f"{CP}resource")}
    for item in root.iter(f"{CP}item"):
        assert item.get("identifierref") in resources
        assert item.get("isvisible") in (None, "true", "false")
    listed = {"imsmanifest.xml"}
    for one in resources.values():
        assert (one.get("type"), one.get(f"{ADL}scormtype")) == ("webcontent", "sco")
        hrefs = [file.get("href") for file in one.iter(f"{CP}file")]
        assert one.get("href") in hrefs
        listed.update(hrefs)
    assert listed == set(files)
    return root


def unpacked(path):
    with ZipFile(path) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name) for name in archive.namelist()}


@pytest.mark.parametrize("name", some(EXERCISES))
def test_every_lesson_has_a_package_that_its_manifest_describes(name, tmp_path):
    files = unpacked(package(find(name), tmp_path / "x.zip"))
    root = check_manifest(files["imsmanifest.xml"], files)
    assert EXERCISES[name].title in root.findtext(f".//{CP}item/{CP}title")
    # No path of this machine, nothing from the network but names of XML's namespaces.
    for file, content in files.items():
        text = content.decode("utf-8")
        assert str(Path(__file__).parents[1]) not in text
        assert str(tmp_path) not in text
        if file != "page.html":
            assert set(re.findall(r"https?://[\w./]+", text)) <= {CP[1:-1], ADL[1:-1]}
            assert not re.search(r'(?:src|href)="(?:/|\w+:)', text)


def test_what_a_title_has_in_it_is_no_markup(tmp_path):
    lesson = find("the-bounce").model_copy(update={"title": 'A & <b> "x" $page \x07'})
    files = unpacked(package(lesson, tmp_path / "x.zip"))
    root = check_manifest(files["imsmanifest.xml"], files)
    said = root.findtext(f".//{CP}item/{CP}title")
    assert said.endswith(r'A & <b> "x" $page \x07')
    assert b"<b>" not in files["index.html"]


def test_the_command_writes_one_file_or_a_folder_of_packages(tmp_path):
    def run(*arguments):
        return CliRunner().invoke(main, ["lesson", "scorm", *map(str, arguments)])

    one = run(3, "-o", tmp_path / "bounce.zip", "--language", "de")
    assert one.exit_code == 0, one.output
    assert f"wrote {tmp_path / 'bounce.zip'}" in one.output
    assert b'lang="de"' in unpacked(tmp_path / "bounce.zip")["index.html"]
    two = run(1, "the-bounce", "-o", tmp_path / "packages", "-q")
    assert (two.exit_code, two.output) == (0, "")
    made = sorted(path.name for path in (tmp_path / "packages").iterdir())
    assert made == ["01-the-parabola.scorm.zip", "03-the-bounce.scorm.zip"]
    assert run(1, 2, "-o", tmp_path / "x.zip").exit_code == 2
    assert "go into a folder" in run(1, 2, "-o", tmp_path / "x.zip").stderr
    for arguments in ([], [3, "--all"]):
        assert "give lessons" in run(*arguments).stderr
    own = tmp_path / "my-lesson"
    assert CliRunner().invoke(main, ["lesson", "new", str(own)]).exit_code == 0
    refused = run(own, "-o", tmp_path / "x.zip")
    assert refused.exit_code == 2
    assert "a live page with an exercise" in refused.stderr
    assert run(3, "--language", "xx", "-o", tmp_path / "x.zip").exit_code == 2
    assert not (tmp_path / "x.zip").exists()


@pytest.fixture
def platform(browser, tmp_path):
    """Open a lesson's package in a platform's stand-in, at a server that is none."""
    if not STAND_IN.is_file():
        pytest.skip("needs npm ci in tests/live")
    context = browser.new_context(viewport={"width": 1366, "height": 900})
    said = []

    def start(name):
        files = {
            f"/package/{file}": content
            for file, content in unpacked(package(find(name), tmp_path / "x.zip")).items()
        }
        files["/scorm12.min.js"] = STAND_IN.read_bytes()
        files["/"] = (LIVE / "lms.html").read_bytes()
        files["/elsewhere"] = b"<!doctype html><title>Elsewhere</title>"

        def answer(route):
            path = route.request.url.removeprefix("http://lms.test").partition("?")[0]
            found = files.get(path)
            if found is None:
                said.append(path)
                route.fulfill(status=404)
            else:
                kind = "text/javascript" if path.endswith(".js") else "text/html"
                route.fulfill(body=found, content_type=f"{kind}; charset=utf-8")

        context.route("**/*", answer)

    def visit(address="/"):
        page = context.new_page()
        page.set_default_timeout(15_000)
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.goto(f"http://lms.test{address}")
        return page

    visit.start = start
    yield visit
    context.close()
    assert said == []


def answers_of(name, student=ADA):
    """The right answers of a student, rounded as a student would."""
    _, cases = draw(EXERCISES[name], student)
    return {str(case.number): f"{case.right:.4g}" for case in cases}


def exercise_of(page):
    """The lesson's page, in a frame of a frame, once it has begun."""
    frame = page.frame_locator("iframe").frame_locator("iframe")
    to_step(frame)
    frame.locator(".question").first.wait_for()
    return frame


def check(frame, number, answer):
    """Answer a question; return the verdict."""
    question = frame.locator(f'.question[data-question="{number}"]')
    if not question.locator("input").is_visible():
        question.locator("summary").click()
    question.locator("input").fill(answer)
    question.locator(".check").click()
    return question.locator(".reply").get_attribute("data-verdict")


def leave(page, last):
    """Go elsewhere, once the platform was told of what was done last; return what it keeps."""
    told = "([, key, value]) => key === 'cmi.suspend_data' && value.includes(last)"
    page.wait_for_function(f"(last) => calls.some({told})", arg=last)
    calls = page.evaluate("calls")
    page.goto("http://lms.test/elsewhere")
    kept = page.evaluate("JSON.parse(localStorage.getItem('kept'))")
    page.close()
    return kept, calls


def interactions(data):
    """Every answer that the platform was told of, in order."""
    found = data["interactions"]
    return [found[key] for key in sorted(found, key=int)] if isinstance(found, dict) else found


@pytest.mark.slow
@pytest.mark.parametrize("name", LESSONS)
def test_a_lesson_is_left_resumed_and_completed_in_a_platform(platform, name):
    platform.start(name)
    right = answers_of(name)
    page = platform()
    frame = exercise_of(page)
    assert ADA in frame.locator("#exercise").inner_text()
    assert check(frame, 1, "123456") == "off"
    assert check(frame, 2, "two metres") == "unread"
    assert check(frame, 1, right["1"]) == "right"
    data, _ = leave(page, '"tries":{"1":2,"2":1}')
    expected = {"raw": str(round(100 / len(right))), "min": "0", "max": "100"}
    assert {key: str(data["core"]["score"][key]) for key in expected} == expected
    assert (data["core"]["lesson_status"], data["core"]["entry"]) == ("incomplete", "resume")

    page = platform()
    frame = exercise_of(page)
    first = frame.locator('.question[data-question="1"]')
    assert "2 tries" in first.locator(".state").text_content()
    assert first.locator("input").input_value() == right["1"]
    # Where it goes on is no news to the platform.
    assert not any("score" in str(call[1]) for call in page.evaluate("calls"))
    for number in list(right)[1:]:
        assert check(frame, number, right[number]) == "right"
    tries = {"1": 2, "2": 2} | dict.fromkeys(list(right)[2:], 1)
    data, calls = leave(page, f'"tries":{json.dumps(tries, separators=(",", ":"))}')
    assert data["core"]["lesson_status"] == "completed"
    assert str(data["core"]["score"]["raw"]) == "100"
    told = [
        (one["id"], one["type"], float(one["student_response"]), one["result"])
        for one in interactions(data)
    ]
    assert told == [
        ("question-1", "numeric", 123456.0, "wrong"),
        *((f"question-{n}", "numeric", float(x), "correct") for n, x in right.items()),
    ]
    # None of what was asked of the platform was an error.
    assert calls[0][:2] == ["LMSInitialize", ""]
    assert {str(call[-1]) for call in calls} == {"0"}


# Quotes and line ends are two characters each in JSON.
LONG = "ü" + 749 * '\n"'


@pytest.mark.slow
def test_a_long_explanation_and_a_long_name_come_back(platform):
    platform.start("the-bounce")
    name = 100 * "Zoë "
    page = platform(f"/?name={name}")
    frame = page.frame_locator("iframe").frame_locator("iframe")
    to_step(frame, "explain")
    frame.locator("textarea").fill(LONG)
    data, _ = leave(page, json.dumps(LONG, ensure_ascii=False))
    assert 3000 < len(data["suspend_data"]) <= 4096
    page = platform(f"/?name={name}")
    frame = page.frame_locator("iframe").frame_locator("iframe")
    to_step(frame, "explain")
    assert frame.locator("textarea").input_value() == LONG
    assert {call[-1] for call in page.evaluate("calls")} == {"0"}


@pytest.mark.slow
def test_platforms_that_refuse_or_are_none_are_told_of(platform):
    platform.start("the-bounce")
    page = platform("/package/index.html")
    alone = page.locator("#alone")
    assert "press “Save to hand in”" in alone.inner_text()
    frame = page.frame_locator("iframe")
    frame.locator("#student").fill("Ada")
    frame.locator("#begin").click()
    to_step(frame)
    assert check(frame, 1, answers_of("the-bounce", "Ada")["1"]) == "right"
    assert frame.locator("#result").inner_text() == "Save to hand in"
    page.close()
    page = platform("/?refuses")
    frame = page.frame_locator("iframe")
    frame.locator("#alone").wait_for()
