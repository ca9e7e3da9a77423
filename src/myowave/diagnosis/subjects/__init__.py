"""Many subjects side by side."""
