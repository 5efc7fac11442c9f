"""Lessons, exercises and their grading."""
