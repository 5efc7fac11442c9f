"""Run a notebook in a kernel of its own, and ask it what its tasks were answered."""

from __future__ import annotations

import os
import secrets
import sys
import tempfile
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from time import monotonic
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Sequence

    from nbclient import NotebookClient

PACKAGES = Path(__file__).parents[2]
"""Where this chutelab lies, for the kernel to find it too."""

LAST_WORD = 5
"""s for the kernel to hand over the answers after its time is up."""

QUIET = "--IPKernelApp.log_level=40"
"""Errors only: the kernel would warn of connections that never leave this machine."""

LONGEST = 200
"""Characters of an error that are told."""


@dataclass(frozen=True)
class Outcome:
    """What came out of a run.

    Attributes
    ----------
    tasks : list
        As `chutelab.exercises.task.report` gives them, unchecked: student's code ran there.
    trouble : str
        What went wrong first, or empty.
    """

    tasks: list[Any]
    trouble: str


def run(code: Sequence[str], time_limit: float) -> Outcome:
    """Run code cells in order; what raises an error does not keep the rest from running.

    Parameters
    ----------
    code : sequence of str
        The cells.
    time_limit : float
        s for all of them together, the kernel's start not counted.

    Raises
    ------
    ImportError
        Without nbclient.
    """
    try:
        import nbclient  # noqa: F401 - with it comes all that is needed
    except ModuleNotFoundError as error:
        message = 'grading needs nbclient: python -m pip install "chutelab[notebook]"'
        raise ImportError(message) from error
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        return _run(code, time_limit, folder)


def _run(code: Sequence[str], time_limit: float, folder: str) -> Outcome:
    from nbclient.exceptions import DeadKernelError

    client = _client(folder)
    trouble = ""
    with client.setup_kernel(cleanup_kc=True):
        deadline = monotonic() + time_limit
        for number, source in enumerate(code, start=1):
            try:
                problem = _execute(client, source, deadline - monotonic())[0]
            except DeadKernelError:
                return Outcome([], trouble or f"the kernel died in code cell {number}")
            if monotonic() >= deadline:
                trouble = f"stopped after {time_limit:g} s, in code cell {number}"
                break
            if problem:
                trouble = trouble or f"code cell {number}: {problem}"
        try:
            return Outcome(_answers(client), trouble)
        except DeadKernelError:
            return Outcome([], trouble or "the kernel died after the last cell")


def _client(folder: str) -> NotebookClient:
    """Return a client whose kernel is this Python with this chutelab, whatever else is installed.

    Start-up files and history of whoever grades are left out.
    """
    from jupyter_client.kernelspec import KernelSpec, KernelSpecManager
    from jupyter_client.manager import AsyncKernelManager
    from nbclient import NotebookClient
    from nbformat.v4 import new_notebook

    paths = [str(PACKAGES), *filter(None, [os.environ.get("PYTHONPATH")])]
    spec = KernelSpec(
        argv=[sys.executable, "-m", "ipykernel_launcher", "-f", "{connection_file}", QUIET],
        display_name="chutelab",
        language="python",
        env={"PYTHONPATH": os.pathsep.join(paths), "IPYTHONDIR": folder},
    )

    class Specs(KernelSpecManager):
        def get_kernel_spec(self, kernel_name: str) -> KernelSpec:
            return spec

    manager = AsyncKernelManager(kernel_name="python3", kernel_spec_manager=Specs())
    return NotebookClient(
        new_notebook(),  # type: ignore[no-untyped-call]
        km=manager,
        allow_errors=True,
        # A cell whose time is up is interrupted and left, whether it stops or not.
        interrupt_on_timeout=True,
        error_on_timeout={"ename": "TimeoutError", "evalue": "", "traceback": []},
        shutdown_kernel="immediate",
        resources={"metadata": {"path": folder}},
    )


def _execute(client: NotebookClient, source: str, seconds: float) -> tuple[str, list[Any]]:
    """Run one cell; return its error in a line, if any, and its outputs."""
    from nbformat.v4 import new_code_cell

    cell = new_code_cell(source)  # type: ignore[no-untyped-call]
    client.nb.cells = [cell]
    client.timeout = max(1, ceil(seconds))
    client.execute_cell(cell, 0)
    for output in cell.outputs:
        if output.output_type == "error":
            return f"{output.ename}: {output.evalue}"[:LONGEST], cell.outputs
    return "", cell.outputs


def _answers(client: NotebookClient) -> list[Any]:
    """Ask the kernel for its tasks, under a name that no cell before could know."""
    name = f"application/x-chutelab-{secrets.token_hex(8)}+json"
    source = (
        "import chutelab.exercises.task, IPython.display\n"
        "IPython.display.publish_display_data("
        f"{{{name!r}: chutelab.exercises.task.report()}})"
    )
    for output in _execute(client, source, LAST_WORD)[1]:
        found = output.get("data", {}).get(name)
        if isinstance(found, list):
            return found
    return []
