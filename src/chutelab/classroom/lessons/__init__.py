"""Lessons: a question, a worksheet, an exercise, a picture, and scenes to run.

- `reading`: ``lesson.toml`` as a frozen model, a lesson's folder with its scenes, all faults in one
  message; the shipped lessons, found by number, by name or by folder.
- `texts`: a lesson's Markdown as HTML and for a terminal, and its formulas.
- `sheets`: the student's sheet, the teacher's and the explanation: Markdown, HTML, PDF.
- `building`: ``lesson.gif``, ``exercise.ipynb``, a new lesson from a template.
- `pages`: all lessons as web pages, and packages for learning platforms.

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
