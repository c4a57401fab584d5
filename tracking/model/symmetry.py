"""How often an object looks the same in one turn about its vertical axis."""

ROUND = 0
"""Symmetry of an object that looks the same at every yaw."""
