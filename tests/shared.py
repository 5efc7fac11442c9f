"""What many test files ask for: a command's outcome, and the shipped lessons, read once."""

from functools import cache

from click.testing import CliRunner

from chutelab.classroom.lessons import shipped_lessons
from chutelab.cli import main

lessons = cache(shipped_lessons)


def chutelab(*arguments):
    return CliRunner().invoke(main, [str(argument) for argument in arguments])


def call(*arguments, code=0):
    result = chutelab(*arguments)
    assert result.exit_code == code, result.output
    assert "Traceback" not in result.output
    return result
