"""The native solver against the Exudyn twin."""
