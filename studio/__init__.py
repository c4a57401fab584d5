"""The app: command line, sessions, reports, windows; no algorithms.

`cli.py` (the table of verbs; the one place that reports errors), `rehearsal.py` (a whole
rehearsal).
"""
