"""Recorded sessions: any instant of them, errors over time, forks and comparisons."""
