"""The command line: parse, call the library, print.

============  =====================================================================================
`console`     the command ``chutelab`` itself, what commands print, and what becomes of errors
`options`     options from signatures and docstrings; scenes with overrides; files of ``--out``
`running`     ``run``, ``show``, ``report``, ``live``
`studies`     ``sweep``, ``solve``, ``compare``, ``discharge``, ``field``
`scenes`      ``scenes``, ``materials``, ``quantities``, ``schema``, ``new``, ``tables``,
              ``figure``, ``check``, ``verify``, ``stress``, ``bench``
`lessons`     ``lesson``: list, show, build, new, page, scorm, grade
============  =====================================================================================

Modules that take long to import are imported inside the commands that need them, so that
``chutelab --help`` answers at once.
"""

from chutelab.cli import lessons, running, scenes, studies  # noqa: F401 - their commands
from chutelab.cli.console import main

__all__ = ["main"]
