"""Small things that know nothing of scenes and machines.

- `arrays`: types of arrays; sine, cosine and arc tangent, the same bits everywhere; bisection.
- `errors`: invalid input: the one error, its faults, what was meant; missing libraries.
- `files`: files that are written whole or not at all, CSV and TSV in them.
- `signals`: Ctrl-C, TERM and HUP, all raised as a KeyboardInterrupt.
- `tables`: tables for people, plain data for JSON, columns as a DataFrame.
- `words`: what a learner is told, and what pictures say, in each language (`strings`).
"""
