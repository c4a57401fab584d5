"""Hypotheses of an object's pose: candidate positions, searches, joint assignment."""
