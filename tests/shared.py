"""What many test files ask for: a command's outcome, and the shipped lessons, read once."""

from functools import cache

import pytest
from click.testing import CliRunner

from chutelab.classroom.lessons import shipped_lessons
from chutelab.cli import main

lessons = cache(shipped_lessons)


def seeds(few, many):
    """Return numbers up to `many`, of which all from `few` on are slow."""
    return [*range(few), *(pytest.param(n, marks=pytest.mark.slow) for n in range(few, many))]


def chutelab(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def call(*arguments, code=0):
    result = chutelab(*arguments)
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result
