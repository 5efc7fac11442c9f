"""Small things that know nothing of scenes and machines.

- `arrays`: types of arrays, each named once.
- `files`: files that are written whole or not at all.
- `tables`: tables for people, and columns as CSV and as a DataFrame.
- `versions`: what is installed, and on what figures were measured.
"""
