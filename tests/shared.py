"""What many test files ask for: a command's outcome, the shipped lessons, read once, a page."""

from functools import cache
from html.parser import HTMLParser

import pytest
from click.testing import CliRunner

from chutelab.classroom import lessons as room
from chutelab.cli import main

read = cache(room.shipped_lessons)


def lessons(language="en"):
    """Return the shipped lessons, which are read once."""
    return read(language)


def find(wanted, language="en"):
    """Return one of them by number or name."""
    (found,) = (one for one in lessons(language) if wanted in (one.number, one.name))
    return found


def seeds(few, many):
    """Return numbers up to `many`, of which all from `few` on are slow."""
    return [*range(few), *(pytest.param(n, marks=pytest.mark.slow) for n in range(few, many))]


def some(cases, of=3):
    """Return one case of each `of` as it is, and the others slow; a tuple is a case of several."""
    rows = [case if isinstance(case, tuple) else (case,) for case in cases]
    return [
        pytest.param(*row, marks=() if n % of == 0 else pytest.mark.slow)
        for n, row in enumerate(rows)
    ]


def chutelab(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def call(*arguments, code=0):
    result = chutelab(*arguments)
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result


class Page(HTMLParser):
    """The tags of a page with their attributes, its text, and the addresses in it."""

    def __init__(self, page):
        super().__init__()
        self.tags, self.text = [], ""
        self.feed(page)

    def handle_starttag(self, tag, attrs):
        self.tags.append((tag, dict(attrs)))

    def handle_data(self, data):
        self.text += data

    def told(self, name, tag=""):
        """Values of an attribute, of all tags or of some."""
        return [given[name] for one, given in self.tags if name in given and tag in ("", one)]

    @property
    def addresses(self):
        return [where for name in ("href", "src", "data-film") for where in self.told(name)]
