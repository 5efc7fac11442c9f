"""The exercises by lesson, and `lesson`, which hands one out."""

from __future__ import annotations

import difflib
from typing import TYPE_CHECKING

from chutelab.exercises import (
    a_stream,
    grip_or_slip,
    landing,
    letting_go,
    the_bounce,
    the_parabola,
    trust,
    turning_the_plate,
)
from chutelab.exercises.task import Task

if TYPE_CHECKING:
    from chutelab.exercises.exercise import Exercise

EXERCISES: dict[str, Exercise] = {
    module.EXERCISE.name: module.EXERCISE
    for module in (
        the_parabola,
        letting_go,
        the_bounce,
        turning_the_plate,
        landing,
        grip_or_slip,
        a_stream,
        trust,
    )
}
"""All exercises by name, in the order of the lessons."""


class ExerciseError(LookupError):
    """There is no exercise of such a lesson."""


def find(name: str | int) -> Exercise:
    """Return an exercise by number or name: 3, "3", "the-bounce" or "03-the-bounce".

    Raises
    ------
    ExerciseError
        If there is none; the message lists them.
    """
    wanted = str(name).strip().casefold().replace("_", "-").replace(" ", "-")
    for exercise in EXERCISES.values():
        number = str(exercise.number)
        names = (exercise.name, number, f"0{number}", f"0{number}-{exercise.name}")
        if wanted in names:
            return exercise
    near = difflib.get_close_matches(wanted, EXERCISES, n=1)
    hint = f" Did you mean {near[0]!r}?" if near else ""
    listed = ", ".join(f"{exercise.number} {name}" for name, exercise in EXERCISES.items())
    raise ExerciseError(f"no lesson {str(name)[:40]!r}.{hint} There are: {listed}")


def lesson(name: str | int, student: object = "") -> Task:
    """Hand out a lesson's exercise with a student's own numbers.

    Parameters
    ----------
    name : str or int
        The lesson, by name or number.
    student : object
        Any name; its text counts. The same name gives the same numbers on every machine; capitals
        and spaces do not matter.

    Returns
    -------
    Task
        With `question`, `check`, `hint`, `reveal` and `progress`.

    Raises
    ------
    ExerciseError
        If there is no such lesson.

    Examples
    --------
    >>> task = lesson("the-bounce", student="any name")
    >>> task.check(1).verdict
    <Verdict.BLANK: 'not attempted'>
    """
    return Task(find(name), str(student).strip() or "anybody")
