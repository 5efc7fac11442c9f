"""Install wheel and sdist with the lowest versions that pyproject.toml allows, or the newest.

    python tools/versions.py lowest|newest [ARGUMENT...]

Both are built, and all of a lesson is done with each (`tools/fresh.py`); then the tests run with
what was installed from the wheel, and arguments are handed to pytest. It is done with the Python
that runs this, in a temporary folder; for `lowest` every library that chutelab or an extra names is
at the lowest version of its bound, and what they need in turn is the newest that fits. For `newest`
the tests run once more with each of the `KERNELS` of linear algebra that this processor can run.
Exit code: pytest's, the largest one.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
import tempfile
import tomllib
from itertools import chain
from pathlib import Path
from typing import Any

from fresh import do, environment, lesson

ROOT = Path(__file__).resolve().parent.parent

LENIENT = ("-W", "default::DeprecationWarning", "-W", "default::PendingDeprecationWarning")
"""A library of some years ago calls what its own libraries have deprecated since; no user sees it,
but the tests take warnings for errors."""

KERNELS = ("Prescott", "Sandybridge", "Haswell", "Zen", "SkylakeX")
"""What OpenBLAS, which is in NumPy and SciPy, chooses between by the processor (x86 only). Their
last digits differ, and so does whatever depends on those."""

TRIAL = "import numpy, scipy.linalg; scipy.linalg.svd(numpy.random.default_rng(0).random((99, 99)))"


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


def kernels(python: Path, about: dict[str, str]) -> list[dict[str, str]]:
    """Return the settings of the environment for the kernels that this processor can run.

    One that needs instructions which it does not have ends with a signal.
    """
    if platform.machine().lower() not in ("x86_64", "amd64"):
        return []
    every = [{"OPENBLAS_CORETYPE": name} for name in KERNELS]
    trial = [python, "-c", TRIAL]
    return [one for one in every if subprocess.run(trial, env={**about, **one}).returncode == 0]


def main(which: str, arguments: list[str]) -> int:
    """Build and install, do the lesson, and run the tests."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        pins = lowest(tomllib.load(file)["project"]) if which == "lowest" else []
    with tempfile.TemporaryDirectory(prefix="chutelab-versions-") as aside:
        folder = Path(aside)
        build = environment(folder / "build", "build") / "python"
        do(build, "-m", "build", "--outdir", folder / "dist", ROOT, folder=folder)
        (wheel,), (sdist,) = ((folder / "dist").glob(one) for one in ("*.whl", "*.tar.gz"))
        constraints = folder / "constraints.txt"
        constraints.write_text("\n".join(pins) + "\n", encoding="utf-8")
        # So that it holds for students' commands, too.
        os.environ["PIP_CONSTRAINT"] = str(constraints)
        for file in (sdist, wheel):
            lesson(file)
        python = environment(folder / "tests", f"chutelab[test] @ {wheel.as_uri()}") / "python"
        do(python, "-m", "pip", "list", folder=folder)
        # What is in `src` here is not to be imported.
        tests = ("-o", "pythonpath=benchmarks", "-o", "testpaths=tests")
        lenient = LENIENT if pins else ()
        about = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
        command = [python, "-m", "pytest", *tests, *lenient, *arguments]
        code = 0
        for kernel in ({}, *(kernels(python, about) if which == "newest" else ())):
            print(f"tests, {kernel or 'kernels of this processor'}", flush=True)
            ended = subprocess.run(command, cwd=ROOT, env={**about, **kernel}).returncode
            code = max(code, abs(ended))
        return code


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1] not in ("lowest", "newest"):
        sys.exit(__doc__)
    sys.exit(main(sys.argv[1], sys.argv[2:]))
