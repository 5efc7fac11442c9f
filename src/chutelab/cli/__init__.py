"""The command line: parse, call the library, print.

===============  ==================================================================================
`program`        the command ``chutelab`` itself, and what becomes of errors
`running`        ``run``, ``show``, ``live``
`checking`       ``check``, ``verify``, ``stress``
`scenes`         ``scenes``, ``materials``, ``quantities``, ``schema``, ``new``, ``tables``,
                 ``figure``
`comparing`      ``compare``
`sweeping`       ``sweep``
`solving`        ``solve``
`lessons`        ``lesson``: list, show, build, new, page, scorm, grade
`benching`       ``bench``
`parameters`     what several commands take: scenes, overrides, folders
`output`         files of ``--out``, all of them or none; what ``run`` and ``show`` leave
`console`        text and JSON on standard output, a bar on standard error
===============  ==================================================================================

Modules that take long to import are imported inside the commands that need them, so that
``chutelab --help`` answers at once.
"""

from chutelab.cli.benching import bench
from chutelab.cli.checking import check, stress, verify
from chutelab.cli.comparing import compare
from chutelab.cli.lessons import lesson
from chutelab.cli.program import main
from chutelab.cli.running import live, run, show
from chutelab.cli.scenes import figure, materials, new, quantities, scenes, schema, tables
from chutelab.cli.solving import solve
from chutelab.cli.sweeping import sweep

for _command in (
    run, live, check, show, sweep, solve, compare, lesson,
    figure, tables, scenes, materials, quantities, new, schema, verify, stress, bench,
):  # fmt: skip
    main.add_command(_command)

__all__ = ["main"]
