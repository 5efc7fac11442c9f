"""Broken input and broken surroundings, and what the commands make of them.

===============  ==================================================================================
`mutants`        what is wrong with an input: bytes, numbers, texts and keys, drawn at random
`inputs`         cases of each kind: files made from mutants, and the command that is given them
`worker`         runs cases in a process of its own, and tells what became of each
`test_inputs`    scenes, machines, arguments and tracks
`test_ends`      signals, a full disk, closed descriptors and odd environments
===============  ==================================================================================

What may come of a command: 0, 2 with a message, 1 where the help promises it, 130 and 143 when it
is told to stop. No traceback, no wait of more than `worker.PATIENCE`, nothing left over or torn.

A default run draws few cases; as many as asked come with ``CHUTELAB_HOSTILE=10000
CHUTELAB_KILLS=300 python -m pytest -n auto -m slow tests/hostile``.
"""
