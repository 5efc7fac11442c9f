"""Build wheel and sdist, and look whether a package index would take them as they are.

    python tools/distribution.py [DIRECTORY]

They go to the directory, by default ``out/dist``, which is emptied. `twine check --strict` has to
accept them; the description must have no relative link or picture, which on a registry's page lead
nowhere; and the wheel, which is built of the sdist, must have the files of the one that
`chutelab lesson page` hands out.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import tempfile
from email.parser import Parser
from pathlib import Path
from zipfile import ZipFile

from chutelab.classroom.lessons.pages import write_wheel

ROOT = Path(__file__).resolve().parent.parent
WRITTEN = re.compile(r"[^/]+\.dist-info/")
"""What the tool that builds a wheel writes itself."""


def faults(wheel: Path) -> list[str]:
    """Return what is wrong with a wheel, a line each."""
    with ZipFile(wheel) as opened, tempfile.TemporaryDirectory() as folder:
        built = {name: opened.read(name) for name in opened.namelist()}
        with ZipFile(write_wheel(Path(folder))) as made:
            handed_out = {name: made.read(name) for name in made.namelist()}
    found = [
        f"{name}: not the same as in what `lesson page` hands out"
        for name in sorted(built.keys() | handed_out.keys())
        if not WRITTEN.match(name) and built.get(name) != handed_out.get(name)
    ]
    about = next(data for name, data in built.items() if name.endswith(".dist-info/METADATA"))
    description = str(Parser().parsestr(about.decode("utf-8")).get_payload())
    if len(description) < 1000:
        found.append("METADATA: hardly a description")
    addresses = re.findall(r"\]\(([^)]*)\)", description)
    return found + [
        f"METADATA: {address} leads nowhere on a registry's page"
        for address in addresses
        if not address.startswith("https://")
    ]


def main(folder: Path) -> int:
    """Build and look; return 1 if something is wrong."""
    shutil.rmtree(folder, ignore_errors=True)
    # What builds is installed: pip, which builds in isolation, has installed the package with it.
    build = ("build", "--no-isolation", "--outdir", folder, ROOT)
    subprocess.run([sys.executable, "-m", *build], check=True)
    made = sorted(folder.iterdir())
    subprocess.run([sys.executable, "-m", "twine", "check", "--strict", *made], check=True)
    found = faults(next(path for path in made if path.suffix == ".whl"))
    print("\n".join(found) or "nothing is wrong")
    return 1 if found else 0


if __name__ == "__main__":
    if len(sys.argv) > 2 or any(argument.startswith("-") for argument in sys.argv[1:]):
        sys.exit(__doc__)
    sys.exit(main(Path(sys.argv[1]) if sys.argv[1:] else ROOT / "out" / "dist"))
