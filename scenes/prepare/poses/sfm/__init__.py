"""Structure from motion in a process of its own.

`run.py` (starts the process), `worker.py` (is it), `features.py` on `code_matches.py`,
`mapping.py` (its stages), `verdict.py` (whether to believe it).
"""
