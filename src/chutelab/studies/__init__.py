"""Many runs for one answer: accuracy, sweeps, design, measured tracks."""
