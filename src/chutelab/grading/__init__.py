"""Grading returned notebooks. It runs students' code: use a container for strangers.

- `notebooks`: the code of a notebook file, however it was saved.
- `running`: a notebook in a kernel of its own, with a time limit; what its tasks were answered.
- `marking`: `grade`, which judges those answers anew; `write_csv`.

What a notebook prints is not looked at. Its kernel hands over the numbers that were checked, and
they are checked again here, against the numbers of the student's name.
"""

from chutelab.grading.marking import Grade, grade, write_csv

__all__ = ["Grade", "grade", "write_csv"]
