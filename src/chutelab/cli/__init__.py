"""The command line: parse, call the library, print.

===============  ==================================================================================
`program`        the command ``chutelab`` itself, and what becomes of errors
`running`        ``run``
`checking`       ``check``
`recordings`     ``show``
`comparing`      ``compare``
`paper`          ``tables``
`scenes`         ``scenes``, ``schema`` and ``new``
`verifying`      ``verify``
`stressing`      ``stress``
`benching`       ``bench``
`lessons`        ``lesson``: list, show, build, new, page
`grading`        ``lesson grade``
`pages`          ``page``
`sweeping`       ``sweep``
`solving`        ``solve``
`figures`        ``figure``
`uncertain`      what ``sweep --uncertainty`` does
`parameters`     what several commands take: scenes, overrides, output
`output`         the files of ``--out``, all of them or none
`report`         summaries as tables for people
`console`        text and JSON on standard output
`stalling`       what becomes of a run that gets stuck
`progress`       a bar on standard error for what takes longer than a second
===============  ==================================================================================

Modules that take long to import are imported inside the commands that need them, so that
``chutelab --help`` answers at once.
"""

from chutelab.cli.benching import bench
from chutelab.cli.checking import check, verify
from chutelab.cli.comparing import compare
from chutelab.cli.lessons import lesson
from chutelab.cli.program import main
from chutelab.cli.running import page, run, show
from chutelab.cli.scenes import figure, new, scenes, schema, tables
from chutelab.cli.solving import solve
from chutelab.cli.stressing import stress
from chutelab.cli.sweeping import sweep

for _command in (
    run,
    check,
    show,
    sweep,
    solve,
    compare,
    lesson,
    page,
    figure,
    tables,
    scenes,
    new,
    schema,
    verify,
    stress,
    bench,
):
    main.add_command(_command)

__all__ = ["main"]
