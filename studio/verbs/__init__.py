"""The command line's verbs, one file each.

`verb.py` (a line of the table), one file a verb; `result_flags.py` (where results go, never over
earlier ones).
"""
