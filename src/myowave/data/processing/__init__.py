"""Processing of recordings: pure functions of signals, in the order in which they are applied."""
