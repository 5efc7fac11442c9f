"""Packages that are installed or not, their versions, and what figures were measured on.

It names no person and no machine.
"""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Mapping
from contextlib import suppress
from importlib import import_module
from importlib.metadata import PackageNotFoundError, distribution, version
from pathlib import Path
from typing import Any

from chutelab.util.errors import MissingLibraryError


def version_of(package: str) -> str | None:
    """Return the version of a package; None if it is not installed.

    >>> version_of("no such package") is None
    True
    """
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def library(module: str, what: str, extra: str) -> Any:
    """Return a module of a package that only one of Chutelab's extras brings.

    Raises a `MissingLibraryError` without it, or if it is too old; says `what`, such as "a fit
    needs SciPy", and what to install.
    """
    install = f'pip install "chutelab[{extra}]"'
    if old := too_old(extra):
        raise MissingLibraryError(f"{what}, {'; '.join(old)}: {install}")
    try:
        return import_module(module)
    except ImportError as error:
        raise MissingLibraryError(f"{what}: {install}", name=error.name) from error


_BOUND = re.compile(
    r"^Requires-Dist: ([\w.-]+)[^>;\n]*>=([\d.]+)(?:.*extra == .([\w-]+))?", re.MULTILINE
)
_VERSION = re.compile(r"^Version: (.+)$", re.MULTILINE)


def too_old(extra: str | None = None) -> list[str]:
    """Return for what packages are too old that are installed, by the bounds of chutelab's own.

    Such as "pydantic>=2.9 (2.7.0 is installed)". By default those that it always needs, else those
    of one extra. Empty where it is not installed itself.
    """
    found = []
    for bound in _BOUND.finditer(_metadata("chutelab")):
        # What is not there the import says.
        said = _VERSION.search(_metadata(bound[1])) if bound[3] == extra else None
        if said is not None and _numbers(said[1]) < _numbers(bound[2]):
            found.append(f"{bound[1]}>={bound[2]} ({said[1]} is installed)")
    return found


def _metadata(package: str) -> str:
    """Return what is said of a package, "" of none; to read all of it takes five times as long."""
    with suppress(PackageNotFoundError):
        return distribution(package).read_text("METADATA") or ""
    return ""


def _numbers(version: str) -> tuple[int, ...]:
    """Return the first three numbers of a version."""
    return (*map(int, re.findall(r"\d+", version)), 0, 0, 0)[:3]


def need_all() -> None:
    """Raise a `MissingLibraryError` if a package that chutelab always needs is too old.

    Some of them fail only by doing less.
    """
    if old := too_old():
        needed = " ".join(f'"{line.partition(" ")[0]}"' for line in old)
        raise MissingLibraryError(f"chutelab needs {'; '.join(old)}: pip install {needed}")


def own_version() -> str:
    """Return chutelab's version, as far as it is known."""
    return version_of("chutelab") or "unknown (not installed)"


PACKAGES = ("chutelab", "numpy", "pymunk", "wasmtime", "scipy")


def environment() -> dict[str, str]:
    """Return processor, number of cores, system, Python and versions of packages.

    What is not installed is left out; no host, user or path is in it.
    """
    cores = os.cpu_count() or 1
    processor = platform.processor() or platform.machine()
    with suppress(OSError):
        told = Path("/proc/cpuinfo").read_text(encoding="utf-8")
        if named := re.search(r"^model name[^:\n]*:(.*)", told, re.MULTILINE):
            processor = " ".join(named[1].split())
    found = {
        "processor": f"{processor}, {cores} core{'s' if cores > 1 else ''}",
        "system": platform.system(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }
    versions = {package: version_of(package) for package in PACKAGES}
    return found | {package: version for package, version in versions.items() if version}


def measured_on(about: Mapping[str, str]) -> str:
    """Return an `environment` as a line of text."""
    return f"measured on {', '.join(f'{key} {value}' for key, value in about.items())}"
