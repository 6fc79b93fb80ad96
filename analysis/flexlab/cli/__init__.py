"""flexlab.cli."""
