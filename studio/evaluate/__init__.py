"""Tracks and preparations against the truth: errors, scores, verdicts."""
