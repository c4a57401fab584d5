"""The command line's verbs, one file each, as they are typed.

`verb.py` (a line of the table), one file a verb; `sessions/` (rehearse, live, and what follows
them), `cutting/` (cut, and what it has beside), `simulate/`, `sites/` and `study/` (verbs of two
words), `flags/` (what several verbs share).
"""
