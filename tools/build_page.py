"""Build the live page: TypeScript modules to one file each for page and thread, and its style.

    python tools/build_page.py           # writes into pictures/live/bundle
    python tools/build_page.py --check   # builds anew and compares the bytes with what is there

Needs node and esbuild in the version that `tests/live/package.json` pins: `npm ci --prefix
tests/live` brings it. The same version gives the same bytes on every machine.
"""

import argparse
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
LIVE = ROOT / "src" / "chutelab" / "pictures" / "live"
BUNDLE = LIVE / "bundle"
SOURCES = {
    "app.ts": "app.js", "lessonpage.ts": "lessonpage.js", "worker.ts": "worker.js",
    "boot.ts": "boot.js",
    "page.css": "page.css", "lesson.css": "lesson.css", "sandbox.css": "sandbox.css",
}  # fmt: skip
"""What is built, and what is made of it."""


def build(folder: Path) -> None:
    """Write scripts and styles into a folder.

    Raises
    ------
    SystemExit
        If esbuild is not there, or says that the modules are wrong.
    """
    esbuild = shutil.which("esbuild", path=ROOT / "tests" / "live" / "node_modules" / ".bin")
    if esbuild is None:
        sys.exit("needs esbuild: npm ci --prefix tests/live")
    sources = [str(LIVE / "assets" / name) for name in SOURCES]
    flags = ["--bundle", "--minify", "--format=iife", "--target=es2022", "--charset=utf8"]
    command = [esbuild, *sources, *flags, "--log-level=warning", f"--outdir={folder}"]
    if code := subprocess.run(command, check=False).returncode:
        sys.exit(code)


def main() -> int:
    """Build, or compare with what is committed; 1 if that is not what the sources give."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--check", action="store_true", help="compare, write nothing")
    names = list(SOURCES.values())
    if not parser.parse_args().check:
        build(BUNDLE)
        print(f"{sum((BUNDLE / name).stat().st_size for name in names)} bytes")
        return 0
    with tempfile.TemporaryDirectory() as folder:
        build(Path(folder))
        old = [
            name
            for name in names
            if (Path(folder) / name).read_bytes() != (BUNDLE / name).read_bytes()
        ]
    if old:
        print(f"{', '.join(old)}: not what the sources give; run python tools/build_page.py")
    return bool(old)


if __name__ == "__main__":
    sys.exit(main())
