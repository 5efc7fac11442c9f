"""Packages that are installed or not, their versions, and what figures were measured on.

Nothing in it names anybody.
"""

from __future__ import annotations

import os
import platform
from collections.abc import Mapping
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
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

    Raises
    ------
    MissingLibraryError
        Without it; says `what`, such as "a fit needs SciPy", and what to install.
    """
    try:
        return import_module(module)
    except ImportError as error:
        text = f'{what}: pip install "chutelab[{extra}]"'
        raise MissingLibraryError(text, name=error.name) from error


def own_version() -> str:
    """Return chutelab's version, as far as it is known."""
    return version_of("chutelab") or "unknown (not installed)"


PACKAGES = ("chutelab", "numpy", "pymunk", "wasmtime", "scipy")


def environment() -> dict[str, str]:
    """Return processor, number of cores, system, Python and versions of packages.

    What is not installed is left out; no host, user or path is in it.
    """
    cores = os.cpu_count() or 1
    found = {
        "processor": f"{_processor()}, {cores} core{'s' if cores > 1 else ''}",
        "system": platform.system(),
        "python": f"{platform.python_implementation()} {platform.python_version()}",
    }
    versions = {package: version_of(package) for package in PACKAGES}
    return found | {package: version for package, version in versions.items() if version}


def measured_on(about: Mapping[str, str]) -> str:
    """Return an `environment` as a line of text."""
    return f"measured on {', '.join(f'{key} {value}' for key, value in about.items())}"


def _processor() -> str:
    try:
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return " ".join(line.partition(":")[2].split())
    except OSError:
        pass
    return platform.processor() or platform.machine()
