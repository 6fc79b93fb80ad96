"""flexlab.crosscheck."""
