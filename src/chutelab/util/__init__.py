"""Small things that know nothing of scenes and machines.

- `arrays`: types of arrays; sine, cosine and arc tangent, the same bits everywhere; bisection.
- `errors`: the error for invalid input, with its faults and suggestions; missing libraries.
- `files`: files that are written whole or not at all; CSV and TSV.
- `signals`: Ctrl-C, TERM and HUP, all raised as a KeyboardInterrupt.
- `tables`: tables for people, plain data for JSON, columns as a DataFrame.
- `words`: texts for learners and pictures in each language (`strings`).
"""
