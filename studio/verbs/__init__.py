"""The command line's verbs, one file each, as they are typed.

`verb.py` (a line of the table), one file a verb; `simulate/`, `sites/` and `study/` (verbs of two
words), `cutting/` (cut, and what it has beside), `flags/` (what several verbs share).
"""
