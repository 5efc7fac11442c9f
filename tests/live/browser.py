"""Pages in a real browser: none of them says anything on the console, or asks for anything.

Chutelab is imported where it is used: the process that only hands out tests loads this, too.
"""

import shutil
from collections import defaultdict
from pathlib import Path

import pytest

# A page without `eval` cannot be waited for by a condition; a run is shown some frames after it is
# there, or is as far as it may go.
DONE = """() => new Promise((resolve, reject) => {
  const end = performance.now() + 120000;
  const under = ({ engine, machine, recording: { state, now, shift } }) =>
    state === "running" && !(machine.interact && now - shift >= engine.until);
  const look = () => {
    if (globalThis.chutelab && !under(chutelab.lab)) {
      requestAnimationFrame(() => requestAnimationFrame(resolve));
    } else if (performance.now() > end) reject(new Error("no run that ends"));
    else setTimeout(look, 5);
  };
  look();
})"""


WITHOUT = "--disable-features=WebUIOmniboxPopup,WebUIOmniboxAimPopup," + ",".join(
    ("AimEnabled", "DestroyProfileOnBrowserClose", "MediaRouter", "NetworkTimeServiceQuerying",
     "OptimizationHints", "PaintHolding", "PreconnectToSearch", "ThirdPartyStoragePartitioning")
)  # fmt: skip
"""Parts of Chromium that are off.

Each window of a headless Chromium has an address bar, whose two lists of suggestions are pages of
their own and cost more than the page that is tested. The others are what Playwright turns off, as
its own list counts no longer.
"""

AXE = Path(__file__).parent / "node_modules" / "axe-core" / "axe.min.js"


def axe(page):
    """Return what axe-core finds wrong with a page as it is now: each rule and where."""
    if not AXE.is_file():
        pytest.skip("needs axe: npm ci --prefix tests/live")
    if not page.evaluate("'axe' in globalThis"):
        page.evaluate(AXE.read_text(encoding="utf-8"))
    # It asks for style sheets again, which a file may not, and takes no formula for a text.
    rules = {"empty-table-header": {"enabled": False}}
    passes, violations = page.evaluate(
        """async (how) => {
          const { passes, violations } = await axe.run(how);
          const where = ({ id, nodes }) => [id, nodes.map(({ html }) => html.slice(0, 200))];
          return [passes.length, violations.map(where)];
        }""",
        {"preload": False, "resultTypes": ["violations"], "rules": rules},
    )
    assert passes > 10
    return violations


def spot(page, u, v):
    """Where a share of the picture's free part is on the screen, in whole pixels."""
    box = page.locator("#stage").bounding_box()
    free = page.evaluate("chutelab.stage.view.free")
    across, up = free["right"] - free["left"], free["bottom"] - free["top"]
    return round(box["x"] + free["left"] + u * across), round(box["y"] + free["top"] + v * up)


def to_step(page, kind="numbers"):
    """Skip the steps of a lesson up to one of a kind."""
    page.locator(".page[data-kind]").wait_for()
    while page.locator(".page").get_attribute("data-kind") != kind:
        page.locator("#skip:visible, #step-next:enabled:visible").first.click()


CLICKED = """() => {
  globalThis.clicked = new Promise((resolve) => {
    addEventListener("click", () => setTimeout(resolve, 0, true), { capture: true, once: true });
    setTimeout(resolve, 3000, false);
  });
}"""


class Hand:
    """Does things in a page as a pupil does, by `mouse`, `touch` or `keyboard`.

    The keyboard goes with Tab to what it uses: no focus that the page does not give.
    """

    def __init__(self, page, by):
        self.page, self.by = page, by

    def to(self, locator):
        """Go to an element by Tab, back or on, and by an arrow within a group."""
        if self.by != "keyboard":
            locator.focus()
            return
        element = locator.element_handle()
        for _ in range(400):
            key = element.evaluate("""(one) => {
              const at = document.activeElement;
              if (one === at) return "";
              if (one.name && one.name === at.name) return "ArrowDown";
              const behind = one.compareDocumentPosition(at) & Node.DOCUMENT_POSITION_FOLLOWING;
              return behind ? "Shift+Tab" : "Tab";
            }""")
            if not key:
                return
            self.page.keyboard.press(key)
        raise AssertionError(f"no key leads to {locator}")

    def press(self, locator, *, force=False):
        """Press a button, or choose a choice."""
        if self.by == "mouse":
            locator.click(force=force)
        elif self.by == "touch":
            # The click comes some time after the finger; a busy browser may drop a tap.
            for _ in range(3):
                self.page.evaluate(CLICKED)
                locator.tap(force=force)
                if self.page.evaluate("clicked"):
                    return
            raise AssertionError(f"no tap reaches {locator}")
        else:
            self.to(locator)
            choice = locator.get_attribute("type") == "radio"
            self.page.keyboard.press("Space" if choice else "Enter")

    def write(self, field, text):
        """Write into a field, in place of what is there."""
        if self.by == "keyboard":
            self.to(field)
        else:
            self.press(field)
        self.page.keyboard.press("Control+A")
        if text:
            self.page.keyboard.insert_text(text)
        else:
            self.page.keyboard.press("Delete")

    def drag(self, places):
        """Draw a path through places, px, by mouse or finger."""
        if self.by == "mouse":
            mouse = self.page.mouse
            mouse.move(*places[0])
            mouse.down()
            for place in places[1:]:
                mouse.move(*place)
            mouse.up()
            return
        session = self.page.context.new_cdp_session(self.page)
        kinds = ["touchStart", *["touchMove"] * (len(places) - 1), "touchEnd"]
        for kind, place in zip(kinds, [*places, None], strict=True):
            points = [{"x": place[0], "y": place[1]}] if place else []
            session.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points})

    def draw(self, share):
        """Draw a path down the picture, from a share of its width on."""
        if self.by == "keyboard":
            self.to(self.page.locator(".pen"))
            for key in ("Enter", "ArrowLeft", "ArrowDown", "Enter", "ArrowDown", "Enter"):
                self.page.keyboard.press(key)
            return
        box = self.page.locator("#stage").bounding_box()
        self.drag([(box["x"] + box["width"] * (share - 0.03 * n),
                    box["y"] + box["height"] * (0.35 + 0.05 * n)) for n in range(8)])  # fmt: skip

    def mark(self):
        """Put the flag somewhere."""
        if self.by == "keyboard":
            self.to(self.page.locator(".guess"))
            for key in ("PageUp", "ArrowLeft"):
                self.page.keyboard.press(key)
            return
        box = self.page.locator(".guess .room").bounding_box()
        x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
        self.drag([(x, y), *[(x + share * (box["x"] + 40 - x), y) for share in (0.3, 0.6, 1.0)]])

    def play(self):
        """Play a run, and go to its end."""
        self.press(self.page.locator("#play"))
        self.page.evaluate(DONE)
        self.page.evaluate("chutelab.lab.allow(1e9)")
        self.page.evaluate(DONE)
        self.to(self.page.locator("#time"))
        self.page.keyboard.press("End")
        self.page.evaluate("chutelab.lab.pause()")


@pytest.fixture(scope="session")
def browser():
    playwright = pytest.importorskip(
        "playwright.sync_api", reason='needs Playwright: pip install "chutelab[test]"'
    )
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    if chromium is None:
        pytest.skip("needs a browser: apt-get install chromium")
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=chromium, args=[WITHOUT])
        yield opened
        opened.close()


@pytest.fixture(scope="session")
def idle():
    """Pages that no test has at present, by what a context has for good."""
    return defaultdict(list)


@pytest.fixture
def opened(browser, idle):
    """Open a file in a page that knows nothing of those before it.

    A page of its own for each test would take Chromium three times as long.
    """
    pages, said = [], []

    def hear(message):
        said.append(message.text)

    def fail(error):
        said.append(str(error))

    def asked(request):
        if not request.url.startswith(("file:", "blob:", "about:")):
            said.append(request.url)

    heard = {"console": hear, "pageerror": fail, "request": asked}

    def open_(path, address="", viewport=None, color_scheme="light",
              reduced_motion="no-preference", **options):  # fmt: skip
        of = idle[tuple(sorted(options.items()))]
        page = of.pop() if of else browser.new_context(**options).new_page()
        pages.append((page, of))
        page.set_default_timeout(10_000)
        page.set_viewport_size(viewport or {"width": 1366, "height": 620})
        page.emulate_media(color_scheme=color_scheme, reduced_motion=reduced_motion)
        for event, listener in heard.items():
            page.on(event, listener)
        page.goto(path.as_uri() + address)
        return page

    yield open_
    for page, of in pages:
        if page.is_closed():
            continue
        for other in page.context.pages:
            if other is not page:
                other.close()
        page.mouse.move(0, 0)
        page.evaluate("localStorage.clear(), sessionStorage.clear()")
        page.goto("about:blank")
        page.emulate_media(media="null")
        for event, listener in heard.items():
            page.remove_listener(event, listener)
        of.append(page)
    assert said == [], said


@pytest.fixture
def shown(opened, tmp_path):
    """Open the live page of a scene, with `more` after its file's end, and wait for the run."""
    from chutelab.pictures.live import html
    from chutelab.scene import load, parse, to_toml

    def show(name="perpendicular", overrides=(), *, more="", language="en", **options):
        path = tmp_path / "page.html"
        scene = parse(to_toml(load(name, overrides)) + more)
        path.write_text(html(scene, language=language), encoding="utf-8")
        page = opened(path, **options)
        page.evaluate(DONE)
        return page

    return show


@pytest.fixture
def page_of(opened, tmp_path):
    """Open the live page of a lesson."""
    from chutelab.classroom.lessons.pages import live_page
    from shared import find

    def open_(name, language="en", size=(1366, 768), **options):
        path = tmp_path / f"{name}-{language}.html"
        live_page(find(name, language), path)
        assert path.stat().st_size <= 450_000
        view = {"width": size[0], "height": size[1]}
        page = opened(path, viewport=view, **options)
        page.evaluate(DONE)
        return page

    return open_
