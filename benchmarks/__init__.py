"""Measures the studio: benchmarks, tables against the truth, hostile input. Not in the wheel."""
