"""Print how large the package is, and how finely it is cut up.

    python tools/size.py [DIRECTORY]

The directory is ``src`` beside this folder by default. A function is short with five lines or
fewer, its docstring aside. A private helper is called once if its name, which begins with an
underscore, stands in one place of its module besides its definition; those that are handed over
there, as callbacks, are told apart.
"""

from __future__ import annotations

import ast
import sys
from collections import Counter
from pathlib import Path

SHORT = 5
"""Lines of a short function."""

LONG = 600
"""Lines of a module that is too long to be read in one go."""

Function = ast.FunctionDef | ast.AsyncFunctionDef


def lines_of(function: Function) -> int:
    """Lines from ``def`` to the end, without the docstring."""
    lines = function.end_lineno - function.lineno + 1
    first = function.body[0]
    if ast.get_docstring(function) is not None:
        lines -= first.end_lineno - first.lineno + 1
    return lines


def called_once(tree: ast.Module, functions: list[Function]) -> list[Function]:
    """Private functions that are named in one place of their module, nested ones aside."""
    names = Counter(
        node.id if isinstance(node, ast.Name) else node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Name | ast.Attribute)
    )
    return [
        function
        for function in functions
        if function.name.startswith("_")
        and not function.name.startswith("__")
        and names[function.name] == 1
    ]


def report(directory: Path) -> list[tuple[str, int]]:
    """Count what stands in all Python files under a directory: names and numbers."""
    modules = sorted(directory.rglob("*.py"))
    total, long, functions, short, once, once_lines, handed = 0, 0, 0, 0, 0, 0, 0
    for path in modules:
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        lines = text.count("\n")
        total += lines
        long += lines > LONG
        found = [node for node in ast.walk(tree) if isinstance(node, Function)]
        functions += len(found)
        short += sum(lines_of(function) <= SHORT for function in found)
        helpers = called_once(tree, found)
        once += len(helpers)
        calls = {
            getattr(node.func, "id", getattr(node.func, "attr", ""))
            for node in ast.walk(tree)
            if isinstance(node, ast.Call)
        }
        handed += sum(function.name not in calls for function in helpers)
        once_lines += sum(function.end_lineno - function.lineno + 1 for function in helpers)
    return [
        ("lines", total),
        ("modules", len(modules)),
        (f"modules over {LONG} lines", long),
        ("functions", functions),
        (f"functions of {SHORT} lines or fewer", short),
        ("private helpers called once", once),
        ("of these not called but handed over", handed),
        ("lines in these", once_lines),
    ]


if __name__ == "__main__":
    given = sys.argv[1:]
    default = Path(__file__).resolve().parent.parent / "src"
    for name, number in report(Path(given[0]) if given else default):
        print(f"{number:7,d}  {name}")
