"""`Task`: the exercise of one lesson for one student, and what it answers."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from typing import TYPE_CHECKING

from chutelab.exercises import html
from chutelab.exercises.drawing import draw
from chutelab.exercises.judging import blank, judge, unread
from chutelab.exercises.reading import Unreadable, number_of
from chutelab.exercises.replies import Passage, Progress, Reply, Standing, Verdict, filled
from chutelab.exercises.values import shown

if TYPE_CHECKING:
    from chutelab.exercises.drawing import Case
    from chutelab.exercises.exercise import Exercise
    from chutelab.exercises.values import Values

OPENED: deque[Task] = deque(maxlen=64)
"""The tasks of this process, the last one last: where grading looks for what was answered."""

UNNAMED = "your name"
"""What stands in a notebook in place of the student's name."""


@dataclass
class _State:
    """What happened to one question so far."""

    reply: Reply
    answer: float | None = None
    tries: int = 0
    hints: int = 0
    revealed: bool = False


class Task:
    """One lesson's exercise with a student's own numbers.

    Made by `chutelab.exercises.lesson`. None of its methods raises an error for what a student
    hands over; they answer in words.

    Parameters
    ----------
    exercise : Exercise
        The lesson's.
    student : str
        Any name: the same name has the same numbers everywhere.

    Attributes
    ----------
    given : Values
        The student's parameters, as attributes.
    answers : dict of float
        Last number checked, by question.
    """

    def __init__(self, exercise: Exercise, student: str) -> None:
        self.exercise = exercise
        self.student = student
        self.given: Values
        self._cases: tuple[Case, ...]
        self.given, self._cases = draw(exercise, student)
        self._states = [_State(blank(i + 1)) for i in range(len(self._cases))]
        OPENED.append(self)

    @property
    def questions(self) -> tuple[Passage, ...]:
        """All questions, with this student's numbers."""
        return tuple(self._asked(index) for index in range(len(self._cases)))

    @property
    def answers(self) -> dict[int, float]:
        """The last number that was checked, by question."""
        return {
            index + 1: state.answer
            for index, state in enumerate(self._states)
            if state.answer is not None
        }

    @property
    def revealed(self) -> tuple[int, ...]:
        """Questions whose working was shown."""
        return tuple(index + 1 for index, state in enumerate(self._states) if state.revealed)

    def question(self, number: object = None) -> Passage | Reply:
        """Show a question with this student's numbers."""
        index = self._index(number)
        return self._unknown(number) if index is None else self._asked(index)

    def check(self, number: object = None, answer: object = None) -> Reply:
        """Say what becomes of an answer.

        Parameters
        ----------
        number : int
            Which question, from 1 on.
        answer : object
            The student's number, or whatever stands in its place.
        """
        index = self._index(number)
        if index is None:
            return self._unknown(number)
        state = self._states[index]
        try:
            value = number_of(answer)
        except Unreadable as problem:
            state.reply = unread(index + 1, str(problem))
            state.tries += 1
            return state.reply
        if value is None:
            return blank(index + 1)
        state.answer = value
        state.tries += 1
        state.reply = judge(index + 1, self._cases[index], value)
        return state.reply

    def hint(self, number: object = None) -> Passage | Reply:
        """Give the next hint to a question; the last one again when there are no more."""
        index = self._index(number)
        if index is None:
            return self._unknown(number)
        case, state = self._cases[index], self._states[index]
        hints = case.question.hints
        state.hints = min(state.hints + 1, len(hints))
        title = f"Hint {state.hints} of {len(hints)} to question {index + 1}"
        text = case.values.text(hints[state.hints - 1])
        if state.hints == len(hints):
            text += f"\nThat was the last one. task.reveal({index + 1}) shows the working."
        return Passage(index + 1, title, text)

    def reveal(self, number: object = None) -> Passage | Reply:
        """Show the working of a question, with the answer. It is noted that you asked."""
        index = self._index(number)
        if index is None:
            return self._unknown(number)
        case = self._cases[index]
        self._states[index].revealed = True
        right = f"{shown(case.right)} {case.question.unit}".strip()
        text = f"{case.values.text(case.question.working)}\nAnswer: {right}"
        text += f"\nSource: {case.question.source}"
        return Passage(index + 1, f"Working of question {index + 1}", text, case.question.unit)

    def progress(self) -> Progress:
        """Draw what is done."""
        rows = tuple(
            Standing(
                number=index + 1,
                title=case.question.title,
                verdict=state.reply.verdict,
                tries=state.tries,
                hints=state.hints,
                revealed=state.revealed,
            )
            for index, (case, state) in enumerate(zip(self._cases, self._states, strict=True))
        )
        return Progress(f"{self.exercise.title}, {self.student}", rows)

    def _index(self, number: object) -> int | None:
        """Return a question's index, None if there is no such question."""
        try:
            wanted = number_of(number)
        except Unreadable:
            wanted = float(number) if isinstance(number, str) and number.isdecimal() else None
        if wanted is None or wanted != int(wanted) or not 1 <= wanted <= len(self._cases):
            return None
        return int(wanted) - 1

    def _unknown(self, number: object) -> Reply:
        count = len(self._cases)
        text = (
            f"This lesson has questions 1 to {count}; ask for one of them, as in task.check(1, …)."
        )
        return Reply(0, Verdict.UNKNOWN, text)

    def _asked(self, index: int) -> Passage:
        case = self._cases[index]
        question = case.question
        unit = question.unit or "a pure number"
        within = f"{100 * question.tolerance:g} %"
        text = f"{self.given.text(question.text)}\nAnswer in: {unit}, to within {within}."
        return Passage(index + 1, f"Question {index + 1}: {question.title}", text, question.unit)

    def _rows(self) -> list[tuple[str, str, str]]:
        return [
            (parameter.symbol, f"{shown(self.given[parameter.name])} {parameter.unit}".strip(),
             parameter.meaning)
            for parameter in self.exercise.parameters
        ]  # fmt: skip

    def __repr__(self) -> str:
        rows = self._rows()
        left, middle = (max(len(row[i]) for row in rows) for i in (0, 1))
        lines = [f"  {s:<{left}} = {value:<{middle}}  {meaning}" for s, value, meaning in rows]
        head = f"Lesson {self.exercise.number}: {self.exercise.title}\nNumbers of {self.student}:"
        questions = [f"  {i + 1} {case.question.title}" for i, case in enumerate(self._cases)]
        story = filled(self.given.text(self.exercise.story))
        return "\n".join([head, *lines, story, "Questions:", *questions])

    def _repr_html_(self) -> str:
        head = f"Lesson {self.exercise.number}: {self.exercise.title}, numbers of {self.student}"
        rows = [(f"{s} = {value}", meaning) for s, value, meaning in self._rows()]
        story = html.box(html.INFO, head, self.given.text(self.exercise.story))
        return f"{story}{html.table(rows)}"


def report() -> list[dict[str, object]]:
    """Return lesson, student, answers and shown workings of all tasks of this process, as JSON."""
    return [
        {
            "lesson": task.exercise.name,
            "student": task.student,
            "answers": {str(number): answer for number, answer in task.answers.items()},
            "revealed": list(task.revealed),
        }
        for task in OPENED
    ]
