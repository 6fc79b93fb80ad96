"""flexlab.recordings."""
