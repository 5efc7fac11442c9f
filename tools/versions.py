"""Run the tests with the lowest versions that pyproject.toml allows, or with the newest there are.

    python tools/versions.py lowest|newest [ARGUMENT...]

Arguments are handed to pytest. A virtual environment of the Python that runs this is made in a
temporary folder, with chutelab, its extra `test`, and for `lowest` every library at the lowest
version of its bound; what they need in turn is the newest that fits. Exit code: pytest's.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
import tomllib
import venv
from itertools import chain
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent

LENIENT = ("-W", "default::DeprecationWarning", "-W", "default::PendingDeprecationWarning")
"""A library of some years ago calls what its own libraries have deprecated since; no user sees it,
but the tests take warnings for errors."""


def lowest(project: dict[str, Any]) -> list[str]:
    """Pin every dependency of a `[project]` table, and of its extras, to its lower bound.

    >>> lowest({"dependencies": ["b[c]>=1.2"], "optional-dependencies": {"x": ["d>=3", "e==4"]}})
    ['b==1.2', 'd==3', 'e==4']
    """
    pins = set()
    for line in chain(project["dependencies"], *project["optional-dependencies"].values()):
        if line.startswith("chutelab["):
            continue
        found = re.fullmatch(r"([\w.-]+)(?:\[\w+\])?[>=]=([\d.]+)", line)
        if found is None:
            sys.exit(f"pyproject.toml: {line!r} has no lower bound such as name>=1.2")
        pins.add(f"{found[1]}=={found[2]}")
    return sorted(pins)


def main(which: str, arguments: list[str]) -> int:
    """Make the environment, and run the tests in it."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        pins = lowest(tomllib.load(file)["project"]) if which == "lowest" else []
    with tempfile.TemporaryDirectory(prefix="chutelab-versions-") as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder) / ("Scripts" if sys.platform == "win32" else "bin") / "python"
        constraints = Path(folder) / "constraints.txt"
        constraints.write_text("\n".join(pins) + "\n", encoding="utf-8")
        install = ("install", "--quiet", "-c", constraints, "-e", f"{ROOT}[test]")
        subprocess.run([python, "-m", "pip", *install], check=True)
        subprocess.run([python, "-m", "pip", "list"], check=True)
        tests = [python, "-m", "pytest", *(LENIENT if pins else ()), *arguments]
        return subprocess.run(tests, cwd=ROOT).returncode


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in ("lowest", "newest"):
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2:]))
