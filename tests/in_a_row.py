"""Runs commands of chutelab one after the other, in the folder it is started in.

It is given a JSON list of commands, each the words after `chutelab`. What each prints goes to
NUMBER.out. Then it draws what `run` draws as PNG only in the other ways.
"""

from __future__ import annotations

import json
import sys
from contextlib import redirect_stdout
from pathlib import Path

import chutelab
from chutelab.cli import main
from chutelab.pictures import plots

if __name__ == "__main__":
    for number, words in enumerate(json.loads(sys.argv[1])):
        with Path(f"{number}.out").open("w", encoding="utf-8") as out, redirect_stdout(out):
            try:
                main(words)
            except SystemExit as end:
                if end.code:
                    sys.exit(f"{words}: exit {end.code}")
    recording = chutelab.simulate(chutelab.load("perpendicular"))
    plots.overlay(recording, path="overlay.svg")
    plots.overlay(recording, path="overlay.pdf")
