"""Is what changed between two groups of trials named? Asked of a person and of simulated arms: docs/changed.md."""
