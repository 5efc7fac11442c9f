"""A whole exercise in the page of its lesson, in a real browser."""

import json

import pytest

from chutelab.classroom.exercises import EXERCISES, lesson
from chutelab.classroom.exercises.exercise import draw
from chutelab.classroom.lessons.pages import live_page
from live.browser import to_step
from shared import find

expect = pytest.importorskip("playwright.sync_api").expect


def begin(page, student):
    """Begin with a name, and go to the questions."""
    page.locator("#student").fill(student)
    page.keyboard.press("Enter")
    to_step(page)


def says(page, number, typed):
    """Type an answer; return verdict and reply."""
    question = page.locator(f'[data-question="{number}"]')
    if question.get_attribute("open") is None:
        question.locator("summary").click()
    question.locator("input").fill(typed)
    question.locator("input").press("Enter")
    reply = question.locator(".reply")
    return reply.get_attribute("data-verdict"), reply.inner_text()


MEASURED = """async () => {
  const { task } = chutelab.lesson;
  while (!task.measured.size) await new Promise((done) => setTimeout(done, 5));
  return [...task.measured].map(([n, value]) => [n, value, task.case(n).right]);
}"""


MACHINES = [one.name for one in EXERCISES.values() if one.machine]


@pytest.mark.parametrize(
    "name", [*MACHINES[:1], *(pytest.param(one, marks=pytest.mark.slow) for one in MACHINES[1:])]
)
def test_the_machine_of_a_student_says_what_is_right(page_of, name):
    page = page_of(name)
    begin(page, "Ada")
    _, cases = draw(EXERCISES[name], "Ada")
    measured = page.evaluate(MEASURED)
    assert [n for n, *_ in measured] == [
        n for n, case in enumerate(cases) if case.question.measured
    ]
    # The picture shows the student's machine, which runs as soon as all that it shows was answered.
    for key, formula in EXERCISES[name].machine.items():
        expected = cases[0].numbers.of(formula)
        table, entry = key.split(".")
        found = page.evaluate(
            "([table, entry]) => chutelab.lab.given[table][entry]", [table, entry]
        )
        assert found == (expected if isinstance(expected, str) else pytest.approx(expected))
    for n, value, right in measured:
        assert right == value == pytest.approx(cases[n].right, rel=1e-6, abs=0.0)
        page.click("#play")
        assert not page.evaluate("chutelab.lab.playing")
        expect(page.locator(".track")).to_have_count(0)
        assert "Your machine" in page.inner_text("#guess")
        close = f"{0.97 * right:.6g}"
        reply = lesson(name, "Ada").check(n + 1, float(close))
        assert says(page, n + 1, close) == ("off", f"↻ {reply.heading}. {reply.text}")
    expect(page.locator(".track")).to_have_count(1)
    expect(page.locator("#guess")).to_be_hidden()
    page.click("#play")
    assert page.evaluate("chutelab.lab.playing")


# A page with the live page in a frame, and what it hears.
FRAME = """<!doctype html><title>frame</title><iframe src="{page}" {sandbox}></iframe><script>
globalThis.heard = [];
const frame = document.querySelector("iframe");
addEventListener("message", ({{ data }}) => {{
  heard.push(data);
  if (data.chutelab !== "ready") return;
  const begin = (more) => frame.contentWindow.postMessage({{ chutelab: "begin", ...more }}, "*");
  for (const odd of [null, 7, {{}}]) frame.contentWindow.postMessage(odd, "*");
  for (const student of [undefined, 3, " "]) begin({{ student }});
  begin({{ student: "x", suspend_data: 3 }});
  begin({{ student: "Lovelace, Ada", suspend_data: {suspended} }});
}});
</script>"""


@pytest.mark.slow
@pytest.mark.parametrize(
    "sandbox",
    [pytest.param("", marks=pytest.mark.slow), 'sandbox="allow-scripts allow-downloads"'],
)
def test_a_page_around_it_says_who_it_is_and_hears_what_becomes_of_it(opened, tmp_path, sandbox):
    live_page(find(3), tmp_path / "page.html")
    cases = draw(EXERCISES["the-bounce"], "Lovelace, Ada")[1]
    suspended = ""
    for done in (1, 2):
        outer = tmp_path / "frame.html"
        html = FRAME.format(page="page.html", sandbox=sandbox, suspended=json.dumps(suspended))
        outer.write_text(html, encoding="utf-8")
        page = opened(outer)
        frame = page.frame_locator("iframe")
        page.wait_for_function("heard.length")
        if not suspended:
            # First it is to be predicted, whoever it is.
            assert frame.locator(".question").count() == 0
            to_step(frame)
        frame.locator("#exercise h3").wait_for()
        expect(frame.locator("#somebody-else")).to_be_hidden()
        question = frame.locator(f'[data-question="{done}"]')
        question.locator("input").fill(f"{cases[done - 1].right:.4g}")
        question.locator(".check").click()
        question.locator(".reply.right").wait_for()
        # It is told by a message, which may come after the reply is seen.
        page.wait_for_function(f"heard.at(-1).done === {done}")
        heard = page.evaluate("heard")
        assert heard[0] == {"chutelab": "ready", "lesson": "the-bounce"}
        told = {key: heard[-1][key] for key in heard[-1] if key not in ("suspend_data", "result")}
        assert told == {
            "chutelab": "progress", "lesson": "the-bounce", "student": "Lovelace, Ada",
            "done": done, "total": 4, "score": 25 * done, "status": "incomplete",
            "verdicts": {str(n): "right" if n <= done else "blank" for n in range(1, 5)},
        }  # fmt: skip
        suspended = heard[-1]["suspend_data"]
        assert len(suspended) < 4000
        assert list(heard[-1]["result"]["answers"]) == ["1", "2"][:done]


@pytest.mark.slow
def test_what_was_kept_in_a_bad_way_is_left_out(page_of):
    page = page_of(3)
    page.evaluate("""() => {
      localStorage.setItem("chutelab/the-bounce/seven", JSON.stringify({student: 7}));
      localStorage.setItem("chutelab/the-bounce/ada", JSON.stringify({
        chutelab_result: 1, lesson: "the-bounce", student: 7, answers: {1: "x", 2: null, 9: 3},
        tries: {1: -3, 2: 1.5, 3: "a"}, hints: {1: 99}, revealed: 4, words: {explain: {}},
      }));
      localStorage.setItem("chutelab/the-bounce/odd", "{");
    }""")
    begin(page, "Ada")
    expect(page.locator(".mark.right")).to_have_count(0)
    assert "3 hints" in page.locator('[data-question="1"]').inner_text()
    # No mistake: looked up among the numbers of all who have been here.
    assert says(page, 1, "0")[0] == "off"
