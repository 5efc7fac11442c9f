"""Lessons: a question, a worksheet, an exercise, a picture, and scenes to run.

===============  ==================================================================================
`models`         ``lesson.toml`` as a frozen model, each key with what it allows
`reading`        a lesson's folder: read, validated with its scenes, all faults in one message
`catalogue`      the shipped lessons, found by number, by name or by folder
`stamp`          what a picture was made from, kept in a comment of the GIF itself
`building`       ``lesson.gif``: made anew only if what it is made from has changed
`starting`       a new lesson from a template
`bundle`         all lessons as a folder of web pages that needs no server
`worksheets`     worksheets in Markdown as HTML
===============  ==================================================================================

A lesson is a folder ``NN-name`` with ``lesson.toml``, the worksheet ``README.md``, the picture
``lesson.gif``, and the notebook ``exercise.ipynb``; scene files of its own lie beside them.
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
