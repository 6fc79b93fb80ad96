"""Recordings: bytes as they arrive, their conversion to SI units, and the Run made of them."""
