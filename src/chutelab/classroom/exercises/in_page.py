"""An exercise as data for a live page: texts as they are, formulas as trees.

No page may evaluate text, so Python's own parser turns each formula into a tree that a small
evaluator (``pictures/live/assets/formula.ts``) walks. There is no answer in the data: the page
draws a student's numbers from the name and computes right and wrong answers from them, as `Task`
does. The way to the answer stands there as a template: it says no more than the formulas that the
page has to know, and has no numbers.
"""

from __future__ import annotations

import ast
from functools import cache
from typing import Any, Final

from chutelab.classroom.exercises.catalogue import UNNAMED
from chutelab.classroom.exercises.exercise import Exercise, Question
from chutelab.classroom.words import words

SAID: Final = (
    "answer", "besides", "decimal", "heading", "hint", "hints", "large", "mistake", "numbers",
    "off", "pair", "pure", "question", "reply", "right", "small", "source", "tries",
    "untranslated", "verdict", "working",
)  # fmt: skip
"""How keys of the catalogue begin that pages need: with nothing of cells, sheets and packages."""

GENERAL: Final = (
    "mistake-sign", "mistake-half-missing", "mistake-half-too-many", "mistake-ten",
    "mistake-radians",
)  # fmt: skip
"""Keys of the mistakes that any question knows, the last of them if an angle is asked for."""

OPERATORS: Final[dict[type[ast.AST], str]] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=",
}  # fmt: skip


@cache
def tree(formula: str) -> Any:
    """Return a formula as nested lists, each an operation's name and what it is done to.

    Numbers and truth values stand for themselves, and a text is a name.

    Raises
    ------
    ValueError
        If there is something in it that pages do not know.

    Examples
    --------
    >>> tree("0.5 * m * v0**2 > -1")
    ['compare', ['*', ['*', 0.5, 'm'], ['**', 'v0', 2]], '>', ['-', 1]]
    >>> tree("transfer(**throw, rebound='as-printed').v3x")
    ['.', ['call', 'transfer', [], [['throw'], ['rebound', ['text', 'as-printed']]]], 'v3x']
    """
    return _of(ast.parse(formula.strip(), mode="eval").body)


def _of(node: ast.expr) -> Any:
    match node:
        case ast.Constant(bool() | int() | float() as value):
            return value
        case ast.Constant(str(text)):
            return ["text", text]
        case ast.Name(name):
            return name
        case ast.UnaryOp(ast.USub(), operand):
            return ["-", _of(operand)]
        case ast.BinOp(left, operator, right) if type(operator) in OPERATORS:
            return [OPERATORS[type(operator)], _of(left), _of(right)]
        case ast.Compare(left, operators, others) if {*map(type, operators)} <= {*OPERATORS}:
            parts = zip(operators, others, strict=True)
            rest = [part for one, other in parts for part in (OPERATORS[type(one)], _of(other))]
            return ["compare", _of(left), *rest]
        case ast.Attribute(value, name):
            return [".", _of(value), name]
        case ast.Subscript(value, index):
            return ["item", _of(value), _of(index)]
        case ast.List(items):
            return ["list", *map(_of, items)]
        case ast.Lambda(ast.arguments() as taken, body):
            return ["lambda", [one.arg for one in taken.args], _of(body)]
        case ast.Call(function, arguments, keywords):
            # A table that is laid open has no name.
            named = [[one.arg, _of(one.value)] if one.arg else [_of(one.value)] for one in keywords]
            return ["call", _of(function), [*map(_of, arguments)], named]
    raise ValueError(f"pages do not know {ast.unparse(node)!r}")


def data_of(exercise: Exercise, explain: str = "") -> dict[str, Any]:
    """Return an exercise as plain data for JSON, in its language.

    Parameters
    ----------
    exercise
        In the language of the page.
    explain
        What students are to explain in their own words; "" for nothing.
    """
    said = words(exercise.language)
    return {
        "name": exercise.name,
        "number": exercise.number,
        "title": exercise.title,
        "language": exercise.language,
        "whole": exercise.whole,
        "story": _line(exercise.story),
        "explain": explain,
        "unnamed": UNNAMED,
        "parameters": [
            [one.name, one.symbol, said.unit(one.unit), one.meaning, list(one.values)]
            for one in exercise.parameters
        ],
        "formulas": {name: tree(formula) for name, formula in exercise.formulas.items()},
        "tell": list(exercise.tell),
        "fits": [tree(condition) for condition in exercise.fits],
        "machine": {key: tree(formula) for key, formula in exercise.machine.items()},
        "questions": [_question(asked, exercise.language) for asked in exercise.questions],
        "words": {
            key: text for key, text in said.catalogue.items() if key.partition("-")[0] in SAID
        },
    }


def _question(asked: Question, language: str) -> dict[str, Any]:
    own = {mistake.name for mistake in asked.mistakes}
    known = GENERAL if asked.unit == "degrees" else GENERAL[:-1]
    return {
        "title": asked.title,
        "text": _line(asked.text),
        "unit": words(language).unit(asked.unit),
        "answer": tree(asked.answer),
        "measured": tree(asked.measured) if asked.measured else None,
        "mistakes": [
            [one.called or one.name, tree(one.formula), _line(one.says)] for one in asked.mistakes
        ],
        "general": [key for key in known if words().say(key) not in own],
        "hints": [_line(hint) for hint in asked.hints],
        "working": [_line(line) for line in asked.working.splitlines()],
        "source": asked.source,
    }


def _line(text: str) -> str:
    return " ".join(text.split())
