"""Whether to trust a scene, a run or an engine: verify, check, stress, bench."""
