"""Exercises that answer back: a student's own numbers, and replies that name the mistake.

>>> from chutelab.classroom.exercises import lesson
>>> task = lesson("the-bounce", student="any name")
>>> task.check(1, "quickly")
? Question 1: not a number. That is text (“quickly”). Give a number, without quotes.

- `catalogue`: `lesson` hands out a `Task`, with `question`, `check`, `hint`, `reveal` and
  `progress`; all exercises by name; `data_of` an exercise as data for a live page, which judges as
  this package does.
- `exercise`: what an exercise is made of: parameters, drawn from a name, questions, known mistakes.
- `judging`: a number read and judged: right, a known mistake, or how far off; replies.
- ``the-parabola.toml`` and so on: the exercises themselves, a file a lesson: what is drawn,
  questions, and each answer and mistake as a formula.

Answers are computed from `chutelab.theory` for the parameters drawn; none is stored.
"""

from chutelab.classroom.exercises.catalogue import EXERCISES, ExerciseError, Task, find, lesson
from chutelab.classroom.exercises.exercise import Exercise, Mistake, Parameter, Question, Values
from chutelab.classroom.exercises.judging import (
    Passage,
    Progress,
    Reply,
    Standing,
    Verdict,
)

__all__ = [
    "EXERCISES",
    "Exercise",
    "ExerciseError",
    "Mistake",
    "Parameter",
    "Passage",
    "Progress",
    "Question",
    "Reply",
    "Standing",
    "Task",
    "Values",
    "Verdict",
    "find",
    "lesson",
]
