"""Many runs for one answer.

- `accuracy`: the step that reaches an accuracy, and what was reached.
- `sweep`: many variants of one scene, a row for each.
- `repeats`: one scene with many seeds, every quantity as mean ± standard error.
- `design`: changes with which a quantity gets a value wanted; uncertainty.
- `discharge`: the stream by engineers' methods beside the simulated one.
- `measured`: measured tracks over the model: read, compare, fit.
"""
