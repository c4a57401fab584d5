"""Printed output of all verbs: rows of figures, progress, the machine.

Rows of figures, progress, the machine; `spoken.py` (figures and events in words, with names for
ids); `extras.py` (what a light installation lacks), `program_files.py` (manual, licence and the
viewer's libraries, in a checkout and installed).
"""
