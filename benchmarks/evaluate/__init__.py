"""Tracker, preparation and twin against the truth: what `nexus evaluate` runs."""
