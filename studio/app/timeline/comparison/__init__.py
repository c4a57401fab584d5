"""Two runs: forks, their tables, and the runs beside each other.

`forking.py` `runs.py` (forks, comparisons), `beside.py` `view.py` (both, and their table).
"""
