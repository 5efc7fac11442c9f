"""Do all of a lesson with what is installed from a file, and from the bundle that it makes.

    python tools/fresh.py [FILE]

FILE is a wheel or an sdist; by default the wheel is built from this folder. As a teacher does, it
is installed in an environment of its own, and lesson 3 is shown, printed, built and bundled. As
students do, chutelab is installed by the commands on the bundle's first page, in another one; the
notebook is solved, run, and marked, and has to get all its marks. Needs the package index, and some
minutes. Nothing is taken from this folder but the solutions in `tests`.
"""

from __future__ import annotations

import csv
import json
import os
import re
import shlex
import subprocess
import sys
import tempfile
import venv
from collections.abc import Sequence
from html import unescape
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
SOLUTION = ROOT / "tests" / "solutions" / "the-bounce.py"
WINDOWS = sys.platform == "win32"
BIN = "Scripts" if WINDOWS else "bin"


def do(*command: str | Path, folder: Path) -> None:
    """Run a command in a folder, with nothing of this one to be imported; it must succeed."""
    print(f"$ {shlex.join(map(str, command))}", flush=True)
    path = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])
    about = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    subprocess.run(command, check=True, cwd=folder, env={**about, "PATH": path})


def environment(folder: Path, *what: str | Path) -> Path:
    """Make a virtual environment, and let pip install; return where its commands are."""
    venv.create(folder, with_pip=True)
    do(folder / BIN / "python", "-m", "pip", "install", "--quiet", *what, folder=folder)
    return folder / BIN


def teach(commands: Path, folder: Path) -> Path:
    """Do with a lesson what a teacher does; return the bundle."""
    lesson = (commands / "chutelab", "lesson")
    do(*lesson, "list", folder=folder)
    do(*lesson, "show", "3", folder=folder)
    for sheet in ("student", "teacher", "explanation"):
        for form in ("md", "html", "pdf"):
            do(*lesson, "show", "3", "--sheet", sheet, "-o", f"{sheet}.{form}", folder=folder)
            if (folder / f"{sheet}.{form}").stat().st_size < 500:
                sys.exit(f"{sheet}.{form} has hardly anything on it")
    do(*lesson, "build", "3", "--force", "--quiet", "--out", "films", folder=folder)
    do(*lesson, "page", "3", "--quiet", "-o", "web", folder=folder)
    return folder / "web"


def install_as_told(bundle: Path) -> Path:
    """Run the commands of the bundle's first page but the last, which runs until it is closed."""
    index = (bundle / "index.html").read_text(encoding="utf-8")
    told = re.findall(r"<pre[^>]*><code>(.*?)</code>", index, re.DOTALL)[0 if WINDOWS else 1]
    *lines, jupyter = unescape(told).splitlines()
    for line in lines:
        shell = ("powershell", "-Command") if WINDOWS else ("sh", "-c")
        do(*shell, line, folder=bundle)
    do(*shlex.split(jupyter, posix=not WINDOWS), "--version", folder=bundle)
    return bundle / ".venv" / BIN


def learn(commands: Path, bundle: Path) -> None:
    """Do with a lesson what a student does, and mark it."""
    do(commands / "chutelab", "run", "perpendicular", "--set", "plate.restitution=0", folder=bundle)
    notebook = bundle / "03-the-bounce" / "exercise.ipynb"
    solved = json.loads(notebook.read_text(encoding="utf-8"))
    cells = [cell for cell in solved["cells"] if cell["cell_type"] == "code"]
    for cell in cells:
        source = "".join(cell["source"]).replace('student = "your name"', 'student = "Ada"')
        cell["source"] = re.sub(r"^answer_\d = None\n", "", source)
    named = next(cell for cell in cells if "task = lesson(" in cell["source"])
    named["source"] += "\n" + SOLUTION.read_text(encoding="utf-8")
    notebook.write_text(json.dumps(solved), encoding="utf-8")
    run = ("nbconvert", "--to", "notebook", "--execute", "--inplace", "--log-level", "ERROR")
    do(commands / "jupyter", *run, notebook, folder=bundle)
    do(commands / "chutelab", "lesson", "grade", notebook, "--out", "class.csv", folder=bundle)
    with (bundle / "class.csv").open(encoding="utf-8-sig", newline="") as file:
        (row,) = csv.DictReader(file)
    if row["student"] != "Ada" or row["total"] != row["out_of"] or int(row["total"]) < 4:
        sys.exit(f"the solved notebook got {row}")


def lesson(file: str | Path, pip: Sequence[str | Path] = ()) -> None:
    """Do all of it with a wheel, an sdist or a folder; more is handed to pip."""
    with tempfile.TemporaryDirectory(prefix="chutelab-fresh-") as aside:
        folder = Path(aside)
        commands = environment(folder / "teacher", *pip, f"chutelab[pdf] @ {Path(file).as_uri()}")
        bundle = teach(commands, folder)
        learn(install_as_told(bundle), bundle)


if __name__ == "__main__":
    if len(sys.argv) > 2 or any(argument.startswith("-") for argument in sys.argv[1:]):
        sys.exit(__doc__)
    lesson(Path(sys.argv[1] if sys.argv[1:] else ROOT).resolve())
