"""Formulas that are written as text: in the rules of a scene, and in lessons.

Python compiles them. No page may evaluate text, so `tree` turns a formula into lists for a small
evaluator (``pictures/live/assets/formula.ts``).
"""

from __future__ import annotations

import ast
from functools import cache
from types import CodeType
from typing import Any, Final

OPERATORS: Final[dict[type[ast.AST], str]] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==",
    ast.And: "and", ast.Or: "or",
}  # fmt: skip


class _Dotted(ast.NodeTransformer):
    """Turns a quantity such as ``landing.x`` into a single name."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.Name:
        return ast.Name(ast.unparse(node), ast.Load())


def of_quantities(formula: str) -> ast.Expression:
    """Parse a formula of quantities, each of which becomes one name."""
    parsed: ast.Expression = _Dotted().visit(ast.parse(formula.strip(), mode="eval"))
    return ast.fix_missing_locations(parsed)


@cache
def tree(formula: str, *, dotted: bool = False) -> Any:
    """Return a formula as nested lists: the name of an operation, then its operands.

    Numbers and truth values stand for themselves, and a text is a name.

    Raises a `ValueError` for anything that pages cannot evaluate.

    Examples
    --------
    >>> tree("0.5 * m * v0**2 > -1")
    ['compare', ['*', ['*', 0.5, 'm'], ['**', 'v0', 2]], '>', ['-', 1]]
    >>> tree("transfer(**throw, rebound='as-printed').v3x")
    ['.', ['call', 'transfer', [], [['throw'], ['rebound', ['text', 'as-printed']]]], 'v3x']

    With `dotted`, quantities are names:

    >>> tree("1000 * ledger.belt_work", dotted=True)
    ['*', 1000, 'ledger.belt_work']
    """
    read = of_quantities(formula) if dotted else ast.parse(formula.strip(), mode="eval")
    return _of(read.body)


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
        case ast.UnaryOp(ast.Not(), operand):
            return ["not", _of(operand)]
        case ast.BoolOp(operator, operands):
            return [OPERATORS[type(operator)], *map(_of, operands)]
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
            # An unpacked table (**table) has no name.
            named = [[one.arg, _of(one.value)] if one.arg else [_of(one.value)] for one in keywords]
            return ["call", _of(function), [*map(_of, arguments)], named]
    raise ValueError(f"pages do not know {ast.unparse(node)!r}")


@cache
def compiled(formula: str) -> CodeType:
    """Return a formula for `eval`."""
    return compile(formula, f"<{formula}>", "eval")
