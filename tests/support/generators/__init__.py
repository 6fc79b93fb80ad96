"""Seeded generators of well-formed inputs, with what must hold of each."""
