"""Accuracy against the truth, one file a table."""
