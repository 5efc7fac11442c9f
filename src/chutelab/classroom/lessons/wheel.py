"""The wheel of the chutelab that runs, made of its own files: no network, no tools for building.

A teacher who hands out lessons has chutelab, so pupils can have the same. Its files are those
of the package, and in a checkout the scenes and lessons beside ``src``; what says what it needs is
what the installer keeps of it. The form is that of the binary distribution format, PEP 427.
"""

from __future__ import annotations

from base64 import urlsafe_b64encode
from hashlib import sha256
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Final
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

from chutelab.util.errors import MissingLibraryError

_PACKAGE: Final = Path(__file__).parents[2]
_SOURCES: Final = (".c", ".h", ".pyc", ".ts")
"""Endings of files that a wheel does without."""

_FORM: Final = "Wheel-Version: 1.0\nGenerator: chutelab\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


def write_wheel(folder: Path) -> Path:
    """Write the wheel into a folder, which is made; the same chutelab gives the same bytes.

    Raises
    ------
    MissingLibraryError
        If chutelab is not installed, so that nothing says what it needs.
    OSError
        If it cannot be written.
    """
    try:
        installed = distribution("chutelab")
    except PackageNotFoundError as error:
        text = "the wheel for students is made of an installed chutelab; install it, or --no-wheel"
        raise MissingLibraryError(text) from error
    about = f"chutelab-{installed.version}.dist-info"
    contents = {name: path.read_bytes() for name, path in sorted(_files().items())}
    for name in ("METADATA", "entry_points.txt", "licenses/LICENSE"):
        contents[f"{about}/{name}"] = (installed.read_text(name) or "").encode("utf-8")
    contents[f"{about}/WHEEL"] = _FORM.encode("ascii")
    record = [f"{name},{_digest(data)},{len(data)}\n" for name, data in contents.items()]
    record.append(f"{about}/RECORD,,\n")
    contents[f"{about}/RECORD"] = "".join(record).encode("utf-8")
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"chutelab-{installed.version}-py3-none-any.whl"
    with ZipFile(path, "w", ZIP_DEFLATED) as wheel:
        for name, data in contents.items():
            entry = ZipInfo(name)  # of 1980, like all that is the same always
            entry.external_attr = 0o644 << 16
            entry.compress_type = ZIP_DEFLATED
            wheel.writestr(entry, data)
    return path


def _files() -> dict[str, Path]:
    """Return the files of the package by their names in the wheel."""
    places = {"chutelab": _PACKAGE}
    if not (_PACKAGE / "data").is_dir():
        beside = _PACKAGE.parents[1]
        places |= {f"chutelab/data/{one}": beside / one for one in ("scenes", "lessons")}
    found = {}
    for place, folder in places.items():
        for path in folder.rglob("*"):
            name = path.relative_to(folder)
            hidden = any(part.startswith(".") for part in name.parts)
            if path.is_file() and path.suffix not in _SOURCES and not hidden:
                found[f"{place}/{name.as_posix()}"] = path
    return found


def _digest(data: bytes) -> str:
    return f"sha256={urlsafe_b64encode(sha256(data).digest()).rstrip(b'=').decode('ascii')}"
