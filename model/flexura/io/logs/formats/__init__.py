"""A module a format: its bytes as a Log."""
