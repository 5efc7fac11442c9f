"""Lessons: a question, a worksheet, an exercise, a picture, and scenes to run.

- `reading`: ``lesson.toml`` as a frozen model, a lesson's folder with its scenes, all faults in one
  message; the shipped lessons, found by number, by name or by folder.
- `texts`: a lesson's Markdown as HTML and for a terminal, its formulas too.
- `formulas`: the part of TeX that lessons have, in plain characters and for print.
- `sheets`: the student's sheet, the teacher's and the explanation.
- `printing`: sheets as files: Markdown, HTML, PDF.
- `cells`: the notebook, made of the worksheet, the lesson's own cells and its exercise.
- `wheel`: the package itself, for those who get the pages.
- `building`: ``lesson.gif``, ``exercise.ipynb``, a new lesson from a template, all lessons as web
  pages.
- `scorm`: a lesson's live page as a package for learning platforms.

A lesson is a folder ``NN-name`` with ``lesson.toml``, the worksheet ``README.md``, the explanation
``explanation.md``, the film ``lesson.gif``, and the notebook ``exercise.ipynb``; scene files of its
own lie beside them.
"""

from chutelab.classroom.lessons.reading import (
    Lesson,
    LessonError,
    find,
    read,
    scene_of,
    shipped_lessons,
)

__all__ = ["Lesson", "LessonError", "find", "read", "scene_of", "shipped_lessons"]
