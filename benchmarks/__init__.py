"""Measures the studio: benchmarks, tables against the truth, hostile input. Not in the wheel.

`files.py` (files as people bring them); `trace_light.py` `scan_built_in.py` (make the light maps
and scans that the program comes with).
"""
