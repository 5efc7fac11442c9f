"""Whether to trust a scene, a run or an engine.

- `agreement`: ``verify``: the answers beside each other, and beside what a scene expects.
- `preflight`: ``check``: the look at a scene before it runs.
- `stress`: the laws that every run must keep.
- `workprecision`: ``bench``: run time against error of a scene.
"""
