"""flexlab.comparison.replay."""
