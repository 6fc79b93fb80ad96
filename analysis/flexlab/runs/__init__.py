"""flexlab.runs."""
